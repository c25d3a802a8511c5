"""Code that all mechanism services share: points, columns, angles and refusals."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tri_glide_interfaces.msg import CrankSweep, Point2
from tri_glide_kinematics.checks import finite
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError

LARGEST = 1e9
"""Largest absolute value of a number in a request, in its unit."""
SMALLEST = 1e-9
"""Smallest size of a mechanism [m]."""


class RefusedRequestError(KinematicsError):
    """A request contradicts itself, or asks for something that cannot be answered."""


def check_numbers(message: Any, name: str = "") -> None:
    """Check all numbers of a message except those in arrays of any length.

    A length beyond that of any machine would overflow in the middle of a formula.

    Raises:
        NotFiniteError: if a number is NaN or infinite; it is named by its place in the message.
        OutOfBoundsError: if its absolute value is above ``LARGEST``.
    """
    for field in message.get_fields_and_field_types():
        _check_value(getattr(message, field), f"{name}.{field}" if name else field)


def _check_value(value: Any, name: str) -> None:
    if isinstance(value, float):
        finite(name, value, LARGEST)
    elif isinstance(value, (list, np.ndarray)):
        for index, item in enumerate(value):
            _check_value(item, f"{name}[{index}]")
    elif hasattr(value, "get_fields_and_field_types"):
        check_numbers(value, name)


def check_size(name: str, size: float) -> None:
    """Check that a mechanism is not so small that squares of its lengths vanish.

    Raises:
        OutOfBoundsError: if its largest length is below ``SMALLEST``.
    """
    if size < SMALLEST:
        raise OutOfBoundsError(name, size, f"at least {SMALLEST:g}", "m")


def point(message: Point2) -> tuple[float, float]:
    """Return x and y."""
    return message.x, message.y


def point_message(place: Iterable[float]) -> Point2:
    """Return a point of x and y."""
    x, y = place
    return Point2(x=float(x), y=float(y))


def column(values: NDArray[np.float64]) -> array[float]:
    """Return numbers in the one form that messages take without looking at each of them."""
    return array("d", values.tobytes())


def one_of(name: str, value: int, choices: Iterable[int]) -> int:
    """Return ``value``.

    Raises:
        RefusedRequestError: if it is not one of the ``choices``.
    """
    allowed = tuple(choices)
    if value not in allowed:
        names = " or ".join(map(str, allowed))
        raise RefusedRequestError(f"{name} = {value} must be {names}")
    return value


def crank_angles(sweep: CrankSweep, max_steps: int, max_turns: int) -> NDArray[np.float64]:
    """Return the crank angles of the rows of a trace, rising or falling. Shape (n,) [rad].

    Raises:
        NotFiniteError: if an angle of the array is NaN or infinite.
        OutOfBoundsError: if there are no or too many steps, or too many turns, or the angles that
            were given one by one do not all rise or all fall.
    """
    given = np.asarray(sweep.crank_angles, dtype=np.float64)
    steps = given.size - 1 if given.size else sweep.steps
    if not 1 <= steps <= max_steps:
        name = "len(crank_angles) - 1" if given.size else "steps"
        raise OutOfBoundsError(name, steps, f"from 1 to {max_steps}")
    if given.size:
        for index in np.flatnonzero(~(np.abs(given) <= LARGEST)):
            _check_value(float(given[index]), f"crank_angles[{index}]")
        differences = np.diff(given)
        for index in np.flatnonzero(differences * (given[-1] - given[0]) <= 0.0):
            value = float(given[index + 1])
            bound = "beyond the one before, all rising or all falling,"
            raise OutOfBoundsError(f"crank_angles[{index + 1}]", value, bound, "rad")
        first, last = float(given[0]), float(given[-1])
    else:
        first, last = sweep.start_angle, sweep.end_angle
    turns = abs(last - first) / math.tau
    if turns > max_turns:
        raise OutOfBoundsError("range of the crank angle", turns, f"at most {max_turns}", "turns")
    return given if given.size else np.linspace(first, last, steps + 1)
