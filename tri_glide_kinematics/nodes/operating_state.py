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
        on_change: Callable[[OperatingState, str], None],
    ) -> None:
        """Start in ``state``; ``on_change`` gets each state with its reason, the first one too."""
        self.state = state
        self.reason = reason
        self._on_change = on_change
        on_change(state, reason)

    def change(self, state: OperatingState, reason: str) -> None:
        """Go to ``state``; staying in the same state only renews the reason.

        Raises:
            ForbiddenTransitionError: if ``state`` cannot follow the present one.
        """
        self.reason = reason
        if state is self.state:
            return
        if state not in FOLLOWERS[self.state]:
            raise ForbiddenTransitionError(self.state, state)
        self.state = state
        self._on_change(state, reason)
