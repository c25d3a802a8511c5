"""The action ~/move_to of ik_node: each way in which a goal can end, over real processes."""

import math
import signal

import numpy as np
import pytest
from action_bench import FAR, NEAR, SLOW, ActionBench
from action_msgs.msg import GoalStatus

from testing.commands import KINEMATICS
from testing.goals import ERROR_NONE
from testing.processes import TIMEOUT
from tri_glide_interfaces.action import FollowPath, MoveTo
from tri_glide_kinematics.motion.engine import GoalCode

TOLERANCE = 0.0005  # m, position_tolerance by default
SUCCEEDED, ABORTED = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED
CANCELED = GoalStatus.STATUS_CANCELED


@pytest.fixture
def own_bench(request, client, nodes):
    """Return a machine for tests that end it, or make it begin anew, or give it parameters."""
    return ActionBench(client, nodes).start(getattr(request, "param", SLOW))


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
    # Ten times in a second, for two and a half; a busy computer loses some.
    assert len(ways) > 1
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


REFUSED = [
    (((0.5, 0.0, 0.25),), "outside the workspace at (0.5, 0, 0.25) m"),
    (((1e300, 0.0, 0.25),), "1e+300"),
    ((NEAR, "world"), "target pose has frame_id 'world'"),
    ((NEAR,), "kind = 'fast' must be one of linear, slider", {"kind": "fast"}),
    ((NEAR,), "speed = 1 m/s must be 0", {"kind": "slider", "speed": 1.0}),
    ((NEAR,), "speed = -1 m/s must be 0, or 1e-05 to", {"speed": -1.0}),
    ((NEAR,), "speed = nan is not a finite", {"speed": math.nan}),
]


def test_what_cannot_be_is_refused_with_the_reason_and_disturbs_nothing(bench):
    goal = bench.under_way()
    sent = [
        (bench.goals.move_to(*arguments, **(fields[0] if fields else {})), text)
        for arguments, text, *fields in REFUSED
    ]
    for refused, text in sent:
        result = bench.ends(refused, ABORTED, GoalCode.REFUSED, text)
    assert goal.response is None
    assert bench.machine.state == "moving"
    # A topic's refusal logs the same.
    bench.client.wait_for(
        lambda: f"refused a goal: {result.text}" in bench.machine.ik.output, "the line in the log"
    )
    bench.client.send_pose(NEAR)
    bench.ends(goal, ABORTED, GoalCode.SUPERSEDED, "superseded by target (0, 0, 0.25) m")


def test_a_speed_that_cannot_be_is_refused_where_the_platform_is_already(bench):
    bench.quickly_to(NEAR)
    goal = bench.goals.move_to(NEAR, speed=-1.0)
    bench.ends(goal, ABORTED, GoalCode.REFUSED, "speed = -1 m/s")


# These have machines of their own, and what the other one says meanwhile is not looked at.


def test_a_node_that_ends_says_so(own_bench):
    bench = own_bench
    goals = [bench.under_way()]
    # This one may not have asked for its result yet, and is far from its end.
    goals.append(bench.goals.move_to((-0.08, 0.03, 0.35)).wait_until_accepted())
    bench.ends(goals[0], ABORTED, GoalCode.SUPERSEDED, "superseded")
    bench.machine.ik.process.send_signal(signal.SIGTERM)
    bench.ends(goals[1], ABORTED, GoalCode.SHUTDOWN, "the node ends")
    assert bench.machine.ik.process.wait(TIMEOUT) == 0
