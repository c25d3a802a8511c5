"""Numbers that a path is made of, checked; errors name the segment, counted from 1."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite, finite_array, finite_vector, positive
from tri_glide_kinematics.errors import OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.motion.path.errors import RepeatedPointError, TooManySegmentsError
from tri_glide_kinematics.motion.path.segments import SHORTEST
from tri_glide_kinematics.vectors import FloatArray, Vector3

# No coordinate, and no tolerance, is larger [m].
LARGEST_PLACE = 100.0

# Largest size of a machine, as the parameters of the nodes have it [m].
LARGEST_MACHINE = 10.0

# No arc turns farther [rad].
LARGEST_ANGLE = 1e5

# No speed is larger, or smaller [m/s].
LARGEST_SPEED = 1e6
LEAST_SPEED = 1e-5

# No path has more segments: while a million are rounded they take 0.6 GB where they are dense, and
# 2 GB where each corner stands alone.
MOST_SEGMENTS = 1_000_000


def check_count(count: int) -> None:
    """Check that a path of ``count`` segments is not too long.

    Raises:
        TooManySegmentsError: if it is.
    """
    if count > MOST_SEGMENTS:
        raise TooManySegmentsError(count, MOST_SEGMENTS)


def check_coordinates(points: FloatArray, first: int) -> None:
    """Check ``points``, shape (n, 3) [m], of which the index ``first`` is that of the first one.

    Raises:
        NotFiniteError: if a number is NaN or infinite.
        OutOfBoundsError: if a number is too large.
    """
    bad = ~(np.abs(points) <= LARGEST_PLACE)
    if bad.any():
        row, column = np.argwhere(bad)[0].tolist()
        coordinate_of(f"points[{first + row}][{column}]", float(points[row, column]))


def coordinate_of(name: str, value: float) -> float:
    """Return ``value`` if it is finite and not too large [m]."""
    number = finite(name, value)
    if abs(number) > LARGEST_PLACE:
        bound = f"from -{LARGEST_PLACE:g} to {LARGEST_PLACE:g}"
        raise OutOfBoundsError(name, number, bound, "m", LARGEST_MACHINE)
    return number


def place_of(name: str, values: Iterable[float]) -> Vector3:
    """Return ``values`` as three plain numbers that are finite and not too large [m]."""
    x, y, z = finite_vector(name, values, 3)
    if not max(abs(x), abs(y), abs(z)) <= LARGEST_PLACE:
        for index, value in enumerate((x, y, z)):
            coordinate_of(f"{name}[{index}]", value)
    return x, y, z


def points_of(points: ArrayLike) -> FloatArray:
    """Return a copy of the ``points`` of a polyline, shape (n, 3) [m].

    Raises:
        KinematicsError: see ``PlatformPath.through``.
    """
    places = finite_array("points", points, (None, 3))
    if len(places) < 2:
        raise WrongShapeError("points", places.shape, "(n, 3) with n at least 2")
    check_count(len(places) - 1)
    check_coordinates(places, 0)
    steps = np.diff(places, axis=0)
    short = np.flatnonzero(~(np.einsum("ij,ij->i", steps, steps) >= SHORTEST * SHORTEST))
    if len(short):
        index = int(short[0])
        length = float(np.linalg.norm(steps[index]))
        raise RepeatedPointError(index, index, places[index].tolist(), length, SHORTEST)
    return places.copy()


def tolerance_of(number: int, value: float) -> float:
    """Return the tolerance of the segment with the index ``number`` [m]."""
    tolerance = coordinate_of(f"tolerance of segment {number + 1}", value)
    if tolerance < 0.0:
        name = f"tolerance of segment {number + 1}"
        raise OutOfBoundsError(name, tolerance, "at least 0", "m")
    return tolerance


def speed_of(number: int, value: float | None) -> float:
    """Return the speed of the segment with the index ``number``, infinite if it has none [m/s]."""
    if value is None:
        return inf
    name = f"speed of segment {number + 1}"
    speed = positive(name, value, "m/s", LARGEST_SPEED)
    if speed < LEAST_SPEED:
        raise OutOfBoundsError(name, speed, f"at least {LEAST_SPEED:g}", "m/s")
    return speed
