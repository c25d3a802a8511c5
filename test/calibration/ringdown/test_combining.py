"""Modes from the swings behind several moves."""

import math
from dataclasses import replace

import numpy as np
import pytest
from soak import many

from testing.swings import Measuring
from tri_glide_kinematics.calibration.ringdown import (
    NoModeError,
    NotKnown,
    Quantity,
    Recording,
    combine_modes,
    combined_report,
    find_modes,
    mode_text,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.shaping import Mode, ShaperKind

SHORT = Measuring(duration=1.0)
X, Y = Mode(15.0, 0.03), Mode(23.0, 0.05)


def swings(modes, seed=1, measuring=SHORT):
    """Return the ring-downs of swings, one for each group of ``modes``."""
    rng = np.random.default_rng(seed)
    return [find_modes(measuring.of(each, rng)) for each in modes]


def test_modes_that_are_seen_in_some_of_the_swings_are_found():
    found = combine_modes(swings([[X], [X], [Y], [X, Y]]))
    assert found.reason is None
    by_frequency = sorted(zip(found.modes, found.seen), key=lambda pair: pair[0].frequency)
    assert [seen for _, seen in by_frequency] == [3, 2]
    for (one, _), true in zip(by_frequency, (X, Y)):
        assert one.frequency == pytest.approx(true.frequency, rel=1e-3)
        assert one.damping == pytest.approx(true.damping, abs=1e-3)


@pytest.mark.slow
def test_numbers_of_several_swings_are_inside_their_intervals():
    rng = np.random.default_rng(5)
    errors = []
    measuring = replace(SHORT, quantity=Quantity.ACCELERATION, noise=10.0**-1.5, axes=1)
    for seed in range(many(3)):
        true = Mode(rng.uniform(10.0, 40.0), rng.uniform(0.01, 0.06))
        (one,) = combine_modes(swings([[true]] * 4, seed, measuring)).modes
        errors.append((one.frequency - true.frequency) / one.frequency_deviation)
        errors.append((one.damping - true.damping) / one.damping_deviation)
    # The weights are those of standard deviations that are known only roughly.
    assert np.mean(np.abs(errors) <= 1.96) >= 0.88
    assert np.std(errors) < 1.3


def test_a_mean_is_weighted_and_nearer_than_each_of_the_swings():
    (exact,), (rough,) = (
        [one] for one in (swings([[X]])[0], swings([[X]], 2, replace(SHORT, noise=2e-5))[0])
    )
    (one,) = combine_modes([exact, rough]).modes
    first, second = exact.modes[0], rough.modes[0]
    assert one.frequency_deviation <= first.frequency_deviation < second.frequency_deviation
    assert abs(one.frequency - first.frequency) < abs(one.frequency - second.frequency)


def test_swings_that_differ_make_the_mean_as_uncertain():
    """A mode is at 15.0 Hz along one way, and at 15.1 Hz along another."""
    found = combine_modes(swings([[X], [Mode(15.1, 0.03)]]))
    (one,) = found.modes
    assert found.seen == (2,)
    assert 15.0 < one.frequency < 15.1
    assert one.frequency_deviation == pytest.approx(0.05, rel=0.5)


def test_two_modes_of_one_swing_stay_two():
    found = combine_modes(swings([[X, Mode(16.5, 0.03)], [X]]))
    assert len(found.modes) == 2
    assert sorted(found.seen) == [1, 2]


def test_a_third_mode_is_told():
    found = combine_modes(swings([[X], [Y], [Mode(40.0, 0.02)]]))
    assert len(found.modes) == 2
    ((_, why),) = found.left_out
    assert why is NotKnown.TOO_MANY
    assert "No mode: frequency" in combined_report(found)


def test_a_mode_that_hardly_swings_needs_no_shaper():
    large, small = swings([[X], [Y]])
    values = small.recording.values * 1e-3
    tiny = find_modes(Recording(small.recording.times, values))
    found = combine_modes([large, tiny])
    assert [one.frequency for one in found.modes] == [pytest.approx(15.0, rel=0.01)]
    assert [why for _, why in found.left_out] == [NotKnown.TOO_SMALL]


def test_where_no_swing_shows_a_mode_the_reason_is_that_of_most():
    noise = swings([[], []])
    short = find_modes(noise[0].recording.between(0.0, 0.03))
    found = combine_modes([short, *noise])
    assert (found.modes, found.reason) == ((), NotKnown.ONLY_NOISE)
    report = combined_report(found)
    assert report.startswith("NOT KNOWN: no swing stands out from the noise")
    assert "Swing 1: 1" in report
    with pytest.raises(NoModeError, match="no swing stands out"):
        mode_text(found, ShaperKind.EI, "modes.yaml")


def test_a_swing_without_noise_does_not_outweigh_all_arithmetic():
    times = np.arange(400) / 400.0
    values = np.exp(-3.0 * times) * np.cos(100.0 * times)
    exact = find_modes(Recording(times, values[:, None]))
    (one,) = combine_modes([exact, exact]).modes
    assert one.frequency == pytest.approx(math.hypot(100.0, 3.0) / math.tau, rel=1e-9)


def test_what_cannot_be_combined_is_refused():
    with pytest.raises(KinematicsError, match="0 swings"):
        combine_modes([])
    (position,) = swings([[X]])
    (acceleration,) = swings([[X]], 1, replace(SHORT, quantity=Quantity.ACCELERATION, noise=0.03))
    with pytest.raises(KinematicsError, match="positions and accelerations"):
        combine_modes([position, acceleration])
