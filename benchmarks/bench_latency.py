"""From a target to the first command that answers it, and from a command to the platform's pose."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from benchmarks.harness import Figure, figure
from benchmarks.ros_session import Session, session

RATE = 500.0  # 1/s of each timer: the default of both nodes
SAMPLES = 480  # of each chain
BLOCK = 40  # samples to one ratio: a single latency depends on where its timers just are
SETTLE_TIME = 0.15  # s between two samples of one chain: longer than the motion
NAMES = ["slider_1", "slider_2", "slider_3"]
POSES = ((0.0, 0.0, 0.25), (0.0, 0.0, 0.2505))
HEIGHTS = ((0.6, 0.6, 0.6), (0.6005, 0.6005, 0.6005))  # the first is where the machine starts


class Chain:
    """What goes in at one end, and what comes out at the other."""

    def __init__(
        self,
        running: Session,
        given: tuple[type, str],
        answer: tuple[type, str],
        value_of: Callable[[Any], Sequence[float]],
    ) -> None:
        """Join the two topics; ``value_of`` tells what changes in an answer."""
        self._publisher = running.probe.create_publisher(*given, 10)
        running.probe.create_subscription(*answer, self._on_answer, 10)
        self._running = running
        self._value_of = value_of
        self._value: Sequence[float] | None = None
        self._changed = 0.0

    def is_ready(self) -> bool:
        """Tell whether somebody listens, and answers flow."""
        return self._publisher.get_subscription_count() > 0 and self._value is not None

    def latency(self, message: object) -> float:
        """Return the time from publishing ``message`` to the first answer that differs [s]."""
        self._changed = 0.0
        begin = time.monotonic()
        self._publisher.publish(message)
        self._running.spin_until(lambda: self._changed, "an answer")
        return self._changed - begin

    def _on_answer(self, message: Any) -> None:
        value = self._value_of(message)
        if value != self._value:
            self._changed = self._changed or time.monotonic()
            self._value = value


def figures() -> Iterator[Figure]:
    """Measure one chain after the other, each beside a chain of bare nodes."""
    with session() as running:
        running.start_node("simulator_node", "/ours")
        running.start_node("ik_node", "/ours")
        running.start_bare("setpoints", "/bare", RATE)
        chains = [
            Chain(
                running,
                (PoseStamped, f"{namespace}/target_pose"),
                (JointState, f"{namespace}/joint_commands"),
                lambda message: (*message.position, *message.velocity),
            )
            for namespace in ("/ours", "/bare")
        ]
        yield figure(
            "target to the first changed command",
            "bare node: PoseStamped in, timer, JointState out",
            *_measure(running, chains, [_pose(position) for position in POSES]),
            1.3,
        )
    with session() as running:
        running.start_node("simulator_node", "/ours")
        running.start_node("fk_node", "/ours")
        running.start_bare("machine", "/bare", RATE)
        running.start_bare("pose", "/bare")
        chains = [
            Chain(
                running,
                (JointState, f"{namespace}/joint_commands"),
                (PoseStamped, f"{namespace}/platform_pose"),
                lambda message: (message.pose.position.x, message.pose.position.z),
            )
            for namespace in ("/ours", "/bare")
        ]
        yield figure(
            "command to platform pose, through simulator_node and fk_node",
            "two bare nodes: JointState in, timer, JointState on, PoseStamped out",
            *_measure(running, chains, [_command(heights) for heights in HEIGHTS]),
            1.3,
        )


def _measure(
    running: Session, chains: Sequence[Chain], messages: Sequence[object]
) -> tuple[list[float], list[float]]:
    """Return the median latency of each block of samples, for each chain [s]."""
    running.spin_until(lambda: all(chain.is_ready() for chain in chains), "both chains")
    running.spin_for(1.0)
    chance = random.Random(5)
    samples: list[list[float]] = [[] for _ in chains]
    for count in range(SAMPLES):
        for chain, times in zip(chains, samples):
            # Anywhere between two cycles, or the timers would be met in step.
            running.spin_for(0.5 * SETTLE_TIME + chance.uniform(0.0, 5.0 / RATE))
            times.append(chain.latency(messages[(count + 1) % 2]))
    ours, bare = (np.median(np.reshape(times, (-1, BLOCK)), axis=1).tolist() for times in samples)
    return ours, bare


def _pose(position: tuple[float, float, float]) -> PoseStamped:
    message = PoseStamped()
    point = message.pose.position
    point.x, point.y, point.z = position
    return message


def _command(heights: tuple[float, float, float]) -> JointState:
    return JointState(name=NAMES, position=list(heights), velocity=[0.0, 0.0, 0.0])
