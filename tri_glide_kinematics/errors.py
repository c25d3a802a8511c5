"""The base of all errors of this package, and those of the checks of numbers.

Each carries the data that explains it. The others stand in the rooms that raise them.
"""

from __future__ import annotations

import math

from tri_glide_kinematics.wording import number_text, unit_question


class KinematicsError(ValueError):
    """Base of all errors of this package.

    The text of a subclass names the offending number and the bound that it breaks, so that it can
    be read in a log without the code beside it.
    """


class NotFiniteError(KinematicsError):
    """A number is NaN or infinite where only finite ones have a meaning."""

    def __init__(self, name: str, value: float) -> None:
        """Store the ``name`` of the quantity and its ``value``."""
        super().__init__(f"{name} = {value} is not a finite number")
        self.name = name
        self.value = value


class NotANumberError(KinematicsError):
    """Something else stands where a number is needed."""

    def __init__(self, name: str, value: object) -> None:
        """Store the ``name`` of the quantity and the ``value`` that is no number."""
        super().__init__(f"{name} = {value!r} is not a number")
        self.name = name
        self.value = value


class OutOfBoundsError(KinematicsError):
    """A number lies outside the interval in which it is allowed."""

    def __init__(
        self, name: str, value: float, bound: str, unit: str = "", largest: float = math.inf
    ) -> None:
        """Store what was checked.

        Args:
            name: what the number is, for example ``arm_lengths[1]``.
            value: the offending number.
            bound: the bound in words, for example ``greater than 0``.
            unit: unit of both, for example ``m``.
            largest: if it is a length, how large one may be expected to be [m].
        """
        suffix = f" {unit}" if unit else ""
        # However small: that may be what is wrong with it.
        text = number_text(value, scale=0.0)
        question = unit_question(value, largest)
        super().__init__(f"{name} = {text}{suffix} must be {bound}{suffix}{question}")
        self.name = name
        self.value = value
        self.bound = bound
        self.unit = unit


class WrongShapeError(KinematicsError):
    """An array has not the shape that its meaning asks for."""

    def __init__(self, name: str, shape: tuple[int, ...], expected: str) -> None:
        """Store the ``name`` of the array, its ``shape`` and the ``expected`` one in words."""
        super().__init__(f"{name} has shape {shape}, expected {expected}")
        self.name = name
        self.shape = shape
        self.expected = expected
