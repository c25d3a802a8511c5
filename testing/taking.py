"""Messages are taken from a subscription without an executor, which costs little."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.subscription import Subscription


def taken(subscription: Subscription) -> Iterator[Any]:
    """Yield the messages that have come in, the oldest first."""
    handle = subscription.handle
    with handle:
        while (message := handle.take_message(subscription.msg_type, False)) is not None:
            yield message[0]
