"""Inputs that a node checks in each cycle, without rclpy's executor."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from time import monotonic
from typing import Any, Protocol, TypeAlias

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message
from rclpy.service import Service
from rclpy.subscription import Subscription

Input: TypeAlias = Subscription | Service
Survive: TypeAlias = Callable[[Exception], None]


class _Queue(Protocol):
    """Messages or requests that wait to be handled."""

    def handle_one(self) -> bool:
        """Handle the oldest one, and tell whether it may be followed by another in this cycle."""


class UrgentInputs:
    """Takes what has come in, and hands it to the callbacks of its subscription or service.

    rclpy's executor builds a list of all that a node waits for before it looks at any of it. To ask
    one subscription that has nothing takes half a microsecond, as long as no message is made for
    the answer, and nothing is done to keep the subscription for that moment alone.
    """

    def __init__(self, inputs: Iterable[Input], context: Context, survive: Survive) -> None:
        """Look at ``inputs`` in this order, and keep them until ``close``.

        Args:
            inputs: subscriptions and services, whose callbacks are no coroutines.
            context: of their node.
            survive: gets what a callback raises, and raises what ends the node.
        """
        inputs = tuple(inputs)
        self._kept = ExitStack()
        for each in inputs:
            self._kept.enter_context(each.handle)
        self._queues: list[_Queue] = [
            _Messages(each, survive) if isinstance(each, Subscription) else _Requests(each, survive)
            for each in inputs
        ]
        subscriptions = [each for each in inputs if isinstance(each, Subscription)]
        # What comes in while others are handled is for the next cycle, so that no flood holds this
        # one: a queue has never more than its depth.
        self._rounds = max((each.qos_profile.depth for each in subscriptions), default=1)
        self._wait_set = rclpy_implementation.WaitSet(
            len(subscriptions), 0, 0, 0, len(inputs) - len(subscriptions), 0, context.handle
        )
        add = {Subscription: self._wait_set.add_subscription, Service: self._wait_set.add_service}
        self._adding = [(add[type(each)], each.handle) for each in inputs]

    def close(self) -> None:
        """Let go of the inputs."""
        self._kept.close()

    def handle(self, until: float) -> None:
        """Handle what has come in, the oldest of each input first.

        Each input gets at least one turn, however slow the others are.

        Args:
            until: time.monotonic() from which on all else waits for the next cycle [s].
        """
        queues = self._queues
        for _ in range(self._rounds):
            queues = [queue for queue in queues if queue.handle_one()]
            if not queues or monotonic() >= until:
                return

    def wait(self, timeout: float) -> None:
        """Wait until something comes in, for ``timeout`` [s] at most."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        for add, handle in self._adding:
            add(handle)
        wait_set.wait(max(0, int(1e9 * timeout)))


class _Messages:
    """Of a subscription."""

    def __init__(self, subscription: Subscription, survive: Survive) -> None:
        self._take = subscription.handle.take_message
        self._kind: Any = subscription.msg_type
        self._callback = subscription.callback
        self._is_raw = subscription.raw
        self._takes_info = subscription._callback_type is Subscription.CallbackType.WithMessageInfo
        self._survive = survive

    def handle_one(self) -> bool:
        try:
            taken = self._take(self._kind, True)
            if taken is None:
                return False
            data, info = taken
            message = data if self._is_raw else deserialize_message(data, self._kind)
            if self._takes_info:
                self._callback(message, info)
            else:
                self._callback(message)
        except Exception as error:
            self._survive(error)
        return True


class _Requests:
    """To a service. One in a cycle is enough: to answer takes a while, and who asks waits."""

    def __init__(self, service: Service, survive: Survive) -> None:
        self._service = service
        self._take = service.handle.service_take_request
        self._kind: Any = service.srv_type
        self._survive = survive

    def handle_one(self) -> bool:
        try:
            request, header = self._take(self._kind.Request)
            if header is not None:
                response = self._service.callback(request, self._kind.Response())
                self._service.send_response(response, header)
        except Exception as error:
            self._survive(error)
        return False
