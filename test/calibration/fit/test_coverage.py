"""The intervals that are told hold the truth."""

from dataclasses import replace

import numpy as np
import pytest
from soak import some

from testing.calibration_coverage import CASES, changed, coverage, seven_touches
from testing.wrong_machines import NOMINAL, RADIUS, TOUCH, WRONG_BY, drawn, ring
from tri_glide_kinematics.calibration.fit import MachineParameters, Plate, Priors, Touch, calibrate
from tri_glide_kinematics.tri_glide import TriGlide

GEOMETRY = NOMINAL.geometry


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_about_95_of_100_errors_lie_inside_the_interval_that_is_told(case):
    found = coverage(case, 12, seed=3)
    assert found.inside > 0.85
    # Nothing is wrong with a measurement, and where priors are given they allow these machines.
    assert found.dropped <= 1 and found.refused == 0


def test_a_wrong_radius_is_found_and_no_touch_is_blamed():
    rng = np.random.default_rng(1)
    machine = changed(radius=-1.8e-3)
    for deviation in (TOUCH, 5.0 * TOUCH):
        touches = [
            replace(one, standard_deviation=deviation) for one in seven_touches(machine, rng)
        ]
        result = calibrate(GEOMETRY, touches)
        assert result.outliers == () and not result.is_contradicted
        assert np.abs(machine.errors(result.machine)[:, 2]).max() < 5e-5
        # Who says that such a radius cannot be is told of the other way out.
        narrow = replace(Priors(3e-4, 3e-4, 1e-4), common_radius=1e-4, common_arm_length=1e-4)
        doubted = calibrate(GEOMETRY, touches, priors=narrow)
        assert doubted.is_contradicted or any(
            "or the machine is farther off than the priors say" in text for text in doubted.warnings
        )


def test_directions_that_the_data_do_not_determine_are_as_uncertain_as_the_priors():
    machine, rng = drawn(2)
    result = calibrate(GEOMETRY, machine.touches(rng), priors=WRONG_BY)
    shift = np.zeros(12)
    shift[:6:2] = 1.0 / np.sqrt(3.0)
    assert np.sqrt(shift @ result.covariance @ shift) == pytest.approx(WRONG_BY.anchors, rel=1e-6)


def test_what_is_common_is_a_prior_of_its_own():
    common = Priors(1e-3, 5e-4, 2e-3, common_radius=2e-3, common_arm_length=3e-3)
    covariance = common.covariance(NOMINAL.vector)
    outwards = np.zeros(12)
    anchors = np.array(GEOMETRY.anchors)
    outwards[:6] = (anchors / np.linalg.norm(anchors, axis=1, keepdims=True)).ravel() / np.sqrt(3.0)
    assert outwards @ covariance @ outwards == pytest.approx(1e-6 + 3.0 * 4e-6)
    arms = np.repeat([0.0, 1.0, 0.0], [6, 3, 3]) / np.sqrt(3.0)
    assert arms @ covariance @ arms == pytest.approx(25e-8 + 3.0 * 9e-6)
    assert np.sqrt(np.diag(covariance))[9:] == pytest.approx([2e-3] * 3)


def bowed(rng, nominal):
    """Touches of a bed that is 0.1 mm higher in the middle, on a machine as it was drawn."""
    kinematics = TriGlide(nominal.geometry)
    places = [(0.0, 0.0), *ring(0.1, 6)]
    heights = [1e-4 * (1.0 - (x * x + y * y) / 0.01) for x, y in places]
    return [
        Touch(kinematics.inverse((x, y, z + TOUCH * rng.standard_normal())), Plate(), TOUCH)
        for (x, y), z in zip(places, heights)
    ]


def test_six_calibrations_in_a_row_on_a_bowed_bed_do_not_drift():
    anchors = [(0.14 * np.cos(a), 0.14 * np.sin(a)) for a in np.radians([90.0, 210.0, 330.0])]
    drawing = MachineParameters(type(GEOMETRY)(anchors, [0.288] * 3))
    rng = np.random.default_rng(1)
    believed, priors, found = drawing, Priors(), []
    for _ in range(6):
        offsets = believed.height_offsets
        result = calibrate(
            believed.geometry, bowed(rng, drawing), (), (), priors, height_offsets=offsets
        )
        believed, priors = result.machine, result.priors
        found.append(believed.vector - drawing.vector)
        assert priors.mean == drawing
    assert np.abs(np.array(found)[:, 6:9]).max() < 1.5e-4
    # The last is no farther off than the first, but for noise.
    assert np.abs(found[-1] - found[0]).max() < 1e-4


def test_a_bad_residual_that_the_machine_leaves_is_told():
    rng = np.random.default_rng(4)
    machine = changed(radius=-1.5e-3)
    # A third of the touches may be wrong, but not left out: nothing is left that would check them.
    touches = machine.touches(rng, [(0.0, 0.0), *ring(RADIUS, 6)])
    touches[1:4] = [
        replace(one, heights=tuple(h + 1e-3 for h in one.heights)) for one in touches[1:4]
    ]
    narrow = replace(Priors(1e-6, 1e-6, 1e-6), common_radius=0.0, common_arm_length=0.0)
    result = calibrate(GEOMETRY, touches, priors=narrow)
    off = [text for text in result.warnings if " off on this machine, " in text]
    assert result.is_contradicted or off


@pytest.mark.slow
@pytest.mark.parametrize("priors", [Priors(), WRONG_BY, None])
def test_deviations_that_are_ten_times_too_small_have_an_answer(priors):
    for seed in some(range(20), 2):
        machine, rng = drawn(seed)
        touches = [replace(one, standard_deviation=TOUCH / 10.0) for one in machine.touches(rng)]
        distances = [replace(one, standard_deviation=5e-6) for one in machine.one_distance(rng)]
        for lengths in (distances, ()):
            assert calibrate(GEOMETRY, touches, (), lengths, priors).warnings
