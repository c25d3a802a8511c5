"""A followed branch of an F-mechanism as plain data: samples along it, and what happens on it."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.results.pose import FMechanismPose
from tri_glide_kinematics.mechanisms.f_mechanism.solving import (
    Linkage,
    direction,
    pins_at,
    pose_of,
    position_of,
)
from tri_glide_kinematics.vectors import Point

Array = NDArray[np.float64]


class EventKind(enum.Enum):
    """An event of a followed branch."""

    TURNING_POINT = "turning point"
    BIFURCATION = "bifurcation"
    SINGULAR = "singular"
    END = "end of the range"
    CLOSED = "closed"


@dataclass(frozen=True)
class FMechanismEvent:
    """An event on a branch; the last one of a trace says why it ended.

    Attributes:
        kind: turning point (the cranks must reverse), bifurcation (another branch crosses),
            singular (no unique way on: an isolated position, or a branch that is singular along
            more than a point), end of the requested range, or closed (back in the starting
            position).
        crank_angle: angle of crank A, counted on from the start [rad].
        phase_b: phase shift of crank B there [rad].
        phase_c: phase shift of crank C there [rad].
        pose: position there.
        index: number of samples of the trace that lie before it.
    """

    kind: EventKind
    crank_angle: float
    phase_b: float
    phase_c: float
    pose: FMechanismPose
    index: int


@dataclass(frozen=True, eq=False)
class FMechanismTrace:
    """Samples along one branch, in the order in which they are passed.

    Attributes:
        crank_angle: angle of crank A, counted on over full turns, shape (m,) [rad].
        phase_b: phase shift of crank B, shape (m,) [rad].
        phase_c: phase shift of crank C, shape (m,) [rad].
        angle: platform angle, continuous over full turns, shape (m,) [rad].
        position: origin of the platform frame, shape (m, 2) [m].
        crank_pins: A1, B1, C1, shape (m, 3, 2) [m].
        platform_joints: A2, B2, C2, shape (m, 3, 2) [m].
        angular_velocity: per unit crank speed at fixed phases, shape (m,) [rad/rad].
        velocity: of the origin, likewise, shape (m, 2) [m/rad].
        residual: largest deviation of a rod length, shape (m,) [m].
        singularity: as in FMechanismPose, shape (m,).
        events: in the order in which they are passed; the last one ends the trace.
        arcs: number of arcs that the branch was followed in.
    """

    crank_angle: Array
    phase_b: Array
    phase_c: Array
    angle: Array
    position: Array
    crank_pins: Array
    platform_joints: Array
    angular_velocity: Array
    velocity: Array
    residual: Array
    singularity: Array
    events: tuple[FMechanismEvent, ...]
    arcs: int
    linkage: Linkage

    @property
    def turning_points(self) -> tuple[FMechanismEvent, ...]:
        """The events at which the cranks reverse."""
        return self._events(EventKind.TURNING_POINT)

    @property
    def bifurcations(self) -> tuple[FMechanismEvent, ...]:
        """The events at which another branch crosses."""
        return self._events(EventKind.BIFURCATION)

    @property
    def closed(self) -> bool:
        """Whether the branch came back to its starting position."""
        return self.events[-1].kind is EventKind.CLOSED

    @property
    def turns(self) -> float:
        """Net turns of the crank from the first sample to the end."""
        return (self.events[-1].crank_angle - float(self.crank_angle[0])) / (2.0 * math.pi)

    @property
    def turns_fully(self) -> bool:
        """Whether the cranks turn through without reversing until the branch closes.

        A branch may need more than one turn to close: ``turns`` tells how many.
        """
        return self.closed and not self.turning_points and abs(round(self.turns)) >= 1

    def pose(self, index: int) -> FMechanismPose:
        """One sample as a position, for instance to start another trace from."""
        crank_angle, angle = float(self.crank_angle[index]), float(self.angle[index])
        phases = (0.0, float(self.phase_b[index]), float(self.phase_c[index]))
        linkage = replace(self.linkage, phases=phases)
        pins = pins_at(linkage, linkage.crank_angles(crank_angle))
        z = direction(angle)
        v = complex(*self.position[index]) + z * linkage.joints[0] - pins.a
        return pose_of(linkage, pins, crank_angle, position_of(linkage, pins, z, v))

    def point(self, platform_point: Point) -> Array:
        """Places in the fixed frame of a point of the platform frame [m]. Shape (m, 2) [m]."""
        return self.position + self._arms(platform_point)

    def point_velocity(self, platform_point: Point) -> Array:
        """Velocities per unit crank speed of a point of the platform frame. Shape (m, 2) [m/rad].

        As ``velocity``, they are those at fixed phases.
        """
        x, y = self._arms(platform_point).T
        rates: Array = self.angular_velocity[:, np.newaxis] * np.stack([-y, x], axis=-1)
        return self.velocity + rates

    def _arms(self, platform_point: Point) -> Array:
        """From the platform's origin to a point of the platform. Shape (m, 2) [m]."""
        arms = direction(self.angle) * complex(*platform_point)
        return np.stack([arms.real, arms.imag], axis=-1)

    def _events(self, kind: EventKind) -> tuple[FMechanismEvent, ...]:
        return tuple(event for event in self.events if event.kind is kind)
