"""Vectors of three plain floats, for what is worked out one by one."""

from __future__ import annotations

from tri_glide_kinematics.vectors import Vector3


def minus(a: Vector3, b: Vector3) -> Vector3:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled(a: Vector3, factor: float) -> Vector3:
    """Return a times a number."""
    return (factor * a[0], factor * a[1], factor * a[2])


def dot(a: Vector3, b: Vector3) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Return the vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def combined(p: float, a: Vector3, q: float, b: Vector3) -> Vector3:
    """Return p a + q b."""
    return (p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2])
