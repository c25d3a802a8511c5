"""Histories: bins of the last seconds."""

import math

import numpy as np
import pytest

from testing.swings import strongest_frequency
from tri_glide_kinematics.panel.tabs.curves import (
    ACCELERATIONS,
    BIN,
    HEIGHTS,
    SPAN,
    SWING_BIN,
    SWING_SPAN,
    VELOCITIES,
    History,
    SwingHistory,
)

AT_REST = (0.0, 0.0, 0.0)
SOMEWHERE = (0.4, 0.5, 0.6)


def swing(time):
    """Heights, velocities and accelerations of three sliders that swing at different rates."""
    rates = np.array([1.0, 2.0, 3.0])
    phases = rates * time
    return (
        0.6 + 0.1 * np.sin(phases),
        0.1 * rates * np.cos(phases),
        -0.1 * rates**2 * np.sin(phases),
    )


@pytest.mark.parametrize("rate", [25.0, 30.0, 500.0])
def test_history_is_the_last_ten_seconds_at_any_rate(rate):
    history = History()
    start = 1234.5678
    times = start + np.arange(round(13.0 * rate)) / rate
    for time in times:
        history.add(time, *swing(time))
    assert history.ages[-1] == 0.0
    assert history.ages[0] == pytest.approx(-SPAN, abs=1.5 * BIN)
    for quantity in (HEIGHTS, VELOCITIES, ACCELERATIONS):
        shown = history.values(quantity)
        assert shown.shape == (3, history.ages.size)
        wanted = np.array([swing(times[-1] + age)[quantity] for age in history.ages]).T
        # A bin is as wide as it is, and stands for a moment anywhere in it.
        steepest = 0.1 * 3.0 ** (quantity + 1)
        assert np.abs(shown - wanted).max() <= steepest * 2.0 * BIN


def test_a_bin_holds_the_newest_height_and_the_largest_rates():
    history = History()
    history.add(10.001, (0.1, 0.1, 0.1), (0.2, -0.9, 0.0), (1.0, 2.0, -8.0))
    history.add(10.002, (0.2, 0.3, 0.4), (0.1, 0.3, -0.1), (-2.0, 1.0, 7.0))
    assert history.values(HEIGHTS)[:, -1] == pytest.approx([0.2, 0.3, 0.4])
    assert history.values(VELOCITIES)[:, -1] == pytest.approx([0.2, -0.9, -0.1])
    assert history.values(ACCELERATIONS)[:, -1] == pytest.approx([-2.0, 2.0, -8.0])


def test_a_time_without_samples_is_empty_and_the_rest_moves_on():
    history = History()
    history.add(20.01, SOMEWHERE, AT_REST, AT_REST)
    history.advance(21.01)
    heights = history.values(HEIGHTS)
    assert np.isnan(heights[:, -20:]).all()
    assert heights[:, -21] == pytest.approx(SOMEWHERE)
    history.advance(40.0)
    assert np.isnan(history.values(HEIGHTS)).all()


def test_a_sample_that_is_late_gets_its_own_place():
    history = History()
    history.add(20.01, SOMEWHERE, AT_REST, AT_REST)
    history.advance(20.51)
    history.add(20.26, (0.7, 0.8, 0.9), AT_REST, AT_REST)
    heights = history.values(HEIGHTS)
    assert heights[:, -11] == pytest.approx(SOMEWHERE)
    assert heights[:, -6] == pytest.approx((0.7, 0.8, 0.9))
    assert np.isnan(heights[:, -1]).all()


def test_a_clock_that_goes_back_starts_anew():
    history = History()
    history.add(20.0, SOMEWHERE, AT_REST, AT_REST)
    history.add(3.0, SOMEWHERE, AT_REST, AT_REST)
    assert np.isfinite(history.values(HEIGHTS)).sum() == 3


def test_nothing_is_shown_before_the_first_sample():
    for quantity in (HEIGHTS, VELOCITIES, ACCELERATIONS):
        assert np.isnan(History().values(quantity)).all()
    assert math.isclose(History().ages[1] - History().ages[0], BIN)


GRAVITY = (0.1, -0.2, 9.81)  # m/s^2, with the errors of a sensor


def swung(times, frequency, amplitude=3.0):
    """Return what an accelerometer tells of a swing along x. Shape (n, 3) [m/s^2]."""
    told = np.tile(GRAVITY, (len(times), 1))
    told[:, 0] += amplitude * np.sin(math.tau * frequency * times)
    return told


@pytest.mark.parametrize("rate", [200.0, 500.0, 2000.0])
@pytest.mark.parametrize("frequency", [8.0, 15.0, 60.0])
def test_a_swing_keeps_its_frequency_and_size_at_any_rate(rate, frequency):
    history = SwingHistory()
    times = 987.6543 + np.arange(round(6.0 * rate)) / rate
    for part in np.array_split(times, 200):
        history.add(part, swung(part, frequency))
    x, y, z = history.values()
    assert history.ages.shape == x.shape == (round(SWING_SPAN / SWING_BIN),)
    # A bin stands for a moment anywhere in it.
    assert strongest_frequency(history.ages, x) == pytest.approx(frequency, rel=0.01)
    assert np.nanmax(np.abs(x)) == pytest.approx(3.0, rel=0.06)
    # Gravity and the errors of the sensor are gone.
    assert np.nanmax(np.abs([y, z])) < 1e-9


def test_no_peak_of_a_swing_is_lost():
    history = SwingHistory()
    times = 50.0 + np.arange(10_000) / 5000.0
    told = np.tile(GRAVITY, (len(times), 1))
    told[7777] += (0.0, -40.0, 0.0)
    told[8888] += (0.0, 0.0, 30.0)
    history.add(times, told)
    _, y, z = history.values()
    assert np.nanmin(y) == pytest.approx(-40.0)
    assert np.nanmax(z) == pytest.approx(30.0)


def test_samples_without_a_meaning_are_left_out():
    history = SwingHistory()
    times = np.array([10.0, 20.0, 20.001, 20.5, 99.0])
    told = np.ones((5, 3))
    told[2, 1], told[4] = math.nan, math.inf
    history.add(times, told)
    values = history.values()
    # The newest that is finite is at 20.5 s, and that of 10 s is too old.
    assert np.flatnonzero(np.isfinite(values[0])).size == 2
    assert np.isfinite(values[:, -1]).all()
    history.advance(40.0)
    assert np.isnan(history.values()).all()
