"""The states of a machine under control, and how one may follow another. No ROS in here."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from tri_glide_kinematics.errors import KinematicsError


class OperatingState(Enum):
    """What the controller is doing."""

    WAITING = "waiting for the machine"
    IDLE = "idle"
    MOVING = "moving"
    JOGGING = "jogging"
    STOPPING = "stopping"
    FAULT = "fault"
    DISABLED = "disabled"


WAITING, IDLE, MOVING, JOGGING, STOPPING, FAULT, DISABLED = OperatingState

# In the rest the sliders are not led by commands, and nothing is published.
IN_MOTION = frozenset((MOVING, JOGGING, STOPPING))

FOLLOWERS: dict[OperatingState, frozenset[OperatingState]] = {
    WAITING: frozenset((IDLE, DISABLED)),
    IDLE: frozenset((MOVING, JOGGING, FAULT, DISABLED)),
    MOVING: frozenset((IDLE, JOGGING, STOPPING, FAULT)),
    JOGGING: frozenset((IDLE, MOVING, STOPPING, FAULT)),
    STOPPING: frozenset((IDLE, MOVING, JOGGING, FAULT, DISABLED)),
    FAULT: frozenset((IDLE, DISABLED)),
    DISABLED: frozenset((IDLE,)),
}


class ForbiddenTransitionError(KinematicsError):
    """One state cannot follow another; the caller has made a mistake."""

    def __init__(self, state: OperatingState, following: OperatingState) -> None:
        """Store both states."""
        super().__init__(f"state {following.value!r} cannot follow state {state.value!r}")
        self.state = state
        self.following = following


class StateMachine:
    """The present state and the reason for it.

    Attributes:
        state: what the controller is doing.
        reason: why it is doing that.
    """

    def __init__(
        self,
        state: OperatingState,
        reason: str,
        on_change: Callable[[], None],
    ) -> None:
        """Start in ``state``; ``on_change`` is called after each change."""
        self.state = state
        self.reason = reason
        self._on_change = on_change

    def change(self, state: OperatingState, reason: str) -> None:
        """Go to ``state``, or stay there with another reason; the same again is no change.

        Raises:
            ForbiddenTransitionError: if ``state`` cannot follow the present one.
        """
        if (state, reason) == (self.state, self.reason):
            return
        if state is not self.state and state not in FOLLOWERS[self.state]:
            raise ForbiddenTransitionError(self.state, state)
        self.state, self.reason = state, reason
        self._on_change()
