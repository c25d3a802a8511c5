r"""Chooses the shaper of each motion where the modes of vibration differ from place to place.

The modes are known at some places $p_i$ of the platform. Between them, each number of a mode, its
frequency or its damping, is interpolated by

$$y(p) = c + g^T p + \sum_i w_i\,|p - p_i|$$

with $\sum_i w_i = 0$ and $g = L \sum_i w_i\,p_i$. The sum of distances alone is the biharmonic
spline of space: of all functions that are right at the places it bends least (Duchon 1977). The
term $g$ lets a number change evenly across all of the workspace, which is what machines do as a
rule, and costs next to nothing. Both together are one system of equations, which has a solution
for any different places, on a line or in a plane, too (Micchelli 1986). So one place gives a
constant; two give a straight line along the line through them, and a constant across it.

What lies beyond the range of the known numbers is set to its end: nothing is extrapolated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import dist

import numpy as np

from tri_glide_kinematics.checks import finite_vector, member
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.motion.shaping.shapers import (
    MOST_MODES,
    TOLERATED,
    Mode,
    Shaper,
    ShaperKind,
    residual,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Largest number of places of a ``ShaperByPlace``.
MOST_PLACES = 100

# Two places are at least so far from each other [m]: between nearer ones, the difference of their
# frequencies is an error of measurement.
LEAST_DISTANCE = 0.001

# L, in mean distances of the places from their middle: where the places are spread over less than
# a tenth of their distances, as across a line or a plane, numbers hardly change evenly.
LINEAR = 100.0

# Frequencies between the known places may be off by this part.
UNCERTAIN = 0.03

# In mid-motion a shaper is kept that leaves no more than this, as another one costs a stop.
KEPT = 2.0 * TOLERATED

# Numbers that differ by this part are equal: rounding.
ROUNDING = 1e-9

# Frequencies that are looked at, as parts of their range.
PARTS = np.linspace(0.0, 1.0, 65)


@dataclass(frozen=True)
class ShaperByPlace:
    """The modes at some places, and the least robust kind of shaper for them.

    Attributes:
        kind: where the modes differ much, a more robust one is chosen.
        places: of the platform. Shape (n, 3) [m].
        modes: one or two of each place. Shape (n, number of modes).
    """

    kind: ShaperKind
    places: tuple[Vector3, ...]
    modes: tuple[tuple[Mode, ...], ...]

    def __post_init__(self) -> None:
        """Check that all fits together.

        Raises:
            NotAChoiceError: if ``kind`` is no ``ShaperKind``.
            WrongShapeError: if a place has not three numbers.
            NotFiniteError: if one of them is NaN or infinite.
            OutOfBoundsError: if two places are less than a millimetre from each other.
            KinematicsError: if the numbers of places and modes do not fit.
        """
        member("kind", self.kind, ShaperKind)
        if not 1 <= len(self.places) <= MOST_PLACES:
            raise KinematicsError(f"{len(self.places)} places must be 1 to {MOST_PLACES}")
        for index, place in enumerate(self.places):
            finite_vector(f"places[{index}]", place, 3)
        counts = [len(modes) for modes in self.modes]
        if len(counts) != len(self.places):
            raise KinematicsError(f"{len(counts)} sets of modes are not {len(self.places)} places")
        if len(set(counts)) != 1 or not 1 <= counts[0] <= MOST_MODES:
            raise KinematicsError(
                f"each place has 1 to {MOST_MODES} modes, and as many as the others, not {counts}"
            )
        for (first, one), (second, other) in combinations(enumerate(self.places), 2):
            distance = dist(one, other)
            if not distance >= LEAST_DISTANCE:
                name = f"distance of place {first + 1} from place {second + 1}"
                raise OutOfBoundsError(name, distance, f"at least {LEAST_DISTANCE:g}", "m")

    @cached_property
    def _known(self) -> FloatArray:
        """Frequencies [Hz] and dampings at the places. Shape (2, number of modes, n)."""
        numbers = [[(mode.frequency, mode.damping) for mode in modes] for modes in self.modes]
        return np.array(numbers).T

    @cached_property
    def _weights(self) -> FloatArray:
        """Weights of the places, and behind them the constants. Shape (2, modes, n + 1)."""
        count = len(self.places)
        equations = np.ones((count + 1, count + 1))
        equations[:count, :count] = self._actions(np.array(self.places))
        equations[count, count] = 0.0
        sums = np.zeros((*self._known.shape[:2], 1))
        known = np.concatenate((self._known, sums), axis=-1)
        solved = np.linalg.solve(equations, known.reshape(-1, count + 1).T)
        return np.asarray(solved.T.reshape(known.shape))

    def _actions(self, places: FloatArray) -> FloatArray:
        """Return by how much the weight of each known place acts on others. Shape (m, n)."""
        known = np.array(self.places)
        middle = known.mean(axis=0)
        spread = float(np.linalg.norm(known - middle, axis=1).mean()) or 1.0
        here, there = (places - middle) / spread, (known - middle) / spread
        apart = np.linalg.norm(here[:, np.newaxis] - there, axis=-1)
        return np.asarray(apart - LINEAR * (here @ there.T))

    def modes_at(self, places: FloatArray) -> FloatArray:
        """Return frequencies [Hz] and dampings of the modes at some ``places``.

        Args:
            places: of the platform. Shape (m, 3) [m].

        Returns:
            Shape (2, number of modes, m).
        """
        weights, known = self._weights, self._known
        numbers = weights[..., :-1] @ self._actions(places).T + weights[..., -1:]
        lowest, highest = known.min(-1), known.max(-1)
        return np.asarray(np.clip(numbers, lowest[..., np.newaxis], highest[..., np.newaxis]))

    def covering(self, places: FloatArray | None, present: Shaper | None = None) -> Shaper:
        """Return a shaper that leaves at most 5 % of the modes at all ``places`` of a motion.

        Of each mode it is the shortest kind, at least as robust as ``kind``, made for the middle
        of what is passed. Where no kind leaves so little, it is the one that leaves least.

        Args:
            places: that the platform passes, near to each other. Shape (m, 3) [m]; None if it may
                go anywhere.
            present: is kept if it leaves at most 10 %, or no more than the best one.
        """
        passed = self._known if places is None else self.modes_at(places)
        ranges = [_ModeRange(mode.min(-1), mode.max(-1)) for mode in passed.swapaxes(0, 1)]
        shapers = [each.shaper(self.kind) for each in ranges]
        best = shapers[0]
        for shaper in shapers[1:]:
            best = best.followed_by(shaper)
        if present is None:
            return best
        left = max(each.left_by(present) for each in ranges)
        least = max(each.left_by(best) for each in ranges)
        return present if left <= max(KEPT, least * (1.0 + ROUNDING)) else best


class _ModeRange:
    """Frequencies and dampings of a mode that a motion passes."""

    def __init__(self, lowest: FloatArray, highest: FloatArray) -> None:
        """Note the ``lowest`` and the ``highest`` frequency [Hz] and damping, shape (2,) each."""
        self._middle = Mode(*(0.5 * (lowest + highest)).tolist())
        low, high = lowest[0] * (1.0 - UNCERTAIN), highest[0] * (1.0 + UNCERTAIN)
        self._frequencies = low + PARTS * (high - low)
        self._dampings = np.array((lowest[1:], highest[1:]))

    def left_by(self, shaper: Shaper) -> float:
        """Return the most that a ``shaper`` leaves of it."""
        return float(residual(shaper, self._frequencies, self._dampings).max())

    def shaper(self, least_robust: ShaperKind) -> Shaper:
        """Return the shortest shaper that leaves little of it, else the one that leaves least."""
        kinds = list(ShaperKind)
        others = []
        for kind in kinds[kinds.index(least_robust) :]:
            shaper = Shaper.of(kind, self._middle)
            left = self.left_by(shaper)
            if left <= TOLERATED * (1.0 + ROUNDING):
                return shaper
            others.append((left, shaper))
        return min(others, key=lambda pair: pair[0])[1]


# A shaper of all motions, or one that is chosen by the places that a motion passes.
Shaping = Shaper | ShaperByPlace
