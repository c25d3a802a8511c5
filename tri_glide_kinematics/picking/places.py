"""Where parts are put: at one place for all, or at those of a grid, which are filled in order."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import NamedTuple

from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.vectors import Vector3, combined, plus


class Place(NamedTuple):
    """A place for a part.

    Attributes:
        number: of the place, in the order in which they are filled; 0 of the one for all parts.
        position: in the frame of the machine [m].
    """

    number: int
    position: Vector3


def grid(
    first: Vector3, counts: tuple[int, int], pitches: tuple[Vector3, Vector3]
) -> list[Vector3]:
    """Return the positions of a grid [m], one row after the other.

    Args:
        first: place of the first row and column [m].
        counts: of rows, and of columns in each.
        pitches: from a row to the next, and from a column to the next [m].

    Raises:
        OutOfBoundsError: if there is no row or no column.
    """
    for name, count in zip(("rows", "columns"), counts):
        if count < 1:
            raise OutOfBoundsError(name, count, "at least 1")
    rows, columns = map(range, counts)
    return [
        plus(first, combined(row, pitches[0], column, pitches[1]))
        for row in rows
        for column in columns
    ]


class Places:
    """Hands out places, the first free one at a time; a single fixed place is never full."""

    def __init__(self, positions: Sequence[Vector3], *, is_fixed: bool = False) -> None:
        """Start with all ``positions`` empty; only the first counts of a fixed place."""
        self._positions = tuple(positions)
        self._is_fixed = is_fixed
        self.empty()

    def empty(self) -> None:
        """Begin anew: another tray has come."""
        self._free = list(range(len(self._positions)))

    @property
    def is_full(self) -> bool:
        """Whether no place is left."""
        return not self._free

    def take(self) -> Place:
        """Return the first free place, of which there has to be one; it is taken from now on."""
        index = self._free[0] if self._is_fixed else heapq.heappop(self._free)
        return Place(index, self._positions[index])

    def give_back(self, place: Place) -> None:
        """Let a place be used again that got no part."""
        if place.number not in self._free:
            heapq.heappush(self._free, place.number)
