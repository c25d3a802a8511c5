"""From a target to the first command that answers it, and from a command to the platform's pose."""

import random
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from benchmarks.harness import Figure, Missing, attempt, figure, in_turn
from benchmarks.ros_session import Session, pose_at, session

RATE = 500.0  # 1/s of each timer: the default of both nodes
BLOCKS = 6  # of each chain; each is another start of its nodes
SAMPLES = 20  # of a block: a single latency depends on where its timers just are
SETTLE_TIME = 0.1  # s between two samples: longer than the motion
NAMES = ["slider_1", "slider_2", "slider_3"]
POSES = ((0.0, 0.0, 0.25), (0.0, 0.0, 0.2505))
HEIGHTS = ((0.6, 0.6, 0.6), (0.6005, 0.6005, 0.6005))  # the first is where the machine starts


class Chain(NamedTuple):
    """Nodes, what goes in at one end, and what comes out at the other.

    Attributes:
        start: starts the nodes.
        given: type and topic of what goes in.
        answer: type and topic of what comes out.
        value_of: tells what changes in an answer.
    """

    start: Callable[[Session], object]
    given: tuple[type, str]
    answer: tuple[type, str]
    value_of: Callable[[Any], Sequence[float]]

    def latency(self, messages: Sequence[object], chance: random.Random) -> float:
        """Return the median time from a message to the first answer that differs [s].

        Nothing else runs meanwhile: two cores are too few for the nodes of two chains.
        """
        value: Sequence[float] = ()
        changed = 0.0
        latencies = []

        def on_answer(message: Any) -> None:
            nonlocal value, changed
            new = self.value_of(message)
            if new != value:
                changed = changed or time.monotonic()
                value = new

        with session() as running:
            self.start(running)
            publisher = running.node.create_publisher(*self.given, 10)
            running.node.create_subscription(*self.answer, on_answer, 10)
            running.spin_until(lambda: value and publisher.get_subscription_count(), "the chain")
            running.spin_for(1.0)
            for count in range(SAMPLES):
                # Anywhere between two cycles, or the timers would be met in step.
                running.spin_for(SETTLE_TIME + chance.uniform(0.0, 5.0 / RATE))
                changed = 0.0
                begin = time.monotonic()
                publisher.publish(messages[(count + 1) % 2])
                running.spin_until(lambda: changed, "an answer")  # noqa: B023
                latencies.append(changed - begin)
        return statistics.median(latencies)


def figures() -> Iterator[Figure | Missing]:
    """Measure chains of our nodes and of bare ones in turn."""
    pose, command = (PoseStamped, "target_pose"), (JointState, "joint_commands")

    def setpoint_of(message: JointState) -> Sequence[float]:
        return (*message.position, *message.velocity)

    yield _compared(
        "target to the first changed command",
        "bare node: PoseStamped in, timer, JointState out",
        Chain(_start_nodes("simulator_node", "ik_node"), pose, command, setpoint_of),
        Chain(_start_bare("setpoints"), pose, command, setpoint_of),
        [pose_at(position) for position in POSES],
        goal=1.15,
    )
    platform = (PoseStamped, "platform_pose")

    def place_of(message: PoseStamped) -> Sequence[float]:
        return (message.pose.position.x, message.pose.position.z)

    yield _compared(
        "command to platform pose, through simulator_node and fk_node",
        "two bare nodes: JointState in, timer, JointState on, PoseStamped out",
        Chain(_start_nodes("simulator_node", "fk_node"), command, platform, place_of),
        Chain(_start_bare("machine", "pose"), command, platform, place_of),
        [_command(heights) for heights in HEIGHTS],
        goal=0.9,
    )


def _compared(
    what: str, reference: str, ours: Chain, bare: Chain, messages: Sequence[object], goal: float
) -> Figure | Missing:
    def measure() -> Figure:
        chance = random.Random(5)
        one, other = (partial(chain.latency, messages, chance) for chain in (ours, bare))
        medians = in_turn(BLOCKS, one, other, warm_up=0)
        return figure(what, reference, *medians, goal=goal)

    return attempt(what, measure)


def _start_nodes(*names: str) -> Callable[[Session], object]:
    return lambda running: [running.start_node(name, "/") for name in names]


def _start_bare(*roles: str) -> Callable[[Session], object]:
    return lambda running: [running.start_bare(role, "/", RATE) for role in roles]


def _command(heights: tuple[float, float, float]) -> JointState:
    return JointState(name=NAMES, position=list(heights), velocity=[0.0, 0.0, 0.0])
