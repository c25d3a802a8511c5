"""What a machine may be asked for: what all commands share, and one class for each kind of them.

A command is one object from when it comes in until it ends. It is this very object that waits, is
planned, is carried out and ends, whatever equals it. All that differs between kinds stands in their
classes, so a new kind is a new class.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

from tri_glide_kinematics.checks import finite, finite_vector, non_negative
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import NoPathError, NoRoomError
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.motion.path import DrivenPath, PlatformPath
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.tracking import SLOWEST_JOG, MovingTarget, Wanted, WantedVelocity
from tri_glide_kinematics.motion.trajectory import SequencePlan, Trajectory
from tri_glide_kinematics.motion.transfer import Station, TransferError
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import vector_text
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
    PLACE = 5


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

    def prepare_transfer(self, goal: Transfer) -> None:
        """Make the plan of a ``goal`` that begins where the present motion comes to rest."""


class Departure(NamedTuple):
    """Where the plan of a command is to begin.

    Attributes:
        state: of the sliders.
        limits: for all of the plan.
        region: where the platform may be on its way.
        moving: whether the sliders are in motion.
        after: plan that leads from there to rest, after which the motion may begin; None if it may
            not.
    """

    state: SliderState
    limits: DriveLimits
    region: Workspace
    moving: bool
    after: SequencePlan | None


class Foresight(Protocol):
    """What knows where a tracked target will be, and which velocity will be wanted."""

    def velocity_after(
        self, dt: float, told: Vector3, shaper: Shaper | None = None
    ) -> WantedVelocity:
        """Return which velocity will be wanted in ``dt`` seconds, ``told`` last [m/s].

        With a ``shaper`` it is led.
        """

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
        destination_unknown: whether nobody knows where its motion leads, as newer ones renew it.
        is_planned_again: whether it is planned with all of the limits where it begins at rest, and
            again with less where shaping takes some.
        is_timed: whether its plan is for the instant for which it was made, and for no later one.
        path: to be followed; None of what is none, and until it is made.
        extends: whether it goes on from the end of the path that is followed.
        size: number of segments of a path.
        outputs: what is told on a path; None for nothing.
        stations: that are gone to, in their order.
        seen: the time of what was told of the target, by the clock of the caller; NaN if nobody
            asks [s].
        lead: so much earlier a setpoint has to be where a target is that moves, as drives follow
            late; only what is timed heeds it [s].
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
    destination_unknown: ClassVar[bool] = False
    is_planned_again: ClassVar[bool] = False
    is_timed: ClassVar[bool] = False
    path: PlatformPath | None = None
    extends: bool = False
    size: int = 0
    outputs: PathOutputs | None = None
    stations: tuple[Station, ...] = ()
    seen: float = math.nan
    lead: float = 0.0
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

    def has_turn(self, following: float, period: float, present: float) -> None:  # noqa: B027
        """Note that it is given to the engine; most commands need nothing of that.

        Args:
            following: for when the next setpoint is, as far as that is known [s].
            period: from the present setpoint to the next one [s].
            present: for when the present setpoint was [s].
        """

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

    def planned(self, planner: MotionPlanner, begin: Departure) -> Interruptible[Trajectory]:
        """Return a plan that leads there from where it is to ``begin``."""
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

    def planned(self, planner: MotionPlanner, begin: Departure) -> Interruptible[Trajectory]:
        """Return a plan that leads there from where it is to ``begin``."""
        state, limits, region, moving, after = begin
        return planner.move(state, self.position, limits.effective, region, moving, after)


class Jog(Command):
    """Move the platform along a direction, up to the edge of the workspace at most.

    Attributes:
        speed: of the platform [m/s].
        direction: unit vector; of no use where it ``is_still``. Shape (3,).
    """

    kind = TargetKind.VELOCITY
    phase = MotionPhase.JOGGING
    destination_unknown = True
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

    def planned(self, planner: MotionPlanner, begin: Departure) -> Interruptible[Trajectory]:
        """Return a plan up to the edge from where it is to ``begin``."""
        state, limits, region, moving, _ = begin
        speed = self.speed * limits.speed_scale
        return planner.jog(state, self.direction, speed, limits.effective, region, moving)

    def wanted(self, tracker: Foresight, limits: DriveLimits, dt: float) -> Wanted:
        """Return its velocity, led as it changes, as far as the scale lets it."""
        (x, y, z), (ax, ay, az) = tracker.velocity_after(dt, self.velocity, limits.shaper)
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
        age: how long before the present setpoint it was so [s].
    """

    kind = TargetKind.MOVING
    phase = MotionPhase.TRACKING
    has_end = False
    has_line = False
    destination_unknown = True
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

    def has_turn(self, following: float, period: float, present: float) -> None:
        """Work out its age: the present setpoint is a period older than the ``following`` one."""
        self.age = finite("age", max(following, self.received) - period - self.seen)

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


class Transfer(Command):
    """Bring the platform from station to station, where stations may move, and come to rest.

    Up to a height, across, down to a station with its velocity, a dwell in which the platform moves
    with it, and on to the next one. All of it is one plan, made before it begins.

    Attributes:
        height: of the platform between stations, by z [m].
        tolerance: how far it may be from a corner of its way [m].
        allowed: so far from a station it may be when it arrives there [m].
        lifts: whether it goes up after the last station. After one that moves it does so anyway.
        leave_at: when the platform leaves its start at the earliest, by the clock of the caller
            [s].
        age: time from that of the positions to the present setpoint, as it begins [s].
        stays: how long it stays at its start at least, from the present setpoint on [s].
    """

    kind = TargetKind.PLACE
    phase = MotionPhase.MOVING
    has_line = False
    destination_unknown = True
    is_timed = True

    def __init__(
        self,
        stations: Sequence[Station],
        height: float,
        *,
        tolerance: float = 0.005,
        allowed: float = 2e-4,
        lifts: bool = True,
        seen: float = math.nan,
        leave_at: float = -math.inf,
        lead: float = 0.0,
    ) -> None:
        """Go to each of the ``stations``.

        Raises:
            WrongShapeError: if a vector of a station has not three numbers.
            NotFiniteError: if a number of a station, or the height, is NaN or infinite.
            OutOfBoundsError: if a dwell, or a tolerance, is negative.
            TransferError: if there is no station.
        """
        super().__init__()
        if not stations:
            raise TransferError("a transfer needs a station")
        for station in stations:
            for name in ("position", "velocity", "acceleration"):
                finite_vector(name, getattr(station, name), 3)
            non_negative("dwell", station.dwell, "s")
        self.stations = tuple(stations)
        self.height = finite("height", height)
        self.tolerance = non_negative("tolerance", tolerance, "m")
        self.allowed = non_negative("allowed", allowed, "m")
        self.lifts, self.seen, self.leave_at, self.lead = lifts, seen, leave_at, lead
        self.age, self.stays = 0.0, 0.0

    def __str__(self) -> str:
        """Return the target in words."""
        place = vector_text(self.stations[0].position, 6)
        moves = ", which moves" if self.stations[0].moves else ""
        count = len(self.stations)
        stations = "a station" if count == 1 else f"{count} stations, the first"
        return f"transfer to {stations} at {place} m{moves}"

    def has_turn(self, following: float, period: float, present: float) -> None:
        """Work out how old the positions of the stations are, and how long it stays."""
        if not math.isnan(self.seen):
            self.age = present - self.seen
        self.stays = max(self.leave_at - self.lead - present, 0.0)

    def begin(self, execution: Execution) -> None:
        """Ask for a plan from where the present motion comes to rest."""
        execution.prepare_transfer(self)

    def planned(self, planner: MotionPlanner, begin: Departure) -> Interruptible[Trajectory]:
        """Refuse: a transfer does not begin again where limits have changed on its way."""
        raise TransferError("new limits do not allow the transfer to go on")


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
