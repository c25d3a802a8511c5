"""The way driven: the integral of the speed over a parameter, span by span, and its inverse."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.vectors import FloatArray, Indices

# Nodes of the rule for spans on which the derivative of the curve changes by less than this.
RULES = ((0.05, 3), (0.3, 6), (1.0, 12), (np.inf, 32))
LARGEST_CHANGES = [change for change, _ in RULES[:-1]]

# Newton's method takes so many steps from the place on a straight line; each doubles the digits.
NEWTON_STEPS = 5


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
        """Take what was found for each span.

        Args:
            breaks: of the parameter. Shape (k + 1,).
            totals: sums of the lengths before each break. Shape (k + 1,) [m].
            kinds: which rule is for each span (``rules_for``). Shape (k,).
            rates: returns the arc length per parameter, on spans, at parameters. Shape (n,).
        """
        self.breaks = breaks
        self._kinds = kinds
        self._rates = rates
        self.totals = totals

    @property
    def total(self) -> float:
        """Arc length of the whole [m]."""
        return float(self.totals[-1])

    def at(self, spans: Indices, parameters: FloatArray) -> FloatArray:
        """Return the arc lengths at ``parameters`` on ``spans``. Shape (n,) [m]."""
        return np.asarray(self.totals[spans] + self._integrals(spans, parameters))

    def inverse(self, lengths: FloatArray) -> FloatArray:
        """Return the parameters at arc lengths, shape (n,) [m]. Shape (n,)."""
        count = len(self.breaks) - 1
        spans = np.clip(np.searchsorted(self.totals, lengths, "right") - 1, 0, count - 1)
        low, high = self.breaks[spans], self.breaks[spans + 1]
        start, end = self.totals[spans], self.totals[spans + 1]
        wanted = np.clip(lengths, 0.0, self.total) - start
        found = low + (high - low) * wanted / (end - start)
        for _ in range(NEWTON_STEPS):
            excess = self._integrals(spans, found) - wanted
            found = np.clip(found - excess / self._rates(spans, found), low, high)
        return np.asarray(found)

    def _integrals(self, spans: Indices, parameters: FloatArray) -> FloatArray:
        """Return the arc lengths from the breaks where ``spans`` begin to ``parameters``."""
        starts = self.breaks[spans]
        return integrals(self._rates, spans, self._kinds[spans], starts, parameters - starts)


def rules_for(changes: FloatArray) -> NDArray[np.int8]:
    """Return which rule is for each span.

    Args:
        changes: how much the derivative of the curve changes on each, at most. Shape (n,) [m].
    """
    return np.searchsorted(LARGEST_CHANGES, changes).astype(np.int8)


def integrals(
    rates: Callable[[Indices, FloatArray], FloatArray],
    spans: Indices,
    kinds: NDArray[np.int8],
    starts: FloatArray,
    steps: FloatArray,
) -> FloatArray:
    """Return the arc lengths on spans, from some of their places to others.

    Args:
        rates: returns the arc length per parameter, on spans, at parameters. Shape (n,).
        spans: indices of them. Shape (n,).
        kinds: which rule is for each. Shape (n,).
        starts: parameters from which on. Shape (n,).
        steps: of the parameter to the end. Shape (n,).
    """
    total = np.empty(len(spans))
    for kind, (_, nodes) in enumerate(RULES):
        some = np.flatnonzero(kinds == kind)
        if len(some):
            total[some] = _by_nodes(rates, spans[some], starts[some], steps[some], nodes)
    return total


def _by_nodes(
    rates: Callable[[Indices, FloatArray], FloatArray],
    spans: Indices,
    starts: FloatArray,
    steps: FloatArray,
    nodes: int,
) -> FloatArray:
    """Integrate by Gauss and Legendre's rule."""
    places, weights = _rule(nodes)
    total = np.zeros(len(steps))
    for place, weight in zip(places, weights):
        total += weight * rates(spans, starts + place * steps)
    return np.asarray(total * steps)


@cache
def _rule(nodes: int) -> tuple[list[float], list[float]]:
    """Return places and weights of Gauss and Legendre's rule, from 0 to 1."""
    places, weights = np.polynomial.legendre.leggauss(nodes)
    return (0.5 * (places + 1.0)).tolist(), (0.5 * weights).tolist()
