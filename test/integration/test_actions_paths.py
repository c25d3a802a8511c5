"""The action ~/follow_path and target_path of ik_node, over real processes.

``~/pause`` and ``~/resume`` are in test_examples.py and test_process_faults.py.
"""

import itertools
import math

import numpy as np
import pytest
from action_bench import NEAR
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path

from testing.commands import KINEMATICS
from tri_glide_interfaces.msg import MachineState, Output
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS

SUCCEEDED, ABORTED = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED
SQUARE = [(0.04, 0.0, 0.25), (0.04, 0.04, 0.25), (0.0, 0.04, 0.25), (0.0, 0.0, 0.25)]
TOLERANCE = 0.001  # m, path_tolerance by default


def places(bench, first=0):
    """Return where the platform was commanded to be since a number of commands."""
    heights = [bench.machine.heights(message) for message in bench.machine.commands[first:]]
    return np.array([KINEMATICS.forward(each) for each in heights])


def distances_from(points, places):
    """Return how far places are from a polyline."""
    points = np.asarray(points)
    nearest = np.full(len(places), np.inf)
    for begin, end in itertools.pairwise(points):
        along = np.clip((places - begin) @ (end - begin) / ((end - begin) @ (end - begin)), 0, 1)
        there = begin + along[:, np.newaxis] * (end - begin)
        nearest = np.minimum(nearest, np.linalg.norm(places - there, axis=1))
    return nearest


def test_it_drives_a_square_within_its_tolerance_and_tells_how_far(bench):
    bench.quickly_to(NEAR)
    first = len(bench.machine.commands)
    goal = bench.goals.follow(SQUARE)
    result = bench.ends(goal, SUCCEEDED, GoalCode.SUCCEEDED, "path of 4 segments is reached")
    bench.machine.catch_up()
    distances = distances_from([NEAR, *SQUARE], places(bench, first))
    assert 0.2 * TOLERANCE < distances.max() <= TOLERANCE
    assert distances.max() <= result.largest_deviation <= TOLERANCE
    ways = [feedback.way for feedback in goal.feedback]
    assert ways == sorted(ways)
    segments = [feedback.segment for feedback in goal.feedback]
    assert segments == sorted(segments)
    # A busy computer may know of the goal when its first segment is over.
    assert {1, 2, 3} <= set(segments) <= {0, 1, 2, 3}
    total = goal.feedback[0].way + goal.feedback[0].way_remaining
    assert 0.15 < total < 0.16


def test_outputs_are_told_at_their_place_and_the_state_tells_where_it_is(bench):
    bench.quickly_to(NEAR)
    bench.set_speed(1.0)
    outputs = bench.client.record(Output, f"{bench.client.namespace}/outputs", LATEST_OUTPUTS)
    known = len(bench.machine.states)
    goal = bench.goals.follow(
        SQUARE,
        speeds=[0.1],
        output_segments=[0, 1, 1, 3],
        outputs=[
            Output(name="digital", number=number, value=number / 2.0) for number in (4, 5, 6, 7)
        ],
    )
    bench.ends(goal, SUCCEEDED, GoalCode.SUCCEEDED, "path of 4 segments is reached")
    bench.client.wait_for(lambda: len(outputs) == 4, "all outputs")
    assert [(each.name, each.number, each.value) for each in outputs] == [
        ("digital", number, number / 2.0) for number in (4, 5, 6, 7)
    ]
    bench.machine.catch_up()
    told = list(bench.machine.states)[known:]
    driving = [state for state in told if state.state == MachineState.MOVING]
    # The way to go is some 1.6 s long; a busy computer loses some.
    assert driving
    assert max(state.speed for state in driving) == pytest.approx(0.1, rel=0.01)
    ways = [state.way_remaining for state in driving if not math.isnan(state.way_remaining)]
    assert ways == sorted(ways, reverse=True) and ways[0] > 0.1
    # At the end nothing is left, and it is told again twice a second.
    last = bench.machine.states[-1]
    assert (last.speed, last.way_remaining, last.time_remaining) == (0.0, 0.0, 0.0)
    count = len(bench.machine.states)
    bench.client.wait_for(lambda: len(bench.machine.states) > count + 1, "signs of life")
    again = [bench.client.time_of(state) for state in bench.machine.states[count:]]
    assert min(np.diff(again)) > 0.45e9


# test/motion/path/test_flat_path.py and test/ros/inputs/test_path_messages.py have all of them.
BAD = [
    ({"points": [(math.nan, 0.0, 0.25)]}, "number 1 of segment 1 = nan"),
    ({"points": SQUARE, "frame": "world"}, "path has frame_id 'world'"),
    ({"points": [(0.5, 0.0, 0.25)]}, "outside the workspace"),
    ({"points": SQUARE, "output_segments": [0]}, "output_segments has shape (1,), expected (0,)"),
]


def test_what_is_no_path_is_refused_with_the_reason_and_disturbs_nothing(bench):
    bench.quickly_to(NEAR)
    for arguments, text in BAD:
        bench.ends(bench.goals.follow(**arguments), ABORTED, GoalCode.REFUSED, text)
        assert bench.machine.state == "idle"
    assert math.dist(places(bench)[-1], NEAR) < 1e-6


def test_target_path_does_the_same_without_an_answer(bench):
    bench.quickly_to(NEAR)
    bench.set_speed(1.0)
    publisher = bench.client.publisher(Path, "target_path")
    bench.client.wait_for_subscribers(publisher)
    message = Path()
    for point in SQUARE[:3]:
        pose = PoseStamped()
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = point
        message.poses.append(pose)

    def is_there():
        publisher.publish(message)
        bench.client.spin_for(0.2)
        return bench.machine.state == "moving"

    bench.client.wait_for(is_there, "a motion")
    bench.client.wait_for(
        lambda: bench.machine.cause is Cause.TARGET_REACHED, "the end of the path"
    )
    assert bench.machine.states[-1].target_kind == MachineState.TARGET_PATH
    assert "path in a message" in bench.machine.reason
    bench.machine.catch_up()
    assert KINEMATICS.forward(bench.machine.heights()) == pytest.approx(SQUARE[2], abs=1e-6)
    message.header.frame_id = "world"
    bench.machine.wait_for_refusal(Refusal.WRONG_FRAME, lambda: publisher.publish(message))
    assert "target path has frame_id 'world'" in bench.machine.ik.output
