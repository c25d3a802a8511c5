"""The table of calibrations at a small count: the goals that hold for each machine."""

from __future__ import annotations

import numpy as np
import pytest
from soak import some

from benchmarks.calibration import with_priors, without_priors
from benchmarks.touch_places import largest_errors
from testing.wrong_machines import (
    IN_RINGS,
    NOMINAL,
    PLACES,
    RADIUS,
    WRONG_BY,
    WrongMachine,
    ring,
)
from tri_glide_kinematics.calibration.fit import calibrate

# Of the largest error along z, as ``python -m benchmarks.touch_places`` finds it [m].
LEAST = 12.37e-6


def numbers(row):
    """Return the numbers of what was measured."""
    words = row.ours.replace("%", " ").replace(",", " ").split()
    return [float(word) for word in words if word.replace(".", "").isdigit()]


@pytest.mark.slow
def test_truth_lies_inside_and_errors_are_as_predicted():
    count = len(some(range(60), 15))
    inside, spread, worst, usual, _ = list(with_priors(count, np.random.default_rng(1), LEAST))[:5]
    # 95 % within three standard deviations of so many draws, and the same for the spread.
    assert numbers(inside)[0] >= 95.0 - 300.0 * np.sqrt(0.05 * 0.95 / count)
    assert numbers(spread) == pytest.approx([1.0] * 3, abs=1.5 / np.sqrt(count))
    across, along = numbers(worst)
    assert across < 60.0 and along < 15.0
    assert usual.is_reached


@pytest.mark.slow
def test_touches_alone_name_what_is_free_and_do_no_harm():
    count = len(some(range(40), 10))
    rows = list(without_priors(count, np.random.default_rng(2)))
    assert [numbers(row)[0] for row in rows[::2]] == [100.0, 100.0]
    assert all(numbers(row)[0] >= 95.0 for row in rows[1::2])


@pytest.mark.slow
@pytest.mark.parametrize("places", [PLACES, IN_RINGS])
def test_largest_errors_are_those_of_calibrations(places):
    """In the linear model, as large as what is left of machines that were calibrated."""
    rng = np.random.default_rng(5)
    found = []
    count = len(some(range(60), 30))
    for _ in range(count):
        machine = WrongMachine.random(rng)
        touches, distances = machine.touches(rng, places), machine.one_distance(rng)
        result = calibrate(NOMINAL.geometry, touches, (), distances, WRONG_BY)
        found.append(np.abs(machine.errors(result.machine)[:, 2]).max())
    expected = median(places)
    # Two standard deviations of the median of so many.
    assert np.median(found) == pytest.approx(expected, rel=1.16 / np.sqrt(count))


def test_places_in_the_middle_and_on_the_rim_are_as_good_as_any():
    assert median(PLACES) == pytest.approx(LEAST, rel=0.01)
    assert median(PLACES) > 1e-5
    rng = np.random.default_rng(6)
    for count in range(6):
        inside = rng.uniform(0.0, 0.9 * RADIUS)
        assert median([*ring(inside, count), *ring(RADIUS, 13 - count)]) > 0.99 * LEAST


def median(places):
    draws = np.random.default_rng(7).standard_normal((20_000, 12))
    return float(np.median(largest_errors(np.array(places), draws)))
