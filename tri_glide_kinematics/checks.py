"""Checks of numbers that come from outside: each returns plain floats or raises a clear error."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError, WrongShapeError


def finite(name: str, value: float) -> float:
    """Return ``value`` as a float.

    Raises:
        NotFiniteError: if it is NaN or infinite.
    """
    number = float(value)
    if not math.isfinite(number):
        raise NotFiniteError(name, number)
    return number


def positive(name: str, value: float, unit: str = "") -> float:
    """Return ``value`` as a float.

    Raises:
        NotFiniteError: if it is NaN or infinite.
        OutOfBoundsError: if it is not greater than zero.
    """
    number = finite(name, value)
    if number <= 0.0:
        raise OutOfBoundsError(name, number, "greater than 0", unit)
    return number


def non_negative(name: str, value: float, unit: str = "") -> float:
    """Return ``value`` as a float.

    Raises:
        NotFiniteError: if it is NaN or infinite.
        OutOfBoundsError: if it is less than zero.
    """
    number = finite(name, value)
    if number < 0.0:
        raise OutOfBoundsError(name, number, "at least 0", unit)
    return number


def finite_vector(name: str, values: Sequence[float], size: int) -> tuple[float, ...]:
    """Return ``values`` as a tuple of ``size`` floats.

    Raises:
        WrongShapeError: if there are more or fewer than ``size``.
        NotFiniteError: if one of them is NaN or infinite; it is named by its index.
    """
    numbers = tuple(values)
    if len(numbers) != size:
        raise WrongShapeError(name, (len(numbers),), f"({size},)")
    numbers = tuple(map(float, numbers))
    if not all(map(math.isfinite, numbers)):
        for index, number in enumerate(numbers):
            finite(f"{name}[{index}]", number)
    return numbers


def array_of_shape(
    name: str, values: ArrayLike, shape: tuple[int | None, ...]
) -> NDArray[np.float64]:
    """Return ``values`` as a float array; ``None`` in ``shape`` stands for any size.

    Raises:
        WrongShapeError: if its shape is another.
    """
    array = np.asarray(values, dtype=np.float64)
    fits = array.ndim == len(shape) and all(
        wanted is None or wanted == actual for wanted, actual in zip(shape, array.shape)
    )
    if not fits:
        expected = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise WrongShapeError(name, array.shape, expected)
    return array
