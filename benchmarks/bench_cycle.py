"""The control cycle of ``ik_node`` at 1 kHz: the work in its callback, and the whole process."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from benchmarks.harness import Figure, Missing, NoAnswerError, attempt, figure
from benchmarks.processor_time import processor_time
from benchmarks.ros_session import Session, session
from benchmarks.timed_cycle import RATE

WINDOWS = 12
WINDOW_TIME = 2.0  # s
TARGETS = ((0.08, 0.0, 0.25), (-0.05, 0.06, 0.22), (-0.04, -0.07, 0.30))
TARGET_PERIOD = 0.25  # s: the machine is always moving
BARE_TIMER = "bare rclpy timer that publishes an equal JointState"
LISTENING_TIMER = f"{BARE_TIMER}, and takes in as many measured ones"

Times = tuple[list[float], list[float]]


def figures() -> Iterator[Figure | Missing]:
    """Run ``ik_node`` and a bare timer at the same time, on a core each, and compare them."""
    work = "ik_node at 1 kHz, one cycle: work in the callback"
    load = "ik_node at 1 kHz: CPU time per second"
    try:
        works, loads = _compared("timer", [])
        yield figure(work, BARE_TIMER, *works, goal=1.5)
        yield figure(load, BARE_TIMER, *loads, goal=1.5)
    except NoAnswerError as error:
        yield from (Missing(what, str(error), is_failure=True) for what in (work, load))
    remaps = ["joint_commands:=/ours/joint_states", "joint_states:=joint_commands"]
    yield attempt(
        "the same", lambda: figure("the same", LISTENING_TIMER, *_compared("machine", remaps)[1])
    )


def _compared(role: str, remaps: list[str]) -> tuple[Times, Times]:
    """Return work in the callback and CPU time of ``ik_node`` and of a bare node.

    Args:
        role: of the bare node.
        remaps: of the bare node's topics.
    """
    with tempfile.TemporaryDirectory() as folder, session() as running:
        files = [Path(folder, name) for name in ("ours.npy", "bare.npy")]
        module = "benchmarks.timed_cycle"
        running.start_node("simulator_node", "/ours")
        pids = (
            running.start_module(module, [str(files[0]), "ik_node"], "ik_node", "/ours", rate=RATE),
            running.start_module(module, [str(files[1]), role], role, "/bare", remaps),
        )
        windows, processor_time = _drive(running, pids)
        running.stop()
        calls = [np.load(file) for file in files]
    work: Times = ([], [])
    for begin, end in windows:
        for side in (0, 1):
            started, taken = calls[side].T
            work[side].append(1e-9 * float(np.median(taken[(started >= begin) & (started < end)])))
    return work, processor_time


def _drive(running: Session, pids: tuple[int, int]) -> tuple[list[tuple[int, int]], Times]:
    """Keep the machine moving; return begin and end of each window and the CPU time in it."""
    commands = {"ours": 0, "bare": 0}
    listeners = {
        name: running.probe.create_subscription(
            JointState,
            f"/{name}/joint_commands",
            partial(_count, commands, name),
            qos_profile_sensor_data,
        )
        for name in commands
    }
    publisher = running.probe.create_publisher(PoseStamped, "/ours/target_pose", 10)
    running.spin_until(lambda: all(commands.values()), "commands")
    # The simulator listens to ours: so each publishes to one that listens.
    running.probe.destroy_subscription(listeners["ours"])
    message = PoseStamped()
    windows = []
    used: Times = ([], [])
    count = 0
    for window in range(-1, WINDOWS):  # the first is for warming up
        for side, pid in enumerate(pids):
            _pin(pid, (window + side) % 2)
        begin, before = time.monotonic_ns(), [processor_time(pid) for pid in pids]
        while time.monotonic_ns() - begin < 1e9 * WINDOW_TIME:
            point = message.pose.position
            point.x, point.y, point.z = TARGETS[count % len(TARGETS)]
            count += 1
            publisher.publish(message)
            time.sleep(TARGET_PERIOD)
        end, after = time.monotonic_ns(), [processor_time(pid) for pid in pids]
        if window >= 0:
            windows.append((begin, end))
            for side in (0, 1):
                used[side].append((after[side] - before[side]) / (end - begin))
    return windows, used


def _count(counts: dict[str, int], name: str, _: JointState) -> None:
    counts[name] += 1


def _pin(pid: int, place: int) -> None:
    """Keep all threads of a process on one core: with two processes, each has its own."""
    cores = sorted(os.sched_getaffinity(0))
    for task in Path(f"/proc/{pid}/task").iterdir():
        os.sched_setaffinity(int(task.name), {cores[place % len(cores)]})
