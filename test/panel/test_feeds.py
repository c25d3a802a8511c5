"""What the panel knows of the motion of a machine, and for how long."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
from joined_domain import joined_domain
from rclpy.node import Node
from rclpy.serialization import serialize_message

from tri_glide_interfaces.msg import MotionState
from tri_glide_kinematics.panel import feeds
from tri_glide_kinematics.panel.feeds import SILENCE, MotionFeed

pytestmark = pytest.mark.nodes

HEIGHTS = (0.6, 0.61, 0.62)
REST = (0.0, 0.0, 0.0)


@pytest.fixture
def feed() -> Iterator[MotionFeed]:
    with joined_domain() as context:
        node = Node("feeding", context=context)
        yield MotionFeed(node)
        node.destroy_node()


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
    later = feeds.time.monotonic() + SILENCE
    monkeypatch.setattr("tri_glide_kinematics.panel.feeds.time.monotonic", lambda: later)
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
