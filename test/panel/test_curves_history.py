"""History: bins of the last ten seconds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tri_glide_kinematics.panel.curves import (
    ACCELERATIONS,
    BIN,
    HEIGHTS,
    SPAN,
    VELOCITIES,
    History,
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
