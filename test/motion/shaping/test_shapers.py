"""Shapers against their closed forms, published ranges, and simulated modes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tri_glide_kinematics.errors import KinematicsError, NotAChoiceError, OutOfBoundsError
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind, residual

KINDS = list(ShaperKind)
EXACT = [ShaperKind.ZV, ShaperKind.MZV, ShaperKind.ZVD, ShaperKind.TWO_HUMP_EI]
MODES = st.builds(Mode, st.floats(1.0, 500.0), st.floats(0.0, 0.3))

# Width of the range of frequencies with at most 5 % left, as part of the mode's frequency
# (Singhose, Porter, Tuttle, Singer 1997, table 1); MZV has none there.
PUBLISHED = {
    ShaperKind.ZV: 0.06,
    ShaperKind.ZVD: 0.29,
    ShaperKind.EI: 0.40,
    ShaperKind.TWO_HUMP_EI: 0.73,
    ShaperKind.THREE_HUMP_EI: 0.97,
}


def swing_left(shaper: Shaper, frequency: float, damping: float) -> float:
    """Return how far a mode swings after the impulses, over that after one at their end.

    The impulse response of the mode, summed up: independent of the formula in ``residual``.
    """
    natural = math.tau * frequency
    damped = natural * math.sqrt(1.0 - damping**2)

    def state(since: float) -> np.ndarray:
        """Position and velocity after an impulse, in a frame in which the swing is a circle."""
        fade = math.exp(-damping * natural * since)
        position = fade * math.sin(damped * since)
        rate = fade * math.cos(damped * since)
        return np.array((position, rate))

    left = sum(a * state(shaper.duration - t) for a, t in zip(shaper.amplitudes, shaper.times))
    return float(np.linalg.norm(left))


@given(st.sampled_from(KINDS), MODES)
def test_impulses_are_positive_ascend_and_sum_to_one(kind: ShaperKind, mode: Mode) -> None:
    shaper = Shaper.of(kind, mode)
    assert shaper.times[0] == 0.0
    assert all(a < b for a, b in zip(shaper.times, shaper.times[1:]))
    assert min(shaper.amplitudes) > 0.0
    assert math.fsum(shaper.amplitudes) == pytest.approx(1.0, abs=1e-14)
    assert 0.0 < shaper.delay < shaper.duration
    # Two equal impulses reach the bound, but for rounding.
    assert 0.0 < shaper.variance <= shaper.duration**2 / 4.0 * (1.0 + 1e-12)


@given(MODES)
def test_zv_and_zvd_are_their_closed_forms(mode: Mode) -> None:
    fade = math.exp(-math.pi * mode.damping / math.sqrt(1.0 - mode.damping**2))
    zv, zvd = Shaper.of(ShaperKind.ZV, mode), Shaper.of(ShaperKind.ZVD, mode)
    assert zv.amplitudes == pytest.approx((1 / (1 + fade), fade / (1 + fade)), abs=1e-12)
    whole = (1.0 + fade) ** 2
    assert zvd.amplitudes == pytest.approx(
        (1 / whole, 2 * fade / whole, fade**2 / whole), abs=1e-12
    )
    assert zv.times == pytest.approx((0.0, mode.period / 2), rel=1e-12)
    assert zvd.times == pytest.approx((0.0, mode.period / 2, mode.period), rel=1e-12)


def test_mzv_without_damping() -> None:
    shaper = Shaper.of(ShaperKind.MZV, Mode(10.0))
    whole = 2.0 + math.sqrt(2.0)
    assert shaper.amplitudes == pytest.approx(
        (1 / whole, math.sqrt(2) / whole, 1 / whole), abs=1e-12
    )
    assert shaper.times == pytest.approx((0.0, 0.0375, 0.075), abs=1e-12)


@given(st.sampled_from(EXACT), MODES)
def test_nothing_is_left_of_the_mode_itself(kind: ShaperKind, mode: Mode) -> None:
    assert residual(Shaper.of(kind, mode), [mode.frequency], mode.damping)[0] < 1e-12


@pytest.mark.parametrize("kind", [ShaperKind.EI, ShaperKind.THREE_HUMP_EI])
def test_five_percent_are_left_at_the_middle_of_one_and_three_humps(kind: ShaperKind) -> None:
    assert residual(Shaper.of(kind, Mode(20.0)), [20.0])[0] == pytest.approx(0.05, abs=1e-12)


@given(st.sampled_from(KINDS), MODES, st.floats(0.3, 3.0), st.floats(0.0, 0.5))
@settings(max_examples=200)
def test_the_residual_is_that_of_a_simulated_mode(
    kind: ShaperKind, mode: Mode, ratio: float, damping: float
) -> None:
    shaper = Shaper.of(kind, mode)
    frequency = ratio * mode.frequency
    expected = swing_left(shaper, frequency, damping)
    assert residual(shaper, [frequency], damping)[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("kind", "width"), PUBLISHED.items(), ids=lambda each: str(each))
def test_ranges_are_those_that_are_published(kind: ShaperKind, width: float) -> None:
    frequencies = np.linspace(0.3, 1.7, 28_001) * 10.0
    left = residual(Shaper.of(kind, Mode(10.0)), frequencies)
    too_much = np.flatnonzero(left > 0.05 + 1e-9)
    middle = len(frequencies) // 2
    low, high = too_much[too_much < middle].max(), too_much[too_much > middle].min()
    assert (frequencies[high] - frequencies[low]) / 10.0 == pytest.approx(width, abs=0.03)


def test_two_modes_are_both_left_at_rest() -> None:
    first, second = Mode(12.0, 0.02), Mode(20.0, 0.1)
    shaper = Shaper.of(ShaperKind.ZV, first, second)
    left = residual(shaper, [12.0, 20.0], [0.02, 0.1])
    assert left == pytest.approx((0.0, 0.0), abs=1e-12)
    assert len(shaper.times) == 4
    assert shaper.duration == pytest.approx(first.period / 2 + second.period / 2)


def test_bad_modes_are_refused() -> None:
    with pytest.raises(OutOfBoundsError, match=r"frequency = 0\.5 Hz must be from 1 to 500"):
        Mode(0.5)
    with pytest.raises(OutOfBoundsError, match=r"damping = 0\.6 must be from 0 to 0\.5"):
        Mode(10.0, 0.6)
    with pytest.raises(NotAChoiceError):
        Shaper.of("ei", Mode(10.0))  # type: ignore[arg-type]
    with pytest.raises(KinematicsError, match="1 to 2 modes, not 0"):
        Shaper.of(ShaperKind.EI)
