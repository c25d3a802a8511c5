"""What the motion engine is asked for, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import ClassVar

from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.moves import MotionPlanner
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.tracking import SLOWEST_JOG
from tri_glide_kinematics.motion.trajectory import (
    PathHeights,
    SequencePlan,
    SliderLimits,
    SliderState,
    Trajectory,
)
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Jogs are the same if their directions differ by less than this [rad], and their speeds by less
# than this fraction.
SAME_JOG = 1e-9


class MotionPhase(Enum):
    """What the engine is doing."""

    IDLE = "idle"
    MOVING = "moving"
    JOGGING = "jogging"
    TRACKING = "tracking"
    FOLLOWING = "following"
    PAUSED = "paused"
    STOPPING = "stopping"


@dataclass(frozen=True)
class Move:
    """Move the platform to a position and rest there.

    Attributes:
        position: Shape (3,) [m].
    """

    phase: ClassVar = MotionPhase.MOVING

    position: Vector3

    @property
    def destination(self) -> Vector3 | None:
        """Where the platform is to rest at last [m]."""
        return self.position

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


@dataclass(frozen=True)
class Jog:
    """Move the platform along a direction.

    Attributes:
        direction: unit vector. Shape (3,).
        speed: of the platform [m/s].
    """

    phase: ClassVar = MotionPhase.JOGGING

    direction: Vector3
    speed: float

    @property
    def destination(self) -> Vector3 | None:
        """Where the platform is to rest at last: nobody knows."""
        return None

    def planned(
        self,
        planner: MotionPlanner,
        state: SliderState,
        limits: DriveLimits,
        region: Workspace,
        moving: bool,
        _after: SequencePlan | None,
    ) -> Interruptible[Trajectory]:
        """Return a plan up to the edge; the arguments are those of ``MotionPlanner.jog``."""
        speed = self.speed * limits.speed_scale
        return planner.jog(state, self.direction, speed, limits.effective, region, moving)

    def is_renewed_by(self, other: Jog) -> bool:
        """Return whether ``other`` asks for the same."""
        return (
            math.dist(self.direction, other.direction) < SAME_JOG
            and abs(self.speed - other.speed) < SAME_JOG * self.speed
        )


@dataclass(frozen=True)
class Track:
    """Follow a target that moves.

    Attributes:
        position: of the target. Shape (3,) [m].
        velocity: of the target. Shape (3,) [m/s].
        age: how long before the present setpoint it was so [s].
    """

    phase: ClassVar = MotionPhase.TRACKING

    position: Vector3
    velocity: Vector3
    age: float = 0.0

    @property
    def destination(self) -> Vector3 | None:
        """Where the platform is to rest at last: nobody knows."""
        return None


@dataclass(frozen=True, eq=False)
class Follow:
    """Follow a path from one of its places on.

    Attributes:
        path: as it was asked for; with ``extends``, what comes after the path that is followed.
        extends: whether it goes on from the end of the path that is followed.
        heights: of the sliders on the path as driven; None until that is known.
        place: from which the way goes on where no plan on the path is held [m].
        is_paused: whether to rest on the way.
        from_rest: whether the next part can only be planned from rest.
    """

    phase: ClassVar = MotionPhase.FOLLOWING

    path: PlatformPath
    extends: bool = False
    heights: PathHeights | None = None
    place: float = 0.0
    is_paused: bool = False
    from_rest: bool = False

    @property
    def destination(self) -> Vector3 | None:
        """Where the platform is to rest at last; None until the path as driven is known [m]."""
        if self.heights is None:
            return None
        x, y, z = self.heights.driven.segments.points[-1].tolist()
        return x, y, z


Command = Move | Jog | Track | Follow


def path_of(goal: Command | None) -> Follow | None:
    """Return a ``goal`` that is a path; None of any other."""
    return goal if isinstance(goal, Follow) else None


def jog_of(velocity: Vector3) -> Jog | None:
    """Return the jog with a platform ``velocity`` [m/s]; None if that is no velocity at all."""
    x, y, z = velocity
    speed = math.hypot(x, y, z)
    if speed < SLOWEST_JOG:
        return None
    return Jog((x / speed, y / speed, z / speed), speed)


@dataclass(frozen=True)
class DriveLimits:
    """Limits of the sliders, and how much of their velocities is used.

    Attributes:
        sliders: limits before the scale.
        speed_scale: in (0, 1].
    """

    sliders: SliderLimits
    speed_scale: float

    def __post_init__(self) -> None:
        """Check the scale.

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        scale = positive("speed_scale", self.speed_scale)
        if scale > 1.0:
            raise OutOfBoundsError("speed_scale", scale, "at most 1")
        object.__setattr__(self, "speed_scale", scale)

    @cached_property
    def effective(self) -> SliderLimits:
        """Limits after the scale."""
        return self.sliders.with_velocity_scaled(self.speed_scale)


def stays_within(state: SliderState, limits: SliderLimits) -> bool:
    """Return whether the sliders can stay inside ``limits`` from this ``state`` on."""
    return all(
        abs(a) <= largest and abs(v) + (a * a / (2.0 * jerk) if a * v > 0.0 else 0.0) <= speed
        for v, a, speed, largest, jerk in zip(
            state.velocities,
            state.accelerations,
            limits.velocity,
            limits.acceleration,
            limits.jerk,
        )
    )
