"""Curves of the last seconds on a real page server: what is drawn, how often, and what it costs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from testing.swings import strongest_frequency
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.settings import IK_NODE

viser = pytest.importorskip("viser")

from tri_glide_kinematics.panel.tabs.curves import (  # noqa: E402
    BIN,
    RECORDED,
    SPAN,
    SWING_SPAN,
    Curves,
    History,
    SwingCurves,
)

FACTS = MachineFacts({parameter.name: parameter.default for parameter in IK_NODE})
AT_REST = (0.0, 0.0, 0.0)
SOMEWHERE = SliderState((0.4, 0.5, 0.6), AT_REST, AT_REST)
ELSEWHERE = SliderState((0.7, 0.8, 0.9), AT_REST, AT_REST)


@pytest.fixture
def curves(server):
    with server.gui.add_folder("curves"):
        return Curves(server.gui)


def drawn(curves, time, facts=FACTS):
    """Return ages, shape (n,), and what is drawn of the sliders at a time [s], shape (3, 3, n)."""
    curves._pace.hurry()
    curves.draw(time, facts)
    data = [plot.handle.data for plot in curves.plots]
    return data[0][0], np.array([columns[1:4] for columns in data])


def swing(time):
    """Heights, velocities and accelerations of three sliders that swing at different rates."""
    rates = np.array([1.0, 2.0, 3.0])
    phases = rates * time
    motion = np.sin(phases), rates * np.cos(phases), -(rates**2) * np.sin(phases)
    heights, velocities, accelerations = (tuple(0.1 * each) for each in motion)
    return SliderState(tuple(0.6 + np.array(heights)), velocities, accelerations)


@pytest.mark.parametrize("rate", [25.0, 30.0, 500.0])
def test_curves_are_the_last_ten_seconds_at_any_rate(curves, rate):
    times = 1234.5678 + np.arange(round(13.0 * rate)) / rate
    for part in np.array_split(times, 100):
        curves.take((time, swing(time)) for time in part)
    ages, shown = drawn(curves, times[-1])
    assert ages[-1] == 0.0
    assert ages[0] == pytest.approx(-SPAN, abs=1.5 * BIN)
    wanted = np.array([swing(times[-1] + age) for age in ages]) * np.c_[[1e3, 1e3, 1.0]]
    # A bin is as wide as it is, and stands for a moment anywhere in it.
    steepest = 0.1 * np.array([3e3, 9e3, 27.0])[:, np.newaxis, np.newaxis]
    assert (np.abs(shown - np.moveaxis(wanted, 0, -1)) <= steepest * 2.0 * BIN).all()


def test_a_bin_holds_what_is_nearest_to_a_limit(curves):
    curves.take([(10.001, SliderState((0.2,) * 3, (0.2, -0.9, 0.0), (1.0, 2.0, -8.0)))])
    curves.take([(10.002, SliderState((0.2, 0.3, 0.4), (0.1, 0.3, -0.1), (-2.0, 1.0, 7.0)))])
    _, shown = drawn(curves, 10.0)
    newest = [(200.0, 300.0, 400.0), (200.0, -900.0, -100.0), (-2.0, 2.0, -8.0)]
    assert shown[..., -1] == pytest.approx(np.array(newest))


def test_a_time_without_samples_is_empty_and_the_rest_moves_on(curves):
    curves.take([(20.01, SOMEWHERE)])
    _, (heights, *_) = drawn(curves, 21.01)
    assert np.isnan(heights[:, -20:]).all()
    assert heights[:, -21] == pytest.approx((400.0, 500.0, 600.0))
    assert np.isnan(drawn(curves, 40.0)[1]).all()


def test_a_sample_that_is_late_gets_its_own_place(curves):
    curves.take([(20.01, SOMEWHERE)])
    drawn(curves, 20.51)
    curves.take([(20.26, ELSEWHERE)])
    _, (heights, *_) = drawn(curves, 20.51)
    assert heights[:, -11] == pytest.approx((400.0, 500.0, 600.0))
    assert heights[:, -6] == pytest.approx((700.0, 800.0, 900.0))
    assert np.isnan(heights[:, -1]).all()


def test_between_two_equal_samples_is_no_hole(curves):
    for time in (20.01, 20.51):
        curves.take([(time, SOMEWHERE)])
    curves.take([(20.91, ELSEWHERE)])
    _, (heights, *_) = drawn(curves, 20.91)
    assert np.isfinite(heights[0]).sum() == 11 + 1


def test_a_clock_that_goes_back_starts_anew(curves):
    for time in (20.0, 3.0):
        curves.take([(time, SOMEWHERE)])
    _, (heights, *_) = drawn(curves, 3.0)
    assert np.isfinite(heights).sum() == 3


def test_limits_are_drawn_in_their_units_and_new_ones_take_their_place(curves):
    assert not any(plot.handle.visible for plot in (*curves.plots, curves.lag))
    limits = {
        "lower_heights": (0.3, 0.2, 0.3),
        "velocity_limits": (1.0, 2.0, 3.0),
        "acceleration_limits": (5.0,) * 3,
    }
    drawn(curves, 5.0)
    drawn(curves, 5.0, FACTS.with_changes(limits))
    wanted = ({200.0, 300.0, 900.0}, {-3e3, -2e3, -1e3, 1e3, 2e3, 3e3}, {-5.0, 5.0})
    for plot, ends in zip(curves.plots, wanted):
        handle = plot.handle
        assert handle.visible
        assert len(handle.series) == len(handle.data)
        assert {round(column[0], 6) for column in handle.data[4:]} == ends
        low, high = handle.scales["y"]["range"]
        assert low < min(ends) and max(ends) < high
    assert not curves.lag.handle.visible


def test_a_recording_is_drawn_in_place_of_the_last_seconds(curves):
    curves.take([(20.0, SOMEWHERE)])
    curves.recorded = History(RECORDED, SPAN, BIN)
    told = np.repeat((0.7, 0.1, 2.0, 0.0004), 3)
    # In a fault, nothing may be measured.
    told[-1] = math.nan
    curves.recorded.add(np.array([3.0]), told[np.newaxis])
    _, shown = drawn(curves, 20.0)
    assert shown[:, 0, -1] == pytest.approx((700.0, 100.0, 2.0))
    assert np.isfinite(shown).sum() == 9
    lag = np.array(curves.lag.handle.data)[1:, -1]
    assert lag == pytest.approx((0.4, 0.4, math.nan), nan_ok=True)
    assert curves.lag.handle.visible
    curves.recorded = None
    drawn(curves, 20.0)
    assert not curves.lag.handle.visible


def test_a_few_times_a_second_and_on_without_samples(curves):
    curves.take([(100.0, SOMEWHERE)])
    changes, before = 0, None
    for step in range(300):
        curves.draw(100.0 + step / 100.0, FACTS)
        newest = np.flatnonzero(np.isfinite(curves.plots[0].handle.data[1]))[-1]
        changes += newest != before
        before = newest
    assert 10 <= changes <= 13


def test_many_samples_cost_no_more_than_a_few(curves):
    """What is sent in a second is the same at each rate of samples."""
    plot, sent = curves.plots[0].handle, {}
    for rate in (10, 500):
        begin, last = 1e4 * rate, plot.data
        sent[rate] = 0
        for step in range(3 * rate):
            now = begin + step / rate
            curves.take([(now, SOMEWHERE._replace(velocities=(math.sin(now), 0.2, 0.3)))])
            curves.draw(now, FACTS)
            if plot.data is not last:
                last = plot.data
                sent[rate] += sum(map(len, last))
    assert 0 < sent[500] <= 1.5 * sent[10]


GRAVITY = (0.1, -0.2, 9.81)  # m/s^2, with the errors of a sensor


@pytest.fixture
def felt(server):
    with server.gui.add_folder("swing"):
        return SwingCurves(server.gui)


def swung(times, frequency=15.0, amplitude=3.0):
    """Return what an accelerometer tells of a swing along x. Shape (n, 3) [m/s^2]."""
    told = np.tile(GRAVITY, (len(times), 1))
    told[:, 0] += amplitude * np.sin(math.tau * frequency * times)
    return told


@pytest.mark.parametrize("rate", [200.0, 500.0, 2000.0])
@pytest.mark.parametrize("frequency", [8.0, 15.0, 60.0])
def test_a_swing_keeps_its_frequency_and_size_at_any_rate(felt, rate, frequency):
    times = 987.6543 + np.arange(round(6.0 * rate)) / rate
    for part in np.array_split(times, 200):
        felt.take(part, swung(part, frequency))
    felt.draw(times[-1])
    ages, x, y, z = felt.plot.handle.data
    assert np.isfinite([x, y, z]).all()
    # Gravity and the errors of the sensor are gone.
    assert np.abs([y, z]).max() < 1e-9
    # A bin stands for a moment anywhere in it.
    assert strongest_frequency(ages, x) == pytest.approx(frequency, rel=0.01)
    assert np.abs(x).max() == pytest.approx(3.0, rel=0.06)


def test_a_slow_sensor_makes_one_curve(felt):
    times = 10.0 + np.arange(100) / 60.0
    felt.take(times, swung(times))
    felt.draw(12.0)
    ages, x, *_ = felt.plot.handle.data
    assert ages == pytest.approx(times - 12.0, abs=0.01)
    assert np.isfinite(x).all()


def test_no_peak_of_a_swing_is_lost_and_what_has_no_meaning_is_left_out(felt):
    times = 50.0 + np.arange(10_000) / 5000.0
    told = swung(times, amplitude=0.0)
    told[7777] += (0.0, -40.0, 0.0)
    told[8888] += (0.0, 0.0, 30.0)
    # One that is too old, and two without numbers, of which one is far ahead.
    others = np.array([10.0, 51.0001, 99.0])
    felt.take(others, np.array([GRAVITY, (9.0, math.nan, 0.0), (math.inf, 0.0, 0.0)]))
    felt.take(times, told)
    felt.draw(times[-1])
    ages, x, y, z = felt.plot.handle.data
    assert (y.min(), z.max(), np.abs(x).max()) == pytest.approx((-40.0, 30.0, 0.0))
    assert len(ages) == pytest.approx(500, abs=1)


def test_a_swing_is_seen_as_long_as_it_is_told(felt):
    assert not felt.draw(10.0)
    assert not felt.plot.handle.visible
    times = 10.0 + np.arange(500) / 500.0
    felt.take(times, swung(times))
    assert felt.draw(11.0)
    assert felt.plot.handle.visible
    assert felt.plot.handle.data[0][-1] == pytest.approx(0.0, abs=0.01)
    # An accelerometer that has ended leaves no plot behind.
    assert felt.draw(10.9 + SWING_SPAN)
    assert not felt.draw(12.0 + SWING_SPAN)
    assert not felt.plot.handle.visible


@pytest.mark.parametrize(
    ("size", "largest"), [(0.0, 1.0), (0.9, 1.0), (1.1, 2.0), (30.0, 32.0), (1e300, 2.0**20)]
)
def test_the_range_holds_the_largest_acceleration(felt, size, largest):
    times = 10.0 + np.arange(1000) / 500.0
    felt.take(times, swung(times, amplitude=size))
    felt.draw(12.0)
    assert felt.plot.handle.scales["y"]["range"] == (-largest, largest)
