r"""Input shapers: impulses $A_i$ at times $t_i$ that excite a vibration and cancel it again.

A motion $x(t)$ becomes $\sum_i A_i\, x(t - t_i)$ with $A_i > 0$ and $\sum A_i = 1$. Of a mode with
the natural frequency $\omega$ and the damping ratio $\zeta$ it then excites

$$V = e^{-\zeta\omega t_n} \Big|\sum_i A_i\, e^{\zeta\omega t_i} e^{j\omega_d t_i}\Big|,\qquad
\omega_d = \omega\sqrt{1 - \zeta^2},$$

as part of what one impulse at the last time $t_n$ would (Singer and Seering 1990, eq. 8). Without
damping, all kinds here are known in closed form. With damping, the impulse at $t$ has to be smaller
by $e^{-\zeta\omega t}$, as the swing of an earlier impulse has faded by that. So with
$A_i \propto a_i e^{-\zeta\omega t_i}$, and times in periods of $\omega_d$, the sum is the same as
without damping.

============= ===================================== ===========================================
kind          impulses a_i without damping          source
============= ===================================== ===========================================
ZV            1, 1 at 0, 1/2                        Smith 1957; Singer and Seering 1990
ZVD           1, 2, 1 at 0, 1/2, 1                  Singer and Seering 1990
MZV           1, sqrt(2), 1 at 0, 3/8, 3/4          derived: 1 + a e^(3j pi/4) + e^(3j pi/2) = 0
EI            (1 + V)/4, (1 - V)/2, (1 + V)/4       Singhose, Seering, Singer 1994
two-hump EI   ``_two_humps`` at 0, 1/2, 1, 3/2      Singhose, Porter, Tuttle, Singer 1997
three-hump EI ``_three_humps`` at 0, 1/2, 1, 3/2, 2 Singhose, Porter, Tuttle, Singer 1997
============= ===================================== ===========================================

The kinds with humps leave up to V = 5 % of the vibration, and no more over a wider range.

Where the modes of vibration differ from place to place, the shaper of each motion is chosen.
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

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite, finite_vector, member, positive
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Frequencies of modes [Hz]: above, no drive follows; below, a shaper would last seconds.
LOWEST_FREQUENCY, HIGHEST_FREQUENCY = 1.0, 500.0

# A mode with more damping does not swing.
MOST_DAMPING = 0.5

# Largest number of modes that a shaper is for.
MOST_MODES = 2

# Part of the unshaped vibration that the kinds with humps leave.
TOLERATED = 0.05


class ShaperKind(Enum):
    """How robust a shaper is, from the shortest to the longest."""

    ZV = "zv"
    MZV = "mzv"
    ZVD = "zvd"
    EI = "ei"
    TWO_HUMP_EI = "two_hump_ei"
    THREE_HUMP_EI = "three_hump_ei"


@dataclass(frozen=True)
class Mode:
    """How a machine swings.

    Attributes:
        frequency: without damping, from 1 to 500 Hz.
        damping: as part of the critical damping, from 0 to 0.5.
    """

    frequency: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if one is NaN or infinite.
            OutOfBoundsError: if one is outside its bounds.
        """
        frequency = positive("frequency", self.frequency, "Hz")
        if not LOWEST_FREQUENCY <= frequency <= HIGHEST_FREQUENCY:
            bound = f"from {LOWEST_FREQUENCY:g} to {HIGHEST_FREQUENCY:g}"
            raise OutOfBoundsError("frequency", frequency, bound, "Hz")
        damping = finite("damping", self.damping)
        if not 0.0 <= damping <= MOST_DAMPING:
            raise OutOfBoundsError("damping", damping, f"from 0 to {MOST_DAMPING:g}")
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "damping", damping)

    @property
    def period(self) -> float:
        """Time of one swing, with damping [s]."""
        return 1.0 / (self.frequency * math.sqrt(1.0 - self.damping * self.damping))

    @property
    def decay(self) -> float:
        """Rate at which the swing fades [1/s]."""
        return math.tau * self.frequency * self.damping


@dataclass(frozen=True)
class Shaper:
    """Impulses, the first at time 0. Use ``of``.

    Attributes:
        times: ascending [s].
        amplitudes: positive; their sum is 1.
    """

    times: tuple[float, ...]
    amplitudes: tuple[float, ...]

    @classmethod
    def of(cls, kind: ShaperKind, *modes: Mode) -> Shaper:
        """Return the shaper of a ``kind`` for one mode or two.

        Raises:
            NotAChoiceError: if ``kind`` is no ``ShaperKind``.
            KinematicsError: if there is no mode, or more than two.
        """
        member("kind", kind, ShaperKind)
        if not 1 <= len(modes) <= MOST_MODES:
            raise KinematicsError(f"a shaper is for 1 to {MOST_MODES} modes, not {len(modes)}")
        shaper = _ONE_IMPULSE
        for mode in modes:
            shaper = shaper.followed_by(_for_mode(kind, mode))
        return shaper

    def followed_by(self, other: Shaper) -> Shaper:
        """Return the shaper that does the same as this one and then the ``other``."""
        pairs = sorted(
            (time + later, amplitude * factor)
            for time, amplitude in zip(self.times, self.amplitudes)
            for later, factor in zip(other.times, other.amplitudes)
        )
        times, amplitudes = zip(*pairs)
        return Shaper(times, amplitudes)

    def covering(self, _places: FloatArray | None, _present: Shaper | None = None) -> Shaper:
        """Return this shaper: it is the same wherever a motion leads (``ShaperByPlace``)."""
        return self

    @property
    def duration(self) -> float:
        """Time of the last impulse: a motion lasts so much longer [s]."""
        return self.times[-1]

    @property
    def delay(self) -> float:
        """Mean time of the impulses: a steady motion comes so much later [s]."""
        return math.fsum(a * t for a, t in zip(self.amplitudes, self.times))

    @property
    def variance(self) -> float:
        """Variance of the times [s^2].

        With a steady acceleration a, the delayed motion is off by half of a times this.
        """
        delay = self.delay
        return math.fsum(a * (t - delay) ** 2 for a, t in zip(self.amplitudes, self.times))


# One impulse at once changes nothing.
_ONE_IMPULSE = Shaper((0.0,), (1.0,))


def residual(shaper: Shaper, frequencies: ArrayLike, damping: ArrayLike = 0.0) -> FloatArray:
    """Return how much of the vibration of modes a ``shaper`` leaves (Singer and Seering, eq. 8).

    Args:
        shaper: the impulses.
        frequencies: without damping. Shape (n,) [Hz].
        damping: as part of the critical one. Shape (n,), or one number; (m, 1) for all pairs.

    Returns:
        As part of what one impulse at the shaper's end would excite. Shape (n,), or (m, n).
    """
    natural = math.tau * np.asarray(frequencies, dtype=np.float64)
    ratio = np.asarray(damping, dtype=np.float64)
    rate = natural * (1j * np.sqrt(1.0 - ratio * ratio) + ratio)
    times = np.array(shaper.times) - shaper.duration
    return np.asarray(np.abs(np.exp(np.multiply.outer(rate, times)) @ np.array(shaper.amplitudes)))


def _for_mode(kind: ShaperKind, mode: Mode) -> Shaper:
    parts, undamped = _UNDAMPED[kind]
    times = tuple(part * mode.period for part in parts)
    faded = [a * math.exp(-mode.decay * time) for a, time in zip(undamped, times)]
    total = math.fsum(faded)
    return Shaper(times, tuple(a / total for a in faded))


def _one_hump(left: float) -> Sequence[float]:
    return (1.0 + left) / 4.0, (1.0 - left) / 2.0, (1.0 + left) / 4.0


def _two_humps(left: float) -> Sequence[float]:
    squared = left * left
    x = (squared * (math.sqrt(1.0 - squared) + 1.0)) ** (1.0 / 3.0)
    first = (3.0 * x * x + 2.0 * x + 3.0 * squared) / (16.0 * x)
    return first, 0.5 - first, 0.5 - first, first


def _three_humps(left: float) -> Sequence[float]:
    first = (1.0 + 3.0 * left + 2.0 * math.sqrt(2.0 * left * (left + 1.0))) / 16.0
    second = (1.0 - left) / 4.0
    return first, second, 1.0 - 2.0 * (first + second), second, first


# Of each kind, the times in periods, and the impulses of a mode without damping.
_UNDAMPED: dict[ShaperKind, tuple[Sequence[float], Sequence[float]]] = {
    ShaperKind.ZV: ((0.0, 0.5), (1.0, 1.0)),
    ShaperKind.MZV: ((0.0, 0.375, 0.75), (1.0, math.sqrt(2.0), 1.0)),
    ShaperKind.ZVD: ((0.0, 0.5, 1.0), (1.0, 2.0, 1.0)),
    ShaperKind.EI: ((0.0, 0.5, 1.0), _one_hump(TOLERATED)),
    ShaperKind.TWO_HUMP_EI: ((0.0, 0.5, 1.0, 1.5), _two_humps(TOLERATED)),
    ShaperKind.THREE_HUMP_EI: ((0.0, 0.5, 1.0, 1.5, 2.0), _three_humps(TOLERATED)),
}


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
            distance = math.dist(one, other)
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
