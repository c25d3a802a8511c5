"""What all commands share: their codes, their phases, and what the engine asks of each of them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.tracking import MovingTarget, Wanted, WantedVelocity
from tri_glide_kinematics.motion.trajectory import SequencePlan, Trajectory
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
    from tri_glide_kinematics.motion.moves import MotionPlanner


class MotionPhase(Enum):
    """What the engine is doing."""

    IDLE = "idle"
    MOVING = "moving"
    JOGGING = "jogging"
    TRACKING = "tracking"
    FOLLOWING = "following"
    PAUSED = "paused"
    STOPPING = "stopping"


class TargetKind(IntEnum):
    """What a target asks for, as programs read it in ``MachineState``."""

    POSITION = 1
    VELOCITY = 2
    MOVING = 3
    PATH = 4


class GoalCode(IntEnum):
    """How a command ended, as who waits for it reads it."""

    SUCCEEDED = 0
    CANCELED = 1
    SUPERSEDED = 2
    REFUSED = 3
    NOT_REACHED = 4
    STOPPED = 5
    FAULT = 6
    DISABLED = 7
    SHUTDOWN = 8


class Outcome(NamedTuple):
    """How a command ended, and that in words."""

    code: GoalCode
    text: str


class Execution(Protocol):
    """What a command asks for when it begins, of what carries it out.

    Before the start, what asks for the goal or changes it raises a ``NotStartedError``.

    Attributes:
        workspace: where the platform may be.
    """

    workspace: Workspace

    @property
    def goal(self) -> Command | None:
        """What was commanded last; None for a stop."""

    @property
    def is_idle(self) -> bool:
        """Whether the platform rests, and nothing is left to do."""

    @property
    def follows_path(self) -> bool:
        """Whether a path is the goal."""

    def stop(self) -> None:
        """Come to rest as soon as the limits allow, and forget the goal."""

    def keep_goal(self) -> None:
        """Give up a new goal that is still being prepared; what is held goes on."""

    def prepare_goal(self, goal: Command) -> None:
        """Make a plan that leads to a ``goal``, or let that wait for limits."""

    def go_over_to(self, goal: Command) -> bool:
        """Track a ``goal`` in motion, if a step towards it is certified; return whether it is."""

    def follow_target(self, goal: Command, target: MovingTarget, age: float) -> None:
        """Track a ``target``, seen ``age`` seconds ago, as soon as a step is certified."""

    def change_limits(self, limits: DriveLimits) -> None:
        """Put limits in force now, or slow down until that is possible; the shaper stays."""


class Foresight(Protocol):
    """What knows where a tracked target will be, and which velocity will be wanted."""

    def velocity_after(self, dt: float, told: Vector3) -> WantedVelocity:
        """Return which velocity will be wanted in ``dt`` seconds, ``told`` last [m/s]."""

    def target_after(self, dt: float, shaper: Shaper | None = None) -> MovingTarget:
        """Return where the target will be in ``dt`` seconds; with a ``shaper``, led."""


class Command(ABC):
    """Something that a machine is asked to do.

    Attributes:
        kind: what a target asks for; None of what is no target.
        phase: what the engine does while it is carried out.
        has_end: whether the platform comes to rest of itself.
        has_line: whether the platform moves on a line, on which a stop should stay.
        is_checked_whole: whether all of it is looked at before it begins, which may take long.
        leads_anywhere: whether nobody knows where its motion leads, as newer ones renew it.
        is_planned_again: whether it is planned with all of the limits where it begins at rest, and
            again with less where shaping takes some.
        path: to be followed; None of what is none, and until it is made.
        extends: whether it goes on from the end of the path that is followed.
        size: number of segments of a path.
        position: of the target, where it has one. Shape (3,) [m].
        velocity: of the target, where it has one. Shape (3,) [m/s].
        received: when it came in, by the clock of the caller; NaN if nobody asks [s].
        pause: how long after the last one of its stream that was [s].
        is_goal: whether its sender waits for its end.
        is_cancelled: whether the machine only comes to rest, as its sender wanted.
        outcome: how it ended; None until then. It is set once.
    """

    kind: ClassVar[TargetKind | None] = None
    phase: ClassVar[MotionPhase]
    has_end: ClassVar[bool] = True
    has_line: ClassVar[bool] = True
    is_checked_whole: ClassVar[bool] = False
    leads_anywhere: ClassVar[bool] = False
    is_planned_again: ClassVar[bool] = False
    path: PlatformPath | None = None
    extends: bool = False
    size: int = 0
    position: Vector3 | None = None
    velocity: Vector3 | None = None

    def __init__(self, *, received: float = math.nan, pause: float = 0.0) -> None:
        """Note when it came in."""
        self.received = received
        self.pause = pause
        self.is_goal = False
        self.is_cancelled = False
        self.outcome: Outcome | None = None

    def __repr__(self) -> str:
        """Return its kind, and what it asks for in words."""
        return f"<{type(self).__name__}: {self}>"

    @property
    def is_target(self) -> bool:
        """Whether it asks for a motion."""
        return self.kind is not None

    @property
    def waits_on(self) -> bool:
        """Whether it is to be begun again where its planning is given up for a stop."""
        return False

    @property
    def destination(self) -> Vector3 | None:
        """Where the platform is to rest at last [m]; None if nobody knows."""
        return None

    @property
    def motion_text(self) -> str:
        """The motion, in words, while it is carried out."""
        return str(self)

    def end(self, code: GoalCode, text: str) -> None:
        """Note how it ended, unless that is known."""
        if self.outcome is None:
            self.outcome = Outcome(code, text)

    def has_turn(self, now: float, period: float) -> None:  # noqa: B027, as most need nothing
        """Note that it is given to the engine ``now`` [s], one ``period`` [s] before a setpoint."""

    def making(self, end: Vector3 | None) -> Interruptible[None] | None:
        """Return what makes the parts of it that are not there yet; None if all is there.

        Args:
            end: of the path that it extends [m]; None if it extends none.
        """
        return None

    @abstractmethod
    def begin(self, execution: Execution) -> None:
        """Ask ``execution`` for what this is.

        Raises:
            NotStartedError: before the start.
            KinematicsError: if it is refused at once.
        """

    def planned(
        self,
        planner: MotionPlanner,
        state: SliderState,
        limits: DriveLimits,
        region: Workspace,
        moving: bool,
        after: SequencePlan | None,
    ) -> Interruptible[Trajectory]:
        """Return a plan that leads there; the arguments are those of ``MotionPlanner.move``."""
        raise NotImplementedError

    def wanted(self, tracker: Foresight, limits: DriveLimits, dt: float) -> Wanted:
        """Return what a step of ``dt`` [s] is to lead to, while this is tracked."""
        raise NotImplementedError

    def ends_at_edge(self, refusal: KinematicsError) -> bool:
        """Return whether a ``refusal`` says that the platform is at the edge, and is held there."""
        return False

    def edge(self, check_position: Callable[[Vector3], object]) -> KinematicsError | None:
        """Return why the platform is held at the edge of the workspace, if it is.

        Args:
            check_position: raises a ``KinematicsError`` for a position [m] outside the workspace.
        """
        return None
