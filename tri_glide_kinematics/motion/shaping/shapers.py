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
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite, member, positive
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.vectors import FloatArray

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
