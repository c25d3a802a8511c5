"""Curves on a real page server: what is sent to be drawn, how often, and what it costs."""

from __future__ import annotations

import numpy as np
import pytest

from tri_glide_kinematics.panel.tabs.curves import SWING_SPAN, CurveLimits, Curves, SwingCurves

viser = pytest.importorskip("viser")

LIMITS = CurveLimits((0.3, 0.3, 0.3), (0.9, 0.9, 0.9), (1.0, 1.0, 1.0), (10.0, 10.0, 10.0))


@pytest.fixture
def curves(server):
    with server.gui.add_folder("curves"):
        return Curves(server.gui, LIMITS)


def test_curves_and_limits_are_drawn_in_their_units(curves):
    curves.history.add(5.0, (0.4, 0.5, 0.6), (0.1, -0.2, 0.3), (1.0, 2.0, -3.0))
    curves.draw(5.0)
    newest = [[column[-1] for column in plot.data] for plot in curves.plots]
    assert newest[0] == pytest.approx([0.0, 400.0, 500.0, 600.0, 300.0, 900.0])
    assert newest[1] == pytest.approx([0.0, 100.0, -200.0, 300.0, -1000.0, 1000.0])
    assert newest[2] == pytest.approx([0.0, 1.0, 2.0, -3.0, -10.0, 10.0])
    for plot in curves.plots:
        assert len(plot.series) == len(plot.data)
        low, high = plot.scales["y"]["range"]
        assert all(low < np.nanmin(column) for column in plot.data[1:])
        assert all(np.nanmax(column) < high for column in plot.data[1:])


def test_a_few_times_a_second_and_on_without_samples(curves):
    curves.history.add(100.0, (0.4, 0.5, 0.6), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    changes, before = 0, None
    for step in range(300):
        curves.draw(100.0 + step / 100.0)
        newest = np.flatnonzero(np.isfinite(curves.plots[0].data[1]))[-1]
        changes += newest != before
        before = newest
    assert 10 <= changes <= 13


def test_each_limit_has_a_line_and_new_limits_take_their_place(curves):
    order = [plot.order for plot in curves.plots]
    curves.set_limits(CurveLimits((0.3, 0.2, 0.3), (0.9,) * 3, (1.0, 2.0, 3.0), (5.0,) * 3))
    heights, velocities, accelerations = (
        [column[0] for column in plot.data[4:]] for plot in curves.plots
    )
    assert heights == pytest.approx([200.0, 300.0, 900.0])
    assert velocities == pytest.approx([-3000.0, -2000.0, -1000.0, 1000.0, 2000.0, 3000.0])
    assert accelerations == pytest.approx([-5.0, 5.0])
    assert [plot.order for plot in curves.plots] == order
    plots = list(curves.plots)
    curves.set_limits(CurveLimits((0.3, 0.2, 0.3), (0.9,) * 3, (1.0, 2.0, 3.0), (5.0,) * 3))
    assert curves.plots == plots


def test_many_samples_cost_no_more_than_a_few(curves):
    """What is sent in a second is the same at each rate of samples."""
    plot, sent = curves.plots[0], {}
    for rate in (10, 500):
        begin, last = 1e4 * rate, plot.data
        sent[rate] = 0
        for step in range(3 * rate):
            now = begin + step / rate
            curves.history.add(
                now, (0.4, 0.5, 0.6), (np.sin(now), 0.2, 0.3), (np.cos(now), 0.0, 0.0)
            )
            curves.draw(now)
            if plot.data is not last:
                last = plot.data
                sent[rate] += sum(map(len, last))
    assert 0 < sent[500] <= 1.5 * sent[10]


@pytest.fixture
def swing(server):
    with server.gui.add_folder("swing"):
        return SwingCurves(server.gui)


def shaken(times, size=3.0):
    """Return accelerations along x, beside gravity. Shape (n, 3) [m/s^2]."""
    return np.column_stack((size * np.sin(94.0 * times), 0.0 * times, 9.81 + 0.0 * times))


def test_a_swing_is_seen_as_long_as_it_is_told(swing):
    assert not swing.draw(10.0)
    assert not swing.plot.visible
    times = 10.0 + np.arange(500) / 500.0
    swing.history.add(times, shaken(times))
    assert swing.draw(11.0)
    assert swing.plot.visible
    ages, x, y, z = swing.plot.data
    assert ages[-1] == pytest.approx(0.0, abs=0.01)
    assert np.abs(x).max() == pytest.approx(3.0, rel=0.05)
    assert np.abs([y, z]).max() < 1e-9
    # An accelerometer that has ended leaves no plot behind.
    assert swing.draw(10.9 + SWING_SPAN)
    assert not swing.draw(12.0 + SWING_SPAN)
    assert not swing.plot.visible


@pytest.mark.parametrize(
    ("size", "largest"), [(0.0, 1.0), (0.9, 1.0), (1.1, 2.0), (30.0, 32.0), (1e300, 2.0**20)]
)
def test_the_range_holds_the_largest_acceleration(swing, size, largest):
    times = 10.0 + np.arange(1000) / 500.0
    swing.history.add(times, shaken(times, size))
    swing.draw(12.0)
    assert swing.plot.scales["y"]["range"] == (-largest, largest)


def test_a_slow_sensor_makes_one_curve(swing):
    times = 10.0 + np.arange(100) / 60.0
    swing.history.add(times, shaken(times))
    swing.draw(12.0)
    ages, x, *_ = swing.plot.data
    assert ages == pytest.approx(times - 12.0, abs=0.01)
    assert np.isfinite(x).all()
