"""Bad data get a clear word before anything is fitted."""

from dataclasses import replace

import numpy as np
import pytest

from testing.wrong_machines import NOMINAL, PLACES, TOUCH, WrongMachine
from tri_glide_kinematics.calibration import (
    CalibrationError,
    Distance,
    MeasuredPosition,
    Plate,
    Touch,
)
from tri_glide_kinematics.calibration.fit import (
    MachineParameters,
    NoMachineThereError,
    OnePlaceError,
    TooFewMeasurementsError,
    WrongUnitError,
    calibrate,
    check_machine,
)
from tri_glide_kinematics.tri_glide import TriGlideGeometry

GEOMETRY = NOMINAL.geometry
RNG = np.random.default_rng(1)
MACHINE = WrongMachine.random(RNG)
TOUCHES = MACHINE.touches(RNG)
DISTANCES = MACHINE.one_distance(RNG)


def scaled(touch, factor):
    """Return a touch with heights in another unit."""
    return replace(touch, heights=tuple(factor * h for h in touch.heights))


def test_too_few_measurements_are_refused():
    with pytest.raises(TooFewMeasurementsError, match="0 measured numbers: at least 3"):
        calibrate(GEOMETRY)
    with pytest.raises(TooFewMeasurementsError, match="2 measured numbers"):
        calibrate(GEOMETRY, TOUCHES[:2])
    free = Plate("table", None, None)
    touches = [replace(one, plate=free) for one in TOUCHES]
    with pytest.raises(TooFewMeasurementsError, match="2 touches of plate 'table': at least 3"):
        calibrate(GEOMETRY, [*TOUCHES, *touches[:2]])
    with pytest.raises(TooFewMeasurementsError, match=r"5 .* at least 6 .*3 are taken by plates"):
        calibrate(GEOMETRY, touches[:5])
    assert calibrate(GEOMETRY, touches[:6]).plates["table"].height is not None
    seen = [MACHINE.position((x, y, 0.1), RNG, "camera") for x, y in PLACES[:4]]
    with pytest.raises(TooFewMeasurementsError, match="2 positions in frame 'camera'"):
        calibrate(GEOMETRY, TOUCHES, seen[1:3])


def test_measurements_in_one_place_are_refused():
    touches = [MACHINE.touch(0.05 + 1e-4 * i, 0.02, RNG) for i in range(10)]
    with pytest.raises(OnePlaceError, match=r"all 10 measurements .* spread them over 24 mm"):
        calibrate(GEOMETRY, touches)


HIGH = Plate("bed", 50.0)


@pytest.mark.parametrize(
    ("change", "question"),
    [
        (lambda: {"touches": [*TOUCHES[1:], scaled(TOUCHES[0], 1000.0)]}, "in millimetres"),
        (
            lambda: {"touches": [scaled(one, 1e-3) for one in TOUCHES], "distances": ()},
            "largest height .*in metres",
        ),
        (
            lambda: {"touches": [replace(one, standard_deviation=10.0) for one in TOUCHES]},
            "standard deviation of touch 1 = 10 m, .*in millimetres",
        ),
        (
            lambda: {"touches": [replace(one, standard_deviation=1e-8) for one in TOUCHES]},
            "standard deviation of touch 1 = 1e-08 m, .*in metres",
        ),
        (
            lambda: {"distances": [replace(DISTANCES[0], distance=240.0)]},
            "length of distance 1 = 240 m, the longest arm 0.4 m: is it in millimetres",
        ),
        (lambda: {"distances": [replace(DISTANCES[0], distance=240e-6)]}, "0.00024 m, .*in metres"),
        (
            lambda: {"positions": [MeasuredPosition(TOUCHES[0].heights, (0.0, 120.0, 0.0))]},
            "coordinate of position 1 = 120 m, .*in millimetres",
        ),
        (lambda: {"touches": [replace(o, plate=HIGH) for o in TOUCHES]}, "plate 'bed' = 50 m"),
    ],
)
def test_units_that_are_wrong_by_a_thousand_are_asked_about(change, question):
    with pytest.raises(WrongUnitError, match=question):
        calibrate(GEOMETRY, **{"touches": TOUCHES, "distances": DISTANCES, **change()})


def test_a_measurement_of_another_machine_is_refused():
    with pytest.raises(NoMachineThereError, match=r"touch 14 .* arms do not meet"):
        calibrate(GEOMETRY, [*TOUCHES, Touch((0.1, 0.6, 0.6), Plate(), TOUCH)])
    with pytest.raises(NoMachineThereError, match=r"touch 14 .* 0\.3\d+ m off"):
        calibrate(GEOMETRY, [*TOUCHES, Touch((0.7, 0.7, 0.7), Plate(), TOUCH)])
    with pytest.raises(NoMachineThereError, match="distance 1"):
        calibrate(GEOMETRY, TOUCHES, (), [replace(DISTANCES[0], distance=0.4)])


def test_one_plate_is_one_plate():
    touches = [*TOUCHES, replace(TOUCHES[0], plate=Plate("bed", 0.01))]
    with pytest.raises(CalibrationError, match="two plates have the name 'bed'"):
        calibrate(GEOMETRY, touches)


def test_ends_of_a_distance_in_one_place_are_no_crash():
    heights = TOUCHES[0].heights
    result = calibrate(GEOMETRY, TOUCHES, (), [Distance(heights, heights, 0.01, 5e-5)])
    assert result.outliers == ("distance 1",)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1000.0, r"nominal anchor 1 y = .* m, at most 10 m is expected, .*: is it in millimetres"),
        (0.001, r"nominal arm length 1 = .* m, .* at least 0.001 m: is it in metres"),
    ],
)
def test_a_machine_in_another_unit_is_asked_about(factor, words):
    """All of the file is in it, so that nothing else contradicts anything."""
    anchors = [[factor * value for value in anchor] for anchor in GEOMETRY.anchors]
    arms = [factor * arm for arm in GEOMETRY.arm_lengths]
    check_machine(MachineParameters(GEOMETRY))
    with pytest.raises(WrongUnitError, match=words):
        check_machine(MachineParameters(TriGlideGeometry(anchors, arms)))
