"""The parts of transfers, each alone: carriages, ways up, legs that are driven slower."""

import math

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import SliderLimitError, SliderLimits, SliderTravelError
from tri_glide_kinematics.motion.limits import AT_REST
from tri_glide_kinematics.motion.shaped import SeriesPlan
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.transfer import Station, Ways
from tri_glide_kinematics.motion.transfer.carried import Carriage, first_proved, resting_after
from tri_glide_kinematics.motion.transfer.lifting import lifted
from tri_glide_kinematics.motion.transfer.meeting import Aim, Crossing, Instants, Meeting
from tri_glide_kinematics.motion.transfer.renewing import slower_leg

HOME, PART, HEIGHT = (0.0, -0.1, 0.25), (0.0, 0.1, 0.25), 0.275
WAYS = Ways(WORKSPACE, HEIGHT, 0.005)
STILL = MovingTarget(AT_REST, AT_REST)
PLACE = MovingTarget((-0.1, 0.08, 0.25), (0.2, 0.03, 0.0), (0.1, -0.2, 0.0))


def leg(limits=LIMITS):
    """Return the leg from rest to a place that moves."""
    station = Station(PLACE.position, 0.05, PLACE.velocity, PLACE.acceleration)
    return at_once(Meeting(WAYS, MovingTarget(HOME, AT_REST), station, 0.0, 0.0).leg(limits))


def test_a_carriage_moves_as_the_place_does_at_all_its_instants():
    instants = (0.3, 0.5, 0.6)
    carriage = Carriage.onto([(0.0, STILL)], PLACE, PART, (*instants, 0.6 + 1e-12))
    assert carriage.times.tolist() == [0.0, *instants]
    for time in (*instants, 0.55):
        there, frame = PLACE.after(time), carriage.at(time)
        assert np.add(frame.position, PART) == pytest.approx(there.position, abs=1e-12)
        assert frame.velocity == pytest.approx(there.velocity, abs=1e-12)


def test_a_frame_that_comes_to_rest_gets_no_faster():
    frame = MovingTarget((0.01, 0.0, 0.0), (0.3, -0.1, 0.0))
    carriage = Carriage((0.0, 0.2), (frame, resting_after(frame, 0.2)))
    speeds = [math.hypot(*carriage.at(time).velocity) for time in np.linspace(0.0, 0.2, 101)]
    assert (np.diff(speeds) < 1e-12).all()
    assert speeds[-1] == pytest.approx(0.0, abs=1e-12)


def test_an_aim_at_where_the_base_leads_is_met_and_a_correction_comes_nearer():
    crossing = Crossing(MovingTarget(HOME, AT_REST), PLACE, True, 1.0)
    # A base that always takes as long.
    found = Instants(0.6, 0.5, 0.1)
    assert not Aim(crossing, 0.0, found).is_missed(found)
    aim = Aim(crossing, 0.0, Instants(1.2, 1.1, 0.1))
    assert aim.is_missed(found)
    assert not aim.corrected(found, 1.0).is_missed(found)


def test_a_leg_arrives_at_the_place_and_rides_with_it():
    found = leg()
    for time in (found.arrival, found.arrival + 0.049):
        assert found.is_at(time) == pytest.approx(PLACE.after(time).position, abs=1e-9)
        place = found.plan.platform_at(MACHINE, time)
        assert place[:3] == pytest.approx(PLACE.after(time).position, abs=1e-9)


def test_a_leg_that_is_driven_slower_goes_the_same_way_and_arrives_later():
    found, now, rate = leg(), 0.2, 0.8
    slower = slower_leg(found, now, rate)
    assert slower.goal == pytest.approx(found.goal, abs=1e-12)
    assert slower.base.scaling.ways[-1] == pytest.approx(found.base.scaling.ways[-1], abs=1e-12)
    assert slower.arrival > found.arrival
    for time in (0.0, 0.1, now):
        assert slower.base.at(time).heights == pytest.approx(found.base.at(time).heights, abs=1e-9)
    # As long before the end, the speeds are less by the rate.
    (*_, fast, _), (*_, slow, _) = (
        each.base.on_curve(each.arrival - left) for each, left in ((found, 0.04), (slower, 0.05))
    )
    assert slow == pytest.approx(rate * fast, rel=1e-6)


@pytest.mark.parametrize("velocity", [AT_REST, (0.2, 0.0, 0.0)])
def test_the_way_up_is_upright_at_first_and_rests_at_the_height(velocity):
    up = at_once(lifted(WAYS, MovingTarget(PART, velocity), 0.02, LIMITS)).plan
    x, y, z, *rates = up.platform_at(MACHINE, 0.02)
    assert (x, y, z) == pytest.approx(MovingTarget(PART, velocity).after(0.02).position, abs=1e-9)
    assert rates[:3] == pytest.approx(velocity, abs=1e-9)
    assert up.platform_at(MACHINE, up.duration)[2] == pytest.approx(HEIGHT, abs=1e-9)
    assert up.at(up.duration).velocities == AT_REST
    assert up.keeps_limits(LIMITS)


def test_the_first_motion_that_is_proved_is_taken_or_the_last_refusal_told():
    plan, low = leg().plan, SliderLimits.uniform(0.01, 10.0, 200.0)
    assert at_once(first_proved(iter([plan]), WORKSPACE, LIMITS)) is plan
    with pytest.raises(SliderLimitError):
        at_once(first_proved(iter([plan, plan]), WORKSPACE, low))


def test_what_is_carried_is_checked_for_the_workspace_and_why_it_is_refused_is_told(monkeypatch):
    def outside(*_):
        raise SliderTravelError(0, 0.91, 0.9)

    monkeypatch.setattr(SeriesPlan, "checking_inside", outside)
    with pytest.raises(SliderTravelError):
        leg()
