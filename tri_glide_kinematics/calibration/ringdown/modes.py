"""The modes of a machine from a decaying swing, with what is not known of them.

A mode is told only if the samples ask for it, and its numbers are as certain as they look: the
standard deviations hold where the noise is white, and grow where the residuals show that more than
noise is left at that frequency.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import combinations

import numpy as np
from scipy.special import chdtri

from tri_glide_kinematics.calibration.ringdown.decay import (
    DRIFT_DEGREE,
    LEAST_NOISE,
    DecayFit,
    Samples,
    cost,
    fitted,
    pencils,
    splits,
    strongest,
)
from tri_glide_kinematics.calibration.ringdown.recording import Recording
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.shaping import Mode
from tri_glide_kinematics.vectors import FloatArray

# A shaper is for so many modes. One more is fitted, so that it does not disturb the others.
MOST_MODES = 2
MOST_OSCILLATIONS = MOST_MODES + 1

# Samples of a swing: more would take longer than anybody waits.
MOST_SAMPLES = 200_000

# Noise alone is taken for an oscillation in so many recordings, all frequencies together.
FALSE_ALARMS = 1e-4

# Of noise that is not white, the size at a frequency is known only roughly: an oscillation has to
# stand out by so much more.
MARGIN_OF_COLOURED_NOISE = 3.0

# Of the starts, so many that explain most are followed for so many steps, the best of them to the
# end if it then improves the fit by this part of what it has to.
STARTS, FIRST_STEPS = 4, 8
PROMISING = 0.5

NO_POLES = np.empty(0, dtype=np.complex128)

# Fewer samples tell of no mode.
LEAST_SAMPLES = 32
# In the recording, and samples in each.
LEAST_PERIODS = 3.0
LEAST_SAMPLES_PER_PERIOD = 2.5

# Standard deviations above which a number is of no use: of the frequency as a part of it, and of
# the damping.
MOST_FREQUENCY_DEVIATION = 0.02
MOST_DAMPING_DEVIATION = 0.02

# A mode has a decay if it is so many standard deviations from none.
DECAY_DEVIATIONS = 3.0

# An oscillation with less of the largest one's amplitude needs no shaper.
LEAST_AMPLITUDE = 0.01

# Two poles with overlapping bands are told apart if they are so many standard deviations from each
# other. Nearer ones have no interval that is symmetric.
APART_DEVIATIONS = 6.0

# More of the energy of the swing than this is left, and not as noise: it is another kind of motion.
MOST_UNEXPLAINED = 0.05

# Bins of the residuals' spectrum on either side of a frequency that are compared with all others.
BINS = 6
# Their power has to exceed that of white noise by so many of its standard deviations.
EXCESS_DEVIATIONS = 4.0

# A sensor is clipped if so many samples stand at an end of its values; if it is so coarse that less
# than half of its values differ, so many times as many as at the value next to it.
LEAST_AT_END = 3
MOST_BEFORE_END = 4.0

# Multiples of a frequency that a clipped or bent swing has.
HARMONICS = (2, 3, 4, 5)
HARMONIC_DEVIATIONS = 3.0
MOST_OF_HARMONIC = 0.5

# Of a swing whose frequency depends on its size: rate of decay of its second part by that of its
# first one, how far the frequencies are apart by that rate, the least part in quadrature.
BENT_RATES = (2.2, 3.8)
BENT_APART = 2.0
BENT_ACROSS = 0.75

# Residuals below this part of the values are rounding errors.
ROUNDING = 1e-9

# The ranges of ``Mode``.
FREQUENCIES = (1.0, 500.0)
MOST_DAMPING = 0.5


class NotKnown(Enum):
    """Why a mode is not known, with the reason as people read it."""

    TOO_FEW_SAMPLES = "there are too few samples"
    ONLY_NOISE = "no swing stands out from the noise"
    NOT_A_DECAY = "the motion is no sum of decaying swings: more than noise is left"
    TOO_SHORT = "the recording is too short for so slow a swing"
    SAMPLED_TOO_SLOWLY = "the samples are too far apart for so fast a swing"
    STEADY = "the swing does not decay: a steady tone, or too short a recording of a slow decay"
    OVERDAMPED = "the motion creeps to rest and hardly swings"
    OUT_OF_RANGE = "no shaper is for this frequency"
    TOO_UNCERTAIN = "the standard deviation is too large: too much noise, or too little swing"
    TOO_NEAR = "two modes are so near to each other that their numbers cannot be told apart"
    TOO_SMALL = "the swing is so small beside the largest one that it needs no shaper"
    CLIPPED = "the sensor is clipped: many samples stand at the largest value or the least one"
    HARMONIC = "a multiple of the frequency of a larger swing: clipping, play, a stiffening spring"
    TOO_MANY = "a shaper is for two modes, and others swing more"


@dataclass(frozen=True)
class Oscillation:
    """A damped oscillation of the fit.

    Attributes:
        frequency: without damping [Hz].
        damping: as part of the critical one; negative if it grows.
        frequency_deviation: standard deviation of the frequency [Hz].
        damping_deviation: standard deviation of the damping.
        amplitudes: of each axis at the first sample, in the unit of the recording. Shape (axes,).
        phases: of each axis at the first sample, of a cosine. Shape (axes,) [rad].
        resolution: two modes nearer to each other than this look like one here [Hz].
        evidence: by how much it lessens the sum of squares, over what the noise at its frequency
            hardly ever makes.
    """

    frequency: float
    damping: float
    frequency_deviation: float
    damping_deviation: float
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]
    resolution: float
    evidence: float

    @property
    def amplitude(self) -> float:
        """Of all axes together, in the unit of the recording."""
        return math.hypot(*self.amplitudes)

    @property
    def is_certain(self) -> bool:
        """Whether its numbers are of use."""
        return (
            self.frequency_deviation <= MOST_FREQUENCY_DEVIATION * self.frequency
            and self.damping_deviation <= MOST_DAMPING_DEVIATION
        )

    @property
    def mode(self) -> Mode:
        """The mode that a shaper is for."""
        return Mode(self.frequency, self.damping)


@dataclass(frozen=True, eq=False)
class RingDown:
    """What a recording says of the modes.

    Attributes:
        recording: that was measured.
        modes: none, one or two, the one with the largest amplitude first.
        left_out: other oscillations of the fit, and why they are no modes.
        reason: why there is no mode; None if there is one.
        fit: what the fit takes the values for. Shape (n, axes), in the unit of the recording.
        drift: the part of it that does not swing. Shape (n, axes).
        noise: standard deviation of the residuals of each axis. Shape (axes,).
        is_explained: whether the residuals look like white noise.
    """

    recording: Recording
    modes: tuple[Oscillation, ...]
    left_out: tuple[tuple[Oscillation, NotKnown], ...]
    reason: NotKnown | None
    fit: FloatArray
    drift: FloatArray
    noise: tuple[float, ...]
    is_explained: bool

    @property
    def residuals(self) -> FloatArray:
        """Measured minus fitted. Shape (n, axes)."""
        return np.asarray(self.recording.values - self.fit)

    @property
    def unexplained(self) -> float:
        """Part of the energy of the swing that the fit leaves, noise included."""
        swing = float(np.square(self.recording.values - self.drift).sum())
        return float(np.square(self.residuals).sum()) / swing if swing > 0.0 else 0.0


def find_modes(recording: Recording) -> RingDown:
    """Return the modes that explain a ``recording``, which begins when the motion has ended.

    Raises:
        KinematicsError: if it has more than ``MOST_SAMPLES`` samples.
    """
    values = recording.values
    moving = np.ptp(values, axis=0) > 0.0
    count = len(recording.times)
    if count > MOST_SAMPLES:
        start, end = recording.times[[0, -1]]
        raise KinematicsError(
            f"{count} samples from {start:.9g} to {end:.9g} s: modes are found in {MOST_SAMPLES} "
            "at most, so name the part behind the motion with --from and --to [s]"
        )
    is_clipped = any(_is_clipped(axis) or _is_clipped(-axis) for axis in values.T[moving])
    if count < LEAST_SAMPLES or not moving.any() or is_clipped:
        few = NotKnown.CLIPPED if is_clipped else NotKnown.ONLY_NOISE
        few = NotKnown.TOO_FEW_SAMPLES if count < LEAST_SAMPLES else few
        means = np.broadcast_to(values.mean(axis=0), values.shape)
        spread = tuple(values.std(axis=0).tolist())
        return RingDown(recording, (), (), few, means, means, spread, is_explained=False)
    # An axis that rests says nothing, and its noise of zero would outweigh all others.
    samples = Samples(recording.times - recording.times[0], values[:, moving])
    for fit in reversed(_fits(samples)):
        excess = _excess(samples, fit)
        oscillations = _oscillations(samples, fit, moving, excess)
        is_explained = bool(np.all(excess == 1.0)) and _is_noise(samples, fit)
        if not _is_divided(oscillations, is_explained):
            break
    margin = 1.0 if is_explained else MARGIN_OF_COLOURED_NOISE
    modes, left_out = _judged(samples, oscillations, margin)
    drift, whole, noise = values.copy(), values.copy(), np.zeros(len(moving))
    whole[:, moving] = samples.values - fit.residuals
    swings = np.exp(np.multiply.outer(samples.times, fit.poles)) @ fit.amplitudes
    drift[:, moving] = whole[:, moving] - swings.real
    noise[moving] = fit.noise
    found = RingDown(
        recording, modes, left_out, None, whole, drift, tuple(noise.tolist()), is_explained
    )
    reason = left_out[0][1] if left_out else NotKnown.ONLY_NOISE
    if not is_explained and found.unexplained > MOST_UNEXPLAINED:
        reason = NotKnown.NOT_A_DECAY
        left_out = (*((mode, reason) for mode in modes), *left_out)
        modes = ()
    return replace(found, modes=modes, left_out=left_out, reason=None if modes else reason)


def _fits(samples: Samples) -> list[DecayFit]:
    """Return fits with 0, 1, 2 ... oscillations, as many as the samples ask for."""
    count, axes = samples.values.shape
    best = fitted(samples, NO_POLES, np.ones(axes))
    fits = [best]
    threshold = _threshold(count, axes)
    for poles in range(1, MOST_OSCILLATIONS + 1):
        if count < 2 * (DRIFT_DEGREE + 1 + 2 * poles * (1 + 1 / axes)):
            break
        starts = sorted(_starts(samples, best, poles), key=lambda each: each[0])[:STARTS]
        tried = [fitted(samples, start, best.noise, FIRST_STEPS) for _, start in starts]
        more = min(tried, key=lambda each: float(np.log(each.noise).sum()))
        if _improvement(samples, best, more) < PROMISING * threshold:
            break
        # With the noise that was found, which weighs the axes.
        more = fitted(samples, more.poles, more.noise)
        if axes > 1:
            more = fitted(samples, more.poles, more.noise)
        if _improvement(samples, best, more) < threshold:
            break
        best = more
        fits.append(best)
    return fits


def _starts(samples: Samples, fit: DecayFit, count: int) -> Iterator[tuple[float, np.ndarray]]:
    """Yield starts with ``count`` poles, and the squares that each leaves."""
    # In units of the noise, no axis outweighs another.
    left = Samples(samples.times, fit.residuals / fit.noise)
    drifting = fitted(samples, NO_POLES, fit.noise).residuals
    swing = Samples(samples.times, drifting / fit.noise)
    one_more = np.concatenate((fit.poles, strongest(left)))
    for poles in (one_more, *splits(fit.poles), *pencils(swing, count)):
        yield cost(samples, poles, fit.noise), poles


def _improvement(samples: Samples, fewer: DecayFit, more: DecayFit) -> float:
    """Return by how much more poles lessen the sum of squares, in variances of what is left."""
    freedom = len(samples.times) - more.basis.shape[1]
    # Below are rounding errors.
    floor = np.square(LEAST_NOISE * samples.values.std()) * len(samples.times)
    ratios = (fewer.sums_of_squares + floor) / (more.sums_of_squares + floor)
    return float(np.log(ratios).sum()) * freedom


def _threshold(count: int, axes: int) -> float:
    """Return the improvement of a sum of squares, in variances, that noise hardly ever makes."""
    # Frequency, damping and an amplitude with its phase for each axis; at any of the frequencies.
    return float(chdtri(2.0 + 2.0 * axes, FALSE_ALARMS / count))


def _excess(samples: Samples, fit: DecayFit) -> FloatArray:
    """Return by how much the noise at the frequency of each pole exceeds that elsewhere.

    The variance of what is found from samples with coloured noise is that of white noise with the
    spectrum at the pole. Shape (k,), 1 where the residuals say nothing else.
    """
    left = fit.residuals / fit.noise
    bin_width = 1.0 / samples.duration
    factors = np.ones(len(fit.poles))
    for place, pole in enumerate(fit.poles):
        frequency, decay = pole.imag / math.tau, max(-pole.real, 0.0)
        # Noise is there all the time, what the model lacks mostly while the machine swings.
        steady = _power(samples, left, frequency, max(bin_width, frequency / (4.0 * BINS)), 0.0)
        fading = _power(samples, left, frequency, max(bin_width, decay / math.pi) / 2.0, decay)
        # About half of the bins of a fading swing are independent of each other.
        bins = 2.0 * BINS * left.shape[1]
        for power, count in ((steady, bins), (fading, bins / 2.0)):
            if power > 1.0 + EXCESS_DEVIATIONS / math.sqrt(count):
                factors[place] = max(factors[place], power)
    return factors


def _power(
    samples: Samples, left: FloatArray, frequency: float, width: float, decay: float
) -> float:
    """Return the mean power of residuals about a frequency, 1 for white noise.

    Args:
        samples: the times.
        left: residuals in units of the noise. Shape (n, axes).
        frequency: in the middle of the bins [Hz].
        width: of a bin [Hz].
        decay: with which later residuals count less [1/s].
    """
    fade = np.exp(-decay * samples.times)
    bins = np.abs(frequency + width * np.arange(-BINS, BINS + 1))
    waves = np.exp(-1j * math.tau * np.multiply.outer(bins, samples.times)) * fade
    return float(np.square(np.abs(waves @ left)).mean() / np.square(fade).sum())


def _is_clipped(axis: FloatArray) -> bool:
    """Return whether more values stand at the upper end than a coarse sensor would leave there."""
    counts = np.unique(axis, return_counts=True)[1]
    is_coarse = len(counts) < 0.5 * len(axis)
    least = max(LEAST_AT_END, MOST_BEFORE_END * counts[-2] if is_coarse else 0.0)
    return bool(counts[-1] >= least)


def _is_divided(oscillations: list[Oscillation], is_explained: bool) -> bool:
    """Return whether several oscillations may stand for one swing that is no exact decay."""
    return any(
        _is_bent(one, other) or (not is_explained and _are_near(one, other, BENT_APART))
        for one, other in combinations(oscillations, 2)
    )


def _is_bent(one: Oscillation, other: Oscillation) -> bool:
    r"""Return whether two are one swing whose frequency depends on its size.

    A spring that stiffens by the square of the amplitude $a = e^{-\sigma t}$ turns the phase by
    $\kappa a^2$: $a e^{j(\omega t + \kappa a^2)} = e^{j\omega t}(a + j\kappa a^3 + ...)$. So the
    second decays three times as fast as the first one, in quadrature to it on each axis.
    """
    slow, fast = sorted((one, other), key=lambda each: each.frequency * each.damping)
    rate = slow.frequency * slow.damping
    swings = [
        np.array(each.amplitudes) * np.exp(1j * np.array(each.phases)) for each in (slow, fast)
    ]
    across = abs(np.vdot(*swings).imag)
    return (
        BENT_RATES[0] * rate < fast.frequency * fast.damping < BENT_RATES[1] * rate
        and abs(fast.frequency - slow.frequency) < BENT_APART * rate
        and across > BENT_ACROSS * slow.amplitude * fast.amplitude
    )


def _is_noise(samples: Samples, fit: DecayFit) -> bool:
    """Return whether neighbouring residuals are independent of each other."""
    left = fit.residuals / fit.noise
    count = len(samples.times)
    if np.all(fit.noise <= ROUNDING * samples.values.std()):
        return True
    related = (left[1:] * left[:-1]).sum() / np.square(left).sum()
    return bool(abs(related) < 4.0 / math.sqrt(count * left.shape[1]))


def _oscillations(
    samples: Samples, fit: DecayFit, moving: np.ndarray, excess: FloatArray
) -> list[Oscillation]:
    """Return the oscillations of a fit, the largest first."""
    count, found = len(fit.poles), []
    threshold = _threshold(*samples.values.shape)
    squares = float(np.square(fit.residuals / fit.noise).sum())
    covariance = fit.covariance if count else np.empty((0, 0))
    for place, pole in enumerate(fit.poles):
        rate, angular, natural = -pole.real, pole.imag, abs(pole)
        by_rate_and_angular = np.array(
            (
                (rate / natural, angular / natural),
                (angular**2 / natural**3, -rate * angular / natural**3),
            )
        )
        both = [place, count + place]
        of_pole = covariance[np.ix_(both, both)]
        variances = np.full(2, np.inf)
        if np.isfinite(of_pole).all():
            variances = np.diag(by_rate_and_angular @ of_pole @ by_rate_and_angular.T)
        deviations = np.sqrt(excess[place] * variances)
        # The sum of squares, in variances, that is left without this pole.
        without = cost(samples, np.delete(fit.poles, place), fit.noise)
        amplitudes = np.zeros(len(moving), dtype=np.complex128)
        amplitudes[moving] = fit.amplitudes[place]
        found.append(
            Oscillation(
                frequency=float(natural / math.tau),
                damping=float(rate / natural),
                frequency_deviation=float(deviations[0] / math.tau),
                damping_deviation=float(deviations[1]),
                amplitudes=tuple(np.abs(amplitudes).tolist()),
                phases=tuple(np.angle(amplitudes).tolist()),
                resolution=_resolution(samples, fit, place),
                evidence=(without - squares) / (threshold * float(excess[place])),
            )
        )
    return sorted(found, key=lambda each: -each.amplitude)


def _resolution(samples: Samples, fit: DecayFit, place: int) -> float:
    r"""Return how far two modes have to be apart to be told from one [Hz].

    Two of half the amplitude at $s \pm d$ swing as one at $s$, but for $d^2 t^2/2$ of it. What the
    fit cannot take up of this has to be more than noise.
    """
    swing = np.exp(fit.poles[place] * samples.times)[:, None] * fit.amplitudes[place]
    curved = np.square(samples.times)[:, None] * swing.real
    curved = (curved - fit.basis @ (fit.basis.T @ curved)) / fit.noise
    scale = np.linalg.norm(fit.slopes, axis=0)
    basis = np.linalg.qr(fit.slopes / np.where(scale > 0.0, scale, 1.0))[0]
    flat = curved.ravel()
    flat = flat - basis @ (basis.T @ flat)
    energy = float(flat @ flat)
    if energy <= 0.0:
        return math.inf
    apart = (4.0 * _threshold(*samples.values.shape) / energy) ** 0.25
    return float(2.0 * apart / math.tau)


def _judged(
    samples: Samples, oscillations: list[Oscillation], margin: float
) -> tuple[tuple[Oscillation, ...], tuple[tuple[Oscillation, NotKnown], ...]]:
    """Return the modes, and what is none."""
    reasons = [_reason(samples, one, oscillations, margin) for one in oscillations]
    known = [one for one, reason in zip(oscillations, reasons) if reason is None]
    least = LEAST_AMPLITUDE * max((one.amplitude for one in known), default=0.0)
    modes = tuple(one for one in known if one.amplitude >= least)[:MOST_MODES]
    left_out = tuple(
        (one, NotKnown.TOO_SMALL if one.amplitude < least else reason or NotKnown.TOO_MANY)
        for one, reason in zip(oscillations, reasons)
        if one not in modes
    )
    return modes, left_out


def _reason(
    samples: Samples, one: Oscillation, oscillations: list[Oscillation], margin: float
) -> NotKnown | None:
    """Return why an oscillation is no mode, whatever the others are; None if it is one."""
    swings = one.frequency * math.sqrt(1.0 - one.damping**2)
    near = [each for each in oscillations if each is not one and _are_near(one, each)]
    if one.evidence < margin:
        return NotKnown.ONLY_NOISE
    if one.damping > MOST_DAMPING:
        return NotKnown.OVERDAMPED
    if swings * samples.duration < LEAST_PERIODS:
        return NotKnown.TOO_SHORT
    if swings * samples.interval * LEAST_SAMPLES_PER_PERIOD > 1.0:
        return NotKnown.SAMPLED_TOO_SLOWLY
    if any(_is_harmonic(one, each) for each in oscillations):
        return NotKnown.HARMONIC
    if not one.is_certain:
        return NotKnown.TOO_NEAR if near else NotKnown.TOO_UNCERTAIN
    if any(_are_alike(one, each) for each in near):
        return NotKnown.TOO_NEAR
    if one.damping < DECAY_DEVIATIONS * one.damping_deviation:
        return NotKnown.STEADY
    if not FREQUENCIES[0] <= one.frequency <= FREQUENCIES[1]:
        return NotKnown.OUT_OF_RANGE
    return None


def _is_harmonic(one: Oscillation, base: Oscillation) -> bool:
    """Return whether one is a multiple of a larger oscillation, within their deviations."""
    if one.amplitude > MOST_OF_HARMONIC * base.amplitude:
        return False
    return any(
        abs(one.frequency - times * base.frequency)
        < HARMONIC_DEVIATIONS
        * math.hypot(one.frequency_deviation, times * base.frequency_deviation)
        and one.frequency * one.damping > base.frequency * base.damping
        for times in HARMONICS
    )


def _are_near(one: Oscillation, other: Oscillation, factor: float = 1.0) -> bool:
    """Return whether the bands of two oscillations overlap; what creeps has none."""
    if max(one.damping, other.damping) > MOST_DAMPING:
        return False
    width = factor * (one.damping * one.frequency + other.damping * other.frequency)
    uncertain = 2.0 * math.hypot(one.frequency_deviation, other.frequency_deviation)
    return abs(one.frequency - other.frequency) < max(width, uncertain)


def _are_alike(one: Oscillation, other: Oscillation) -> bool:
    """Return whether two poles could be one, but for some standard deviations."""
    rates = [math.tau * each.frequency * each.damping for each in (one, other)]
    spreads = [
        math.tau * math.hypot(each.frequency_deviation, each.frequency * each.damping_deviation)
        for each in (one, other)
    ]
    apart = math.hypot(rates[0] - rates[1], math.tau * (one.frequency - other.frequency))
    return apart < APART_DEVIATIONS * math.hypot(*spreads)


# One set of modes from the swings behind several moves.
#
# A move excites only the modes that lie in its direction, so a mode is seen in some of the swings.
# What is found in two of them is one mode if the numbers differ by no more than three standard
# deviations, or than a shaper would notice. Its frequency and damping are means, weighted by the
# inverse variances. If the swings differ by more than their standard deviations say, as modes do
# from place to place and with the size of the swing, that of the mean grows by as much.

# Numbers that differ by so many standard deviations may be the same.
ALIKE_DEVIATIONS = 3.0


@dataclass(frozen=True, eq=False)
class CombinedModes:
    """What several swings of one machine say of its modes.

    Attributes:
        ringdowns: of each swing.
        modes: none, one or two, the one with the largest amplitude first. Numbers are those of all
            swings together, amplitudes and phases those of the largest swing.
        seen: in how many swings each of the modes was found.
        left_out: other modes that were found in a swing, and why they are left out.
        reason: why there is no mode; None if there is one.
    """

    ringdowns: tuple[RingDown, ...]
    modes: tuple[Oscillation, ...]
    seen: tuple[int, ...]
    left_out: tuple[tuple[Oscillation, NotKnown], ...]
    reason: NotKnown | None


@dataclass
class _Group:
    """What is taken for one mode: the swings in which it was found, and what was found there."""

    swings: list[int]
    found: list[Oscillation]

    @property
    def together(self) -> Oscillation:
        """Their mean, with the amplitudes of the first, which is the largest."""
        frequency, frequency_deviation = _mean(
            [(one.frequency, one.frequency_deviation) for one in self.found]
        )
        damping, damping_deviation = _mean(
            [(one.damping, one.damping_deviation) for one in self.found]
        )
        return replace(
            self.found[0],
            frequency=frequency,
            damping=damping,
            frequency_deviation=frequency_deviation,
            damping_deviation=damping_deviation,
            resolution=min(one.resolution for one in self.found),
        )


def combine_modes(ringdowns: Sequence[RingDown]) -> CombinedModes:
    """Return the modes that several swings of one machine show.

    Raises:
        KinematicsError: if there are no swings, or they are not of the same quantity.
    """
    if not ringdowns:
        raise KinematicsError("0 swings: at least one is needed")
    quantities = {found.recording.quantity for found in ringdowns}
    if len(quantities) > 1:
        raise KinematicsError("positions and accelerations cannot be combined")
    groups = _groups(ringdowns)
    modes: list[tuple[Oscillation, int]] = []
    left_out: list[tuple[Oscillation, NotKnown]] = []
    for group in groups:
        one = group.together
        reason = _why_left_out(one, modes)
        if reason is None:
            modes.append((one, len(group.found)))
        else:
            left_out.append((one, reason))
    return CombinedModes(
        tuple(ringdowns),
        tuple(one for one, _ in modes),
        tuple(count for _, count in modes),
        tuple(left_out),
        None if modes else _why_none(ringdowns, left_out),
    )


def _groups(ringdowns: Sequence[RingDown]) -> list[_Group]:
    """Return the modes of all swings, those that are alike together, the largest first."""
    found = sorted(
        ((one, swing) for swing, each in enumerate(ringdowns) for one in each.modes),
        key=lambda pair: -pair[0].amplitude,
    )
    groups: list[_Group] = []
    for one, swing in found:
        # Two of one swing have been told apart there.
        possible = [
            group
            for group in groups
            if swing not in group.swings and _may_be_one(one, group.together)
        ]
        if possible:
            nearest = min(possible, key=lambda group: _apart(one, group.together))
            nearest.swings.append(swing)
            nearest.found.append(one)
        else:
            groups.append(_Group([swing], [one]))
    return groups


def _apart(one: Oscillation, other: Oscillation) -> float:
    return abs(one.frequency - other.frequency)


def _may_be_one(one: Oscillation, other: Oscillation) -> bool:
    """Return whether two may be the same mode, or the same to a shaper."""
    frequency = ALIKE_DEVIATIONS * math.hypot(one.frequency_deviation, other.frequency_deviation)
    damping = ALIKE_DEVIATIONS * math.hypot(one.damping_deviation, other.damping_deviation)
    return _apart(one, other) <= max(frequency, MOST_FREQUENCY_DEVIATION * other.frequency) and abs(
        one.damping - other.damping
    ) <= max(damping, MOST_DAMPING_DEVIATION)


def _mean(found: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the weighted mean of values with standard deviations, and its standard deviation."""
    # A swing without noise would have an infinite weight.
    least = max(deviation for _, deviation in found) * 1e-6
    if least <= 0.0:
        return found[0]
    weights = [max(deviation, least) ** -2 for _, deviation in found]
    whole = math.fsum(weights)
    mean = math.fsum(weight * value for weight, (value, _) in zip(weights, found)) / whole
    squares = math.fsum(weight * (value - mean) ** 2 for weight, (value, _) in zip(weights, found))
    excess = squares / (len(found) - 1) if len(found) > 1 else 1.0
    return mean, math.sqrt(max(excess, 1.0) / whole)


def _why_left_out(one: Oscillation, modes: Sequence[tuple[Oscillation, int]]) -> NotKnown | None:
    """Return why something that was found is left out, beside the larger ``modes``."""
    if not one.is_certain:
        return NotKnown.TOO_UNCERTAIN
    if modes and one.amplitude < LEAST_AMPLITUDE * modes[0][0].amplitude:
        return NotKnown.TOO_SMALL
    return None if len(modes) < MOST_MODES else NotKnown.TOO_MANY


def _why_none(
    ringdowns: Sequence[RingDown], left_out: Sequence[tuple[Oscillation, NotKnown]]
) -> NotKnown:
    """Return why no mode is known: what holds for most swings, of equally many the first."""
    if left_out:
        return left_out[0][1]
    reasons = [found.reason for found in ringdowns if found.reason is not None]
    return Counter(reasons).most_common(1)[0][0]
