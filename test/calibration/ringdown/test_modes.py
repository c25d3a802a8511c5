"""Modes from simulated swings: exact where they can be, and not known where they are not."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from soak import many, some

from testing.mode_tally import ACCELERATIONS, NEAR, POSITIONS, WIDE, tally
from testing.swings import NOISE, Measuring
from tri_glide_kinematics.calibration.ringdown import NotKnown, Recording, find_modes
from tri_glide_kinematics.motion.shaping import Mode

TIMES = np.arange(1000) / 500.0
COUNT = len(some(range(10), 2))


def swing(
    frequency: float, damping: float, times: np.ndarray = TIMES, amplitude: float = 1e-3
) -> np.ndarray:
    """A damped oscillation [m]."""
    angular = math.tau * frequency
    fade = amplitude * np.exp(-damping * angular * times)
    return fade * np.cos(angular * math.sqrt(1.0 - damping**2) * times + 0.3)


def recorded(values: np.ndarray, times: np.ndarray = TIMES, noise: float = NOISE) -> Recording:
    """One axis, with noise."""
    rng = np.random.default_rng(25)
    return Recording(times, (values + noise * rng.standard_normal(len(times)))[:, None])


@pytest.mark.slow
@pytest.mark.parametrize(
    "measuring", [POSITIONS, ACCELERATIONS], ids=["positions", "accelerations"]
)
@pytest.mark.parametrize("ratios", [WIDE, NEAR], ids=["wide", "near"])
def test_two_modes_are_found_as_exactly_as_is_said(measuring, ratios):
    """With drift and 1 % of the samples missing."""
    found = tally(measuring, ratios, COUNT, seed=7)
    assert 0.9 <= found.coverage <= 1.0
    assert found.covered == found.one
    if measuring is POSITIONS:
        assert found.exact >= 0.95 * COUNT


@settings(derandomize=True, deadline=None, max_examples=many(4))
@given(
    st.floats(8.0, 60.0),
    st.floats(0.005, 0.15),
    st.floats(1e-6, 1e3),
    st.sampled_from([1, 2, 3]),
    st.floats(0.0, 0.3),
)
def test_the_answer_depends_on_no_unit_and_on_no_raster(frequency, damping, unit, axes, uneven):
    measuring = Measuring(axes=axes, uneven=uneven)
    recording = measuring.of([Mode(frequency, damping)], np.random.default_rng(1))
    first = find_modes(recording)
    [mode] = first.modes
    assert abs(mode.frequency - frequency) < 5.0 * mode.frequency_deviation
    assert abs(mode.damping - damping) < 5.0 * mode.damping_deviation
    shifted = Recording(recording.times + 1000.0, unit * recording.values)
    [again] = find_modes(shifted).modes
    assert again.frequency == pytest.approx(mode.frequency, abs=0.1 * mode.frequency_deviation)
    assert again.amplitude == pytest.approx(unit * mode.amplitude, rel=1e-3)


def test_amplitude_and_phase_are_those_of_each_axis():
    values = np.column_stack((swing(15.0, 0.03), -2.0 * swing(15.0, 0.03), 0.0 * TIMES))
    [mode] = find_modes(Recording(TIMES, values)).modes
    assert mode.amplitudes == pytest.approx((1e-3, 2e-3, 0.0), rel=1e-6)
    assert mode.phases[:2] == pytest.approx((0.3, 0.3 - math.pi), abs=1e-6)
    assert mode.mode == Mode(mode.frequency, mode.damping)


SHORT = TIMES[:60]
SPARSE = np.arange(100) / 50.0


@pytest.mark.parametrize(
    ("recording", "reason"),
    [
        (recorded(0.0 * TIMES), NotKnown.ONLY_NOISE),
        (recorded(swing(15.0, 0.1), noise=2e-3), NotKnown.ONLY_NOISE),
        (Recording(TIMES, np.ones((1000, 2))), NotKnown.ONLY_NOISE),
        (recorded(swing(15.0, 0.2), noise=2e-4), NotKnown.TOO_UNCERTAIN),
        (recorded(swing(15.0, 0.03)[:20], TIMES[:20]), NotKnown.TOO_FEW_SAMPLES),
        (recorded(swing(15.0, 0.03, SHORT), SHORT), NotKnown.TOO_SHORT),
        (recorded(swing(0.7, 0.03)), NotKnown.TOO_SHORT),
        (recorded(swing(22.0, 0.03, SPARSE), SPARSE), NotKnown.SAMPLED_TOO_SLOWLY),
        (recorded(swing(13.0, 0.0)), NotKnown.STEADY),
        (recorded(swing(13.0, -0.005)), NotKnown.STEADY),
        (recorded(swing(5.0, 0.7)), NotKnown.OVERDAMPED),
        (recorded(1e-3 * np.exp(-10.0 * TIMES)), NotKnown.OVERDAMPED),
        (recorded(swing(15.0, 0.03) + 1e-3 * (TIMES > 0.9)), NotKnown.NOT_A_DECAY),
    ],
)
def test_it_says_why_nothing_is_known(recording, reason):
    found = find_modes(recording)
    assert found.reason is reason
    assert bool(found.modes) == (reason is None)
    assert np.isfinite(found.fit).all()


@pytest.mark.parametrize("seed", range(many(2)))
def test_a_random_walk_has_no_mode(seed):
    walk = np.cumsum(np.random.default_rng(seed).normal(0.0, 1e-5, 1000))
    found = find_modes(recorded(walk))
    assert not found.modes
    assert not found.is_explained


def test_near_modes_whose_numbers_cannot_be_told_apart_are_not_told():
    found = find_modes(recorded(swing(15.0, 0.15) - 0.5 * swing(15.5, 0.15)))
    assert found.reason is NotKnown.TOO_NEAR


def test_two_modes_nearer_than_the_resolution_look_like_one():
    def count(apart: float) -> int:
        return len(find_modes(recorded(swing(15.0, 0.03) + swing(15.0 + apart, 0.03))).modes)

    [alone] = find_modes(recorded(2.0 * swing(15.0, 0.03))).modes
    assert count(0.7 * alone.resolution) == 1
    [merged] = find_modes(
        recorded(swing(15.0, 0.03) + swing(15.0 + 0.7 * alone.resolution, 0.03))
    ).modes
    assert abs(merged.frequency - 15.0) < alone.resolution
    assert count(6.0 * alone.resolution) == 2


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        (swing(50.0, 0.0), NotKnown.STEADY),
        (1e-3 * np.exp(-10.0 * TIMES), NotKnown.OVERDAMPED),
        (swing(30.0, 0.03, amplitude=5e-6), NotKnown.TOO_SMALL),
    ],
    ids=["hum", "creep", "too small"],
)
def test_what_else_moves_disturbs_no_mode(more, reason):
    found = find_modes(recorded(swing(15.0, 0.03) + more))
    [mode] = found.modes
    assert abs(mode.frequency - 15.0) < 5.0 * mode.frequency_deviation < 0.01
    assert {why for _, why in found.left_out} == {reason}
    assert found.is_explained


def test_the_third_mode_is_left_out_and_the_others_are_exact():
    values = swing(15.0, 0.03) + swing(25.0, 0.03, amplitude=5e-4) + swing(40.0, 0.05)
    found = find_modes(recorded(values))
    assert sorted(round(mode.frequency, 1) for mode in found.modes) == [15.0, 40.0]
    [(third, reason)] = found.left_out
    assert third.frequency == pytest.approx(25.0, abs=0.01)
    assert reason is NotKnown.TOO_MANY


def test_friction_makes_the_answer_uncertain_and_adds_no_mode():
    """Dry friction: the amplitude falls along a line, which is no sum of decays."""
    values = 1e-3 * np.maximum(1.0 - TIMES, 0.0) * np.cos(math.tau * 15.0 * TIMES)
    found = find_modes(recorded(values))
    [mode] = found.modes
    assert abs(mode.frequency - 15.0) < 3.0 * mode.frequency_deviation
    assert mode.frequency_deviation > 5e-3
    assert not found.is_explained


def test_coloured_noise_widens_the_interval():
    """White noise through a low pass at 30 Hz, as accelerometers have it."""
    rng = np.random.default_rng(6)
    errors = []
    for _ in range(5):
        noise = np.zeros(1000)
        for place, push in enumerate(rng.normal(0.0, 1e-5, 999)):
            noise[place + 1] = 0.7 * noise[place] + push
        found = find_modes(recorded(swing(15.0, 0.03) + noise))
        [mode] = found.modes
        assert not found.is_explained
        errors.append((mode.frequency - 15.0) / mode.frequency_deviation)
    assert np.square(errors).mean() < 2.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "values",
    [
        np.eye(40)[0],
        np.eye(40)[20],
        np.exp(-np.arange(40.0)),
        np.arange(40.0),
        np.repeat((0.0, 1.0), 20),
        1e30 * np.tile((1.0, -1.0), 20),
        1e-30 * np.cos(np.arange(40.0)),
    ],
    ids=["first", "spike", "exponential", "line", "step", "large", "small"],
)
def test_odd_recordings_have_an_answer_and_no_mode(values):
    found = find_modes(Recording(np.arange(40.0) / 100.0, values[:, None]))
    assert found.reason is not None
    assert np.isfinite(found.fit).all()


@pytest.mark.parametrize(("frequency", "part"), [(9.0, 0.5), (22.0, 0.6), (55.0, 0.75)])
def test_a_sensor_that_is_clipped_tells_no_mode(part, frequency):
    values = swing(frequency, 0.02) + NOISE * np.random.default_rng(3).standard_normal(len(TIMES))
    limit = part * np.abs(values).max()
    found = find_modes(Recording(TIMES, np.clip(values, -limit, limit)[:, None]))
    assert found.reason is NotKnown.CLIPPED and not found.modes
    # A coarse sensor is not clipped: of a count of 20 steps each is there several times.
    coarse = np.round(values / 5e-5) * 5e-5
    assert find_modes(Recording(TIMES, coarse[:, None])).reason is not NotKnown.CLIPPED


def test_a_multiple_of_the_frequency_is_no_mode():
    """As if noise had been added behind a clipped sensor."""
    found = find_modes(recorded(swing(15.0, 0.03) + swing(45.0, 0.04, amplitude=2e-4)))
    [mode] = found.modes
    assert mode.frequency == pytest.approx(15.0, abs=0.01)
    [(third, reason)] = found.left_out
    assert third.frequency == pytest.approx(45.0, abs=0.1) and reason is NotKnown.HARMONIC
    # A second mode that is no multiple, or as large, is one.
    for frequency, amplitude in ((47.0, 2e-4), (45.0, 8e-4)):
        both = find_modes(recorded(swing(15.0, 0.03) + swing(frequency, 0.04, amplitude=amplitude)))
        assert len(both.modes) == 2


@pytest.mark.parametrize("seed", range(many(2)))
def test_a_spring_that_stiffens_is_no_second_mode(seed):
    """Integrated by itself: x'' = -2 d w x' - w^2 x (1 + b x^2), in units of the first swing."""
    rng = np.random.default_rng(seed)
    angular, damping = math.tau * rng.uniform(8.0, 40.0), rng.uniform(0.005, 0.05)
    stiffening, phase = rng.uniform(0.02, 0.3), rng.uniform(-math.pi, math.pi)
    steps = 20
    step = (TIMES[1] - TIMES[0]) / steps
    place, speed, places = math.cos(phase), -angular * math.sin(phase), []
    for index in range(steps * len(TIMES)):
        if index % steps == 0:
            places.append(place)
        force = angular**2 * place * (1.0 + stiffening * place * place)
        # Leapfrog: errors of the frequency are below 1e-4 of it.
        speed -= step * (force + 2.0 * damping * angular * speed)
        place += step * speed
    found = find_modes(recorded(1e-3 * np.array(places)))
    assert len(found.modes) <= 1 and not found.is_explained
