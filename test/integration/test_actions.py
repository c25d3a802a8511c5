"""The action ~/move_to of ik_node: each way in which a goal can end, over real processes."""

from __future__ import annotations

import math
import os
import signal

import numpy as np
import pytest
from action_bench import FAR, NEAR, SLOW, ActionBench
from action_msgs.msg import GoalStatus
from std_srvs.srv import Trigger

from testing.commands import KINEMATICS, assert_within_limits
from testing.forks import ForkedNodes
from testing.goals import ERROR_NONE
from testing.processes import launched
from testing.scenarios import HEALTHY
from tri_glide_interfaces.action import FollowPath, MoveTo
from tri_glide_kinematics.motion.engine import GoalCode

TOLERANCE = 0.0005  # m, position_tolerance by default
SUCCEEDED, ABORTED = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED
CANCELED = GoalStatus.STATUS_CANCELED


@pytest.fixture(scope="module")
def bench(ros_domain, ros_context, tmp_path_factory):
    namespace = f"/actions_{os.getpid()}"
    with launched(tmp_path_factory.mktemp("actions"), namespace, ForkedNodes) as launcher:
        bench = ActionBench(ros_context, launcher, namespace)
        yield bench.start()
        assert_within_limits(bench.machine)
        bench.client.close()


@pytest.fixture
def own_bench(request, ros_context, nodes, namespace):
    """Return a machine for tests that end it, or make it begin anew, or give it parameters."""
    bench = ActionBench(ros_context, nodes, namespace)
    yield bench.start(getattr(request, "param", SLOW))
    bench.client.close()


def measured(machine):
    return KINEMATICS.forward(machine.heights(machine.measured[-1]))


def place(point):
    return (point.x, point.y, point.z)


def test_codes_are_those_of_the_controller():
    for result in (MoveTo.Result, FollowPath.Result):
        assert {code.name: code for code in GoalCode} == {
            name: getattr(result, name) for name in GoalCode.__members__
        }


def test_it_succeeds_when_the_platform_is_measured_there_and_tells_on_the_way(bench):
    bench.quickly_to(NEAR)
    goal = bench.goals.move_to(FAR)
    result = bench.ends(goal, SUCCEEDED, GoalCode.SUCCEEDED, "is reached, measured")
    assert math.dist(place(result.position), FAR) <= TOLERANCE
    ways = [feedback.way_remaining for feedback in goal.feedback]
    times = [feedback.time_remaining for feedback in goal.feedback]
    # Ten times in a second, for two and a half.
    assert len(ways) > 10
    assert ways == sorted(ways, reverse=True)
    assert times == sorted(times, reverse=True)
    assert math.dist(place(goal.feedback[0].position), NEAR) < math.dist(NEAR, FAR)
    bench.ends(bench.goals.move_to(FAR), SUCCEEDED, GoalCode.SUCCEEDED, "is reached")


@pytest.mark.parametrize("own_bench", [{"rate": 10.0}], ids=["cycles-of-100-ms"], indirect=True)
def test_goals_that_are_sent_at_once_do_not_wait_for_a_cycle_each(own_bench):
    bench, commands = own_bench, own_bench.machine.commands
    cycles = []
    # They wait for one of the cycles each, or never; a busy computer is late now and then.
    while len(cycles) < 5 and min(cycles, default=20) >= 14:
        first = len(commands)
        *others, last = [bench.goals.move_to((0.0, 0.0, 0.25 + 0.002 * k)) for k in range(20)]
        for goal in others:
            bench.ends(goal, ABORTED, GoalCode.SUPERSEDED, "superseded by target")
        cycles.append(len(commands) - first)
        bench.ends(last, SUCCEEDED, GoalCode.SUCCEEDED, "is reached")
    assert min(cycles) < 14


def test_a_cancelled_goal_rests_on_its_way_and_says_where(bench):
    goal = bench.under_way()
    answer = goal.cancel()
    assert answer.return_code == ERROR_NONE
    assert len(answer.goals_canceling) == 1
    result = bench.ends(goal, CANCELED, GoalCode.CANCELED, "cancelled: target (0.08, 0.03, 0.35)")
    assert math.dist(place(result.position), measured(bench.machine)) <= TOLERANCE
    assert math.dist(place(result.position), FAR) > 0.01
    assert not any(bench.machine.commands[-1].velocity)
    # Nothing to cancel any more.
    assert not goal.cancel().goals_canceling


NEWER = {
    "pose": (lambda bench: bench.client.send_pose(NEAR), "superseded by target (0, 0, 0.25) m"),
    "twist": (
        lambda bench: bench.client.send_twist((0.0, 0.0, 0.02)),
        "superseded by twist (0, 0, 0.02) m/s",
    ),
    "moving target": (
        lambda bench: bench.client.send_state(NEAR),
        "superseded by moving target (0, 0, 0.25) m",
    ),
}


@pytest.mark.parametrize("name", NEWER)
def test_a_newer_command_on_a_topic_supersedes_it(bench, name):
    send, text = NEWER[name]
    goal = bench.under_way()
    send(bench)
    bench.ends(goal, ABORTED, GoalCode.SUPERSEDED, text)
    bench.machine.wait_for_state("idle")


@pytest.mark.parametrize("position", [NEAR, FAR])
def test_a_newer_goal_supersedes_it_even_the_same(bench, position):
    goal = bench.under_way()
    newer = bench.goals.move_to(position)
    bench.ends(goal, ABORTED, GoalCode.SUPERSEDED, "superseded by target")
    bench.ends(newer, SUCCEEDED, GoalCode.SUCCEEDED, "is reached")


def test_a_speed_that_is_asked_for_is_kept(bench):
    bench.quickly_to(NEAR)
    bench.set_speed(1.0)
    first = len(bench.machine.commands)
    goal = bench.goals.move_to((0.04, 0.0, 0.25), speed=0.08)
    bench.ends(goal, SUCCEEDED, GoalCode.SUCCEEDED, "on a line is reached")
    bench.set_speed(SLOW["speed_scale"])
    # The velocities that are commanded: the times between commands differ on a busy computer.
    speeds = np.array(
        [
            np.linalg.norm(KINEMATICS.forward_velocity(message.position, message.velocity)[1])
            for message in bench.machine.commands[first:]
        ]
    )
    assert 0.075 < np.median(speeds[speeds > 0.07]) < 0.085


REFUSED = {
    "outside": (((0.5, 0.0, 0.25), "tri_glide_base"), "outside the workspace at (0.5, 0, 0.25) m"),
    "not finite": (((math.nan, 0.0, 0.25), "tri_glide_base"), "target pose position.x = nan"),
    "huge": (((1e300, 0.0, 0.25), "tri_glide_base"), "1e+300"),
    "foreign frame": ((NEAR, "world"), "target pose has frame_id 'world'"),
    "unknown kind": ((NEAR,), "kind = 'fast' must be one of linear, slider", {"kind": "fast"}),
    "speed of sliders": ((NEAR,), "speed = 1 m/s must be 0", {"kind": "slider", "speed": 1.0}),
    "negative speed": ((NEAR,), "speed = -1 m/s must be 0, or 1e-05 to", {"speed": -1.0}),
    "speed that is no number": ((NEAR,), "speed = nan is not a finite", {"speed": math.nan}),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_with_the_reason_and_disturbs_nothing(bench, name):
    arguments, text, *fields = REFUSED[name]
    goal = bench.under_way()
    refused = bench.goals.move_to(*arguments, **(fields[0] if fields else {}))
    result = bench.ends(refused, ABORTED, GoalCode.REFUSED, text)
    # A topic's refusal logs the same.
    bench.client.wait_for(
        lambda: f"refused a goal: {result.text}" in bench.machine.ik.output, "the line in the log"
    )
    assert goal.response is None
    assert bench.machine.state == "moving"
    goal.cancel()
    goal.result()


def test_a_speed_that_cannot_be_is_refused_where_the_platform_is_already(bench):
    bench.quickly_to(NEAR)
    goal = bench.goals.move_to(NEAR, speed=-1.0)
    bench.ends(goal, ABORTED, GoalCode.REFUSED, "speed = -1 m/s")


def test_a_stop_by_the_service_ends_it(bench):
    goal = bench.under_way()
    assert bench.client.call(Trigger, "ik_node/stop", Trigger.Request()).success
    bench.ends(goal, ABORTED, GoalCode.STOPPED, "stop was asked for")
    bench.machine.wait_for_state("idle")


def test_a_result_is_given_to_all_who_ask(bench):
    goal = bench.under_way()
    early = [goal.ask_again() for _ in range(3)]
    goal.cancel()
    bench.client.wait_for(lambda: all(each.done() for each in early), "all results")
    late = goal.ask_again()
    bench.client.wait_for(late.done, "the result")
    for future in (*early, late):
        response = future.result()
        assert (response.status, response.result) == (CANCELED, goal.result())


# These have machines of their own, and what the other one says meanwhile is not looked at.


def test_a_disabled_machine_ends_it_and_refuses_the_next_one(own_bench):
    bench = own_bench
    goal = bench.under_way()
    assert bench.client.enable(False).success
    bench.ends(goal, ABORTED, GoalCode.DISABLED, "disabled by request")
    bench.machine.wait_for_state("disabled")
    bench.ends(bench.goals.move_to(FAR), ABORTED, GoalCode.REFUSED, "no motion while disabled")
    assert bench.client.enable().success
    bench.ends(bench.goals.move_to(NEAR), SUCCEEDED, GoalCode.SUCCEEDED, "is reached")


def test_a_fault_ends_it_with_its_reason(own_bench):
    bench = own_bench
    goal = bench.under_way()
    assert bench.client.set_parameters("ik_node", {"tracking_error_limit": 0.01}).successful
    stuck = {"stuck_sliders": [True, False, False]}
    assert bench.client.set_parameters("simulator_node", stuck).successful
    result = bench.ends(goal, ABORTED, GoalCode.FAULT, "slider_1 is measured at")
    bench.machine.wait_for_state("fault")
    assert bench.machine.reason == result.text


def test_a_slider_that_is_stuck_short_of_the_target_makes_it_not_reached(own_bench):
    bench = own_bench
    bench.quickly_to(NEAR)
    stuck = {"stuck_sliders": [True, False, False]}
    assert bench.client.set_parameters("simulator_node", stuck).successful
    # Near enough to be no fault.
    target = (NEAR[0], NEAR[1], NEAR[2] + 0.002)
    goal = bench.goals.move_to(target)
    result = bench.ends(goal, ABORTED, GoalCode.NOT_REACHED, "NOT reached, measured")
    assert TOLERANCE < math.dist(place(result.position), target) < 0.005
    assert bench.client.set_parameters("simulator_node", HEALTHY).successful
    bench.ends(bench.goals.move_to(target), SUCCEEDED, GoalCode.SUCCEEDED, "is reached")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_node_that_ends_says_so(own_bench, number):
    bench = own_bench
    goals = [bench.under_way()]
    # This one may not have asked for its result yet, and is far from its end.
    goals.append(bench.goals.move_to((-0.08, 0.03, 0.35)).wait_until_accepted())
    bench.ends(goals[0], ABORTED, GoalCode.SUPERSEDED, "superseded")
    bench.machine.ik.process.send_signal(number)
    bench.ends(goals[1], ABORTED, GoalCode.SHUTDOWN, "the node ends")
    assert bench.machine.ik.process.wait(10.0) == 0
