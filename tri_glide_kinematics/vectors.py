"""Points, vectors and arrays of them: their types, sums and products."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]
Vector3 = tuple[float, float, float]
FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Indices = NDArray[np.intp]


def three(values: Iterable[float]) -> Vector3:
    """Return three numbers, of an array for instance, as a vector."""
    x, y, z = map(float, values)
    return x, y, z


def plus(a: Vector3, b: Vector3) -> Vector3:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


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


def ascending(numbers: FloatArray) -> FloatArray:
    """Return ``numbers``, of any shape, in ascending order and each once. Shape (n,).

    The function of numpy for this loads a module when it is first called, for 30 ms.
    """
    ordered = np.sort(numbers, axis=None)
    is_new = np.ones(len(ordered), dtype=bool)
    np.greater(ordered[1:], ordered[:-1], out=is_new[1:])
    return np.asarray(ordered[is_new])


def are_among(numbers: FloatArray, others: FloatArray) -> BoolArray:
    """Return which of some ``numbers`` are also among ``others``, as np.isin does.

    It loads no module either.

    Args:
        numbers: Shape (n,).
        others: ascending. Shape (m,).

    Returns:
        Shape (n,).
    """
    if not len(others):
        return np.zeros(len(numbers), dtype=bool)
    following = np.searchsorted(others, numbers)
    nearest = others[np.minimum(following, len(others) - 1)]
    return np.asarray(nearest == numbers)
