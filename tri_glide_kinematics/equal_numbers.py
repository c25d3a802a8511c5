"""Choices between numbers that are equal but for rounding, made the same on every processor.

The last bits of a result depend on the processor, whose vector units decide how numpy and its
linear algebra calculate. So nothing may hang on which of two equal numbers is larger, nor on which
side of a jump an angle lies that is exactly on it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Angles closer than this are equal [rad].
SAME_ANGLE = 1e-12

# Differences below this part of the largest of some numbers are rounding.
SAME_PART = 1e-9


def first_largest(values: ArrayLike) -> int:
    """Return the flat index of the largest value; of equal ones, that of the first."""
    flat = np.ravel(values)
    slack = SAME_PART * np.abs(flat[np.isfinite(flat)]).max(initial=0.0)
    return int(np.argmax(flat >= flat.max() - slack))


def first_smallest(values: ArrayLike) -> int:
    """Return the flat index of the smallest value; of equal ones, that of the first."""
    return first_largest(np.negative(values))


def wrapped(angle: float) -> float:
    """Return the equal angle in (-pi, pi]; half a turn, seen from either side, is pi [rad]."""
    angle = math.remainder(angle, math.tau)
    return math.pi if angle <= SAME_ANGLE - math.pi else angle


def directions(vectors: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the angles of plane vectors in (-pi, pi], half a turn as in ``wrapped`` [rad]."""
    angles: NDArray[np.float64] = np.angle(vectors)
    angles[angles <= SAME_ANGLE - math.pi] = math.pi
    return angles


def within_turn(angles: ArrayLike) -> NDArray[np.float64]:
    """Return the equal angles from 0 to a full turn, which itself, seen from below, is 0 [rad]."""
    turned = np.mod(angles, math.tau)
    return np.where(turned < math.tau - SAME_ANGLE, turned, 0.0)
