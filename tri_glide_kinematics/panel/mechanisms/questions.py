"""Questions about a mechanism, asked with numbers that a person may change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from tri_glide_kinematics.mechanisms.pictures import Skeleton
from tri_glide_kinematics.panel.mechanisms.picture import Branch, Position
from tri_glide_kinematics.vectors import FloatArray

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


class Questions(Protocol):
    """Requests about one mechanism, and what is drawn of the answers.

    Attributes:
        dimensions: what a person may change; ``values`` below are theirs, in [m] and [rad].
        crank_angle: to start from [rad].
        key: of the position to start from.
        skeleton: of the mechanism.
        paths: indices of the points whose paths are drawn.
    """

    skeleton: Skeleton
    paths: tuple[int, ...]
    dimensions: tuple[Dimension, ...]
    crank_angle: float
    key: float

    @property
    def solve_service(self) -> Any:
        """Type of the service that gives all positions at a crank angle."""

    @property
    def trace_service(self) -> Any:
        """Type of the service that follows a branch."""

    def pivots(self, values: Sequence[float]) -> FloatArray:
        """Return the joints that do not move. Shape (k, 2) [m]."""

    def solve_request(self, values: Sequence[float], crank_angle: float) -> Any:
        """Ask for all positions at a crank angle [rad]."""

    def positions(self, answer: Any) -> tuple[Position, ...]:
        """Return the positions of an answer."""

    def distance(self, key: float, other: float) -> float:
        """Return how far apart two positions at one crank angle are."""

    def trace_request(
        self, values: Sequence[float], crank_angle: float, key: float, answer: Any
    ) -> Any:
        """Ask for the branch of the position ``key`` that was answered at a crank angle [rad]."""

    def branch(self, request: Any, answer: Any) -> Branch | None:
        """Return the branch of an answer, or none if it is a single position."""
