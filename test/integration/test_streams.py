"""Streams of commands: the cycle goes on, jogs turn, moving targets are followed."""

import math
import time

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from shared_machine import shared_nodes

from testing.client import Client
from testing.commands import KINEMATICS, LIMITS, assert_within_limits, check, stream_of
from testing.driven_programs import WORKSPACE
from testing.machine import Machine
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.motion import plan_move

INTERVAL = 0.01  # s between two commands
HEIGHT = 0.25  # m
ROUND = 400  # setpoints
LATE = 1.5  # periods
# A busy computer gets so many rounds.
ROUNDS = 6
# So many late cycles more than without commands are allowed; the fault of old had one in five.
MORE_LATE = 0.08
RATE = 500.0  # 1/s
# The time between setpoints is long enough for so many plans of a move, each with its checks.
PLANS = 5


def turning(client, now):
    angle = math.pi * now
    client.send_twist((0.1 * math.cos(angle), 0.1 * math.sin(angle), 0.0))


def circling_pose(client, now):
    angle = math.pi * now
    client.send_pose((0.03 * math.cos(angle), 0.03 * math.sin(angle), HEIGHT))


def circling_state(client, now):
    (x, y), (dx, dy) = circle(now)
    client.send_state((x, y, HEIGHT), (dx, dy, 0.0))


def circle(now, radius=0.03, turns=0.5):
    rate = 2.0 * math.pi * turns
    x, y = radius * math.cos(rate * now), radius * math.sin(rate * now)
    return (x, y), (-rate * y, rate * x)


def rate_of_this_computer():
    """Return the rate of setpoints that fits the speed of this computer, ``RATE`` at most [1/s]."""
    took = []
    for _ in range(51):
        begin = time.process_time()
        plan_move(WORKSPACE, LIMITS, (-0.03, 0.02, HEIGHT), (0.03, -0.02, HEIGHT))
        took.append(time.process_time() - begin)
    return min(RATE, 1.0 / (PLANS * float(np.median(took))))


def late_part(machine, client, rate, send=None):
    """Return which part of the setpoints is late while commands are sent, or nothing is."""
    timer = None
    if send is not None:
        timer = client.node.create_timer(INTERVAL, lambda: send(client, 1e-9 * client.now()))
    first = len(machine.commands)
    client.wait_for(lambda: len(machine.commands) > first + ROUND, "setpoints")
    if timer is not None:
        timer.cancel()
    times = [client.time_of(message) for message in machine.commands[first:]]
    return float(np.mean(1e-9 * np.diff(times) > LATE / rate))


@pytest.fixture(scope="module")
def shared(ros_domain, ros_context, tmp_path_factory):
    rate = rate_of_this_computer()
    with shared_nodes(ros_context, tmp_path_factory, "streams") as (client, launcher):
        yield Machine(client, launcher).start({"motion": "slider", "rate": rate}), rate


@pytest.mark.alone
@pytest.mark.parametrize(
    ("send", "state"),
    [(turning, "jogging"), (circling_pose, "moving"), (circling_state, "tracking")],
)
def test_a_stream_of_commands_does_not_make_setpoints_late(shared, send, state):
    machine, rate = shared
    client = machine.client
    machine.forget()
    idle = [late_part(machine, client, rate)]
    busy = []
    # A busy computer is busy with both; the best round of each shows what the node can do.
    for _ in range(ROUNDS):
        busy.append(late_part(machine, client, rate, send))
        machine.wait_for_state("idle")
        idle.append(late_part(machine, client, rate))
        if min(busy) <= min(idle) + MORE_LATE:
            break
    assert state in machine.states_since(0)
    assert min(busy) <= min(idle) + MORE_LATE, (rate, busy, idle)
    check(stream_of(machine, period=1.0 / rate), LIMITS)


def test_poses_at_a_rate_are_followed_and_the_last_one_is_reached(running_machine):
    machine, client = running_machine, running_machine.client
    assert client.set_parameters("ik_node", {"follow_poses": True}).successful
    begin = client.now()
    timer = client.node.create_timer(
        1.0 / 30.0, lambda: circling_pose(client, 1e-9 * (client.now() - begin))
    )
    machine.wait_for_state("tracking")
    client.wait_for(lambda: client.now() > begin + 2e9, "a circle")
    timer.cancel()
    machine.wait_for_state("idle")
    assert machine.cause is Cause.TARGET_REACHED
    x, y, z = KINEMATICS.forward(machine.heights())
    assert (math.hypot(x, y), z) == pytest.approx((0.03, HEIGHT), abs=1e-4)
    assert_within_limits(machine)
    assert client.set_parameters("ik_node", {"follow_poses": False}).successful


def test_two_senders_are_told_of(running_machine, ros_context):
    machine, client = running_machine, running_machine.client
    reports = client.record(DiagnosticArray, "/diagnostics")
    second = Client(ros_context, client.namespace)
    try:
        client.wait_for(
            lambda: any(
                "target_state: the newest message wins" in state.remark for state in machine.states
            ),
            "the remark in the state",
        )
        client.wait_for(lambda: reports, "diagnostics")
        words = "target_pose: the newest message wins"
        assert not any(words in state.remark for state in machine.states)
        assert client.set_parameters("ik_node", {"follow_poses": True}).successful
        client.wait_for(lambda: words in machine.states[-1].remark, "that poses are a stream now")
    finally:
        client.set_parameters("ik_node", {"follow_poses": False})
        second.close()
