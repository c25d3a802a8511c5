"""Keeps a transfer in time with its stations, and its outputs with it. No ROS in here."""

from __future__ import annotations

import math
from collections import deque
from operator import attrgetter
from typing import TYPE_CHECKING

from tri_glide_kinematics.control.newest_target import DueOutput
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import Command, MotionEngine, Station

if TYPE_CHECKING:
    from tri_glide_kinematics.control.command_queue import CommandQueue
    from tri_glide_kinematics.control.newest_target import NewestTarget

# Setpoints that come later by more than this are too late for a station that moves [s].
LARGEST_DRIFT = 2e-4


class TransferTiming:
    """Knows when the outputs of a transfer are due, and where its next station was told to be."""

    def __init__(
        self, engine: MotionEngine, queue: CommandQueue, newest_target: NewestTarget
    ) -> None:
        """Know no transfer yet.

        Args:
            engine: that carries it out.
            queue: knows for when the present setpoint is.
            newest_target: keeps its outputs.
        """
        self._engine = engine
        self._queue = queue
        self._newest_target = newest_target
        # The number of the plan for which it is known when outputs are due.
        self._scheduled = 0
        # The station that moves, how it does, and when it was there; and how far the engine was
        # behind the clock when that was told.
        self._told: tuple[int, Station, float] | None = None
        self._behind = 0.0

    def begin(self, command: Command) -> None:
        """Note the stations and outputs of a ``command`` that the engine has taken."""
        new = (
            DueOutput(math.inf, output, command, index, after)
            for index, station in enumerate(command.stations)
            for after, output in station.outputs
        )
        self._schedule(*new)
        moving = [(i, each) for i, each in enumerate(command.stations) if each.moves]
        self._told = (*moving[0], command.seen) if moving else None
        self._behind = self._queue.behind

    def renew(self, station: int, motion: Station, seen: float) -> bool:
        """Let it go on to its next ``station``, which moves otherwise.

        Args:
            station: its index.
            motion: how it moves.
            seen: when it was at its position [s].

        Returns:
            Whether that is begun: not while another plan is made, or the station is not the next.
        """
        is_begun = self._engine.renew(station, motion, self._queue.present - seen)
        if is_begun:
            self._told = station, motion, seen
            self._behind = self._queue.present - self._engine.elapsed
        return is_begun

    def look_after(self) -> KinematicsError | None:
        """Keep it in time; return why it is given up, if it is, as a station is not met."""
        progress = self._engine.transfer_progress
        if progress is None or progress.gives_up is not None:
            return None if progress is None else progress.gives_up
        # Where cycles were left out the station went on.
        drift = self._queue.present - self._engine.elapsed - self._behind
        if self._told is not None and abs(drift) > LARGEST_DRIFT:
            self.renew(*self._told)
        if self._newest_target.due and self._scheduled != self._engine.plan_number:
            self._schedule()
        return None

    def _schedule(self, *new: DueOutput) -> None:
        """Note when outputs are due; a plan that was renewed may arrive at another time."""
        progress, target = self._engine.transfer_progress, self._newest_target
        self._scheduled = self._engine.plan_number
        arrivals = progress.arrivals if progress is not None else ()
        due = []
        for each in (*target.due, *new):
            if each.transfer is target.command and each.station < len(arrivals):
                instant = self._queue.present + arrivals[each.station] + each.after
                each = each._replace(instant=instant)
            due.append(each)
        target.due = deque(sorted(due, key=attrgetter("instant")))
