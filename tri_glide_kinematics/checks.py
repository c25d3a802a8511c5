"""Checks of numbers that come from outside: each returns plain floats or raises a clear error."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from enum import Enum
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.errors import (
    NotAChoiceError,
    NotANumberError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)

# Numbers are no larger than this, whatever their unit, so that products of several do not overflow.
LARGEST = 1e30

# Numbers nearer to zero than this have lost digits. An integer that is read as a float is one, too.
SMALLEST = sys.float_info.min

Member = TypeVar("Member", bound=Enum)


def plain_float(name: str, value: float) -> float:
    """Return a number of any type as a float of Python, which calculates in double precision.

    Raises:
        NotANumberError: if it is none; text is none either.
        NotFiniteError: if it is a whole number too large for a float.
    """
    try:
        if not isinstance(value, (str, bytes)):
            return float(value)
    except OverflowError:
        raise NotFiniteError(name, math.inf if value > 0 else -math.inf) from None
    except (TypeError, ValueError):
        pass
    raise NotANumberError(name, value)


def plain_floats(name: str, values: Iterable[float], size: int) -> tuple[float, ...]:
    """Return ``size`` numbers of any type as floats of Python; they may be NaN or infinite.

    Raises:
        WrongShapeError: if there are more or fewer, or ``values`` is a single number.
        NotANumberError: if one of them is none; it is named by its index.
        NotFiniteError: if one of them is a whole number too large for a float.
    """
    try:
        numbers = tuple(values)
    except TypeError:
        raise WrongShapeError(name, (), f"({size},)") from None
    if len(numbers) != size:
        raise WrongShapeError(name, np.shape(numbers), f"({size},)")
    return tuple(plain_float(f"{name}[{i}]", number) for i, number in enumerate(numbers))


def three_floats(name: str, values: Iterable[float]) -> tuple[float, float, float]:
    """Return three numbers, as ``plain_floats`` does; those that are such cost one look."""
    try:
        a, b, c = values
        if type(a) is type(b) is type(c) is float:
            return a, b, c
        values = (a, b, c)
    except (TypeError, ValueError):
        pass
    a, b, c = plain_floats(name, values, 3)
    return a, b, c


def finite(name: str, value: float, largest: float = LARGEST) -> float:
    """Return ``value`` as a float.

    Raises:
        NotANumberError: if it is no number.
        NotFiniteError: if it is NaN or infinite.
        OutOfBoundsError: if its absolute value is above ``largest``.
    """
    number = plain_float(name, value)
    if not math.isfinite(number):
        raise NotFiniteError(name, number)
    if abs(number) > largest:
        raise OutOfBoundsError(name, number, f"at most {largest:g} in absolute value")
    return number


def normal(name: str, value: float, unit: str = "") -> float:
    """Return ``value``.

    Raises:
        OutOfBoundsError: if it is not zero, but nearer to it than ``SMALLEST``.
    """
    if 0.0 < abs(value) < SMALLEST:
        bound = f"0 (not an integer that is read as a float) or at least {SMALLEST:.3g}"
        raise OutOfBoundsError(name, value, bound, unit)
    return value


def zero_if_tiny(value: float) -> float:
    """Return ``value``, and 0 for what is nearer to it than ``SMALLEST``; NaN stays NaN."""
    return 0.0 if abs(value) < SMALLEST else value


def positive(name: str, value: float, unit: str = "", largest: float = LARGEST) -> float:
    """Return ``value`` as a float.

    Raises:
        NotFiniteError: if it is NaN or infinite.
        OutOfBoundsError: if it is not greater than zero, or above ``largest``.
    """
    number = finite(name, value, largest)
    if number <= 0.0:
        raise OutOfBoundsError(name, number, "greater than 0", unit)
    return number


def non_negative(name: str, value: float, unit: str = "") -> float:
    """Return ``value`` as a float.

    Raises:
        NotFiniteError: if it is NaN or infinite.
        OutOfBoundsError: if it is less than zero, or above ``LARGEST``.
    """
    number = finite(name, value)
    if number < 0.0:
        raise OutOfBoundsError(name, number, "at least 0", unit)
    return number


def finite_vector(name: str, values: Iterable[float], size: int) -> tuple[float, ...]:
    """Return ``values`` as a tuple of ``size`` floats.

    Raises:
        WrongShapeError: if there are more or fewer than ``size``, or a single number.
        NotANumberError: if one of them is no number; it is named by its index.
        NotFiniteError: if one of them is NaN or infinite; it is named by its index.
        OutOfBoundsError: if the absolute value of one of them is above ``LARGEST``.
    """
    numbers = plain_floats(name, values, size)
    if not sum(map(abs, numbers)) <= LARGEST:
        for index, number in enumerate(numbers):
            finite(f"{name}[{index}]", number)
    return numbers


def checked_vector(
    name: str, values: Iterable[float], check: Callable[[str, float, str], float], unit: str
) -> tuple[float, float, float]:
    """Return three ``values`` that pass a ``check``, as that of ``positive``, one by one.

    Raises:
        WrongShapeError: if there are more or fewer than three.
        NotFiniteError: if one of them is NaN or infinite.
        OutOfBoundsError: as the check does; it is named by its index.
    """
    numbers = finite_vector(name, values, 3)
    x, y, z = (check(f"{name}[{i}]", value, unit) for i, value in enumerate(numbers))
    return x, y, z


def array_of_shape(
    name: str, values: ArrayLike, shape: tuple[int | None, ...]
) -> NDArray[np.float64]:
    """Return ``values`` as a float array; ``None`` in ``shape`` stands for any size.

    An empty list, which has no further sizes, is taken for an array without rows.

    Raises:
        WrongShapeError: if its shape is another.
        NotANumberError: if something in it is no number.
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise NotANumberError(name, values) from None
    if array.shape == (0,) and shape[0] is None:
        array = array.reshape((0, *(size or 0 for size in shape[1:])))
    fits = array.ndim == len(shape) and all(
        wanted is None or wanted == actual for wanted, actual in zip(shape, array.shape)
    )
    if not fits:
        expected = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise WrongShapeError(name, array.shape, expected)
    return array


def finite_array(
    name: str, values: ArrayLike, shape: tuple[int | None, ...]
) -> NDArray[np.float64]:
    """Return ``values`` as a float array of finite numbers; ``shape`` as in ``array_of_shape``.

    Raises:
        WrongShapeError: if its shape is another.
        NotANumberError: if something in it is no number.
        NotFiniteError: if one of the numbers is NaN or infinite; it is named by its index.
        OutOfBoundsError: if the absolute value of one of them is above ``LARGEST``.
    """
    array = array_of_shape(name, values, shape)
    # Not by a scalar product: the linear algebra library may share that out to threads, which keep
    # their cores busy for a while after.
    fits = np.abs(array) <= LARGEST
    if not fits.all():
        index = np.argwhere(~fits)[0].tolist()
        finite(name + "".join(f"[{i}]" for i in index), float(array[tuple(index)]))
    return array


def member(name: str, value: Member, choices: type[Member]) -> Member:
    """Return ``value``, which must be a member of the enumeration ``choices``.

    Raises:
        NotAChoiceError: if it is not, as its name or its value; the text names all members.
    """
    if not isinstance(value, choices):
        raise NotAChoiceError(name, value, tuple(map(str, choices)))
    return value
