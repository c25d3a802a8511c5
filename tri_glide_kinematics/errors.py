"""The base of all errors of this package, and those of the checks of numbers.

Each carries the data that explains it. The others stand in the rooms that raise them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import IntEnum
from typing import Any

from tri_glide_kinematics.wording import refused_text, unit_question


class Refusal(IntEnum):
    """Why a command is refused, as programs read it: ``MachineState`` says what each one means."""

    NONE = 0
    OTHER = 1
    NOT_FINITE = 2
    OUT_OF_BOUNDS = 3
    WRONG_FRAME = 4
    ROTATION = 5
    STAMP = 6
    MESSAGE = 7
    UNSUPPORTED = 8
    UNREACHABLE = 9
    OUTSIDE_WORKSPACE = 10
    NO_ROOM = 11
    PATH = 12
    NO_PLAN = 13
    WAITING = 14
    FAULT = 15
    DISABLED = 16
    STOPPING = 17
    NOT_RELEASED = 18
    NO_PATH = 19
    NEWER_COMMAND = 20
    NO_MEASUREMENT = 21
    OTHER_PUBLISHER = 22
    OUTSIDE_TRAVEL = 23


class KinematicsError(ValueError):
    """Base of all errors of this package.

    The text of a subclass names the offending number and the bound that it breaks, so that it can
    be read in a log without the code beside it.

    Attributes:
        refusal: why a command is refused, if it is refused for this error.
    """

    refusal = Refusal.OTHER

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]:
        """Return what a copy is made of: text and attributes, as a subclass is not given these."""
        return _copied, (type(self), self.args), self.__dict__


def _copied(kind: type[KinematicsError], texts: tuple[Any, ...]) -> KinematicsError:
    """Return an error of a ``kind`` as ``Exception`` makes it; its attributes are copied after."""
    return kind.__new__(kind, *texts)


class NotFiniteError(KinematicsError):
    """A number is NaN or infinite where only finite ones have a meaning."""

    refusal = Refusal.NOT_FINITE

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

    refusal = Refusal.OUT_OF_BOUNDS

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
        text = refused_text(value)
        question = unit_question(value, largest)
        super().__init__(f"{name} = {text}{suffix} must be {bound}{suffix}{question}")
        self.name = name
        self.value = value
        self.bound = bound
        self.unit = unit


class WrongShapeError(KinematicsError):
    """An array has not the shape that its meaning asks for."""

    refusal = Refusal.OUT_OF_BOUNDS

    def __init__(self, name: str, shape: tuple[int, ...], expected: str) -> None:
        """Store the ``name`` of the array, its ``shape`` and the ``expected`` one in words."""
        super().__init__(f"{name} has shape {shape}, expected {expected}")
        self.name = name
        self.shape = shape
        self.expected = expected


class NotAChoiceError(KinematicsError):
    """Something else than a member of an enumeration where one is asked for, such as its name."""

    def __init__(self, name: str, value: object, choices: tuple[str, ...]) -> None:
        """Store the ``name`` of the argument, its ``value`` and the ``choices`` there are."""
        super().__init__(f"{name} = {value!r} must be {' or '.join(choices)}")
        self.name = name
        self.value = value
        self.choices = choices
