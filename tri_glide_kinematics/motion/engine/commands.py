"""What a machine may be asked for: one class for each kind of command.

A command is one object from when it comes in until it ends. It is this very object that waits, is
planned, is carried out and ends, whatever equals it. All that differs between kinds stands in their
classes, so a new kind is a new class.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from tri_glide_kinematics.checks import finite, finite_vector
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.command import (
    Command,
    Execution,
    Foresight,
    MotionPhase,
    TargetKind,
)
from tri_glide_kinematics.motion.errors import NoPathError, NoRoomError
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.motion.path import DrivenPath, PlatformPath
from tri_glide_kinematics.motion.tracking import SLOWEST_JOG, MovingTarget, Wanted, WantedVelocity
from tri_glide_kinematics.motion.trajectory import SequencePlan, Trajectory
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import vector_text
from tri_glide_kinematics.workspace import Workspace

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
    from tri_glide_kinematics.motion.moves import MotionPlanner

# Jogs are the same if their directions differ by less than this [rad], and their speeds by less
# than this fraction.
SAME_JOG = 1e-9

# Makes a path, from the end of the one that it extends [m] or from where it begins.
PathMaking = Callable[[Vector3 | None], Interruptible[PlatformPath]]


class Move(Command):
    """Move the platform to a position and rest there."""

    kind = TargetKind.POSITION
    phase = MotionPhase.MOVING
    is_planned_again = True
    position: Vector3

    def __init__(self, position: Sequence[float]) -> None:
        """Move to a ``position``. Shape (3,) [m].

        Raises:
            WrongShapeError: if there are not three numbers.
            NotFiniteError: if one of them is NaN or infinite.
        """
        super().__init__()
        x, y, z = finite_vector("position", position, 3)
        self.position = (x, y, z)

    def __str__(self) -> str:
        """Return the target in words."""
        return f"target {vector_text(self.position, 6)} m"

    @property
    def waits_on(self) -> bool:
        """Whether it is to be begun again where its planning is given up for a stop."""
        return True

    @property
    def destination(self) -> Vector3 | None:
        """Where the platform is to rest at last [m]."""
        return self.position

    def begin(self, execution: Execution) -> None:
        """Ask for a plan; the position that is moved to, or was reached, changes nothing."""
        goal = execution.goal
        if goal is not None and goal.destination == self.position:
            execution.keep_goal()
        else:
            execution.workspace.check_position(self.position)
            execution.prepare_goal(self)

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
        return planner.move(state, self.position, limits.effective, region, moving, after)


class Jog(Command):
    """Move the platform along a direction, up to the edge of the workspace at most.

    Attributes:
        speed: of the platform [m/s].
        direction: unit vector; of no use where it ``is_still``. Shape (3,).
    """

    kind = TargetKind.VELOCITY
    phase = MotionPhase.JOGGING
    leads_anywhere = True
    velocity: Vector3

    def __init__(
        self, velocity: Sequence[float], *, received: float = math.nan, pause: float = 0.0
    ) -> None:
        """Move with a ``velocity``. Shape (3,) [m/s].

        Raises:
            WrongShapeError: if there are not three numbers.
            NotFiniteError: if one of them is NaN or infinite.
        """
        super().__init__(received=received, pause=pause)
        x, y, z = finite_vector("velocity", velocity, 3)
        self.velocity = (x, y, z)
        self.speed = math.hypot(x, y, z)
        self.direction: Vector3 = self.velocity
        if not self.is_still:
            self.direction = (x / self.speed, y / self.speed, z / self.speed)

    def __str__(self) -> str:
        """Return the target in words."""
        return f"twist {vector_text(self.velocity, 6)} m/s"

    @property
    def is_still(self) -> bool:
        """Whether this is no velocity at all."""
        return self.speed < SLOWEST_JOG

    def renews(self, goal: Command | None) -> bool:
        """Return whether this asks for what a ``goal`` asked for."""
        return (
            isinstance(goal, Jog)
            and math.dist(goal.direction, self.direction) < SAME_JOG
            and abs(goal.speed - self.speed) < SAME_JOG * goal.speed
        )

    def begin(self, execution: Execution) -> None:
        """Go over to it at once if a step is certified, else ask for a plan.

        The same velocity again changes nothing while the platform moves; none at all is a stop.
        """
        is_idle = execution.is_idle
        if self.is_still:
            execution.stop()
        elif not is_idle and self.renews(execution.goal):
            execution.keep_goal()
        elif is_idle or not execution.go_over_to(self):
            execution.prepare_goal(self)

    def planned(
        self,
        planner: MotionPlanner,
        state: SliderState,
        limits: DriveLimits,
        region: Workspace,
        moving: bool,
        after: SequencePlan | None,
    ) -> Interruptible[Trajectory]:
        """Return a plan up to the edge; the arguments are those of ``MotionPlanner.jog``."""
        speed = self.speed * limits.speed_scale
        return planner.jog(state, self.direction, speed, limits.effective, region, moving)

    def wanted(self, tracker: Foresight, limits: DriveLimits, dt: float) -> Wanted:
        """Return its velocity, led as it changes, as far as the scale lets it."""
        (x, y, z), (ax, ay, az) = tracker.velocity_after(dt, self.velocity)
        scale = limits.speed_scale
        return WantedVelocity(
            (scale * x, scale * y, scale * z), (scale * ax, scale * ay, scale * az)
        )

    def ends_at_edge(self, refusal: KinematicsError) -> bool:
        """Return whether a ``refusal`` says that there is no room in its direction."""
        return isinstance(refusal, NoRoomError)


class Track(Command):
    """Follow a target that moves.

    Attributes:
        seen: when it was there, by the clock of the caller [s].
        age: how long before the present setpoint it was so [s].
    """

    kind = TargetKind.MOVING
    phase = MotionPhase.TRACKING
    has_end = False
    has_line = False
    leads_anywhere = True
    position: Vector3
    velocity: Vector3

    def __init__(
        self,
        position: Sequence[float],
        velocity: Sequence[float],
        *,
        age: float = 0.0,
        seen: float = math.nan,
        received: float = math.nan,
        pause: float = 0.0,
    ) -> None:
        """Follow a target at a ``position`` [m] with a ``velocity`` [m/s]. Shapes (3,).

        Raises:
            WrongShapeError: if there are not three numbers in each.
            NotFiniteError: if one of them, or the age, is NaN or infinite.
        """
        super().__init__(received=received, pause=pause)
        x, y, z = finite_vector("position", position, 3)
        dx, dy, dz = finite_vector("velocity", velocity, 3)
        self.position, self.velocity = (x, y, z), (dx, dy, dz)
        self.age = finite("age", age)
        self.seen = seen

    def __str__(self) -> str:
        """Return the target in words."""
        return (
            f"moving target {vector_text(self.position, 6)} m, "
            f"velocity {vector_text(self.velocity, 6)} m/s"
        )

    @property
    def motion_text(self) -> str:
        """The motion, in words, while it is carried out."""
        return "follows a moving target"

    def has_turn(self, now: float, period: float) -> None:
        """Work out its age: the next setpoint is for now, the present one a period older."""
        self.age = finite("age", max(now, self.received) - period - self.seen)

    def begin(self, execution: Execution) -> None:
        """Track it as soon as a step is certified, and brake until then."""
        execution.follow_target(self, MovingTarget(self.position, self.velocity), self.age)

    def wanted(self, tracker: Foresight, limits: DriveLimits, dt: float) -> Wanted:
        """Return where the target will be, and how it will move; with a shaper, led."""
        return tracker.target_after(dt, limits.shaper)

    def edge(self, check_position: Callable[[Vector3], object]) -> KinematicsError | None:
        """Return why the target is not inside the workspace, if it is not."""
        try:
            check_position(self.position)
        except KinematicsError as error:
            return error
        return None


class PathOutputs(NamedTuple):
    """What is told while a path is driven, each at the start of a segment.

    Attributes:
        segments: their indices, none smaller than the one before.
        told: what is told at each of them; nobody in here looks at it.
        total: number of all segments. A first one that leads nowhere is no part of the path.
    """

    segments: Sequence[int]
    told: Sequence[Any]
    total: int

    def places(self, path: PlatformPath, driven: DrivenPath) -> list[float]:
        """Return where on the path as driven each is told [m].

        Args:
            path: that the segments are those of.
            driven: it ends with that path.
        """
        own = len(path.segments)
        first = len(driven.segments) - own
        left_out = self.total - own
        numbers = [first + max(segment - left_out, 0) for segment in self.segments]
        places: list[float] = driven.joints[numbers].tolist()
        return places


class Follow(Command):
    """Follow a path.

    Attributes:
        outputs: what is told on the way; None for nothing.
        path: as it was asked for; of one that ``extends``, what comes after the path that is
            followed. None until it is made.
        deviation: the largest distance from it as programmed may be this [m]; NaN until that is
            known.
    """

    kind = TargetKind.PATH
    phase = MotionPhase.FOLLOWING
    is_checked_whole = True

    def __init__(
        self,
        path: PlatformPath | None,
        name: str = "path",
        *,
        extends: bool = False,
        outputs: PathOutputs | None = None,
    ) -> None:
        """Follow a ``path`` of one segment at least.

        Args:
            path: as it is asked for.
            name: in words.
            extends: whether it goes on from the end of the path that is followed.
            outputs: what is told on the way.
        """
        super().__init__()
        self.path = path
        self.outputs = outputs
        self.extends = extends
        self.deviation = math.nan
        self._name = name
        self._make: PathMaking | None = None

    @classmethod
    def made(
        cls,
        make: PathMaking,
        name: str,
        extends: bool = False,
        outputs: PathOutputs | None = None,
    ) -> Follow:
        """Return a command whose path is made when it is its turn, in pieces.

        Args:
            make: makes it from the end of the path that it extends [m]; from where it begins if
                that is None.
            name: in words.
            extends: whether it goes on from the end of the path that is followed, if there is one.
            outputs: what is told on the way.
        """
        command = cls(None, name, extends=extends, outputs=outputs)
        command._make = make
        return command

    def __str__(self) -> str:
        """Return the target in words."""
        return self._name

    @property
    def size(self) -> int:  # type: ignore[override]
        """Number of segments of the path, as far as it is made."""
        return self.path.count if self.path is not None else 0

    @property
    def waits_on(self) -> bool:
        """Whether it is to be begun again where its planning is given up for a stop."""
        return not self.extends

    def making(self, end: Vector3 | None) -> Interruptible[None] | None:
        """Return what makes its path, from the ``end`` [m] of the one that it extends, if it does.

        It begins where the platform is, so it is made anew each time that it has its turn.
        """
        return None if self._make is None else self._made(self._make(end))

    def _made(self, computation: Interruptible[PlatformPath]) -> Interruptible[None]:
        self.path = yield from computation

    def begin(self, execution: Execution) -> None:
        """Ask for a plan.

        Raises:
            NotStartedError: before the start.
            NoPathError: if it extends a path, and none is followed.
        """
        if self.extends and not execution.follows_path:
            raise NoPathError("to extend")
        execution.prepare_goal(self)


class NewLimits(Command):
    """What the sliders may do from now on.

    Attributes:
        limits: of the sliders, with the scale; the shaper stays the one that is in force, or next.
    """

    def __init__(self, limits: DriveLimits) -> None:
        """Change the limits to these."""
        super().__init__()
        self.limits = limits

    def __str__(self) -> str:
        """Return what is asked for in words."""
        return "new limits"

    def begin(self, execution: Execution) -> None:
        """Put them in force now, or slow down until that is possible."""
        execution.change_limits(self.limits)
