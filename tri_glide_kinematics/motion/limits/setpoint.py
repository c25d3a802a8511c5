"""Setpoints of the sliders, at one instant or at many, and of which motion of the platform."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple, TypeAlias

from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3

AT_REST: Vector3 = (0.0, 0.0, 0.0)


class SliderState(NamedTuple):
    """Setpoint of the sliders at one instant; a tuple, as one is made in each control cycle.

    Attributes:
        heights: Shape (3,) [m].
        velocities: Shape (3,) [m/s].
        accelerations: Shape (3,) [m/s^2].
    """

    heights: Vector3
    velocities: Vector3
    accelerations: Vector3


# Makes a state of three vectors in half the time that its class takes: one is made in each cycle.
new_state = tuple.__new__

# For each arm, where its anchor is [m], and the square of its length [m^2].
Arms: TypeAlias = tuple[Vector3, Vector3, Vector3]


def arms_of(geometry: TriGlideGeometry) -> Arms:
    """Return the arms as ``slider_state`` takes them."""
    first, second, third = (
        (x, y, length * length) for (x, y), length in zip(geometry.anchors, geometry.arm_lengths)
    )
    return first, second, third


def slider_state(arms: Arms, platform: tuple[float, ...]) -> SliderState:
    """Return the setpoint that moves the platform so, in plain floats: each cycle may need one.

    Args:
        arms: of the machine.
        platform: nine numbers, as ``Trajectory.platform_at`` returns them.

    Raises:
        ValueError: if the position is out of reach of an arm.
    """
    x, y, z, vx, vy, vz, ax, ay, az = platform
    level = vx * vx + vy * vy
    (c1, d1, q1), (c2, d2, q2), (c3, d3, q3) = arms
    c1, c2, c3, d1, d2, d3 = x - c1, x - c2, x - c3, y - d1, y - d2, y - d3
    r1 = sqrt(q1 - c1 * c1 - d1 * d1)
    r2 = sqrt(q2 - c2 * c2 - d2 * d2)
    r3 = sqrt(q3 - c3 * c3 - d3 * d3)
    g1 = (c1 * vx + d1 * vy) / -r1
    g2 = (c2 * vx + d2 * vy) / -r2
    g3 = (c3 * vx + d3 * vy) / -r3
    return new_state(
        SliderState,
        (
            (z + r1, z + r2, z + r3),
            (g1 + vz, g2 + vz, g3 + vz),
            (
                az - (level + g1 * g1 + c1 * ax + d1 * ay) / r1,
                az - (level + g2 * g2 + c2 * ax + d2 * ay) / r2,
                az - (level + g3 * g3 + c3 * ax + d3 * ay) / r3,
            ),
        ),
    )


class SampledPlan(NamedTuple):
    """Setpoints at many instants.

    Attributes:
        times: Shape (n,) [s].
        heights: Shape (n, 3) [m].
        velocities: Shape (n, 3) [m/s].
        accelerations: Shape (n, 3) [m/s^2].
    """

    times: FloatArray
    heights: FloatArray
    velocities: FloatArray
    accelerations: FloatArray
