"""Services that answer each call, also of clients that cannot take the answer yet.

A client sees a service as soon as its own half of the discovery is done, so a request may come in
before the node knows who reads the answer. rmw_fastrtps then waits 100 ms within the call that
sends, in which nothing else of Python runs, and drops the answer.

rclpy does not tell whose a request is, but the graph tells which participants send requests and
which read answers. So an answer is kept while any that sends does not read as well.

Each answer goes to all clients of its service. A client by default keeps ten until it looks, and
what comes beyond that displaces what it waits for. So of many answers to calls that were made at
once, the first are sent at once, and the others one after the other, as fast as clients can look.
"""

from __future__ import annotations

import time
import traceback
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rclpy.duration import Infinite
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.service import Service
from rclpy.topic_endpoint_info import TopicEndpointInfo

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.loop import steady_timer

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
MAX_WAITING = 1000  # answers; beyond it the one that waited longest is given up
LINES_PER_SECOND = 5

# Of calls that are made at once, so many are answered at once: half of what a client keeps.
AT_ONCE = 5
# From one answer to the next beyond that [s].
SPACING = 0.01
# The same while calls still come in: who makes one after the other may not look meanwhile. Calls
# have ceased to come when there was none for QUIET [s].
SPACING_IN_BURST = 0.2
QUIET = 0.02
# A client in Python takes 0.3 ms to look at an answer, also at one for another. In s.
SPACING_PER_CLIENT = 0.001

NEVER_KNOWN = "a client was never discovered"

# How services are offered: calls that are made at once wait in the middleware until it is their
# turn. rclpy offers those of parameters so.
CALLS = QoSProfile(depth=1000)

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
        send: sends it and tells whether somebody reads it; if not, that takes 100 ms.
        asked: when the call came in, or a time before that [s of time.monotonic].
        known: when the answer was [s of time.monotonic].
    """

    send: Callable[[], bool]
    asked: float
    known: float


@dataclass
class _Pace:
    """How answers of one service follow each other.

    Attributes:
        sent: when the latest ones were sent [s of time.monotonic].
        turn: when the latest one should have been sent [s of time.monotonic].
        spacing: from one turn to the next [s].
        called: when the latest answer was known [s of time.monotonic].
        waiting: answers that are not sent yet, the oldest first.
    """

    sent: deque[float] = field(default_factory=lambda: deque(maxlen=AT_ONCE))
    turn: float = 0.0
    spacing: float = SPACING
    called: float = 0.0
    waiting: deque[_Answer] = field(default_factory=deque)

    def is_turn(self, answer: _Answer, now: float, clients: Callable[[], int]) -> bool:
        """Tell whether an ``answer`` may be sent ``now``, to so many ``clients``."""
        if len(self.sent) < AT_ONCE or self.sent[0] < answer.asked:
            return True
        spacing = SPACING if now - self.called > QUIET else SPACING_IN_BURST
        self.spacing = max(spacing, SPACING_PER_CLIENT * clients())
        return now - self.turn >= self.spacing

    def note(self, now: float) -> None:
        """Note that an answer was sent; turns that passed between two looks are made up for."""
        self.sent.append(now)
        self.turn = min(now, max(self.turn + self.spacing, now - RETRY_PERIOD))


class PatientServices:
    """Keeps the answers of a node's services until the clients can take them."""

    def __init__(self, node: Node, may_wait: Callable[[], bool] = lambda: True) -> None:
        """Take over the answers of all services that ``node`` has; rclpy's own are among them.

        ``may_wait`` tells whether 100 ms may pass now without anything else being done. Only then
        an answer is tried, once, that has waited for ``PATIENCE`` seconds.
        """
        self._node = node
        self._may_wait = may_wait
        self._paces: dict[str, _Pace] = {}
        # Those that were sent already in vain, as their readers seemed to be known.
        self._failed: deque[tuple[str, _Answer]] = deque()
        # When each reader of the answers of a service was first known of [s].
        self._readers: dict[str, dict[bytes, float]] = {}
        # How many clients a service had when all of them were known.
        self._counts: dict[str, int] = {}
        self._tried_at = self._second_began = 0.0
        # Whether an answer waits for its turn alone.
        self._has_turns = False
        self._given_up = ReasonLog(node.get_logger().warning, LINES_PER_SECOND)
        self._timer = steady_timer(node, RETRY_PERIOD, self.send_kept)
        self._timer.cancel()
        for service in node.services:
            self._take_over(service)

    def send(
        self,
        service: str,
        send: Callable[[], object],
        asked: float,
        known: dict[str, bool] | None = None,
    ) -> None:
        """Send an answer now, or as soon as its client can take it.

        Args:
            service: full name of the one that was asked.
            send: sends the answer by a method of rclpy.
            asked: when it was asked, or a time before that [s of time.monotonic].
            known: of services, whether their clients are known: to find out takes 0.3 ms, so it
                is kept here for answers that are sent together. What is missing is added.
        """
        now = time.monotonic()
        answer = _Answer(lambda: _is_sent(send), asked, now)
        pace = self._paces.setdefault(service, _Pace())
        pace.called = now
        known = {} if known is None else known
        is_turn = not pace.waiting and pace.is_turn(answer, now, partial(self._count, service))
        if is_turn and service not in known:
            known[service] = self._clients_are_known(service)
        if is_turn and known[service]:
            known[service] = self._has_sent(service, answer)
        else:
            self._has_turns = self._has_turns or not is_turn
            self._keep(pace, answer)

    def expect(self, service: str) -> None:
        """Look who reads the answers of a ``service``, as there will be one."""
        # To count them takes a fortieth of the time.
        count = self._count(service)
        if self._counts.get(service) != count and self._clients_are_known(service):
            self._counts[service] = count

    def _take_over(self, service: Service) -> None:
        send = service.send_response
        # The executor sends what the callback returns by this method of the service.
        service.send_response = lambda response, header: self.send(  # type: ignore[method-assign]
            service.service_name, lambda: send(response, header), _received(header)
        )

    def _count(self, service: str) -> int:
        return self._node.count_clients(service)

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

    def _keep(self, pace: _Pace, answer: _Answer) -> None:
        pace.waiting.append(answer)
        paces = [(name, each) for name, each in self._paces.items() if each.waiting]
        if sum(len(each.waiting) for _, each in paces) > MAX_WAITING:
            oldest, its = min(paces, key=lambda named: named[1].waiting[0].known)
            its.waiting.popleft()
            self._give_up(oldest, f"more than {MAX_WAITING} wait")
        self._wake()

    def _wake(self) -> None:
        # Begun anew with each request, the wait would not end while requests come in faster.
        if self._timer.is_canceled():
            self._timer.reset()

    @property
    def keeps_any(self) -> bool:
        """Whether there are answers that wait."""
        return bool(self._failed) or any(pace.waiting for pace in self._paces.values())

    def try_soon(self) -> None:
        """Send the answers that wait sooner than by the timer; to be called in each cycle."""
        if self._timer.is_canceled():
            return
        now = time.monotonic()
        if now - self._tried_at >= SHORT_RETRY_PERIOD and (self._has_turns or self._has_new(now)):
            self.send_kept()

    def _has_new(self, now: float) -> bool:
        newest = (pace.waiting[-1].known for pace in self._paces.values() if pace.waiting)
        return any(now - known < SOON for known in newest)

    def send_kept(self) -> None:
        """Send the answers that wait, as far as their clients can take them by now."""
        now = self._tried_at = time.monotonic()
        self._has_turns = False
        may_wait = self._may_wait()
        for _ in range(len(self._failed)):
            may_wait = self._try_late(*self._failed.popleft(), now, may_wait)
        for service, pace in self._paces.items():
            known: bool | None = None
            while pace.waiting:
                if not pace.is_turn(pace.waiting[0], now, partial(self._count, service)):
                    self._has_turns = True
                    break
                if known is None:
                    known = self._clients_are_known(service)
                if known:
                    known = self._has_sent(service, pace.waiting.popleft())
                elif now - pace.waiting[0].known > PATIENCE and may_wait:
                    may_wait = self._try_late(service, pace.waiting.popleft(), now, may_wait)
                elif now - pace.waiting[0].known > GIVE_UP_AFTER:
                    pace.waiting.popleft()
                    self._give_up(service, NEVER_KNOWN)
                else:
                    break
        if now - self._second_began >= 1.0:
            self._second_began = now
            self._given_up.end_of_second()
        if not self.keeps_any:
            self._timer.cancel()
            self._given_up.end_of_second()

    def end(self) -> None:
        """Log how many answers are never sent, as the node ends."""
        kept = Counter({name: len(each.waiting) for name, each in self._paces.items()})
        kept.update(service for service, _ in self._failed)
        for service, count in (+kept).items():
            log = self._node.get_logger()
            log.warning(f"{service}: the node ends before {count} answers are sent")

    def _has_sent(self, service: str, answer: _Answer) -> bool:
        """Send an answer and return True, or keep it for later."""
        is_sent = answer.send()
        if is_sent:
            self._paces[service].note(time.monotonic())
        else:
            self._failed.append((service, answer))
            self._wake()
        return is_sent

    def _try_late(self, service: str, answer: _Answer, now: float, may_wait: bool) -> bool:
        """Send an answer that has waited for long; return whether another may be tried, too."""
        age = now - answer.known
        if age > PATIENCE and may_wait:
            if answer.send():
                self._paces[service].note(time.monotonic())
                return True
            self._give_up(service, NEVER_KNOWN)
            # One such attempt at a time: others want to be served, too.
            return False
        if age > GIVE_UP_AFTER:
            self._give_up(service, NEVER_KNOWN)
        else:
            self._failed.append((service, answer))
        return may_wait

    def _give_up(self, service: str, reason: str) -> None:
        self._given_up.add(f"{service}: gave up an answer, as {reason}")


def _received(header: Any) -> float:
    """Return when a request came in [s of time.monotonic]; the middleware tells it by the date."""
    now = time.monotonic()
    return now - max(0.0, 1e-9 * (time.time_ns() - header.received_timestamp))


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


# Lines of the log about requests that are refused.
REFUSALS_PER_SECOND = 10


class Answers:
    """Turns what a request leads to into ``success`` and ``message`` of its response.

    So no request ends the node, and nobody who asks waits for ever.
    """

    def __init__(self, node: Node) -> None:
        """Log by ``node`` what is refused, a few lines a second."""
        self._logger = node.get_logger()
        self._refused = ReasonLog(self._logger.warning, lines_per_second=REFUSALS_PER_SECOND)
        node.create_timer(1.0, self._refused.end_of_second)

    @contextmanager
    def told_in(self, response: Any, name: str) -> Iterator[None]:
        """Tell in the ``response`` of a service, with this ``name``, what its body comes to."""
        try:
            yield
            response.success = True
        except KinematicsError as error:
            response.message = str(error)
            self._refused.add(f"{name}: {error}")
        except Exception as error:
            _empty(response)
            response.message = f"internal error: {type(error).__name__}: {error}"
            self._logger.error(f"{name}: {traceback.format_exc()}")


def _empty(message: Any) -> None:
    """Give all fields of a ``message`` the values of a new one."""
    new = type(message)()
    for name in new.get_fields_and_field_types():
        setattr(message, name, getattr(new, name))
