"""Positions of the moving triangle of an F-mechanism as plain data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.solving import Linkage, pins_at
from tri_glide_kinematics.vectors import Point

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FMechanismPose:
    """One position of the moving triangle, and its motion per unit crank speed.

    Where the position is singular the rates are infinite or without meaning.

    Attributes:
        crank_angle: angle of crank A [rad].
        angle: rotation phi_70 of the platform, in (-pi, pi] [rad].
        position: origin u_0 of the platform frame [m].
        crank_pins: A1, B1, C1 [m].
        platform_joints: A2, B2, C2 in the fixed frame [m].
        angular_velocity: d angle / d crank_angle [rad/rad].
        velocity: d position / d crank_angle [m/rad].
        residual: largest deviation of a rod length [m].
        singularity: signed, dimensionless determinant of the three rod lines: each row is the
            unit direction of a rod and its moment over the platform radius (root mean square
            distance of the platform joints from their centroid). It is zero exactly where the rods
            are concurrent or parallel, and of order one far from there.
        double: whether two positions coincide here to rounding (a fold, or a branching point).
    """

    crank_angle: float
    angle: float
    position: Point
    crank_pins: tuple[Point, Point, Point]
    platform_joints: tuple[Point, Point, Point]
    angular_velocity: float
    velocity: Point
    residual: float
    singularity: float
    double: bool

    def point(self, platform_point: Point) -> Point:
        """Place in the fixed frame of a point given in the platform frame [m]."""
        x, y = platform_point
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return (
            float(self.position[0] + cosine * x - sine * y),
            float(self.position[1] + sine * x + cosine * y),
        )

    def point_velocity(self, platform_point: Point) -> Point:
        """Velocity per unit crank speed of a point given in the platform frame [m/rad]."""
        x, y = self.point(platform_point)
        return (
            self.velocity[0] - self.angular_velocity * (y - self.position[1]),
            self.velocity[1] + self.angular_velocity * (x - self.position[0]),
        )


@dataclass(frozen=True, eq=False)
class FMechanismPoses:
    """All positions at many crank angles; places without a position hold NaN.

    Attributes:
        crank_angles: shape (n,) [rad].
        counts: number of positions, shape (n,).
        angle: platform angles, ascending in each row, shape (n, 6) [rad].
        position: origins of the platform frame, shape (n, 6, 2) [m].
        angular_velocity: shape (n, 6) [rad/rad].
        velocity: of the origin, shape (n, 6, 2) [m/rad].
        residual: largest deviation of a rod length, shape (n, 6) [m].
        singularity: as in FMechanismPose, shape (n, 6).
        self_motion: rows in which the platform can move with the cranks at rest, so that there is
            no finite number of positions; their count is 0. Shape (n,).
        linkage: dimensions of the mechanism.
    """

    crank_angles: Array
    counts: NDArray[np.int64]
    angle: Array
    position: Array
    angular_velocity: Array
    velocity: Array
    residual: Array
    singularity: Array
    self_motion: NDArray[np.bool_]
    linkage: Linkage

    def platform_joints(self) -> Array:
        """A2, B2, C2 in the fixed frame, shape (n, 6, 3, 2) [m]."""
        joints = np.array([(joint.real, joint.imag) for joint in self.linkage.joints])
        cosine, sine = np.cos(self.angle)[..., np.newaxis], np.sin(self.angle)[..., np.newaxis]
        x = cosine * joints[:, 0] - sine * joints[:, 1]
        y = sine * joints[:, 0] + cosine * joints[:, 1]
        places: Array = self.position[..., np.newaxis, :] + np.stack([x, y], axis=-1)
        return places

    def crank_pins(self) -> Array:
        """A1, B1, C1, shape (n, 3, 2) [m]."""
        pins = pins_at(self.linkage, self.linkage.crank_angles(self.crank_angles))
        places = np.stack([pins.a, pins.b, pins.c], axis=-1)
        return np.stack([places.real, places.imag], axis=-1)
