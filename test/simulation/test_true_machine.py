"""Where a simulated platform truly is, and when it touches."""

import pytest

from tri_glide_kinematics.simulation import SimulatedPlate, TrueMachine
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, NoPoseError, TriGlide

MACHINE = TriGlide(DEFAULT_GEOMETRY)
OFFSETS = (0.001, -0.002, 0.0005)


def test_offsets_are_added_to_what_the_drives_report():
    truth = TrueMachine(MACHINE, OFFSETS)
    heights = MACHINE.inverse((0.03, -0.02, 0.25))
    reported = tuple(height - offset for height, offset in zip(heights, OFFSETS))
    assert truth.position(reported) == pytest.approx((0.03, -0.02, 0.25), abs=1e-12)


def test_arms_that_do_not_meet_are_an_error():
    with pytest.raises(NoPoseError):
        TrueMachine(MACHINE, OFFSETS).position((0.3, 0.3, 1.5))


@pytest.mark.parametrize(
    ("position", "is_touched"),
    [
        ((0.0, 0.0, 0.0501), False),
        ((0.0, 0.0, 0.0499), True),
        ((0.1, 0.0, 0.0509), True),
        ((0.1, 0.0, 0.0511), False),
        ((0.0, 0.1, 0.0479), True),
        ((0.0, 0.1, 0.0481), False),
    ],
)
def test_a_tilted_plate_is_touched_from_above(position, is_touched):
    assert SimulatedPlate(0.05, 0.01, -0.02).is_touched(position) == is_touched


def test_heights_are_those_that_the_drives_would_report():
    truth = TrueMachine(MACHINE, OFFSETS)
    place = (0.03, -0.02, 0.25)
    heights, rates = truth.heights(place, (0.1, -0.2, 0.3))
    assert truth.position(heights) == pytest.approx(place, abs=1e-12)
    later = tuple(height + 1e-6 * rate for height, rate in zip(heights, rates))
    moved = [(b - a) / 1e-6 for a, b in zip(place, truth.position(later))]
    assert moved == pytest.approx((0.1, -0.2, 0.3), abs=1e-5)
