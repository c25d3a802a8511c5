"""What a calibration says of itself: its standard deviations, and what its priors deny."""

from dataclasses import replace

import numpy as np
import pytest
from soak import some

from testing.wrong_machines import NOMINAL, WRONG_BY, drawn
from tri_glide_kinematics.calibration.fit import Plate, Priors, WrongUnitError, calibrate

GEOMETRY = NOMINAL.geometry


def measured(seed, height=0.0):
    """Return touches of a plate that is believed to be at this height, and a distance."""
    machine, rng = drawn(seed)
    plate = Plate("bed", height)
    touches = [replace(one, plate=plate) for one in machine.touches(rng)]
    return touches, machine.one_distance(rng)


@pytest.mark.parametrize("seed", range(3))
def test_a_plate_that_is_5_mm_wrong_contradicts_the_priors(seed):
    touches, distances = measured(seed, 5e-3)
    result = calibrate(GEOMETRY, touches, (), distances, WRONG_BY)
    assert result.is_contradicted and not result.has_gross_residuals
    (name, size), *others = result.far_from_priors.items()
    # Three offsets of 1 mm each, together.
    assert name == "shifting along z (all height offsets together)"
    assert size == pytest.approx(5.0 * np.sqrt(3.0), abs=3.0)
    assert all(other.startswith("height offset") for other, _ in others)
    # Who assumes nothing, or says that it may be so, is not contradicted.
    wide = replace(WRONG_BY, height_offsets=5e-3)
    for priors in (wide, None):
        result = calibrate(GEOMETRY, touches, (), distances, priors)
        assert result.far_from_priors == {} and not result.is_contradicted


def test_machines_as_the_priors_say_are_not_contradicted():
    for seed in some(range(40), 15):
        touches, distances = measured(seed)
        assert not calibrate(GEOMETRY, touches, (), distances, WRONG_BY).is_contradicted


def test_priors_of_another_unit_are_asked_about():
    touches, distances = measured(1)
    with pytest.raises(WrongUnitError, match=r"of anchors in the priors = 10000 m, .*millimetres"):
        calibrate(GEOMETRY, touches, (), distances, replace(WRONG_BY, anchors=1e4))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("spread", [1e-6, 0.4])
def test_deviations_are_numbers_however_narrow_or_wide_the_priors_are(spread):
    touches, distances = measured(2)
    result = calibrate(GEOMETRY, touches, (), distances, Priors(spread, spread, spread))
    places = [(0.0, 0.0, 0.0), (0.1, -0.05, 0.1)]
    for values in (
        result.standard_deviations,
        result.position_uncertainties(places),
        result.position_uncertainties(places, aligned=True),
    ):
        assert np.isfinite(values).all() and (values > 0.0).all()
    np.testing.assert_allclose(
        result.standard_deviations, np.sqrt(np.diag(result.covariance)), rtol=1e-6
    )
