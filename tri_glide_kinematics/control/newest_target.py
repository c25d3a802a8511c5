"""The newest target, and what has become of it."""

from __future__ import annotations

from tri_glide_kinematics.control.engine_commands import CarriedOut
from tri_glide_kinematics.control.in_position import Arrival, InPosition, InPositionBounds
from tri_glide_kinematics.control.inbox import Target


class NewestTarget:
    """The newest target that the engine has taken.

    A position is judged from when the setpoints stand still, until the next target. If it is not
    reached it is judged on: what holds the sliders back may give way.

    Attributes:
        bounds: when a position counts as reached.
        command: the target; None before the first.
        text: the target in words; empty before the first.
        is_missed: whether the machine stands still and is not measured there.
        held_at_edge: whether it leads out of the workspace, so that the platform is held there.
    """

    def __init__(self, bounds: InPositionBounds) -> None:
        """Know no target yet."""
        self.bounds = bounds
        self.command: Target | None = None
        self.text = ""
        self.is_missed = False
        self.held_at_edge = False
        self._in_position: InPosition | None = None

    @property
    def is_judged(self) -> bool:
        """Whether measured distances matter."""
        return self._in_position is not None

    def take(self, command: CarriedOut) -> None:
        """Take a target in place of the last one."""
        self.command = command.target
        self.text = str(command.target)
        self.held_at_edge = command.held_at_edge
        self.end()

    def judge_from(self, now: float) -> None:
        """Judge the measured distances from ``now`` [s] on."""
        self._in_position = InPosition(self.bounds, now)

    def measured(self, distance: float, now: float) -> None:
        """Take in a ``distance`` [m] from the target that was measured ``now`` [s]."""
        if self._in_position is not None:
            self._in_position.measured(distance, now)

    def end(self) -> None:
        """Judge no more, and call nothing missed."""
        self._in_position, self.is_missed = None, False

    def arrival(self, now: float) -> tuple[Arrival, str]:
        """Return what has become of the target by ``now`` [s], and that in words."""
        position = self._in_position
        if position is None or (arrival := position.arrival(now)) is Arrival.SETTLING:
            return Arrival.SETTLING, ""
        self.is_missed = arrival is not Arrival.REACHED
        if arrival is not Arrival.NOT_REACHED:
            self._in_position = None
        return arrival, position.text(arrival, self.text)
