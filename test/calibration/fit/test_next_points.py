"""The measurements that are proposed: inside, possible, and worth it."""

import numpy as np
import pytest

from testing.wrong_machines import DISTANCE, NOMINAL, POSITION, RADIUS, TOUCH, WRONG_BY, drawn
from tri_glide_kinematics.calibration.fit import (
    CalibrationError,
    Distance,
    MeasuredPosition,
    Touch,
    calibrate,
)
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.tri_glide import TriGlide

GEOMETRY = NOMINAL.geometry
ALL = {"touch": TOUCH, "position": POSITION, "distance": DISTANCE}
FEW = [(0.0, 0.0), (0.1, 0.0), (-0.05, 0.08), (-0.05, -0.08)]


@pytest.fixture(scope="module")
def start():
    """Return a machine, its first touches and what they say."""
    machine, rng = drawn(1)
    touches = machine.touches(rng, FEW)
    return machine, touches, calibrate(GEOMETRY, touches, priors=WRONG_BY)


def volume(result):
    return np.exp(0.5 * np.linalg.slogdet(result.covariance)[1])


def test_by_default_the_kinds_that_were_measured_are_proposed(start):
    proposals = start[2].next_points(5)
    assert {one.kind for one in proposals} == {"touch"}
    assert {one.target for one in proposals} == {"bed"}
    assert all(one.measurement.standard_deviation == TOUCH for one in proposals)
    volumes = [one.volume for one in proposals]
    assert volumes == sorted(volumes, reverse=True) and volumes[0] < 1.0
    assert len({one.places for one in proposals}) == 5


def test_all_kinds_are_compared_and_a_position_says_most_of_a_shift(start):
    proposals = start[2].next_points(8, kinds=ALL)
    assert proposals[0].kind == "position"
    assert [one.kind for one in start[2].next_points(8, kinds={"distance": DISTANCE})] == [
        "distance"
    ] * 8


def test_the_heights_that_are_proposed_lead_to_the_place(start):
    result = start[2]
    kinematics = TriGlide(result.geometry)
    for one in result.next_points(6, kinds=ALL):
        measurement = one.measurement
        heights = (
            [measurement.heights_from, measurement.heights_to]
            if isinstance(measurement, Distance)
            else [measurement.heights]
        )
        assert isinstance(measurement, (Touch, MeasuredPosition, Distance))
        for reported, place in zip(heights, one.places):
            true = np.add(reported, result.height_offsets)
            assert kinematics.forward(true) == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("kinds", [{"touch": TOUCH}, {"touch": TOUCH, "distance": DISTANCE}])
def test_ten_proposals_are_worth_more_than_twice_ten_random_ones(start, kinds):
    machine, touches, result = start
    rng = np.random.default_rng(2)

    def after(chosen):
        more = [machine.touch(*places[0][:2], rng) for places in chosen if len(places) == 1]
        distances = [machine.distance(*places, rng) for places in chosen if len(places) == 2]
        return volume(calibrate(GEOMETRY, [*touches, *more], (), distances, WRONG_BY))

    def at_random(count):
        places = rng.uniform(-RADIUS, RADIUS, (100, 2))
        inside = places[np.hypot(*places.T) < RADIUS][:count]
        return [(x, y, 0.0) for x, y in inside.tolist()]

    chosen = [one.places for one in result.next_points(10, kinds=kinds)]
    others = [after([at_random(len(places)) for places in chosen]) for _ in range(5)]
    assert after(chosen) < 0.5 * np.median(others)


def test_the_volume_that_is_promised_is_the_one_that_is_reached():
    # All directions are determined by so many positions, so that nothing is left as assumed.
    machine, rng = drawn(3)
    places = [(x, y, z) for x, y in FEW * 4 for z in (0.0, 0.1)]
    wide = type(WRONG_BY)(5e-3, 5e-3, 5e-3)
    positions = [machine.position(place, rng) for place in places]
    result = calibrate(GEOMETRY, positions=positions, priors=wide)
    proposals = result.next_points(4)
    more = [one.measurement for one in proposals]
    again = calibrate(GEOMETRY, positions=[*positions, *more], priors=wide)
    assert again.unidentified == result.unidentified == ()
    assert volume(again) / volume(result) == pytest.approx(proposals[-1].volume, rel=0.05)


def test_what_cannot_be_proposed_is_refused(start):
    assert start[2].next_points(0) == ()
    with pytest.raises(OutOfBoundsError, match="count = -1 must be at least 0"):
        start[2].next_points(-1)
    with pytest.raises(CalibrationError, match="'photo' is no kind of measurement"):
        start[2].next_points(1, kinds={"photo": 1e-3})


def test_without_priors_too_the_next_points_shrink_what_is_not_determined():
    machine, rng = drawn(4)
    result = calibrate(GEOMETRY, machine.touches(rng), priors=None)
    first = result.next_points(1, kinds=ALL)[0]
    # Only a position in the frame of the machine says where x = 0 is.
    assert first.kind == "position"


def test_a_place_is_proposed_as_its_frame_sees_it():
    machine, rng = drawn(3)
    places = [(x, y, z) for x, y in FEW for z in (0.0, 0.1)]
    positions = [machine.position(place, rng, "camera") for place in places]
    result = calibrate(GEOMETRY, positions=positions, priors=WRONG_BY)
    frame = result.frames["camera"]
    for one in result.next_points(3):
        assert (one.kind, one.target) == ("position", "camera")
        seen = frame.rotation @ one.places[0] + frame.shift
        assert one.measurement.position == pytest.approx(seen, abs=1e-9)
