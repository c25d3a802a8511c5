"""The state of a machine under control, and why it is in it. No ROS in here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, NamedTuple

from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.vectors import Vector3

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.engine import TargetKind


class Cause(IntEnum):
    """Why it is in its state, as programs read it: ``MachineState`` says what each one means."""

    COMMAND = 1
    SLOW_STREAM = 2
    EDGE = 3
    PAUSE_ASKED = 4
    TARGET_REACHED = 5
    TARGET_NOT_REACHED = 6
    TARGET_TOO_FAR = 7
    TARGET_REFUSED = 8
    STOP_ASKED = 9
    DISABLE_ASKED = 10
    ENABLE_ASKED = 11
    CANCELLED = 12
    RELEASED = 13
    TWISTS_SILENT = 14
    TARGETS_SILENT = 15
    STARTED_DISABLED = 16
    NO_MEASUREMENT = 17
    MEASUREMENT = 18
    LOOKING_FOR_OTHERS = 19
    OTHER_PUBLISHER = 20
    MEASUREMENTS_SILENT = 21
    MEASUREMENT_JUMP = 22
    MEASUREMENT_NOT_FINITE = 23
    TRACKING_ERROR = 24
    PROGRAM_ERROR = 25
    NODE_ENDS = 26
    PROGRAM_LOST = 27


@dataclass(frozen=True)
class Reason:
    """A cause, and the text that tells people more about it.

    Attributes:
        cause: what programs decide by.
        text: what people read; nothing is decided by it.
    """

    cause: Cause
    text: str

    def __str__(self) -> str:
        """Return the text."""
        return self.text


class OperatingState(Enum):
    """What the controller is doing."""

    WAITING = "waiting for the machine"
    IDLE = "idle"
    MOVING = "moving"
    JOGGING = "jogging"
    TRACKING = "tracking"
    STOPPING = "stopping"
    FAULT = "fault"
    DISABLED = "disabled"
    PAUSED = "paused"


WAITING, IDLE, MOVING, JOGGING, TRACKING, STOPPING, FAULT, DISABLED, PAUSED = OperatingState

# There is a place to be reached.
ON_THE_WAY = frozenset((MOVING, PAUSED))

# In all other states nothing moves by command.
IN_MOTION = ON_THE_WAY | {JOGGING, TRACKING, STOPPING}

# Each may follow the other.
LEAD_ON = frozenset((MOVING, JOGGING, TRACKING))

REFUSAL_IN = {WAITING: Refusal.WAITING, FAULT: Refusal.FAULT, DISABLED: Refusal.DISABLED}

FOLLOWERS: dict[OperatingState, frozenset[OperatingState]] = {
    WAITING: frozenset((IDLE, DISABLED)),
    # A path that was paused in its last moment may be extended.
    IDLE: LEAD_ON | {PAUSED, FAULT, DISABLED},
    MOVING: LEAD_ON | {PAUSED, IDLE, STOPPING, FAULT},
    PAUSED: LEAD_ON | {IDLE, STOPPING, FAULT},
    JOGGING: LEAD_ON | {IDLE, STOPPING, FAULT},
    TRACKING: LEAD_ON | {STOPPING, FAULT},
    STOPPING: LEAD_ON | {IDLE, FAULT, DISABLED},
    FAULT: frozenset((IDLE, DISABLED)),
    DISABLED: frozenset((IDLE,)),
}


@dataclass(frozen=True)
class ControllerStatus:
    """What the controller does and why.

    Attributes:
        state: what it is doing.
        reason: why it is doing that.
        newest_target: the newest target that was accepted, in words; empty before the first.
        target_missed: whether the machine stands still and is not measured at its target.
        held_at_edge: whether the target leads out of the workspace, so that the platform is held.
        target_reached: whether the machine stands still and is measured at its target.
        target_distance: that was measured when this was decided, one way or the other [m].
        target_kind: of the newest target; None before the first.
        target_position: its place, or end. Shape (3,) [m]; None if it has none.
        target_velocity: Shape (3,) [m/s]; None if it has none.
        leads: whether there is a setpoint in each cycle.
        speed_scale: by how much velocities are reduced.
        path_speed_scale: by what the speeds that paths ask for are multiplied.
        shaper_waits: whether a new shaper waits for the next rest to be in force.
        is_teaching: whether the teach mode is switched on.
        platform_speed_limit: in force for the platform; inf for none [m/s].
        stops: how often a stop was asked for, a program was lost, the lead was taken away, or a
            fault came.
    """

    state: OperatingState
    reason: Reason
    newest_target: str
    target_missed: bool
    held_at_edge: bool
    target_reached: bool = False
    target_distance: float | None = None
    target_kind: TargetKind | None = None
    target_position: Vector3 | None = None
    target_velocity: Vector3 | None = None
    leads: bool = False
    speed_scale: float = 1.0
    path_speed_scale: float = 1.0
    shaper_waits: bool = False
    is_teaching: bool = False
    platform_speed_limit: float = math.inf
    stops: int = 0


# Reason to tell when ``stops`` has changed.
WAS_STOPPED = "ik_node was stopped, disabled, in a fault or started anew"


class MotionProgress(NamedTuple):
    """Where the setpoints are, and what is left of the motion; NaN where nothing is known.

    Attributes:
        position: of the platform. Shape (3,) [m].
        speed: of the platform [m/s].
        segment: of the path that is followed, from 0.
        way_remaining: to the end of what is done [m].
        time_remaining: until then [s].
    """

    position: Vector3 = (math.nan, math.nan, math.nan)
    speed: float = math.nan
    segment: int = 0
    way_remaining: float = math.nan
    time_remaining: float = math.nan


class CommandRefusedError(KinematicsError):
    """A command that does not fit the present state."""

    def __init__(self, text: str, refusal: Refusal) -> None:
        """Store why, in words and for programs."""
        super().__init__(text)
        self.refusal = refusal


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
        after_stop: the state that follows a stop, idle or disabled.
        stop_was_asked_for: whether a stop that goes on was asked for, so that it must not be cut
            short.
    """

    def __init__(
        self,
        state: OperatingState,
        reason: Reason,
        on_change: Callable[[], None],
    ) -> None:
        """Start in ``state``; ``on_change`` is called after each change."""
        self.state = state
        self.reason = reason
        self.after_stop = IDLE
        self.stop_was_asked_for = False
        self._on_change = on_change

    def change(self, state: OperatingState, reason: Reason) -> None:
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

    def stop(self, reason: Reason, *, asked_for: bool, then: OperatingState = IDLE) -> None:
        """Go to the state of stopping; ``stopped`` ends it.

        Raises:
            ForbiddenTransitionError: if nothing moves.
        """
        self.after_stop, self.stop_was_asked_for = then, asked_for
        self.change(STOPPING, reason)

    def stopped(self) -> None:
        """Go to the state that follows the stop."""
        self.change(self.after_stop, at_rest(self.reason))

    def check_accepting(self) -> None:
        """Check that a motion may begin, or change, in this state.

        Raises:
            CommandRefusedError: if it may not.
        """
        if (refusal := REFUSAL_IN.get(self.state)) is not None:
            text = f"no motion while {self.state.value}: {self.reason}"
            raise CommandRefusedError(text, refusal)
        if self.state is STOPPING and self.stop_was_asked_for:
            text = f"no motion before the stop is over: {self.reason}"
            raise CommandRefusedError(text, Refusal.STOPPING)


def at_rest(reason: Reason) -> Reason:
    """Return the ``reason`` of a motion's end, once the setpoints rest."""
    return Reason(reason.cause, f"at rest: {reason}")
