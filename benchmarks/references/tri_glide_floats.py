"""The closed form of the tri-glide as the shortest functions of plain floats, without checks."""

from collections.abc import Callable
from math import sqrt

from tri_glide_kinematics.tri_glide import TriGlideGeometry

Vector3 = tuple[float, float, float]
Pair = Callable[[Vector3, Vector3], tuple[Vector3, Vector3]]


def inverse_velocity_of(geometry: TriGlideGeometry) -> Pair:
    """Return the function from position and velocity to heights and their rates."""
    (x1, y1), (x2, y2), (x3, y3) = geometry.anchors
    b1, b2, b3 = (length * length for length in geometry.arm_lengths)

    def inverse_velocity(position: Vector3, velocity: Vector3) -> tuple[Vector3, Vector3]:
        x, y, z = position
        dx, dy, dz = velocity
        f1x, f1y, f2x, f2y, f3x, f3y = x1 - x, y1 - y, x2 - x, y2 - y, x3 - x, y3 - y
        s1 = sqrt(b1 - f1x * f1x - f1y * f1y)
        s2 = sqrt(b2 - f2x * f2x - f2y * f2y)
        s3 = sqrt(b3 - f3x * f3x - f3y * f3y)
        return (z + s1, z + s2, z + s3), (
            dz + (f1x * dx + f1y * dy) / s1,
            dz + (f2x * dx + f2y * dy) / s2,
            dz + (f3x * dx + f3y * dy) / s3,
        )

    return inverse_velocity


def forward_velocity_of(geometry: TriGlideGeometry) -> Pair:
    """Return the function from heights and their rates to position and velocity."""
    (x1, y1), (x2, y2), (x3, y3) = geometry.anchors
    b1, b2, b3 = (length * length for length in geometry.arm_lengths)
    area = (x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)
    ux, uy, vx, vy = (y3 - y1) / area, (x1 - x3) / area, (y1 - y2) / area, (x2 - x1) / area
    k2 = ((x2 - x1) ** 2 + (y2 - y1) ** 2 + b1 - b2) / 2.0
    k3 = ((x3 - x1) ** 2 + (y3 - y1) ** 2 + b1 - b3) / 2.0

    def forward_velocity(heights: Vector3, rates: Vector3) -> tuple[Vector3, Vector3]:
        h1, h2, h3 = heights
        r1, r2, r3 = rates
        d2, d3 = h2 - h1, h3 - h1
        e2, e3 = k2 + 0.5 * d2 * d2, k3 + 0.5 * d3 * d3
        px, py, mx, my = ux * e2 + vx * e3, uy * e2 + vy * e3, ux * d2 + vx * d3, uy * d2 + vy * d3
        n, dot = 1.0 + mx * mx + my * my, px * mx + py * my
        root = sqrt(dot * dot - n * (px * px + py * py - b1))
        w = (dot - root) / n
        wx, wy = px - mx * w, py - my * w
        g2, g3 = (d2 - w) * (r2 - r1), (d3 - w) * (r3 - r1)
        gx, gy = ux * g2 + vx * g3, uy * g2 + vy * g3
        dw = (wx * gx + wy * gy) / root
        return (x1 + wx, y1 + wy, h1 + w), (gx - mx * dw, gy - my * dw, r1 + dw)

    return forward_velocity
