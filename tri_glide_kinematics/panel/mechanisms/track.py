"""The way along a followed branch: which crank angles it passes, in which order."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.rounding import first_smallest
from tri_glide_kinematics.vectors import FloatArray


@dataclass(frozen=True, eq=False)
class Track:
    """Rows along a branch. A place on it is a number of rows from its start, parts included.

    Attributes:
        crank_angles: Shape (n,), n at least 2 [rad].
        keys: what tells positions at one crank angle from each other. Shape (n,).
        closed: whether the last row is the first one again.
    """

    crank_angles: FloatArray
    keys: FloatArray
    closed: bool

    @property
    def end(self) -> float:
        """The last place."""
        return float(self.crank_angles.size - 1)

    def crank_angle(self, place: float) -> float:
        """Return the crank angle at a place [rad]."""
        return self._between(self.crank_angles, place)

    def key(self, place: float) -> float:
        """Return the key at a place."""
        return self._between(self.keys, place)

    def place_of(self, crank_angle: float, near: float) -> float | None:
        """Return the place at a crank angle [rad] that is the fewest rows away from ``near``.

        The branch passes some crank angles several times, and full turns do not matter. Where it
        never comes to this angle, there is none.
        """
        offsets = np.remainder(self.crank_angles - crank_angle + math.pi, math.tau) - math.pi
        before, after = offsets[:-1], offsets[1:]
        # Opposite signs half a turn away from the angle are no passage.
        passes = (before * after <= 0.0) & (np.abs(before) + np.abs(after) < math.pi)
        rows = np.flatnonzero(passes)
        if not rows.size:
            return None
        ways = np.abs(before[rows]) + np.abs(after[rows])
        parts = np.divide(np.abs(before[rows]), ways, out=np.zeros(rows.size), where=ways > 0.0)
        places = rows + parts
        distances = np.abs(places - near)
        if self.closed:
            distances = np.minimum(distances, self.end - distances)
        return float(places[first_smallest(distances)])

    def advanced(self, place: float, way: float, forward: bool) -> tuple[float, bool]:
        """Go on along the track: round and round, or back where it ends.

        Args:
            place: to go on from.
            way: of the crank, at least 0 [rad].
            forward: whether along the rows.

        Returns:
            The new place, and whether it goes on forward.
        """
        step = float(np.abs(np.diff(self.crank_angles)).max())
        rows = way / step if step > 0.0 else 0.0
        if self.closed:
            return (place + (rows if forward else -rows)) % self.end, forward
        # As if the way back lay behind the end.
        unfolded = ((place if forward else 2.0 * self.end - place) + rows) % (2.0 * self.end)
        return min(unfolded, 2.0 * self.end - unfolded), unfolded < self.end

    def _between(self, column: FloatArray, place: float) -> float:
        return float(np.interp(place, np.arange(column.size), column))
