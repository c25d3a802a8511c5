r"""How the sliders move while the platform moves straight on: rates and their derivatives.

With the rise $s_i = h_i - z$ of arm i and the velocity $(u_x, u_y, u_z)$ the rise changes by
$r_i = \dot h_i - u_z$ per second, and as $s_i^2 + |F_i|^2$ is the square of the arm's length,

$$\ddot h_i = -\frac{u_x^2 + u_y^2 + r_i^2}{s_i}, \quad \dddot h_i = -\frac{3 r_i \ddot h_i}{s_i}.$$
"""

from __future__ import annotations

from typing import NamedTuple

from tri_glide_kinematics.tri_glide import NoPoseError, TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import vector_text


class SliderLine(NamedTuple):
    """Sliders while the platform passes a place at a steady velocity.

    Attributes:
        heights: at the place. Shape (3,) [m].
        rates: of the heights. Shape (3,) [m/s].
        accelerations: Shape (3,) [m/s^2].
        jerks: Shape (3,) [m/s^3].
    """

    heights: Vector3
    rates: Vector3
    accelerations: Vector3
    jerks: Vector3


def slider_line(machine: TriGlide, position: Vector3, velocity: Vector3) -> SliderLine:
    """Return the motion of the sliders for a platform on a straight line.

    Args:
        machine: the kinematics.
        position: of the platform. Shape (3,) [m].
        velocity: of the platform. Shape (3,) [m/s].

    Raises:
        KinematicsError: if the machine has no pose there, or a number is not finite.
    """
    heights, rates = machine.inverse_velocity(position, velocity)
    (h1, h2, h3), (w1, w2, w3), z = heights, rates, position[2]
    dx, dy, dz = velocity
    level = dx * dx + dy * dy
    s1, s2, s3 = h1 - z, h2 - z, h3 - z
    if not (s1 > 0.0 and s2 > 0.0 and s3 > 0.0):
        # However far up or down a place is, the heights lie above it; but not by what they are
        # rounded to.
        place = vector_text(position, 3)
        raise NoPoseError(f"the place {place} m is too far away to tell the sliders", heights)
    r1, r2, r3 = w1 - dz, w2 - dz, w3 - dz
    a1, a2, a3 = -(level + r1 * r1) / s1, -(level + r2 * r2) / s2, -(level + r3 * r3) / s3
    return SliderLine(
        heights,
        rates,
        (a1, a2, a3),
        (-3.0 * r1 * a1 / s1, -3.0 * r2 * a2 / s2, -3.0 * r3 * a3 / s3),
    )
