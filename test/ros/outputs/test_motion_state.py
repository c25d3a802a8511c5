"""The topic ~/motion_state: the engine's own numbers, told now and then, to listeners only."""

import itertools
import math

import pytest
from joined_domain import joined_domain
from motion_machine import HOME, TARGET, engine
from rclpy.node import Node
from rclpy.serialization import serialize_message

from testing.taking import taken
from testing.waiting import wait_until
from tri_glide_interfaces.msg import MotionState
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.ros.outputs import Motion, MotionStates, read_motion
from tri_glide_kinematics.ros.outputs.motion_state import NEWEST

pytestmark = pytest.mark.nodes

PERIOD = 0.002  # s
NUMBERS = itertools.count()


@pytest.fixture(scope="module")
def node():
    with joined_domain() as context:
        node = Node("telling", context=context)
        yield node
        node.destroy_node()


class Telling:
    """A publisher on a topic of its own, and who may listen to it."""

    def __init__(self, node, monkeypatch, rate=500.0, state_rate=50.0):
        self.node = node
        self.topic = f"~/motion_state_{next(NUMBERS)}"
        monkeypatch.setattr("tri_glide_kinematics.ros.outputs.motion_state.TOPIC", self.topic)
        values = {"base_frame": "base", "rate": rate, "state_publish_rate": state_rate}
        self.states = MotionStates(node, values)

    def due_in(self, cycles):
        return sum(self.states.is_due() for _ in range(cycles))

    def listen(self):
        self.subscription = self.node.create_subscription(
            MotionState, self.topic, lambda message: None, NEWEST
        )
        wait_until(lambda: self.due_in(1000), "a listener")

    def take(self):
        messages = []

        def has_come():
            messages.extend(taken(self.subscription))
            return messages

        wait_until(has_come, "a message")
        return messages[0]


@pytest.fixture
def telling(node, monkeypatch):
    return lambda *rates: Telling(node, monkeypatch, *rates)


def test_nothing_is_due_while_nobody_listens(telling):
    told = telling()
    assert told.due_in(1000) == 0
    told.listen()
    assert told.due_in(1000) == 100
    told.node.destroy_subscription(told.subscription)
    wait_until(lambda: told.due_in(1000) == 0, "nobody to listen")


@pytest.mark.parametrize(
    ("rate", "state_rate", "expected"),
    [(500.0, 50.0, 100), (500.0, 30.0, 60), (1000.0, 333.0, 333), (100.0, 2000.0, 1000)],
)
def test_so_many_cycles_are_told_of_evenly(telling, rate, state_rate, expected):
    told = telling(rate, state_rate)
    told.listen()
    due = [told.states.is_due() for _ in range(2000)]
    assert abs(sum(due) - 2 * expected) <= 1
    gaps = {len(list(run)) for is_due, run in itertools.groupby(due[100:1900]) if not is_due}
    assert not gaps or max(gaps) - min(gaps) <= 1


def test_the_message_has_the_setpoint_of_the_engine_and_the_measured_heights(telling):
    told = telling()
    told.listen()
    moving = engine()
    moving.move_to(TARGET)
    for _ in range(20):
        setpoint = moving.step(PERIOD)
    assert max(map(abs, setpoint.accelerations)) > 1.0
    before = told.node.get_clock().now().nanoseconds
    told.states.publish(setpoint, HOME)
    message = told.take()
    assert tuple(message.commanded_heights) == setpoint.heights
    assert tuple(message.commanded_velocities) == setpoint.velocities
    assert tuple(message.commanded_accelerations) == setpoint.accelerations
    assert tuple(message.measured_heights) == HOME
    assert message.header.frame_id == "base"
    stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
    assert before <= stamp <= told.node.get_clock().now().nanoseconds


def test_what_is_not_known_is_nan(telling):
    told = telling()
    told.listen()
    told.states.publish(None, HOME)
    message = told.take()
    assert tuple(message.measured_heights) == HOME
    for numbers in (
        message.commanded_heights,
        message.commanded_velocities,
        message.commanded_accelerations,
    ):
        assert all(map(math.isnan, numbers))
    told.states.publish(engine().state, None)
    message = told.take()
    assert all(map(math.isnan, message.measured_heights))
    assert tuple(message.commanded_heights) == HOME


def marked(frame, stamp, *triples):
    message = MotionState()
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = stamp
    (
        message.commanded_heights,
        message.commanded_velocities,
        message.commanded_accelerations,
        message.measured_heights,
    ) = triples
    return message


@pytest.mark.parametrize("frame", ["", *("abcdefghi"[:size] for size in range(1, 10)), "säule"])
def test_bytes_are_read_as_the_message_is_whatever_its_frame(frame):
    setpoint = SliderState((0.1, 0.2, 0.3), (0.4, -0.5, 0.6), (7.0, 8.0, -9.0))
    data = serialize_message(marked(frame, (12, 500_000_000), *setpoint, HOME))
    assert read_motion(data) == Motion(12.5, setpoint, HOME)
    unknown = (math.nan,) * 3
    data = serialize_message(marked(frame, (3, 0), *[unknown] * 3, HOME))
    assert read_motion(data) == Motion(3.0, None, HOME)
    data = serialize_message(marked(frame, (3, 0), *setpoint, unknown))
    assert read_motion(data) == Motion(3.0, setpoint, None)
