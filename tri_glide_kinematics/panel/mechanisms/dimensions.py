"""The numbers of a mechanism that a person may change, each with its range."""

from __future__ import annotations

import math
from dataclasses import dataclass

SHORTEST, LONGEST = 0.2, 2.5  # part of a length in the file


@dataclass(frozen=True)
class Dimension:
    """One number.

    Attributes:
        label: of its slider, without the unit.
        value: in the file [m] or [rad].
        lowest: [m] or [rad].
        highest: [m] or [rad].
        is_angle: whether it is an angle.
    """

    label: str
    value: float
    lowest: float
    highest: float
    is_angle: bool = False

    @property
    def unit(self) -> str:
        """In which a person sees it."""
        return "deg" if self.is_angle else "mm"

    def shown(self, value: float) -> float:
        """Return what a person sees [deg] or [mm]."""
        return math.degrees(value) if self.is_angle else 1000.0 * value

    def read(self, shown: float) -> float:
        """Return what a person has chosen [rad] or [m]."""
        return math.radians(shown) if self.is_angle else shown / 1000.0


def length(label: str, value: float) -> Dimension:
    """Return a length that may shrink and grow [m]."""
    return Dimension(label, value, SHORTEST * value, LONGEST * value)


def coordinate(label: str, value: float, size: float) -> Dimension:
    """Return a coordinate in [m] that may change by ``size`` either way."""
    return Dimension(label, value, value - size, value + size)


def phase(label: str, value: float) -> Dimension:
    """Return a phase shift that may change by half a turn either way [rad]."""
    return Dimension(label, value, value - math.pi, value + math.pi, is_angle=True)
