"""The table of calibrations at a small count: the goals that hold for each machine."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.calibration import again_and_again, with_an_outlier, with_priors, without_priors


def numbers(row):
    """Return the numbers of what was measured."""
    words = row.ours.replace("%", " ").replace(",", " ").split()
    return [float(word) for word in words if word.replace(".", "").isdigit()]


@pytest.mark.slow
def test_truth_lies_inside_and_errors_are_as_predicted():
    count = 60
    inside, spread, worst, usual, _ = list(with_priors(count, np.random.default_rng(1)))[:5]
    # 95 % within three standard deviations of so many draws, and the same for the spread.
    assert numbers(inside)[0] >= 86.0
    assert numbers(spread) == pytest.approx([1.0] * 3, abs=0.2)
    across, along = numbers(worst)
    assert across < 60.0 and along < 15.0
    assert usual.is_reached


@pytest.mark.slow
def test_touches_alone_name_what_is_free_and_do_no_harm():
    rows = list(without_priors(40, np.random.default_rng(2)))
    assert [numbers(row)[0] for row in rows[::2]] == [100.0, 100.0]
    assert all(numbers(row)[0] >= 95.0 for row in rows[1::2])


@pytest.mark.slow
def test_again_and_again_does_not_wander():
    assert all(row.is_reached for row in again_and_again(1, np.random.default_rng(3)))


@pytest.mark.slow
def test_a_wrong_measurement_is_named_and_does_no_harm():
    rows = list(with_an_outlier(28, np.random.default_rng(4)))
    assert all(row.is_reached for row in rows)
