"""What the panel knows of the motion of a machine, and for how long."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
from joined_domain import joined_domain
from rclpy.node import Node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu

from testing.waiting import wait_until
from tri_glide_interfaces.msg import MachineState, MotionState
from tri_glide_kinematics.panel import link
from tri_glide_kinematics.panel.link import (
    SILENCE,
    STATE_SILENCE,
    Feeds,
    MotionFeed,
    SteadyTimes,
    SwingFeed,
    read_acceleration,
)

pytestmark = pytest.mark.nodes

HEIGHTS = (0.6, 0.61, 0.62)
REST = (0.0, 0.0, 0.0)


@pytest.fixture
def node() -> Iterator[Node]:
    with joined_domain() as context:
        node = Node("feeding", context=context)
        yield node
        node.destroy_node()


@pytest.fixture
def feed(node: Node) -> MotionFeed:
    return MotionFeed(node)


def told(feed: MotionFeed, measured: tuple[float, float, float] = HEIGHTS) -> None:
    """Let the feed take a message."""
    message = MotionState(
        commanded_heights=HEIGHTS,
        commanded_velocities=REST,
        commanded_accelerations=REST,
        measured_heights=measured,
    )
    feed.subscription.callback(serialize_message(message))


def test_what_was_told_long_ago_is_not_known(
    feed: MotionFeed, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert feed.commanded is None
    told(feed)
    assert feed.commanded is not None
    assert (feed.commanded.heights, feed.measured) == (HEIGHTS, HEIGHTS)
    later = link.time.monotonic() + SILENCE
    monkeypatch.setattr("tri_glide_kinematics.panel.link.time.monotonic", lambda: later)
    assert feed.commanded is None
    assert feed.measured is None
    # The curves show it all the same.
    assert len(feed.unseen) == 1


def test_what_another_node_has_told_is_forgotten(feed: MotionFeed) -> None:
    told(feed)
    feed.forget()
    assert feed.commanded is None
    assert feed.measured is None
    assert not feed.unseen


def test_sliders_that_are_not_measured_are_nowhere(feed: MotionFeed) -> None:
    told(feed, (math.nan,) * 3)
    assert feed.measured is None
    assert feed.commanded is not None


@pytest.mark.parametrize(("speed", "is_silent"), [(0.025, True), (0.0, False), (math.nan, False)])
def test_a_machine_that_moved_and_tells_no_more_is_not_heard(
    node: Node, monkeypatch: pytest.MonkeyPatch, speed: float, is_silent: bool
) -> None:
    all_feeds = Feeds(node, "/ik_node")
    assert not all_feeds.is_silent
    all_feeds._on_state(MachineState(state=MachineState.MOVING, speed=speed))
    assert not all_feeds.is_silent
    later = link.time.monotonic() + 1.1 * STATE_SILENCE
    monkeypatch.setattr("tri_glide_kinematics.panel.link.time.monotonic", lambda: later)
    assert all_feeds.is_silent == is_silent


def imu(number: float, frame: str = "tri_glide_platform") -> Imu:
    """Return a message whose other numbers are not those of the acceleration."""
    message = Imu(orientation_covariance=[9.0] * 9, linear_acceleration_covariance=[8.0] * 9)
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = 7, 250_000_000
    acceleration = message.linear_acceleration
    acceleration.x, acceleration.y, acceleration.z = number, -2.0, 9.81
    return message


@pytest.mark.parametrize("frame", ["", "a", "imu", "frame_7", "tri_glide_platform"])
def test_an_acceleration_is_read_behind_any_frame(frame: str) -> None:
    data = serialize_message(imu(1.5, frame))
    assert read_acceleration(data) == (7.25, 1.5, -2.0, 9.81)


def test_an_accelerometer_is_listened_to_only_when_it_is_wanted(node: Node) -> None:
    publisher = node.create_publisher(Imu, "imu/data_raw", 10)
    swing = SwingFeed(node)

    def wait_for_listeners(count: int) -> None:
        wait_until(lambda: publisher.get_subscription_count() == count, f"{count} listeners")

    for _ in range(2):
        assert not swing.own
        assert len(swing.take()) == 0
        swing.listen()
        wait_for_listeners(1)
        # Bytes of something else tell nothing, and stop nothing.
        publisher.publish(b"\x00\x01\x00\x00\x01\x02\x03\x04")
        for number in range(5):
            publisher.publish(imu(float(number)))
        samples: list[list[float]] = []

        def five_are_taken() -> bool:
            samples.extend(swing.take().tolist())  # noqa: B023
            return len(samples) >= 5  # noqa: B023

        wait_until(five_are_taken, "samples")
        assert samples == [[7.25, float(number), -2.0, 9.81] for number in range(5)]
        swing.close()
        wait_for_listeners(0)


def test_stamps_of_another_clock_are_placed_on_the_steady_one() -> None:
    times = SteadyTimes()
    assert 100.0 + times.offset(100.0, 5.0) == 5.0
    # What is late by itself has its own place.
    assert 100.5 + times.offset(100.5, 5.7) == 5.5
    # It was on its way for a shorter time than the first.
    assert 101.0 + times.offset(101.0, 5.9) == pytest.approx(5.9)
    # The other clock was set.
    assert 50.0 + times.offset(50.0, 6.0) == 6.0
