"""A node as a user would write it, with bounded waiting."""

import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from testing.processes import TIMEOUT
from testing.taking import taken

RETRY_AFTER = 10.0  # s
NAP = 0.05  # s after which a condition is looked at without an event, too
RECORDED_NAP = 0.01  # s, the same where messages are recorded, which are no events
DEEP_QUEUE = QoSProfile(depth=5000)
# Deeper than that of the publisher: a client that is kept waiting must not miss a state.
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Answers are not kept by services, so a reader of kept ones is never connected to them.
NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)
NO_PUBLISHER_EVENTS = PublisherEventCallbacks(use_default_callbacks=False)
UNFIT = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class _Recorded(NamedTuple):
    """A subscription whose messages are kept.

    Attributes:
        subscription: of the topic.
        messages: so far.
        take: takes what has come in.
    """

    subscription: Any
    messages: Any
    take: Callable[[Any], Iterable[Any]]


class _OfOthers(SingleThreadedExecutor):
    """An executor of all that a node has but its recorded subscriptions.

    It takes some 0.3 ms for each message, and a machine publishes a thousand in a second.
    """

    def __init__(self, context: Context, recorded: list[_Recorded]) -> None:
        super().__init__(context=context)
        self._recorded = recorded

    def can_execute(self, entity: Any) -> bool:
        """Tell whether to look at ``entity``."""
        is_recorded = any(entity is each.subscription for each in self._recorded)
        return not is_recorded and super().can_execute(entity)


def values_of(status: Any) -> dict[str, str]:
    """Return the values of a status in diagnostics by their names."""
    return {entry.key: entry.value for entry in status.values}


class Probe:
    """A node that listens, publishes and calls, and waits for what comes of it."""

    def __init__(self, context: Context, namespace: str, name: str = "probe") -> None:
        """Join the domain of the ``context``."""
        self.namespace = namespace
        # Whatever a node has, the executor looks at each time.
        self.node = Node(name, namespace=namespace, context=context, start_parameter_services=False)
        self._recorded: list[_Recorded] = []
        self._executor = _OfOthers(context, self._recorded)
        self._executor.add_node(self.node)
        self._services: dict[str, Any] = {}
        self._parameters: dict[str, AsyncParameterClient] = {}

    def close(self) -> None:
        """Leave the domain's graph."""
        self._executor.shutdown()
        self.node.destroy_node()

    def spin_once(self, longest_nap: float = NAP) -> None:
        """Handle one event, if one comes in time [s], and take in what is recorded."""
        nap = min(longest_nap, RECORDED_NAP) if self._recorded else longest_nap
        self._executor.spin_once(timeout_sec=nap)
        for each in self._recorded:
            each.messages.extend(each.take(each.subscription))

    def spin_for(self, duration: float) -> None:
        """Spin for ``duration`` seconds."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0.0:
            self.spin_once(left)

    def now(self) -> int:
        """Return the time of the node's clock [ns]."""
        return int(self.node.get_clock().now().nanoseconds)

    @staticmethod
    def time_of(message: Any) -> int:
        """Return the stamp of a message [ns]."""
        stamp = message.header.stamp
        return int(stamp.sec * 1_000_000_000 + stamp.nanosec)

    def wait_for(
        self,
        condition: Callable[[], Any],
        what: str,
        timeout: float = TIMEOUT,
        longest_nap: float = NAP,
    ) -> None:
        """Spin until ``condition`` holds.

        Args:
            condition: is looked at after each event.
            what: is waited for.
            timeout: of the waiting [s].
            longest_nap: time after which it is looked at without an event, too [s].

        Raises:
            TimeoutError: if it does not hold in time.
        """
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"waited {timeout:g} s in vain for {what}")
            self.spin_once(longest_nap)

    def record(
        self,
        kind: type,
        topic: str,
        qos: QoSProfile = DEEP_QUEUE,
        keep: int | None = None,
        take: Callable[[Any], Iterable[Any]] = taken,
    ) -> Any:
        """Return a list of all messages of a topic, or a deque of the last ``keep`` ones."""
        messages: Any = [] if keep is None else deque(maxlen=keep)
        subscription = self.node.create_subscription(
            kind, topic, _ignore, qos, event_callbacks=NO_EVENTS
        )
        self._recorded.append(_Recorded(subscription, messages, take))
        return messages

    def statuses(self, diagnostics: Any, node: str = "ik_node") -> list[Any]:
        """Return what a ``node`` of this namespace has told in messages of /diagnostics."""
        name = f"{self.namespace[1:]}/{node}"
        return [each for array in diagnostics for each in array.status if each.name == name]

    def publisher(self, kind: type, topic: str, qos: QoSProfile | int = 10) -> Any:
        """Return a publisher of a topic."""
        return self.node.create_publisher(kind, topic, qos, event_callbacks=NO_PUBLISHER_EVENTS)

    def wait_for_subscribers(self, *publishers: Any) -> None:
        """Wait until each publisher has somebody who listens."""
        self.wait_for(
            lambda: all(publisher.get_subscription_count() for publisher in publishers),
            "somebody who listens",
        )

    def call(self, kind: type, service: str, request: Any) -> Any:
        """Call a service and return its response."""
        if service not in self._services:
            self._services[service] = self.node.create_client(kind, service)
        client = self._services[service]
        self.wait_for(client.service_is_ready, f"service {service}")
        return self._answer(lambda: client.call_async(request), f"the response of {service}")

    def set_parameters(self, node: str, values: dict[str, Any]) -> Any:
        """Set parameters of a node as a set, and return the result."""
        if node not in self._parameters:
            self._parameters[node] = AsyncParameterClient(self.node, node)
        client = self._parameters[node]
        self.wait_for(client.services_are_ready, f"the parameter services of {node}")
        parameters = [Parameter(name, value=value) for name, value in values.items()]
        ask = partial(client.set_parameters_atomically, parameters)
        return self._answer(ask, f"{node} to answer").result

    def _answer(self, ask: Callable[[], Future], what: str) -> Any:
        """Ask, and ask again once a server that had not discovered this client knows it.

        rmw_fastrtps drops an answer that has nowhere to go yet.
        """
        futures = [ask()]
        patience = time.monotonic() + RETRY_AFTER

        def answered() -> bool:
            if len(futures) == 1 and time.monotonic() > patience:
                futures.append(ask())
            return any(future.done() for future in futures)

        self.wait_for(answered, what)
        return next(future.result() for future in futures if future.done())


def _ignore(_: Any) -> None:
    """Take a message that the executor never hands out."""


class Client(Probe):
    """A client of one machine."""

    def __init__(self, context: Context, namespace: str) -> None:
        """Join the machine in ``namespace``."""
        super().__init__(context, namespace, "client")
        self._pose = self.publisher(PoseStamped, "target_pose")
        self._twist = self.publisher(TwistStamped, "target_twist")
        self._state = self.publisher(Odometry, "target_state")

    def send_pose(self, position: Sequence[float], frame: str = "tri_glide_base") -> None:
        """Publish a target pose [m] as soon as somebody listens."""
        self.wait_for_subscribers(self._pose)
        message = PoseStamped()
        message.header.frame_id = frame
        point = message.pose.position
        point.x, point.y, point.z = map(float, position)
        self._pose.publish(message)

    def send_twist(self, velocity: Sequence[float], frame: str = "tri_glide_base") -> None:
        """Publish a target twist [m/s] as soon as somebody listens."""
        self.wait_for_subscribers(self._twist)
        message = TwistStamped()
        message.header.frame_id = frame
        linear = message.twist.linear
        linear.x, linear.y, linear.z = map(float, velocity)
        self._twist.publish(message)

    def send_state(
        self,
        position: Sequence[float],
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        stamp: int | None = None,
        frame: str = "tri_glide_base",
    ) -> None:
        """Publish the state of a moving target [m], [m/s] as soon as somebody listens.

        Args:
            position: Shape (3,) [m].
            velocity: Shape (3,) [m/s].
            stamp: when it was so; None for now [ns].
            frame: of the position.
        """
        self.wait_for_subscribers(self._state)
        message = Odometry()
        message.header.frame_id = frame
        time = self.now() if stamp is None else stamp
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time, 1_000_000_000)
        point, linear = message.pose.pose.position, message.twist.twist.linear
        point.x, point.y, point.z = map(float, position)
        linear.x, linear.y, linear.z = map(float, velocity)
        self._state.publish(message)

    def stop(self, node: str = "ik_node") -> Any:
        """Call ``~/stop`` of a node."""
        return self.call(Trigger, f"{node}/stop", Trigger.Request())

    def enable(self, data: bool = True, node: str = "ik_node") -> Any:
        """Call ``~/enable`` of a node."""
        return self.call(SetBool, f"{node}/enable", SetBool.Request(data=data))
