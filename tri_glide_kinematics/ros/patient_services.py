"""Services whose answers wait for clients that are not fully discovered, instead of the node.

A client sees a service as soon as its own half of the discovery is done, so a request may come in
before the node knows who reads the answer. rmw_fastrtps then waits 100 ms within the call that
sends, in which nothing else of Python runs, and drops the answer.

rclpy does not tell whose a request is, but the graph tells which participants send requests and
which read answers. So an answer is kept while any that sends does not read as well.
"""

from __future__ import annotations

import time
import warnings
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass

from rclpy.clock import Clock, ClockType
from rclpy.duration import Infinite
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.service import Service
from rclpy.topic_endpoint_info import TopicEndpointInfo

RCLError = rclpy_implementation.RCLError

RETRY_PERIOD = 0.02  # s
# Most clients are known a moment later. So a node with a cycle looks with this period [s] while the
# newest answer that waits is younger than SOON [s].
SHORT_RETRY_PERIOD = 0.004
SOON = 0.1
# The middleware tells of a reader a moment before it is connected to the service [s].
CONNECTING = 0.003
# Discovery takes a fraction of this, or a little more than 3 s where a packet was lost [s].
PATIENCE = 5.0
GIVE_UP_AFTER = 30.0  # s
MAX_WAITING = 100  # answers; beyond it the one that waited longest is given up

# The part of an endpoint's identifier that is that of its participant.
PARTICIPANT = slice(0, 12)

# With what quality of service answers are published, in the words of the graph.
OFFERED = QoSProfile(
    depth=10,
    deadline=Infinite,
    liveliness=LivelinessPolicy.AUTOMATIC,
    liveliness_lease_duration=Infinite,
)


@dataclass
class _Answer:
    """Something to send.

    Attributes:
        service: name of the one that was asked.
        send: sends it and tells whether somebody reads it; if not, that takes 100 ms.
        received: when it was asked [s of time.monotonic].
        has_failed: whether it was sent already, as its reader seemed to be known.
    """

    service: str
    send: Callable[[], bool]
    received: float
    has_failed: bool = False


class PatientServices:
    """Keeps the answers of a node's services until the clients can take them."""

    def __init__(self, node: Node, may_wait: Callable[[], bool] = lambda: True) -> None:
        """Take over the answers of all services that ``node`` has; rclpy's own are among them.

        Args:
            node: that offers the services.
            may_wait: whether 100 ms may pass now without anything else being done. Only then an
                answer is tried, once, that has waited for ``PATIENCE`` seconds.
        """
        self._node = node
        self._may_wait = may_wait
        self._waiting: deque[_Answer] = deque()
        # When each reader of the answers of a service was first known of [s].
        self._readers: dict[str, dict[bytes, float]] = {}
        # How many clients a service had when all of them were known.
        self._counts: dict[str, int] = {}
        self._tried_at = 0.0
        self._timer = node.create_timer(
            RETRY_PERIOD, self.send_kept, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._timer.cancel()
        for service in node.services:
            self._take_over(service)

    def send(
        self, service: str, send: Callable[[], object], known: dict[str, bool] | None = None
    ) -> None:
        """Send an answer now, or as soon as its client can take it.

        Args:
            service: full name of the one that was asked.
            send: sends the answer by a method of rclpy.
            known: of services, whether their clients are known: to find out takes 0.3 ms, so it
                is kept here for answers that are sent together. What is missing is added.
        """
        answer = _Answer(service, lambda: _is_sent(send), time.monotonic())
        known = {} if known is None else known
        if service not in known:
            known[service] = self._clients_are_known(service)
        if known[service]:
            if answer.send():
                return
            answer.has_failed = True
            known[service] = False
        self._keep(answer)

    def expect(self, service: str) -> None:
        """Look who reads the answers of a ``service``, as there will be one."""
        # To count them takes a fortieth of the time.
        count = self._node.count_clients(service)
        if self._counts.get(service) != count and self._clients_are_known(service):
            self._counts[service] = count

    def _take_over(self, service: Service) -> None:
        send = service.send_response
        # The executor sends what the callback returns by this method of the service.
        service.send_response = lambda response, header: self.send(  # type: ignore[method-assign]
            service.service_name, lambda: send(response, header)
        )

    def _clients_are_known(self, service: str) -> bool:
        """Tell whether the reader of answers of each client is known, as its writer is."""
        now = time.monotonic()
        requests = self._node.get_publishers_info_by_topic(f"rq{service}Request", no_mangle=True)
        answers = self._node.get_subscriptions_info_by_topic(f"rr{service}Reply", no_mangle=True)
        before = self._readers.get(service, {})
        gids = [bytes(reader.endpoint_gid) for reader in answers if _may_read(reader)]
        since = self._readers[service] = {gid: before.get(gid, now) for gid in gids}
        reading = Counter(gid[PARTICIPANT] for gid in gids if now - since[gid] >= CONNECTING)
        asking = Counter(bytes(writer.endpoint_gid[PARTICIPANT]) for writer in requests)
        return not asking - reading

    def _keep(self, answer: _Answer) -> None:
        if len(self._waiting) == MAX_WAITING:
            self._give_up(self._waiting.popleft())
        self._waiting.append(answer)
        # Begun anew with each request, the wait would not end while requests come in faster.
        if self._timer.is_canceled():
            self._timer.reset()

    @property
    def keeps_any(self) -> bool:
        """Whether there are answers that wait."""
        return bool(self._waiting)

    def try_soon(self) -> None:
        """Send the answers that wait sooner than by the timer; to be called in each cycle."""
        if not self._waiting:
            return
        now = time.monotonic()
        is_new = now - self._waiting[-1].received < SOON
        if is_new and now - self._tried_at >= SHORT_RETRY_PERIOD:
            self.send_kept()

    def send_kept(self) -> None:
        """Send the answers that wait, as far as their clients can take them by now."""
        now = self._tried_at = time.monotonic()
        may_wait = self._may_wait()
        services = {answer.service for answer in self._waiting}
        known = {service for service in services if self._clients_are_known(service)}
        for _ in range(len(self._waiting)):
            answer = self._waiting.popleft()
            age = now - answer.received
            if answer.service in known and not answer.has_failed:
                answer.has_failed = not answer.send()
                if answer.has_failed:
                    self._waiting.append(answer)
            elif age > PATIENCE and may_wait:
                if not answer.send():
                    self._give_up(answer)
                    # One such attempt at a time: others want to be served, too.
                    may_wait = False
            elif age > GIVE_UP_AFTER:
                self._give_up(answer)
            else:
                self._waiting.append(answer)
        if not self._waiting:
            self._timer.cancel()

    def _give_up(self, answer: _Answer) -> None:
        self._node.get_logger().warning(
            f"{answer.service}: gave up an answer, as a client was never discovered"
        )


def _may_read(reader: TopicEndpointInfo) -> bool:
    """Tell whether the middleware connects a service to this reader of answers at all."""
    compatibility, _ = qos_check_compatible(OFFERED, reader.qos_profile)
    return bool(compatibility != QoSCompatibility.ERROR)


def _is_sent(send: Callable[[], object]) -> bool:
    """Send, and return whether the client's reader was known; rclpy has two ways to say so."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RuntimeWarning)
        try:
            send()
        except RCLError:
            return False
    return not any("failed to send response" in str(warning.message) for warning in caught)
