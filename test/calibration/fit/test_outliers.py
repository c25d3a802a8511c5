"""Measurements that contradict the others are named, and those that agree are not."""

import numpy as np
import pytest
from soak import some

from testing.wrong_machines import NOMINAL, RADIUS, TOUCH, WRONG_BY, drawn, ring
from tri_glide_kinematics.calibration.fit import (
    Distance,
    MeasuredPosition,
    Plate,
    Priors,
    Region,
    Touch,
    calibrate,
    positions_of,
)

GEOMETRY = NOMINAL.geometry


def lifted(touch, error):
    """Return a touch with the platform off the plate."""
    return Touch(tuple(h + error for h in touch.heights), touch.plate, touch.standard_deviation)


def test_what_is_left_out_is_what_a_fit_without_it_says():
    machine, rng = drawn(1)
    touches, distances = machine.touches(rng), machine.one_distance(rng)
    positions = [machine.position((0.05, 0.02, 0.1), rng), machine.position((0.0, 0.0, 0.0), rng)]
    # Priors so wide that all is determined: then the reported machine is the one that is judged.
    wide = Priors(0.05, 0.05, 0.05)
    result = calibrate(GEOMETRY, touches, positions, distances, wide)
    assert result.unidentified == ()
    for wrong in (0, 5, 12):
        less = [one for i, one in enumerate(touches) if i != wrong]
        without = calibrate(GEOMETRY, less, positions, distances, wide)
        assert without.unidentified == ()
        heights = np.array([touches[wrong].heights])
        place = positions_of(without.machine.vector, heights)[0]
        assert result.residuals[wrong].left_out[0] == pytest.approx(place[2], abs=1e-7)


@pytest.mark.parametrize("priors", [WRONG_BY, None])
@pytest.mark.parametrize("plate", [Plate(), Plate("bed", None, None)])
@pytest.mark.parametrize("error", [5e-3, 5e-2])
def test_what_is_far_off_leads_nothing_astray(priors, plate, error):
    machine, rng = drawn(6)
    touches = [Touch(one.heights, plate, TOUCH) for one in machine.touches(rng)]
    touches[7] = lifted(touches[7], error)
    distances = machine.one_distance(rng)
    result = calibrate(GEOMETRY, touches, (), distances, priors)
    assert result.outliers == ("touch 8",)
    residuals = [one.size for one in result.residuals if not one.is_outlier]
    assert len(residuals) == len(touches) and np.nanmax(residuals) < 6.0
    wrong = result.residuals[7]
    assert wrong.is_outlier and wrong.size > 10.0
    assert result.warnings[0].startswith("touch 8 contradicts the others by ")
    reference = calibrate(GEOMETRY, touches[:7] + touches[8:], (), distances, priors)
    np.testing.assert_allclose(result.machine.vector, reference.machine.vector, atol=1e-9)


def test_several_wrong_measurements_of_all_kinds_are_named():
    machine, rng = drawn(3)
    places = Region.of(GEOMETRY).places[:40]
    touches = machine.touches(rng, places[:, :2])
    positions = [machine.position(place, rng) for place in places[5:15]]
    distances = [machine.distance(places[i], places[i + 20], rng) for i in range(1, 8)]
    touches[3], touches[20] = lifted(touches[3], 1e-3), lifted(touches[20], -3e-4)
    one = positions[4]
    x, y, z = one.position
    positions[4] = MeasuredPosition(one.heights, (x + 2e-3, y, z), "base", one.standard_deviation)
    other = distances[2]
    distances[2] = Distance(other.heights_from, other.heights_to, other.distance + 1e-3, 5e-5)
    result = calibrate(GEOMETRY, touches, positions, distances, WRONG_BY)
    assert result.outliers == ("touch 4", "touch 21", "position 5", "distance 3")
    assert np.abs(machine.errors(result.machine)).max() < 1e-4


def test_a_distance_that_alone_knows_the_scale_is_not_checked_by_touches_without_priors():
    machine, rng = drawn(4)
    plate = Plate("bed", None, None)
    touches = [Touch(one.heights, plate, TOUCH) for one in machine.touches(rng)]
    result = calibrate(GEOMETRY, touches, (), machine.one_distance(rng), None)
    assert result.outliers == ()
    for one in result.residuals:
        assert one.size < 6.0 or np.isnan(one.size)


@pytest.mark.parametrize("priors", [Priors(), WRONG_BY])
def test_a_quarter_that_is_wrong_alike_is_named_or_the_result_is_not_valid(priors):
    """Four of sixteen touches, on grains or on a patch of the bed, are higher by 0.3 mm."""
    named = 0
    seeds = some(range(12), 6)
    for seed in seeds:
        machine, rng = drawn(seed)
        places = [(0.0, 0.0), *ring(RADIUS / 2.0, 6), *ring(RADIUS, 9)]
        touches, distances = machine.touches(rng, places), machine.one_distance(rng)
        wrong = rng.choice(16, 4, replace=False).tolist() if seed % 2 else [7, 8, 9, 10]
        for index in wrong:
            touches[index] = lifted(touches[index], 3e-4)
        result = calibrate(GEOMETRY, touches, (), distances, priors)
        assert result.is_contradicted
        named += set(result.outliers) == {f"touch {index + 1}" for index in wrong}
    assert named >= len(seeds) // 3
