"""The controller with the real engine and a clock of our own: no process, no waiting."""

import math
from contextlib import suppress

import numpy as np
import pytest
from controller_rig import (
    HOME,
    LIMITS,
    MACHINE,
    MEASURED_TIMEOUT,
    PERIOD,
    TARGET,
    TARGET_TIMEOUT,
    TWIST_TIMEOUT,
    Rig,
    violations_of,
)
from motion_machine import SHAPER

from tri_glide_kinematics.control import (
    DISABLED,
    FAULT,
    IDLE,
    JOGGING,
    LEAST_PAUSE,
    MOVING,
    STOPPING,
    TRACKING,
    WAITING,
    Cause,
    CommandRefusedError,
    Reason,
)
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion import MotionKind, MotionPhase
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind

SOMEBODY_ELSE = Reason(Cause.OTHER_PUBLISHER, "somebody else leads")


@pytest.fixture
def rig(request):
    rig = Rig(**getattr(request, "param", {}))
    rig.cycle(2)
    return rig


def a_rig(*options):
    """Let a test have a rig with each of these options."""
    return pytest.mark.parametrize("rig", options, indirect=True)


in_pieces = a_rig({"in_pieces": True})
each_kind = a_rig(*({"kind": kind} for kind in MotionKind))


def test_it_waits_for_the_machine_and_gives_no_setpoint_before():
    rig = Rig()
    rig.measures = False
    assert rig.cycle(10) is None
    assert rig.controller.state is WAITING
    for command in (lambda: rig.controller.move_to(TARGET), lambda: rig.jog()):
        with pytest.raises(CommandRefusedError, match="no motion while waiting") as caught:
            command()
        assert caught.value.refusal is Refusal.WAITING
    rig.measures = True
    rig.cycle()
    assert rig.controller.state is IDLE
    assert rig.cycle().heights == HOME


@pytest.mark.parametrize(
    ("heights", "reason"),
    [
        ((0.6, 0.6, 0.902), "slider 3 is measured at 0.902 m, outside its travel"),
        ((0.298, 0.6, 0.6), "slider 1 is measured at 0.298 m, outside its travel"),
        ((0.6, float("nan"), 0.6), "slider_2 is nan"),
        ((0.31, 0.89, 0.31), "put the platform above slider 1"),
    ],
)
def test_it_does_not_start_from_everywhere(heights, reason):
    rig = Rig()
    with pytest.raises(KinematicsError, match=reason):
        rig.controller.measured(heights, rig.now)
    assert rig.controller.state is WAITING
    rig.cycle(2)
    assert rig.controller.state is IDLE


def test_a_move_ends_at_its_target_with_reasons(rig):
    rig.controller.move_to(TARGET)
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)
    assert rig.changes[-2:] == [
        (MOVING, "target (0.05, 0.03, 0.3) m"),
        (IDLE, "at rest: target (0.05, 0.03, 0.3) m is reached, measured 0 m away"),
    ]


def test_a_jog_ends_without_renewal(rig):
    for _ in range(5):
        rig.jog()
        rig.cycle(25)
    assert rig.controller.state is JOGGING
    rig.cycle(30)
    assert rig.controller.state in (STOPPING, IDLE)
    rig.cycle_until(IDLE)
    assert (STOPPING, "no twist for 0.1 s") in rig.changes
    assert rig.cycle().velocities == (0.0, 0.0, 0.0)


def jog_to_the_edge(rig):
    for _ in range(300):
        rig.jog((0.0, 0.0, 0.5))
        rig.cycle(5)


def test_a_jog_rests_at_the_edge_and_says_why(rig):
    jog_to_the_edge(rig)
    assert rig.controller.state is JOGGING
    assert rig.engine.phase is MotionPhase.IDLE
    assert max(rig.heights) <= 0.9
    assert rig.controller.status.held_at_edge
    assert rig.controller.reason.cause is Cause.EDGE
    assert "slider travel" in rig.controller.reason.text
    # The first twist, and that it is held: no more, however often it is renewed.
    assert rig.states.count(JOGGING) == 2
    assert rig.refusals == []
    rig.jog((0.0, 0.0, -0.1))
    rig.cycle(20)
    assert not rig.controller.status.held_at_edge
    assert rig.heights[0] < 0.899


def test_a_jog_that_begins_at_the_edge_is_held_there_as_one_that_came_to_it(rig):
    jog_to_the_edge(rig)
    rig.jog((0.0, 0.0, 0.0))
    rig.cycle_until(IDLE)
    rig.jog((0.0, 0.0, 0.2))
    assert rig.controller.state is JOGGING
    assert rig.controller.reason.cause is Cause.EDGE


def test_a_twist_without_room_in_mid_jog_brings_the_platform_to_rest(rig):
    """The old direction is not wanted any more, and the new one is not possible."""
    jog_to_the_edge(rig)
    rig.jog((0.3, 0.0, 0.0))
    rig.cycle(60)
    for _ in range(60):
        rig.jog((0.0, 0.0, 0.3))
        rig.cycle(5)
    assert rig.controller.state is JOGGING
    assert rig.controller.status.held_at_edge
    assert rig.cycle().velocities == (0.0, 0.0, 0.0)


def test_a_stop_holds_against_twists_until_they_pause(rig):
    rig.jog()
    rig.cycle(25)
    assert rig.controller.stop() == "ramping to a stop: was jogging, twist (0, 0, 0.05) m/s"
    for _ in range(50):
        with pytest.raises(CommandRefusedError):
            rig.jog()
        rig.cycle(10)
    assert rig.controller.state is IDLE
    rig.cycle(1 + round(LEAST_PAUSE / PERIOD))
    rig.jog()
    assert rig.controller.state is JOGGING


def test_a_stop_refuses_poses_until_it_is_over(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    rig.controller.stop()
    with pytest.raises(CommandRefusedError, match="before the stop is over: stop was asked for"):
        rig.controller.move_to(TARGET)
    rig.cycle_until(IDLE)
    rig.controller.move_to(TARGET)
    assert rig.controller.stop().startswith("ramping to a stop: was moving, target (0.05,")
    assert rig.controller.stop() == "ramping to a stop already: stop was asked for"
    rig.cycle_until(IDLE)
    assert rig.controller.stop() == "nothing moves: idle"
    # Whoever makes one motion after another has to know of each.
    assert rig.controller.status.stops == 4


def test_stops_disablings_and_faults_are_counted_where_nothing_moves_too(rig):
    controller, counts = rig.controller, []
    for act in (
        rig.cycle,
        controller.stop,
        controller.disable,
        rig.cycle,
        lambda: controller.enable(rig.now),
        lambda: controller.set_obstacle(SOMEBODY_ELSE),
    ):
        act()
        counts.append(controller.status.stops)
    assert counts == [0, 1, 2, 2, 2, 3]


def test_disabled_after_a_ramp_and_enabled_where_it_is_measured(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    rig.controller.disable()
    assert rig.controller.state is STOPPING
    while (setpoint := rig.cycle()) is not None:
        last = setpoint
    assert last.velocities == last.accelerations == (0.0, 0.0, 0.0)
    assert rig.controller.state is DISABLED
    rig.heights = (0.7, 0.65, 0.62)
    rig.cycle()
    assert rig.controller.enable(rig.now) == "enabled"
    assert rig.cycle().heights == (0.7, 0.65, 0.62)


def test_enabled_again_while_ramping_it_stays_enabled(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    rig.controller.disable()
    assert rig.controller.enable(rig.now) == "stays enabled"
    rig.cycle_until(IDLE)


def test_started_disabled():
    rig = Rig(start_disabled=True)
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        rig.controller.enable(rig.now)
    rig.cycle(5)
    assert rig.controller.state is DISABLED
    with pytest.raises(CommandRefusedError, match="no motion while disabled"):
        rig.controller.move_to(TARGET)
    rig.controller.enable(rig.now)
    assert rig.controller.state is IDLE


def silent(rig):
    rig.measures = False
    rig.cycle(round(MEASURED_TIMEOUT / PERIOD) + 5)


def jumping(rig):
    rig.controller.measured((rig.heights[0] + 0.04, *rig.heights[1:]), rig.now)


def apart(rig):
    for k in range(10):
        heights = (rig.heights[0] - 0.006 * k, *rig.heights[1:])
        rig.controller.measured(heights, rig.now)


def not_finite(rig):
    rig.controller.measured((float("inf"), 0.6, 0.6), rig.now)


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        (silent, Cause.MEASUREMENTS_SILENT),
        (jumping, Cause.MEASUREMENT_JUMP),
        (apart, Cause.TRACKING_ERROR),
        (not_finite, Cause.MEASUREMENT_NOT_FINITE),
    ],
)
def test_a_fault_is_a_ramp_and_then_silence_until_somebody_clears_it(rig, fault, cause):
    rig.controller.set_limits(LIMITS, 0.05)
    rig.controller.move_to(TARGET)
    rig.cycle(100)
    fault(rig)
    rig.measures = False
    assert rig.controller.state is FAULT
    assert rig.controller.reason.cause is cause
    if fault is not silent:
        # The setpoint is still on its way down.
        with pytest.raises(CommandRefusedError, match="ramp to a stop is not over"):
            rig.controller.enable(rig.now)
        with pytest.raises(CommandRefusedError, match="ramp to a stop is not over"):
            rig.controller.disable()
    before = rig.heights
    last = None
    while (setpoint := rig.cycle()) is not None:
        last = setpoint
    if last is not None:
        assert last.velocities == (0.0, 0.0, 0.0)
        assert last.heights != before
    with pytest.raises(CommandRefusedError, match="no motion while fault"):
        rig.controller.move_to(TARGET)
    rig.now += MEASURED_TIMEOUT + PERIOD
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        rig.controller.enable(rig.now)
    rig.measures = True
    rig.cycle()
    assert rig.controller.state is FAULT
    rig.controller.enable(rig.now)
    assert rig.controller.state is IDLE
    rig.controller.move_to(TARGET)
    rig.cycle_until(MOVING)
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)


def test_a_machine_in_fault_can_be_disabled(rig):
    not_finite(rig)
    rig.cycle(2)
    assert rig.controller.disable() == "disabled"
    assert rig.controller.state is DISABLED


def test_no_silence_without_being_enabled(rig):
    rig.controller.disable()
    rig.measures = False
    rig.cycle(1000)
    assert rig.controller.state is DISABLED


@pytest.mark.parametrize("pause", range(4))
@each_kind
def test_a_client_that_first_sends_its_measured_pose_does_not_hide_its_target(rig, pause):
    """A tiny move ends while the next target waits for its turn."""
    x, y, z = MACHINE.forward(rig.heights)
    rig.controller.move_to((x + 3e-7, y, z))
    rig.cycle(pause)
    rig.controller.move_to(TARGET)
    rig.cycle(60)
    assert rig.cycle().velocities != (0.0, 0.0, 0.0)
    assert rig.controller.state is MOVING
    assert rig.controller.stop().startswith("ramping to a stop: was moving, target (0.05,")
    rig.cycle_until(IDLE)
    assert rig.cycle().velocities == (0.0, 0.0, 0.0)


def flood(rig, send):
    """Let five commands come in each of forty cycles, which are not planned one by one."""
    before = rig.engine.plan_number
    for step in range(40):
        for part in range(5):
            send(step + 0.1 * part)
        rig.cycle()
    assert rig.engine.plan_number - before <= 40 * PERIOD / 0.005 + 1


@pytest.mark.parametrize("pending", [False, True])
@each_kind
def test_a_flood_costs_one_plan_in_five_milliseconds_whatever_else_is_pending(rig, pending):
    rig.controller.move_to((0.05, 0.03, 0.35))
    rig.cycle(50)
    if pending:
        rig.controller.set_limits(LIMITS, 0.001)
        assert rig.engine.limits_pending
    flood(rig, lambda number: rig.controller.move_to((0.05, 0.03, 0.3 + 1e-4 * number)))
    rig.controller.set_limits(LIMITS, 1.0)
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse((0.05, 0.03, 0.30394)), abs=1e-9)


def test_a_storm_of_limits_is_not_planned_one_by_one(rig):
    rig.controller.move_to((0.05, 0.03, 0.35))
    rig.cycle(20)
    flood(rig, lambda number: rig.controller.set_limits(LIMITS, 0.9 + 0.001 * number))
    rig.cycle_until(IDLE)
    assert rig.engine.speed_scale == pytest.approx(0.9394)


def test_a_shaper_that_waits_for_rest_is_told(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(10)
    rig.engine.set_shaper(Shaper.of(ShaperKind.ZV, Mode(15.0, 0.03)))
    assert rig.controller.status.shaper_waits
    rig.cycle_until(IDLE)
    assert not rig.controller.status.shaper_waits


@pytest.mark.parametrize("size", [0.0, 1e-8, 9e-8])
def test_what_counts_as_no_velocity_ends_a_jog_and_leaves_a_move_alone(rig, size):
    rig.controller.move_to(TARGET)
    rig.cycle(10)
    rig.jog((0.0, size, 0.0))
    assert rig.controller.state is MOVING
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)
    rig.jog((0.0, 0.0, -0.05))
    rig.cycle(10)
    rig.jog((0.0, size, 0.0))
    assert rig.changes[-1] == (STOPPING, "twist of zero")


def test_stop_during_the_ramp_of_a_fault_says_what_is_going_on(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    jumping(rig)
    assert rig.controller.stop().startswith("ramping to a stop already: fault: measured height")


def test_it_is_enabled_again_before_the_next_measurement(rig):
    rig.controller.disable()
    assert rig.controller.enable(rig.now) == "enabled"
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    jumping(rig)
    while rig.cycle() is not None:
        pass
    assert rig.controller.enable(rig.now) == "enabled"


def test_a_target_that_is_not_reached_is_told_and_told_again_when_it_is(rig):
    rig.offset = 0.002
    rig.controller.move_to(TARGET)
    rig.cycle_until(IDLE)
    assert rig.controller.reason.cause is Cause.TARGET_NOT_REACHED
    text = rig.controller.reason.text
    assert "target (0.05, 0.03, 0.3) m is NOT reached, measured 0.00" in text
    assert "more than 0.0005 m" in text
    assert rig.controller.status.target_distance > 0.0005
    assert rig.controller.status.target_missed
    count = len(rig.statuses)
    rig.cycle(200)
    assert len(rig.statuses) == count
    rig.offset = 0.0
    rig.cycle(20)
    assert rig.controller.reason.cause is Cause.TARGET_REACHED
    assert rig.controller.status.target_reached
    assert rig.controller.status.target_distance < 1e-9
    assert not rig.controller.status.target_missed


def test_a_new_target_in_mid_motion_is_told(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(20)
    rig.controller.move_to((0.0, 0.02, 0.28))
    assert rig.changes[-2:] == [
        (MOVING, "target (0.05, 0.03, 0.3) m"),
        (MOVING, "target (0, 0.02, 0.28) m"),
    ]
    assert rig.controller.status.newest_target == "target (0, 0.02, 0.28) m"


def test_a_waiting_target_that_is_stopped_is_named(rig):
    rig.controller.move_to(TARGET)
    rig.cycle_until(IDLE)
    rig.controller.set_limits(LIMITS, 0.5)
    rig.controller.move_to((0.0, 0.0, 0.25))  # the limits had the turn of this cycle
    answer = rig.controller.stop()
    assert "(0, 0, 0.25)" in answer
    rig.cycle(20)
    assert rig.controller.state is IDLE
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)


def test_twists_that_come_too_seldom_are_told_to(rig):
    for _ in range(3):
        rig.jog()
        rig.cycle(100)
    jogs = [reason for state, reason in rig.changes if state is JOGGING]
    assert "0.2 s after the last one: longer than twist_timeout, 0.1 s" in jogs[-1]


def test_an_obstacle_keeps_it_from_leading_and_is_a_fault_while_it_leads():
    rig = Rig()
    rig.controller.set_obstacle(SOMEBODY_ELSE)
    assert rig.cycle(5) is None
    assert (WAITING, "somebody else leads") in rig.changes
    rig.controller.set_obstacle(None)
    rig.cycle(2)
    assert rig.controller.state is IDLE
    rig.controller.move_to(TARGET)
    rig.cycle(20)
    rig.controller.set_obstacle(SOMEBODY_ELSE)
    assert rig.controller.state is FAULT
    while rig.cycle() is not None:
        pass
    with pytest.raises(CommandRefusedError, match="somebody else leads") as caught:
        rig.controller.enable(rig.now)
    assert caught.value.refusal is Refusal.OTHER_PUBLISHER
    rig.controller.set_obstacle(None)
    assert rig.controller.enable(rig.now) == "enabled"


def test_the_first_setpoint_is_where_the_machine_is_measured(rig):
    """Also if a target comes between the enabling and the cycle."""
    for target in (TARGET, (0.0, 0.0, 0.25)):
        rig.controller.disable()
        rig.cycle(3)
        assert rig.controller.state is DISABLED
        rig.controller.enable(rig.now)
        rig.controller.move_to(target)
        place = rig.measured
        first = rig.cycle()
        assert first.heights == place
        assert first.velocities == (0.0, 0.0, 0.0)
        rig.cycle_until(MOVING)
        rig.cycle_until(IDLE)


@a_rig(*({"kind": kind, "in_pieces": True} for kind in MotionKind))
@pytest.mark.parametrize("end_of_jog", ["released", "silent"])
def test_a_pose_is_not_lost_when_the_jog_before_it_ends(rig, end_of_jog):
    """The pose is still being planned when the stick is let go."""
    rig.jog()
    rig.cycle_until(JOGGING)
    rig.cycle(30)
    rig.jog((0.05, 0.0, 0.0))
    rig.cycle(10)
    rig.controller.move_to(TARGET)
    rig.cycle()
    if end_of_jog == "released":
        rig.jog((0.0, 0.0, 0.0))
    else:
        rig.now += 2.0 * TWIST_TIMEOUT
        rig.controller.measured(rig.measured, rig.now)
    rig.cycle_until(MOVING)
    rig.cycle_until(IDLE)
    assert MACHINE.forward(rig.heights) == pytest.approx(TARGET, abs=1e-9)


@a_rig({"start": (0.9, 0.9, 0.9), "in_pieces": True})
def test_a_refusal_that_comes_late_names_its_target(rig):
    rig.controller.move_to((0.0, 0.0, 0.5))
    rig.cycle_until(MOVING)
    rig.jog((0.0, 0.0, 0.3))
    rig.cycle_until(IDLE)
    for text in rig.refusals:
        assert text.startswith("twist (0, 0, 0.3) m/s: ")


@each_kind
def test_new_limits_leave_the_shaper_as_it_is(rig):
    rig.engine.set_shaper(SHAPER)
    rig.controller.move_to(TARGET)
    heights = [rig.cycle().heights for _ in range(60)]
    rig.controller.set_limits(LIMITS, 0.5)
    heights += [rig.cycle().heights for _ in range(60)]
    assert rig.engine.phase is MotionPhase.MOVING
    assert rig.engine.speed_scale == 0.5
    assert rig.engine.shaper is SHAPER
    rig.cycle_until(IDLE)
    assert MACHINE.forward(rig.heights) == pytest.approx(TARGET, abs=1e-9)
    assert not violations_of(heights)


def circling(rig, begin):
    angle = 3.0 * (rig.now - begin)
    return 0.03 * math.cos(angle), 0.03 * math.sin(angle), 0.3


def follow_poses(rig, place, seconds, each=0.03):
    """Let poses come at a rate; return how far the setpoint is from them where each comes [m]."""
    distances = []
    for cycle in range(round(seconds / PERIOD)):
        if cycle % round(each / PERIOD) == 0:
            distances.append(math.dist(MACHINE.forward(rig.heights), place()))
            rig.controller.follow_pose(place(), rig.now, rig.now)
        rig.cycle()
    return distances


@in_pieces
def test_poses_at_a_rate_are_followed_and_the_last_one_is_reached(rig):
    begin = rig.now
    distances = follow_poses(rig, lambda: circling(rig, begin), 1.5)
    assert rig.states[-2:] == [MOVING, TRACKING]
    assert max(distances[30:]) < 3e-4
    last = rig.controller.newest_target.position
    rig.cycle_until(MOVING, round(0.1 / PERIOD) + 1)
    rig.cycle_until(IDLE)
    assert rig.controller.reason.cause is Cause.TARGET_REACHED
    assert MACHINE.forward(rig.heights) == pytest.approx(last, abs=1e-9)
    assert rig.refusals == []


def test_a_pose_that_comes_seldom_is_a_move_though_poses_are_followed(rig):
    follow_poses(rig, lambda: TARGET, 1.5, each=0.3)
    assert TRACKING not in rig.states
    assert MACHINE.forward(rig.heights) == pytest.approx(TARGET, abs=1e-9)


@in_pieces
@pytest.mark.parametrize("each", [0.1, 0.2, 0.24])
def test_the_end_of_poses_is_no_silence(rig, each):
    begin = rig.now
    follow_poses(rig, lambda: (0.03 * (rig.now - begin), 0.0, 0.3), 1.5, each)
    rig.cycle_until(IDLE)
    assert STOPPING not in rig.states
    assert rig.controller.reason.cause is Cause.TARGET_REACHED


@in_pieces
@pytest.mark.parametrize("each", [0.034, 0.05, 0.1])
def test_a_pose_that_is_lost_is_no_end_though_each_is_early_or_late(rig, each):
    begin = rig.now
    arrivals = [number * each + 0.002 * (-1) ** number for number in range(20) if number != 14]
    # The one before the gap is early, after one that was late; the one behind it is late.
    arrivals[14] = 15 * each + 0.002
    for arrival in arrivals:
        while rig.now - begin < arrival:
            rig.cycle()
        rig.controller.follow_pose(circling(rig, begin), rig.now, rig.now)
    assert rig.states[-2:] == [MOVING, TRACKING]
    assert rig.states.count(TRACKING) == 1


@in_pieces
@pytest.mark.parametrize("gap", [0.002, 0.01])
def test_a_second_pose_that_comes_soon_is_reached(rig, gap):
    rig.pieces = 50
    rig.controller.follow_pose((0.0, 0.0, 0.3), rig.now, rig.now)
    rig.cycle(round(gap / PERIOD))
    rig.controller.follow_pose(TARGET, rig.now, rig.now)
    rig.cycle_until(IDLE)
    assert MACHINE.forward(rig.heights) == pytest.approx(TARGET, abs=1e-9)


@in_pieces
@pytest.mark.parametrize("apart", [0.0, 0.001])
def test_a_last_pose_that_is_told_again_is_reached_as_one_that_is_not(rig, apart):
    rig.pieces = 50
    begin, farthest = rig.now, 0.0
    for _ in range(27):
        seen, last = rig.now, (0.1 * (rig.now - begin), 0.0, 0.3)
        follow_poses(rig, lambda last=last: last, 0.03)
    for number in range(10):
        rig.controller.follow_pose(last, seen + apart * number, rig.now)
        for _ in range(round(0.03 / PERIOD)):
            rig.cycle()
            farthest = max(farthest, MACHINE.forward(rig.heights)[0])
    rig.cycle_until(IDLE)
    assert STOPPING not in rig.states
    assert MACHINE.forward(rig.heights) == pytest.approx(last, abs=1e-9)
    assert farthest - last[0] < 0.015


def test_a_pose_that_is_older_than_the_last_is_refused_and_changes_nothing(rig):
    begin = rig.now
    follow_poses(rig, lambda: circling(rig, begin), 0.6)
    with pytest.raises(CommandRefusedError, match="older, by its stamp"):
        rig.controller.follow_pose(TARGET, rig.now - 0.04, rig.now)
    assert max(follow_poses(rig, lambda: circling(rig, begin), 0.6)) < 3e-4


@a_rig({"in_pieces": True, "kind": MotionKind.LINEAR})
def test_poses_with_noise_at_a_high_rate_do_not_shake_the_platform(rig):
    rng = np.random.default_rng(1)
    follow_poses(rig, lambda: (0.0, 0.0, 0.3), 0.5, 0.004)
    place = lambda: tuple((0.0, 0.0, 0.3) + 1e-4 * rng.normal(size=3))  # noqa: E731
    most = 0.0
    for _ in range(250):
        follow_poses(rig, place, 0.004, 0.004)
        most = max(most, math.dist(MACHINE.forward(rig.heights), (0.0, 0.0, 0.3)))
    assert most < 3e-3


@in_pieces
def test_a_pose_that_jumps_is_not_overshot(rig):
    begin, most = rig.now, 0.0
    place = lambda: (0.05 if rig.now > begin + 0.6 else -0.05, 0.0, 0.3)  # noqa: E731
    for _ in range(40):
        follow_poses(rig, place, 0.03)
        most = max(most, MACHINE.forward(rig.heights)[0])
    assert most < 0.0501


def test_after_a_stop_poses_at_a_rate_need_a_pause(rig):
    begin = rig.now
    follow_poses(rig, lambda: circling(rig, begin), 0.6)
    rig.controller.stop()
    rig.cycle_until(IDLE)
    for _ in range(30):
        with pytest.raises(CommandRefusedError, match="needs a pause"):
            follow_poses(rig, lambda: circling(rig, begin), PERIOD)
        rig.cycle(10)
    rig.cycle(round(LEAST_PAUSE / PERIOD) + 1)
    follow_poses(rig, lambda: circling(rig, begin), 0.3)
    assert rig.controller.state is TRACKING


@in_pieces
def test_after_a_stop_poses_that_were_held_up_for_less_than_a_pause_move_nothing(rig):
    begin = rig.now
    follow_poses(rig, lambda: circling(rig, begin), 0.6, 0.01)
    rig.controller.stop()
    rig.cycle_until(IDLE)
    stopped = rig.heights
    for pause in (0.0, 0.3):
        rig.cycle(round(pause / PERIOD))
        for _ in range(50):
            with suppress(CommandRefusedError):
                follow_poses(rig, lambda: circling(rig, begin), 0.01, 0.01)
            rig.cycle(round(0.01 / PERIOD))
    assert rig.heights == stopped


@in_pieces
def test_after_a_stop_a_second_pose_needs_a_pause(rig):
    rig.controller.follow_pose((0.0, 0.0, 0.3), rig.now, rig.now)
    rig.cycle(2)
    rig.controller.stop()
    rig.cycle_until(IDLE)
    rig.controller.measured(rig.measured, rig.now)
    with pytest.raises(CommandRefusedError, match="needs a pause"):
        rig.controller.follow_pose(TARGET, rig.now, rig.now)


def test_the_end_of_poses_moves_nothing_else(rig):
    begin = rig.now
    follow_poses(rig, lambda: circling(rig, begin), 0.6)
    for _ in range(20):
        rig.controller.track((0.0, 0.0, 0.3), (0.0, 0.0, 0.0), rig.now, rig.now)
        rig.cycle(10)
    assert rig.states[-1] is TRACKING
    rig.controller.jog((0.0, 0.0, 0.01), rig.now)
    rig.cycle_until(JOGGING)


@in_pieces
def test_with_a_shaper_a_target_is_followed_and_its_silence_ends_that(rig):
    rig.pieces = 2
    rig.engine.set_shaper(SHAPER)
    rig.cycle(20)
    begin = rig.now
    for cycle in range(600):
        if cycle % 10 == 0:
            seen = rig.now - 0.03
            place = (-0.06 + 0.1 * (seen - begin), 0.02, 0.3)
            rig.controller.track(place, (0.1, 0.0, 0.0), seen, rig.now)
        rig.cycle()
    assert rig.controller.state is TRACKING
    assert rig.controller.tracking_distance < 1e-9
    cycles = round(TARGET_TIMEOUT / PERIOD)
    rig.cycle_until(STOPPING, cycles + 2)
    rig.cycle_until(IDLE, cycles)
    assert rig.measured == rig.engine.state.heights


@pytest.mark.parametrize("phase", [0.0, 0.4, 0.8])
def test_a_target_is_met_whenever_in_a_period_it_is_told(rig, phase):
    # At 0.2 m/s half a period is a tenth of a millimetre.
    speed, errors = 0.2, []

    def place(time):
        return (-0.08 + speed * (time - begin), 0.0, 0.3)

    rig.cycle(10)
    begin = rig.now
    for cycle in range(400):
        told = rig.now + phase * PERIOD
        if cycle % 5 == 0:
            rig.controller.track(place(told), (speed, 0.0, 0.0), told, told)
        setpoint = rig.cycle()
        errors.append(math.dist(MACHINE.forward(setpoint.heights), place(rig.now)))
    assert max(errors[300:]) < 1e-6
