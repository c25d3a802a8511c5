"""Which line a motion takes from where it begins: to a position, to the edge, or to a stop."""

from __future__ import annotations

from typing import Protocol

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.trajectory import EDGE_CLEARANCE, NoRoomError, StraightLine
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Ruckig plans no more than two hours; a jog that is so slow ends after this time [s].
LONGEST_JOG = 1000.0


class LineBuilder(Protocol):
    """Makes lines from any start; their check is a second step, as it takes longer."""

    def line(self, start: Vector3) -> StraightLine:
        """Return the line that begins at ``start`` [m], of any length."""

    def limited(self, line: StraightLine) -> Interruptible[StraightLine]:
        """Return the ``line`` with its final length, inside the workspace.

        Raises:
            KinematicsError: if there is none.
        """


class LineToPosition:
    """Lines to one position."""

    def __init__(self, region: Workspace, position: Vector3) -> None:
        """Lead to ``position`` [m] inside ``region``."""
        self._region = region
        self._position = position

    def line(self, start: Vector3) -> StraightLine:
        """Return the line from ``start`` to the position."""
        return StraightLine.between(self._region.machine.geometry, start, self._position)

    def limited(self, line: StraightLine) -> Interruptible[StraightLine]:
        """Return the ``line``.

        Raises:
            KinematicsError: if it leaves the workspace.
        """
        yield from self._region.segment_check(line.start, self._position)
        return line


class LineToEdge:
    """Lines in one direction, up to the edge of the workspace or for a long time."""

    def __init__(self, region: Workspace, direction: Vector3, speed: float) -> None:
        """Lead along the unit vector ``direction`` inside ``region``, at a ``speed`` [m/s]."""
        self._region = region
        self._direction = direction
        limits = region.limits
        # No straight line inside the workspace is longer.
        longest = 2.0 * max(region.machine.geometry.arm_lengths) + max(
            upper - lower for lower, upper in zip(limits.lower_heights, limits.upper_heights)
        )
        self._longest = min(longest, LONGEST_JOG * speed)

    def line(self, start: Vector3) -> StraightLine:
        """Return the beginning of the line from ``start``."""
        return StraightLine(self._region.machine.geometry, start, self._direction, 0.0)

    def limited(self, line: StraightLine) -> Interruptible[StraightLine]:
        """Return the line up to the edge.

        Raises:
            NoRoomError: if it begins there.
        """
        longest = max(self._longest, 3.0 * EDGE_CLEARANCE)
        distance = yield from self._region.exit_search(line.start, line.direction, longest)
        if distance < 2.0 * EDGE_CLEARANCE:
            raise NoRoomError(line.start, line.direction, self._edge(line))
        geometry = self._region.machine.geometry
        return StraightLine(geometry, line.start, line.direction, distance - EDGE_CLEARANCE)

    def _edge(self, line: StraightLine) -> str:
        """Return which limit is next to the start of ``line``, in words."""
        try:
            self._region.check_segment(line.start, line.point(10.0 * EDGE_CLEARANCE))
        except KinematicsError as error:
            return str(error)
        return "the edge of the workspace is near"


class LineToStop:
    """Lines in one direction, for as long as the platform takes to stop."""

    def __init__(self, geometry: TriGlideGeometry, direction: Vector3) -> None:
        """Lead along the unit vector ``direction``."""
        self._geometry = geometry
        self._direction = direction

    def line(self, start: Vector3) -> StraightLine:
        """Return the beginning of the line from ``start``."""
        return StraightLine(self._geometry, start, self._direction, 0.0)

    def limited(self, line: StraightLine) -> Interruptible[StraightLine]:
        """Return the ``line``; where it ends is known only when the plan is made."""
        yield from ()
        return line
