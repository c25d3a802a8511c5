"""The way driven: the integral of the speed over a parameter, piece by piece, and its inverse."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.interruptible import Interruptible, accumulated, column_of, indices_of
from tri_glide_kinematics.vectors import FloatArray

Indices = NDArray[np.intp]

# Nodes of the rule for pieces on which the derivative of the curve changes by less than this.
NODES = ((0.05, 3), (0.3, 6), (1.0, 12), (np.inf, 32))

# So many pieces are worked on between two breaks of the computation.
AT_A_TIME = 500

# Newton's method takes so many steps from the place on a straight line; each doubles the digits.
STEPS = 5


class ArcLength:
    """Arc length of a curve that is smooth between breaks.

    Attributes:
        breaks: of the parameter. Shape (k + 1,).
        totals: arc lengths there. Shape (k + 1,) [m].
    """

    def __init__(
        self,
        breaks: FloatArray,
        totals: FloatArray,
        kinds: NDArray[np.int8],
        rates: Callable[[Indices, FloatArray], FloatArray],
    ) -> None:
        """Use ``measured``."""
        self.breaks = breaks
        self._kinds = kinds
        self._rates = rates
        self.totals = totals

    @classmethod
    def measured(
        cls,
        breaks: FloatArray,
        changes: FloatArray,
        rates: Callable[[Indices, FloatArray], FloatArray],
    ) -> Interruptible[ArcLength]:
        """Integrate, interruptibly.

        Args:
            breaks: of the parameter. Shape (k + 1,).
            changes: how much the derivative of the curve changes on each piece, at most; 0 where
                the parameter is the arc length. Shape (k,) [m].
            rates: returns the arc length per parameter, on pieces, at parameters. Shape (n,).
        """
        limits = [change for change, _ in NODES[:-1]]
        kinds = yield from column_of(
            len(changes), lambda some: np.searchsorted(limits, changes[some]).astype(np.int8)
        )
        # The length of the piece before each break, and of the whole before the first.
        lengths = yield from column_of(
            len(breaks), lambda some: np.diff(breaks[some], prepend=breaks[some][:1]), margin=1
        )
        made = cls(breaks, lengths, kinds, rates)
        bent = yield from indices_of(changes)
        for first in range(0, len(bent), AT_A_TIME):
            yield
            some = bent[first : first + AT_A_TIME]
            lengths[some + 1] = made._integrals(some, breaks[some + 1])
        made.totals = yield from accumulated(np.add, lengths)
        return made

    @property
    def total(self) -> float:
        """Arc length of the whole [m]."""
        return float(self.totals[-1])

    def at(self, pieces: Indices, parameters: FloatArray) -> FloatArray:
        """Return the arc lengths at ``parameters`` on ``pieces``. Shape (n,) [m]."""
        return np.asarray(self.totals[pieces] + self._integrals(pieces, parameters))

    def inverse(self, lengths: FloatArray) -> FloatArray:
        """Return the parameters at arc lengths, shape (n,) [m]. Shape (n,)."""
        count = len(self.breaks) - 1
        pieces = np.clip(np.searchsorted(self.totals, lengths, "right") - 1, 0, count - 1)
        low, high = self.breaks[pieces], self.breaks[pieces + 1]
        start, end = self.totals[pieces], self.totals[pieces + 1]
        wanted = np.clip(lengths, 0.0, self.total) - start
        found = low + (high - low) * wanted / (end - start)
        for _ in range(STEPS):
            excess = self._integrals(pieces, found) - wanted
            found = np.clip(found - excess / self._rates(pieces, found), low, high)
        return np.asarray(found)

    def _integrals(self, pieces: Indices, parameters: FloatArray) -> FloatArray:
        """Return the arc lengths from the breaks where ``pieces`` begin to ``parameters``."""
        total = np.empty(len(pieces))
        kinds = self._kinds[pieces]
        for kind, (_, nodes) in enumerate(NODES):
            some = np.flatnonzero(kinds == kind)
            if len(some):
                starts = self.breaks[pieces[some]]
                total[some] = self._by_nodes(pieces[some], starts, parameters[some] - starts, nodes)
        return total

    def _by_nodes(
        self, pieces: Indices, starts: FloatArray, steps: FloatArray, nodes: int
    ) -> FloatArray:
        """Integrate by Gauss and Legendre's rule."""
        places, weights = _rule(nodes)
        total = np.zeros(len(steps))
        for place, weight in zip(places, weights):
            total += weight * self._rates(pieces, starts + place * steps)
        return np.asarray(total * steps)


@cache
def _rule(nodes: int) -> tuple[list[float], list[float]]:
    """Return places and weights of Gauss and Legendre's rule, from 0 to 1."""
    places, weights = np.polynomial.legendre.leggauss(nodes)
    return (0.5 * (places + 1.0)).tolist(), (0.5 * weights).tolist()
