"""Searches for modes that lead a controller with a swing behind it, in the time of its cycles."""

import math
import re
from dataclasses import replace

import pytest
from led_machine import WALL, LedMachine

from tri_glide_kinematics.calibration.ringdown import Quantity, combine_modes, find_modes
from tri_glide_kinematics.calibration.session import Delivery, SwingSettings, swing_search
from tri_glide_kinematics.control import DISABLED, IDLE, MOVING, WAS_STOPPED
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.simulation import PlatformMode

PLACE = (0.0, 0.0, 0.3)
MODES = (
    PlatformMode(0, (15.0,), 0.03),
    PlatformMode(1, (22.0,), 0.02),
    PlatformMode(2, (22.0,), 0.02),
)
ALONG_X = SwingSettings(((1.0, 0.0, 0.0),), duration=1.0)
NAMES = ("slider_1", "slider_2", "slider_3")
# Promised: of a frequency as a part of it, of a damping.
FREQUENCY, DAMPING = 0.01, 0.01


@pytest.fixture
def machine():
    return LedMachine(PLACE, modes=MODES)


def begin(machine, settings=ALONG_X, names=None):
    return machine.begin(swing_search(machine.leading, machine, settings, names))


def between_two_moves(machine, settings=ALONG_X):
    """Return a search whose first move has ended, while its swing is recorded."""
    future = begin(machine, settings)
    machine.look_until_state(MOVING)
    machine.look_until_state(IDLE)
    return future


def refused(machine, settings=ALONG_X, names=None):
    """Return why a search is refused; nothing may have moved."""
    failure = machine.failure_of(begin(machine, settings, names))
    assert not machine.moves
    assert machine.listens is None
    return failure


def found(search):
    return combine_modes([find_modes(recording) for recording in search.recordings])


def test_the_modes_are_those_of_the_simulated_machine(machine):
    settings = SwingSettings(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), duration=1.0)
    future = begin(machine, settings)
    machine.look_until(lambda: machine.listens == "/cell/imu/data_raw")
    search = machine.result_of(future)
    assert search.failure is None
    modes = sorted(found(search).modes, key=lambda mode: mode.frequency)
    assert len(search.recordings) == 6
    for mode, (frequency, damping) in zip(modes, ((15.0, 0.03), (22.0, 0.02))):
        assert mode.frequency == pytest.approx(frequency, rel=FREQUENCY)
        assert mode.damping == pytest.approx(damping, abs=DAMPING)
    assert machine.place == pytest.approx(PLACE, abs=1e-6)
    machine.assert_nothing_moves_on()


@pytest.mark.parametrize("sees_swing", [True, False])
def test_encoders_see_the_swing_or_motors_that_stand_still(machine, sees_swing):
    machine.encoders_see_swing = sees_swing
    search = machine.result_of(begin(machine, ALONG_X, NAMES))
    assert search.failure is None
    assert search.recordings[0].names == NAMES
    modes = found(search).modes
    if sees_swing:
        assert modes[0].frequency == pytest.approx(15.0, rel=FREQUENCY)
    else:
        assert not modes


def test_with_a_shaper_there_is_nothing_to_measure(machine):
    machine.shaper = "ei"
    assert refused(machine) == (
        "ik_node has the shaper ei, which takes away the swing that is to be measured: set its "
        "parameter shaper to none first"
    )


def test_without_a_server_nobody_is_asked(machine):
    machine.is_ready = False
    assert refused(machine) == "there is no /cell/ik_node that could move the platform"


def test_a_machine_that_is_not_idle_is_left_alone(machine):
    machine.controller.disable()
    machine.look_until_state(DISABLED)
    machine.look()
    assert refused(machine).startswith("ik_node is disabled: ")


def test_one_who_jogs_while_a_search_waits_is_left_to_it(machine):
    machine.answer_time = 0.3
    future = begin(machine)
    machine.creep_until(future.done)
    assert machine.failure_of(future).startswith("ik_node is jogging: ")
    assert not machine.moves


def test_a_target_that_is_measured_elsewhere_is_arrived_at(machine):
    machine.offset = 0.001
    machine.pass_time(0.5)
    search = machine.result_of(begin(machine))
    assert search.failure is None
    assert {goal.result.code for goal in machine.goals} == {GoalCode.NOT_REACHED}


def test_sliders_that_move_are_waited_for_and_then_told(machine):
    future, begun = begin(machine), machine.now
    machine.shake_until(future.done)
    assert machine.now - begun == pytest.approx(1.0, abs=0.1)
    assert machine.failure_of(future).startswith("slider 1 moves: by 0.002 m in the last 0.2 s")


def test_parameters_that_do_not_come_are_told(machine):
    machine.answer_time = 100.0
    begun = machine.now
    assert refused(machine) == "ik_node has not told its parameters in 5 s"
    assert machine.now - begun == pytest.approx(5.0, abs=0.01)
    machine.answer_time = 0.0
    assert machine.result_of(begin(machine)).failure is None


def test_one_that_comes_while_another_waits_for_rest_is_refused_once_that_leads(machine):
    first = begin(machine)
    machine.shake(0.1)
    second = begin(machine)
    machine.shake(0.1)
    assert machine.failure_of(second) == "a search for modes is under way"
    assert machine.result_of(first).failure is None


@pytest.mark.parametrize(
    ("stop", "words"),
    [
        (lambda machine: machine.leading.stop(), "stop was asked for"),
        (lambda machine: machine.controller.stop(), WAS_STOPPED),
        (lambda machine: machine.leading.end("the node ends"), "the node ends"),
    ],
)
def test_a_stop_before_anything_moves_is_remembered(machine, stop, words):
    machine.answer_time = 0.5
    future = begin(machine)
    stop(machine)
    assert machine.failure_of(future) == words
    assert not machine.moves


def test_our_own_stop_cancels_the_move_and_waits_for_rest(machine):
    future = begin(machine)
    machine.look_until_state(MOVING)
    machine.look()
    assert machine.leading.stop()
    machine.look()
    assert machine.goals[0].is_cancelled
    assert machine.controller.progress.speed > 0.0
    assert not future.done()
    assert machine.result_of(future).failure == "stop was asked for"
    assert machine.goals[0].result is not None
    machine.assert_nothing_moves_on()
    assert not machine.leading.stop()


def test_our_own_stop_between_two_moves_ends_the_search_at_once(machine):
    future = between_two_moves(machine)
    assert machine.leading.stop()
    machine.look()
    assert machine.result_of(future).failure == "stop was asked for"
    assert len(machine.moves) == 1
    machine.assert_nothing_moves_on()


def test_the_end_of_the_node_ends_search_and_motion(machine):
    future = begin(machine)
    machine.look_until_state(MOVING)
    machine.leading.end("calibration_node ends")
    assert machine.result_of(future).failure == "calibration_node ends"
    assert machine.goals[0].is_cancelled
    assert machine.failure_of(begin(machine)) == "calibration_node ends"


@pytest.mark.parametrize("is_gone", [False, True])
def test_a_goal_that_does_not_end_is_given_up(machine, is_gone):
    future = begin(machine)
    machine.look_until_state(MOVING)
    machine.obeys = machine.is_alive = False
    machine.leading.stop()
    machine.is_ready = not is_gone
    begun = machine.now
    assert machine.result_of(future).failure == "stop was asked for"
    assert machine.now - begun == pytest.approx(0.0 if is_gone else 10.0, abs=0.02)


def test_somebody_else_who_leads_the_platform_ends_the_search(machine):
    future = between_two_moves(machine)
    machine.send_pose((0.0, 0.02, 0.3))
    assert "somebody else leads the platform" in machine.result_of(future).failure
    assert len(machine.moves) == 1


def test_somebody_else_who_leads_it_before_the_end_of_a_move_is_seen_ends_the_search(machine):
    future = begin(machine)
    machine.look_until_state(MOVING)
    machine.tells_setpoints = False
    machine.look_until(lambda: machine.goals[0].result is not None)
    machine.send_pose((0.0, 0.02, 0.3))
    machine.pass_time(0.1)
    machine.tells_setpoints = True
    failure = machine.result_of(future, most=3.0).failure
    assert re.match(r"the setpoints are \d.* mm away .* somebody else leads the platform", failure)
    assert len(machine.moves) == 1


def test_a_target_of_somebody_else_takes_the_place_of_a_move(machine):
    future = begin(machine)
    machine.look_until_state(MOVING)
    machine.send_pose((0.0, 0.02, 0.3))
    assert "did not end there: " in machine.result_of(future).failure
    assert len(machine.moves) == 1


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (
            {"feels": False},
            "0 samples with ascending stamps have come on /cell/imu/data_raw in 3 s",
        ),
        ({"stamp_of": lambda sent: 0.0}, "0 samples with ascending stamps"),
        ({"stamp_of": lambda sent: 7.0}, "1 samples with ascending stamps"),
        ({"measures_acceleration": False}, "the sensor on imu/data_raw measures no accelerations"),
        ({"tells_setpoints": False}, "ik_node has told of no setpoints on motion_state in 3 s: ik"),
    ],
)
def test_without_samples_and_setpoints_nothing_moves(machine, wrong, words):
    vars(machine).update(wrong)
    assert machine.result_of(begin(machine)).failure.startswith(words)
    assert not machine.moves


def test_a_recording_begins_when_the_setpoints_rest_and_has_the_stamps_of_the_sensor(machine):
    # Stamps are by another clock than that of the computer.
    machine.stamp_of = lambda sent: sent + 5e4
    future = between_two_moves(machine)
    rested = machine.now + WALL + 5e4
    search = machine.result_of(future)
    assert len(search.recordings) == 3
    assert search.recordings[0].times[0] == pytest.approx(rested, abs=0.025)
    for recording in search.recordings:
        assert recording.quantity is Quantity.ACCELERATION
        assert recording.times[-1] - recording.times[0] == pytest.approx(1.0, abs=0.01)


def test_samples_that_are_missing_now_and_then_end_nothing(machine):
    future = between_two_moves(machine)
    for index in range(100):
        machine.feels = index % 10 != 0
        machine.look()
    sent = machine.now + WALL
    machine.leading.leader.sample(
        (math.nan, 0.0, 0.0), sent + 1e-4, Delivery(sent, sent, machine.now)
    )
    assert machine.result_of(future).failure is None


def test_too_few_samples_are_told(machine):
    future = between_two_moves(machine, replace(ALONG_X, duration=0.5))
    machine.feels = False
    machine.pass_time(0.6)
    machine.feels = True
    assert machine.result_of(future).failure == (
        "1 samples have come on /cell/imu/data_raw in 0.5 s, at least 10 are needed"
    )


@pytest.mark.parametrize(
    ("quiet", "words"),
    [
        ("tells_setpoints", "ik_node has told nothing on motion_state for 1 s: does it run?"),
        ("feels", "no sample has come on /cell/imu/data_raw for 1 s"),
    ],
)
def test_silence_ends_a_search(machine, quiet, words):
    future = between_two_moves(machine, replace(ALONG_X, duration=5.0))
    setattr(machine, quiet, False)
    assert machine.result_of(future).failure == words
    assert len(machine.moves) == 1


def test_setpoints_that_end_are_told(machine):
    future = between_two_moves(machine)
    machine.tells_setpoints = False
    sent = machine.now + WALL
    machine.leading.leader.setpoints(None, Delivery(sent, sent, machine.now))
    assert machine.result_of(future).failure == "ik_node leads the machine no more"


def listening(machine):
    future = begin(machine)
    machine.look_until(lambda: machine.listens)
    return future


def moving(machine):
    future = begin(machine)
    machine.look_until_state(MOVING)
    machine.look()
    return future


@pytest.mark.parametrize("begun", [listening, moving, between_two_moves])
def test_a_stop_of_ik_node_ends_the_search_where_nothing_moves_too(machine, begun):
    future = begun(machine)
    count = len(machine.moves)
    machine.tell_state(IDLE, more_stops=1)
    assert machine.result_of(future).failure == WAS_STOPPED
    assert len(machine.moves) == count


def test_who_was_held_up_does_not_go_on(machine):
    future = between_two_moves(machine)
    machine.hold_up(2.0)
    assert machine.result_of(future).failure.startswith("this node was held up for 2")
    assert len(machine.moves) == 1


def test_a_goal_whose_end_is_not_told_is_given_up(machine, monkeypatch):
    room = "tri_glide_kinematics.calibration.session"
    monkeypatch.setattr(f"{room}.swinging.LONGEST_MOVE", 3.0)
    machine.goals_end = False
    future = begin(machine)
    failure = machine.result_of(future).failure
    assert failure.startswith("the move has not ended after 4 s: ik_node is idle: ")
    assert machine.goals[0].is_cancelled


@pytest.mark.parametrize("delay", [1.5, -1.5])
def test_clocks_that_are_set_otherwise_end_the_search(machine, delay):
    future = between_two_moves(machine)
    machine.delay = delay
    assert machine.result_of(future).failure == (
        f"a message came {delay:g} s after it was sent, at most 1 s can be: are the clocks of the "
        "computers set alike?"
    )


def test_heights_by_another_clock_do_not_matter_to_a_search_by_an_accelerometer(machine):
    future = between_two_moves(machine)
    machine.stamp_error = 5.0
    assert machine.result_of(future).failure is None
