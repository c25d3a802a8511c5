"""The control cycle: the work in its callback, and the processor time of each node that has one."""

import itertools
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.qos import qos_profile_sensor_data
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState

from benchmarks.harness import Figure, Missing, NoAnswerError, attempt, figure
from benchmarks.machine import processor_time
from benchmarks.ros_session import Session, pose_at, session
from benchmarks.timed_cycle import RATE

WINDOWS = 12
WINDOW_TIME = 2.0  # s
TARGETS = ((0.08, 0.0, 0.25), (-0.05, 0.06, 0.22), (-0.04, -0.07, 0.30))
TARGET_PERIOD = 0.25  # s: the machine is always moving
DEFAULT_RATE = 500.0  # 1/s of the nodes
BARE_TIMER = "bare rclpy timer that publishes an equal JointState"
LISTENING_TIMER = f"{BARE_TIMER}, and takes in as many measured ones"
RELAY = "bare rclpy timer that publishes an equal JointState, and takes in as many commands"
ANSWER = "bare rclpy node that answers each JointState with a pose and a twist"

OURS, BARE = "/ours", "/bare"
MEASURED_OF_OURS = ("joint_states:=/ours/joint_states",)
COMMANDS_OF_OURS = ("joint_commands:=/ours/joint_commands",)
# The bare relay in the place of ik_node: it takes in what ours takes in.
IN_PLACE_OF_IK = ("joint_commands:=/ours/joint_states", "joint_states:=joint_commands")

Times = tuple[list[float], list[float]]
Pids = tuple[int, int]


def figures() -> Iterator[Figure | Missing]:
    """Run each node and a bare one at the same time, on a core each, and compare them."""
    work = "ik_node at 1 kHz, one cycle: work in the callback"
    load = "ik_node at 1 kHz: CPU time per second"
    try:
        works, loads = _ik_node("timer", ())
        yield figure(work, BARE_TIMER, *works, goal=1.5)
        yield figure(load, BARE_TIMER, *loads, goal=1.5)
    except NoAnswerError as error:
        yield from (Missing(what, str(error), is_failure=True) for what in (work, load))
    for what, reference, measure in (
        (
            "ik_node at 1 kHz with 500 measurements a second: CPU time per second",
            LISTENING_TIMER,
            lambda: _ik_node("machine", IN_PLACE_OF_IK)[1],
        ),
        ("simulator_node at 500 Hz: CPU time per second", RELAY, _simulator_node),
        ("fk_node at 500 Hz: CPU time per second", ANSWER, _fk_node),
    ):
        yield attempt(what, partial(_load, what, reference, measure))


def _load(what: str, reference: str, measure: Callable[[], Times]) -> Figure:
    return figure(what, reference, *measure(), goal=0.4)


def _ik_node(role: str, remaps: tuple[str, ...]) -> tuple[Times, Times]:
    """Return work in the callback and CPU time of ``ik_node`` and of a bare node.

    Args:
        role: of the bare node.
        remaps: of the bare node's topics.
    """
    with tempfile.TemporaryDirectory() as folder, session() as running:
        files = [Path(folder, name) for name in ("ours.npy", "bare.npy")]
        module = "benchmarks.timed_cycle"
        running.start_node("simulator_node", OURS)
        pids = (
            running.start_module(module, [str(files[0]), "ik_node"], "ik_node", OURS, rate=RATE),
            running.start_module(module, [str(files[1]), role], role, BARE, remaps),
        )
        # The simulator listens to ours: so each publishes to one that listens.
        _listen(running, JointState, f"{BARE}/joint_commands")
        first = _listen(running, JointState, f"{OURS}/joint_commands")
        running.node.destroy_subscription(first)
        publisher = running.node.create_publisher(PoseStamped, f"{OURS}/target_pose", 10)
        targets = itertools.cycle(map(pose_at, TARGETS))
        windows, loads = watch(pids, lambda: publisher.publish(next(targets)))
        running.stop()
        calls = [np.load(file) for file in files]
    work: Times = ([], [])
    for begin, end in windows:
        for side in (0, 1):
            started, taken = calls[side].T
            work[side].append(1e-9 * float(np.median(taken[(started >= begin) & (started < end)])))
    return work, loads


def _simulator_node() -> Times:
    """Return the CPU time of ``simulator_node`` and of a bare node that gets the same commands."""
    with session() as running:
        running.start_bare("timer", OURS, DEFAULT_RATE)
        pids = (
            running.start_node("simulator_node", OURS),
            running.start_bare("machine", BARE, DEFAULT_RATE, COMMANDS_OF_OURS),
        )
        for place in (OURS, BARE):
            _listen(running, JointState, f"{place}/joint_states")
        return watch(pids)[1]


def _fk_node() -> Times:
    """Return the CPU time of ``fk_node`` and of a bare node that gets the same measurements."""
    with session() as running:
        running.start_node("simulator_node", OURS)
        pids = (
            running.start_node("fk_node", OURS),
            running.start_bare("pose_and_twist", BARE, DEFAULT_RATE, MEASURED_OF_OURS),
        )
        for place in (OURS, BARE):
            _listen(running, PoseStamped, f"{place}/platform_pose")
            _listen(running, TwistStamped, f"{place}/platform_twist")
        return watch(pids)[1]


def _listen(running: Session, kind: type, topic: str) -> Subscription:
    """Wait for a first message, and stay a listener: messages then come in, and nobody looks."""
    received: list[Any] = []
    listener = running.node.create_subscription(
        kind, topic, received.append, qos_profile_sensor_data
    )
    running.spin_until(lambda: received, topic)
    return listener


def watch(
    pids: Pids, act: Callable[[], None] = lambda: None
) -> tuple[list[tuple[int, int]], Times]:
    """Return begin and end of each window [ns], and the CPU time per second in it.

    Args:
        pids: processes; each is on a core of its own, the other one in the next window.
        act: is called each ``TARGET_PERIOD`` seconds.
    """
    windows = []
    used: Times = ([], [])
    for window in range(-1, WINDOWS):  # the first is for warming up
        for side, pid in enumerate(pids):
            _pin(pid, (window + side) % 2)
        begin, before = time.monotonic_ns(), [processor_time(pid) for pid in pids]
        while time.monotonic_ns() - begin < 1e9 * WINDOW_TIME:
            act()
            time.sleep(TARGET_PERIOD)
        end, after = time.monotonic_ns(), [processor_time(pid) for pid in pids]
        if window >= 0:
            windows.append((begin, end))
            for side in (0, 1):
                used[side].append((after[side] - before[side]) / (end - begin))
    return windows, used


def _pin(pid: int, place: int) -> None:
    """Keep all threads of a process on one core: with two processes, each has its own."""
    cores = sorted(os.sched_getaffinity(0))
    for task in Path(f"/proc/{pid}/task").iterdir():
        os.sched_setaffinity(int(task.name), {cores[place % len(cores)]})
