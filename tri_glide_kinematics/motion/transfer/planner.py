r"""Plans transfers: legs from station to station, each in the frame that goes over between both.

A leg leads up from a station, across, and down to the next. It is planned like any path, in nearly
the least time, and carried where a station moves (``meeting``).
"""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits
from tri_glide_kinematics.motion.path import check_place
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.transfer.carried import moves
from tri_glide_kinematics.motion.transfer.legs import Leg, Station, TransferPlan, stay
from tri_glide_kinematics.motion.transfer.lifting import lifted
from tri_glide_kinematics.motion.transfer.meeting import Meeting
from tri_glide_kinematics.motion.transfer.ways import Ways
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace


class TransferPlanner:
    """Plans transfers inside one workspace."""

    def __init__(self, workspace: Workspace, height: float, tolerance: float) -> None:
        """Prepare for a ``workspace``.

        Args:
            workspace: where the platform may be, and of which machine.
            height: of the platform between stations, by z; stations may be higher [m].
            tolerance: how far the platform may be from a corner of its way [m].
        """
        self._ways = Ways(workspace, height, tolerance)

    def planned(
        self,
        start: Vector3,
        stations: Sequence[Station],
        age: float,
        limits: SliderLimits,
        *,
        wait: float = 0.0,
        lifts: bool = True,
    ) -> Interruptible[TransferPlan]:
        """Return a plan from rest through all ``stations`` to rest.

        Args:
            start: of the platform. Shape (3,) [m].
            stations: in their order.
            age: time from that of the stations to the begin of the plan [s].
            limits: of the sliders.
            wait: rest before it begins [s].
            lifts: whether it goes up after the last station; after one that moves it does anyway.

        Raises:
            KinematicsError: if there is no plan.
        """
        legs: list[Leg] = []
        frame, rest, time = MovingTarget(start, AT_REST), wait, 0.0
        for station in stations:
            legs.append((yield from self._leg(frame, station, age + time, rest, limits)))
            time += legs[-1].plan.duration
            frame, rest = station.after(age + time), station.rest
        if lifts or moves(frame):
            legs.append((yield from lifted(self._ways, frame, rest, limits)))
        elif rest > 0.0:
            legs.append(stay(legs[-1], rest))
        return TransferPlan(legs, wait=wait)

    def _leg(
        self, frame: MovingTarget, station: Station, age: float, wait: float, limits: SliderLimits
    ) -> Interruptible[Leg]:
        """Return the leg to a ``station``, which takes as long as it has to.

        Args:
            frame: how the station moves that it is at, and where the platform is.
            station: to be reached.
            age: time from that of the station to the begin of the leg [s].
            wait: rest in the frame before it begins [s].
            limits: of the sliders.
        """
        ways = self._ways
        if station.moves or moves(frame):
            return (yield from Meeting(ways, frame, station, age, wait).leg(limits))
        base = yield from ways.timed(ways.between(frame.position, station.position), limits)
        base = base.delayed(wait)
        yield from check_place(base.heights.driven, ways.workspace, 0.0)
        return Leg(base, base, wait, base.duration)
