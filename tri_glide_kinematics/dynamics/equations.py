"""The equations of ``slider_forces.py``, for numbers or for arrays of them.

In each control cycle they are calculated for one pose in plain floats; elsewhere for many poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

from tri_glide_kinematics.tri_glide import TriGlideGeometry

# A float, or an array of them; three of these, or an array with three rows.
Number: TypeAlias = Any
Triple: TypeAlias = Any

# Of each arm its horizontal part over its rise, x and y; and the inverse of the determinant of the
# Jacobian.
Slopes: TypeAlias = tuple[Number, Number, Number, Number, Number, Number, Number]


def slopes_of(geometry: TriGlideGeometry, heights: Triple, position: Triple) -> Slopes:
    """Return the slopes of the arms at ``heights`` and a ``position`` that belong together."""
    (x1, y1), (x2, y2), (x3, y3) = geometry.anchors
    x, y, z = position
    h1, h2, h3 = heights
    r1 = 1.0 / (h1 - z)
    r2 = 1.0 / (h2 - z)
    r3 = 1.0 / (h3 - z)
    n1x = (x1 - x) * r1
    n1y = (y1 - y) * r1
    n2x = (x2 - x) * r2
    n2y = (y2 - y) * r2
    n3x = (x3 - x) * r3
    n3y = (y3 - y) * r3
    determinant = (n2x - n1x) * (n3y - n1y) - (n2y - n1y) * (n3x - n1x)
    return n1x, n1y, n2x, n2y, n3x, n3y, 1.0 / determinant


def squares_of(heights: Triple, position: Triple, rates: Triple, velocity: Triple) -> Triple:
    """Return for each arm the squared speed of its end against the other, over its rise."""
    h1, h2, h3 = heights
    v1, v2, v3 = rates
    dx, dy, dz = velocity
    z = position[2]
    across = dx * dx + dy * dy
    v1 = v1 - dz
    v2 = v2 - dz
    v3 = v3 - dz
    return (
        (across + v1 * v1) / (h1 - z),
        (across + v2 * v2) / (h2 - z),
        (across + v3 * v3) / (h3 - z),
    )


def height_rates(slopes: Slopes, x: Number, y: Number, z: Number) -> Triple:
    """Return the rates of the heights for rates of the platform: the Jacobian times these."""
    n1x, n1y, n2x, n2y, n3x, n3y, _ = slopes
    return n1x * x + n1y * y + z, n2x * x + n2y * y + z, n3x * x + n3y * y + z


def platform_rates(slopes: Slopes, rate1: Number, rate2: Number, rate3: Number) -> Triple:
    """Return the platform's rates for rates of the heights: the inverse Jacobian times these."""
    n1x, n1y, n2x, n2y, n3x, n3y, inverse = slopes
    step2 = rate2 - rate1
    step3 = rate3 - rate1
    x = (step2 * (n3y - n1y) - step3 * (n2y - n1y)) * inverse
    y = (step3 * (n2x - n1x) - step2 * (n3x - n1x)) * inverse
    return x, y, rate1 - n1x * x - n1y * y


def driven(numbers: Sequence[float], slopes: Slopes, heights: Triple, platform: Triple) -> Triple:
    """Return the forces of the sliders for second derivatives, without friction.

    Args:
        numbers: of ``Constants``, one after the other.
        slopes: of the arms.
        heights: second derivatives.
        platform: second derivatives that belong to them.
    """
    n1x, n1y, n2x, n2y, n3x, n3y, inverse = slopes
    m1, m2, m3, b1, b2, b3, mass, w1, w2, w3, wx, wy, wz = numbers
    a1, a2, a3 = heights
    x, y, z = platform
    fz = mass * z + b1 * a1 + b2 * a2 + b3 * a3 - wz
    fx = mass * x - wx - n1x * fz
    fy = mass * y - wy - n1y * fz
    y2 = (fx * (n3y - n1y) - fy * (n3x - n1x)) * inverse
    y3 = (fy * (n2x - n1x) - fx * (n2y - n1y)) * inverse
    return (
        m1 * a1 + b1 * z - w1 + (fz - y2 - y3),
        m2 * a2 + b2 * z - w2 + y2,
        m3 * a3 + b3 * z - w3 + y3,
    )
