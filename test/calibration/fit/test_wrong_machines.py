"""Calibrations of many wrong machines: the truth lies where the result says, and near."""

import numpy as np
import pytest
from scipy.stats import chi2
from soak import some

from testing.wrong_machines import NOMINAL, REGION, TOUCH, WRONG_BY, WrongMachine
from tri_glide_kinematics.calibration.fit import Plate, Touch, calibrate

GEOMETRY = NOMINAL.geometry
FREE = {"shifting along x", "shifting along y", "turning about z"}


@pytest.mark.slow
def test_truth_lies_inside_and_errors_are_as_predicted():
    """With thirteen touches, one distance, and priors that are right."""
    count, rng = len(some(range(60), 25)), np.random.default_rng(1)
    inside, ratios, sizes = 0, [], []
    for _ in range(count):
        machine = WrongMachine.random(rng)
        touches, distances = machine.touches(rng), machine.one_distance(rng)
        result = calibrate(GEOMETRY, touches, (), distances, WRONG_BY)
        error = result.machine.vector - machine.parameters.vector
        inside += error @ np.linalg.solve(result.covariance, error) <= chi2.isf(0.05, 12)
        errors = machine.errors(result.machine)
        ratios.append(errors / result.position_uncertainties(REGION.places, aligned=True))
        sizes.append(np.column_stack((np.hypot(*errors[:, :2].T), np.abs(errors[:, 2]))))
    # 95 % within three standard deviations of so many draws, and the same for the spread.
    assert inside / count >= 0.95 - 3.0 * np.sqrt(0.05 * 0.95 / count)
    spread = np.sqrt(np.square(ratios).mean(axis=(0, 1)))
    assert spread == pytest.approx([1.0] * 3, abs=1.5 / np.sqrt(count))
    # The worst place of each machine, median of all.
    across, along = np.median(np.max(sizes, axis=1), axis=0)
    assert across < 60e-6 and along < 15e-6
    # The median of all at each place, worst of these.
    across, along = np.median(sizes, axis=0).max(axis=0)
    assert across < 60e-6 and along < 10e-6


@pytest.mark.slow
@pytest.mark.parametrize("plate", [Plate(), Plate("bed", None, None)], ids=["known", "unknown"])
def test_touches_alone_name_what_is_free_and_do_no_harm(plate):
    count, rng = len(some(range(40), 10)), np.random.default_rng(2)
    better = 0
    for _ in range(count):
        machine = WrongMachine.random(rng)
        touches = [Touch(one.heights, plate, TOUCH) for one in machine.touches(rng)]
        result = calibrate(GEOMETRY, touches, priors=None)
        assert {*FREE, "the common scale of anchors and arms"} <= set(result.unidentified)
        before, after = (machine.errors(each) for each in (NOMINAL, result.machine))
        if plate.height is None:
            # Nothing tells their mean height.
            before, after = (each - (0.0, 0.0, each[:, 2].mean()) for each in (before, after))
        better += np.square(after).sum() <= np.square(before).sum()
    assert better >= 0.95 * count
