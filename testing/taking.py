"""Messages are taken from a subscription without an executor, which costs little."""

from collections.abc import Iterator
from typing import Any

from rclpy.subscription import Subscription


def taken(subscription: Subscription) -> Iterator[Any]:
    """Yield the messages that have come in, the oldest first."""
    handle = subscription.handle
    with handle:
        while (message := handle.take_message(subscription.msg_type, False)) is not None:
            yield message[0]


def taken_as_sent(subscription: Subscription) -> Iterator[Any]:
    """Yield them with the time at which they were sent as stamp: that of setpoints is nominal."""
    handle = subscription.handle
    with handle:
        while (taken := handle.take_message(subscription.msg_type, False)) is not None:
            message, info = taken
            stamp = message.header.stamp
            stamp.sec, stamp.nanosec = divmod(info["source_timestamp"], 1_000_000_000)
            yield message
