"""The loop of a node with a period: its cycle first, all else in what time is left."""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Callable, Collection, Container, Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from inspect import iscoroutinefunction
from select import select
from time import monotonic, sleep
from typing import Any, Protocol, TypeAlias

from rclpy.clock import Clock, ClockType
from rclpy.executors import (
    ExternalShutdownException,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from rclpy.waitable import NumberOfEntities

from tri_glide_kinematics.reason_log import ReasonLog

# After this part of a period, what has come in and is not handled yet waits for the next cycle.
INPUT_PART = 0.25
# In a sleep that would go on for longer than this, others get their turns, too [s].
ROOM = 0.005
# Background work ends this long before the next cycle [s]: a sleep may end that much too late.
WORK_MARGIN = 0.0002
# How long what is not urgent waits at most, beside the callbacks that are due [s].
LONGEST_WAIT = 0.02


@dataclass(frozen=True)
class Cycle:
    """The work that a node repeats.

    Attributes:
        urgent: what is looked at in each cycle, in this order.
        period: from cycle to cycle [s]; None for a cycle whenever something urgent comes in.
        step: is done in each cycle, once all that came in is handled.
        work: is called after each cycle with the time.monotonic() until which it may work [s],
            which is past where there is no time left. It is not called without a period.
        early: of what is urgent, what takes so long that it is handled in the sleep: the first that
            comes in between two cycles at once, or behind the step if that would end too late.
        may_end: is asked before each further cycle once the loop is to stop, and returns whether it
            may: what moves has to come to rest before.
        end: is done once, after the last cycle, unless nothing can be sent any more.
        own: what ``step`` takes by itself, and nobody else; the node may change it at any time.
        patience: returns how long all else waits at most, beside the callbacks that are due [s].
    """

    urgent: tuple[Input, ...]
    period: float | None = None
    step: Callable[[], None] = lambda: None
    work: Callable[[float], None] | None = None
    early: tuple[Input, ...] = ()
    may_end: Callable[[], bool] = lambda: True
    end: Callable[[], None] = lambda: None
    own: Collection[Input] = ()
    patience: Callable[[], float] = lambda: LONGEST_WAIT


class CycleLoop:
    """Handles what is urgent, steps, works, and gives turns to all else.

    Times are those of the steady clock: a clock that is set changes nothing. Cycles that a stall
    has made impossible are left out; the next ones come when they would have come without it.

    A node never sleeps in a wait set. In some builds of ROS 2 its deadline is one of the wall
    clock: one that is set back by an hour makes a sleep of a millisecond one of an hour.
    """

    def __init__(self, node: Node, cycle: Cycle, survive: Survive) -> None:
        """Prepare to run the ``cycle`` of ``node``.

        ``survive`` gets what a callback raises, and raises what ends the node.
        """
        # Kept, so that to ask it takes no more than a call.
        context: Any = node.context.handle
        self._kept = ExitStack()
        self._kept.enter_context(context)
        self._is_context_valid: Callable[[], bool] = context.ok
        self._is_stopped = False
        self._cycle = cycle
        self._survive = survive
        self._inputs = UrgentInputs(cycle.urgent, survive)
        self._early = UrgentInputs(cycle.early, survive)
        self._rest = UrgentInputs((x for x in cycle.urgent if x not in cycle.early), survive)
        # What is early has come in too late to be handled before the step.
        self._is_late = False
        self._reading = PlanningTime()
        self._arrivals = Arrivals(cycle.urgent if cycle.period is None else cycle.early)
        self._others = OtherTurns(node, cycle.urgent, cycle.own, cycle.patience)
        self._next = monotonic()

    def spin(self) -> None:
        """Run until it is stopped, or the context is shut down.

        Raises:
            Exception: what ``survive`` raises.
        """
        self._next = monotonic()
        try:
            if self._cycle.period is None:
                while self._is_running():
                    self._react()
            else:
                while self._is_running():
                    self._run_cycle(self._cycle.period)
        finally:
            if self._is_context_valid():
                self._cycle.end()

    def stop(self) -> None:
        """End as soon as the cycle may; may be called by a handler of signals."""
        self._is_stopped = True

    def close(self) -> None:
        """Let go of the node."""
        self._arrivals.close()
        self._inputs.close()
        self._early.close()
        self._others.shutdown()
        self._kept.close()

    def _react(self) -> None:
        """Handle what is urgent as soon as it comes in, until others have their turn."""
        others = self._others
        while (left := others.due - monotonic()) > 0.0:
            self._arrivals.wait(left)
            self._handle_one_of_each()
        # Also when what is not urgent takes so long that its next turn is due already.
        self._handle_one_of_each()
        self._do(others.give)

    def _handle_one_of_each(self) -> None:
        if self._inputs.handle(until=0.0):
            # There may be more.
            self._arrivals.ring()
        self._do(self._cycle.step)

    def _run_cycle(self, period: float) -> None:
        """Wait for the next cycle, and run it."""
        if not self._wait(period):
            return
        now = monotonic()
        self._next += period * (1 + math.floor((now - self._next) / period))
        inputs = self._rest if self._is_late else self._inputs
        inputs.handle(now + INPUT_PART * period)
        self._do(self._cycle.step)
        if self._is_late:
            self._is_late = False
            self._read_early()
        self._give_turn()
        self._work()

    def _read_early(self) -> bool:
        """Handle the oldest of what is early; tell whether there was any."""
        begin = monotonic()
        is_any = self._early.handle(until=0.0)
        if is_any:
            self._reading.note(monotonic() - begin)
        return is_any

    def _work(self) -> None:
        """Do background work until shortly before the next cycle."""
        work = self._cycle.work
        if work is not None:
            self._do(partial(work, self._next - WORK_MARGIN))

    def _wait(self, period: float) -> bool:
        """Sleep until the next cycle, and return whether there is to be one.

        Others get their turns in a sleep that is long enough for them.
        """
        wait: Callable[[float], object] = self._arrivals.wait
        while (left := self._next - (now := monotonic())) > 0.0:
            nap = max(self._others.due - now, 0.0)
            is_turn = left - nap > ROOM
            pause = nap if is_turn else left
            if wait(pause):
                self._is_late = not self._reading.is_short(self._next + INPUT_PART * period)
                if self._is_late:
                    wait = sleep
                elif self._read_early():
                    self._work()
                    # One in a cycle: a flood is no reason not to sleep.
                    wait = sleep
            elif is_turn:
                if not self._is_running():
                    return False
                self._give_turn()
        return True

    def _is_running(self) -> bool:
        if not self._is_context_valid():
            return False
        return not self._is_stopped or not self._cycle.may_end()

    def _give_turn(self) -> None:
        if monotonic() >= self._others.due:
            self._do(self._others.give)

    def _do(self, call: Callable[[], object]) -> None:
        try:
            call()
        except Exception as error:
            self._survive(error)


Input: TypeAlias = Subscription | Service
Survive: TypeAlias = Callable[[Exception], None]


# Of rcl: sets what the middleware calls as soon as something has come in.
TELL_ARRIVALS = {
    Subscription: "rcl_subscription_set_on_new_message_callback",
    Service: "rcl_service_set_on_new_request_callback",
}


class Arrivals:
    """A sleep by the steady clock that ends when something comes in.

    The middleware adds to a counter of the system, in a thread of its own: ``eventfd_write`` takes
    a descriptor and a number, as the callbacks of rcl do.
    """

    def __init__(self, inputs: Iterable[Input]) -> None:
        """Be woken by ``inputs``; where a middleware cannot do that, the sleep goes on."""
        self._counter = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._closing = ExitStack()
        self._closing.callback(os.close, self._counter)
        rcl, ring = ctypes.CDLL("librcl.so"), ctypes.CDLL(None).eventfd_write
        for each in inputs:
            self._closing.enter_context(each.handle)
            pointer = ctypes.c_void_p(each.handle.pointer)
            tell = partial(getattr(rcl, TELL_ARRIVALS[type(each)]), pointer)
            tell(ring, ctypes.c_void_p(self._counter))
            self._closing.callback(tell, None, None)

    def close(self) -> None:
        """Let go of the inputs."""
        self._closing.close()

    def ring(self) -> None:
        """Let the next sleep end at once."""
        os.eventfd_write(self._counter, 1)

    def wait(self, timeout: float) -> bool:
        """Sleep for ``timeout`` [s] at most, and tell whether something came in."""
        has_come = bool(select((self._counter,), (), (), timeout)[0])
        if has_come:
            os.eventfd_read(self._counter)
        return has_come


class _Queue(Protocol):
    """Messages or requests that wait to be handled."""

    def handle_one(self) -> bool:
        """Handle the oldest one, and tell whether there was one."""


class UrgentInputs:
    """Takes what has come in, and hands it to the callbacks of its subscription or service.

    rclpy's executor builds a list of all that a node waits for before it looks at any of it. To ask
    one subscription that has nothing takes half a microsecond, as long as no message is made for
    the answer, and nothing is done to keep the subscription for that moment alone.
    """

    def __init__(self, inputs: Iterable[Input], survive: Survive) -> None:
        """Look at ``inputs`` in this order, and keep them until ``close``.

        Their callbacks are no coroutines. ``survive`` gets what they raise.
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
        # Messages that come in while others are handled are for the next cycle, so that no flood
        # holds this one: a queue has never more than its depth.
        self._rounds = max((each.qos_profile.depth for each in subscriptions), default=1)

    def close(self) -> None:
        """Let go of the inputs."""
        self._kept.close()

    def handle(self, until: float) -> bool:
        """Handle what has come in, the oldest of each input first; tell whether there was any.

        Each input gets at least one turn, however slow the others are. All else waits at the
        time.monotonic() ``until`` for the next cycle.
        """
        taken = [queue for queue in self._queues if queue.handle_one()]
        # One request in a cycle is enough: to answer takes a while, and who asks waits.
        queues = [queue for queue in taken if isinstance(queue, _Messages)]
        for _ in range(self._rounds - 1):
            if not queues or monotonic() >= until:
                break
            queues = [queue for queue in queues if queue.handle_one()]
        return bool(taken)


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
    """To a service."""

    def __init__(self, service: Service, survive: Survive) -> None:
        self._service = service
        self._take = service.handle.service_take_request
        self._kind: Any = service.srv_type
        self._survive = survive

    def handle_one(self) -> bool:
        try:
            request, header = self._take(self._kind.Request)
            if header is None:
                return False
            response = self._service.callback(request, self._kind.Response())
            self._service.send_response(response, header)
        except Exception as error:
            self._survive(error)
        return True


class ReadyLook:
    """A list of what a node waits for, which is made once.

    The executor makes its list anew each time, which takes 0.1 to 0.2 ms for one of our nodes; a
    look at a list that is there takes 0.03 ms. It holds as long as the node has the same entities.

    Attributes:
        asked: the service that was asked at the last look, if nothing else was ready.
    """

    def __init__(self, node: Node, left_out: Container[Any]) -> None:
        """List all that ``node`` waits for, save timers and what is ``left_out``."""
        subscriptions = [each for each in node.subscriptions if each not in left_out]
        services = [each for each in node.services if each not in left_out]
        clients = list(node.clients)
        self._waitables: list[Any] = list(node.waitables)
        count = NumberOfEntities(len(subscriptions), 1, 0, len(clients), len(services))
        for waitable in self._waitables:
            count += waitable.get_num_entities()
        self._wait_set = wait_set = rclpy_implementation.WaitSet(
            count.num_subscriptions,
            count.num_guard_conditions,
            count.num_timers,
            count.num_clients,
            count.num_services,
            count.num_events,
            node.context.handle,
        )
        self.asked: Service | None = None
        # Without anything that is ready, the wait set would sleep, be it for no time.
        context: Any = node.context.handle
        with context:
            self._guard = rclpy_implementation.GuardCondition(context)
        kinds: tuple[tuple[str, Callable[[Any], object], list[Any]], ...] = (
            ("subscription", wait_set.add_subscription, subscriptions),
            ("client", wait_set.add_client, clients),
            ("service", wait_set.add_service, services),
        )
        self._services = {each.handle.pointer: each for each in services}
        self._kinds = [name for name, _, entities in kinds if entities]
        self._adding = [(add, each.handle) for _, add, entities in kinds for each in entities]
        self._adding.append((wait_set.add_guard_condition, self._guard))

    def is_any_ready(self) -> bool:
        """Tell whether a message, a request, an answer or an event is there."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        for add, handle in self._adding:
            add(handle)
        for waitable in self._waitables:
            waitable.add_to_wait_set(wait_set)
        self._guard.trigger_guard_condition()
        wait_set.wait(0)
        ready = [each for kind in self._kinds for each in wait_set.get_ready_entities(kind)]
        is_event = any(waitable.is_ready(wait_set) for waitable in self._waitables)
        self.asked = self._services.get(ready[0]) if len(ready) == 1 and not is_event else None
        return is_event or bool(ready)


# A client that asked for something often asks again: for so long after it [s], looks are this part
# of the usual time apart.
ATTENTION = 0.01
SHORT_PART = 0.1


class OtherTurns(SingleThreadedExecutor):
    """An executor of all that a node has, save what is urgent, for a loop that has other work.

    Alone it is that of a command, which waits by the steady clock, too.

    Attributes:
        due: time.monotonic() of the next turn [s].
    """

    def __init__(
        self,
        node: Node,
        urgent: Iterable[Any] = (),
        own: Collection[Any] = (),
        patience: Callable[[], float] = lambda: LONGEST_WAIT,
    ) -> None:
        """Look at all of ``node`` but what is ``urgent``, and what it takes on its ``own``.

        Anything waits for what ``patience`` returns at most [s], beside the callbacks that are due.
        """
        self.due = 0.0
        self._patience = patience
        self._node = node
        self._urgent = frozenset(urgent)
        self._own = own
        self._attentive_until = 0.0
        # Of the last look of the executor there may be callbacks left; and it may have tasks.
        self._has_more = self._was_timer = False
        self._has_tasks = False
        self._look: ReadyLook | None = None
        super().__init__(context=node.context)
        self.add_node(node)

    def can_execute(self, entity: Any) -> bool:
        """Tell whether to look at ``entity``."""
        is_left_out = isinstance(entity, Timer) or entity in self._urgent or entity in self._own
        return not is_left_out and super().can_execute(entity)

    def wake(self) -> None:
        """Look at other things than before, as the node has made or destroyed some."""
        self._look = None
        super().wake()

    def create_task(self, *arguments: Any, **named: Any) -> Any:
        """Run a callback in one of the next turns."""
        self._has_tasks = True
        return super().create_task(*arguments, **named)

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Run one callback; without a timeout, wait until there is one.

        Raises:
            Exception: what the callback raises.
            ExternalShutdownException: if the context is shut down.
        """
        end = math.inf if timeout_sec is None else monotonic() + timeout_sec
        while not self.give() and (left := end - monotonic()) > 0.0:
            sleep(max(0.0, min(left, self.due - monotonic())))
            if not self.context.ok():
                raise ExternalShutdownException

    def give(self) -> bool:
        """Run one callback, if one is ready, and set when the next turn is due.

        Returns:
            Whether one was ready.

        Raises:
            Exception: what the callback raises.
        """
        timer = self._ready_timer()
        # Behind each timer it is the turn of what else is ready.
        call = self._next_call() if timer is None or self._was_timer else None
        self._was_timer = call is None and timer is not None
        now = monotonic()
        if call is not None:
            self._attentive_until = now + ATTENTION
        is_short = self._was_timer or now < self._attentive_until
        self.due = now + self._patience() * (SHORT_PART if is_short else 1.0)
        if call is not None:
            call()
        elif timer is not None:
            with timer.handle:
                timer.handle.call_timer()
            timer.callback()
        return call is not None or timer is not None

    def _ready_timer(self) -> Timer | None:
        """Return the timer that is ready for longest: the executor would make a list for each."""
        ready = [timer for timer in self._node.timers if timer.is_ready()]
        return min(ready, key=Timer.time_until_next_call, default=None)

    def _next_call(self) -> Callable[[], object] | None:
        """Return what runs a callback that is ready, None if there is none.

        The executor looks anew only if it would find something, as that takes 0.2 ms.
        """
        taken = self._taken() if self._has_more else None
        if taken is None:
            if self._look is None:
                self._look = ReadyLook(self._node, self._urgent.union(self._own))
            if not (self._look.is_any_ready() or self._has_tasks):
                self._has_more = False
                return None
            service = self._look.asked
            if not (service is None or self._has_tasks or iscoroutinefunction(service.callback)):
                self._has_more = False
                return partial(self._answer, service)
            self._has_tasks = False
            taken = self._taken()
        self._has_more = taken is not None
        return None if taken is None else partial(self._run, taken)

    def _answer(self, service: Service) -> None:
        """Answer one request."""

        def fail(error: Exception) -> None:
            raise error

        with service.handle:
            _Requests(service, fail).handle_one()

    def _run(self, handler: Any) -> None:
        handler()
        self._has_tasks |= not handler.done()
        # Raises what the callback has raised.
        handler.result()

    def _taken(self) -> Any:
        """Return what the executor has: the next of the last look; behind the last one, None."""
        # Or it would sleep where nothing is ready, be it for no time.
        super().wake()
        try:
            ready: Any = self.wait_for_ready_callbacks(timeout_sec=0.0)
            return ready[0]
        except (TimeoutException, ShutdownException):
            return None


# A piece is taken to last as long as the longest before it, which counts for this much less after
# each: one that was interrupted by another process is soon forgotten.
FORGETTING = 0.8


class PlanningTime:
    """Ends planning before a piece that would last too long, not after it."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        """Expect short pieces; ``clock`` returns seconds."""
        self._clock = clock
        self._expected = 0.0
        self._has_begun = self._has_waited = False

    def next_cycle(self) -> None:
        """Begin a cycle, in which a piece of any length is planned if none was in the last one."""
        self._has_waited = not self._has_begun
        self._has_begun = False

    def may_begin(self, end: float) -> bool:
        """Return whether to plan a piece: one before ``end`` [s], or that waited for a cycle."""
        is_allowed = self.is_short(end) or (self._has_waited and not self._has_begun)
        self._has_begun |= is_allowed
        return is_allowed

    def note(self, taken: float) -> None:
        """Learn from a piece that has ``taken`` so long [s]."""
        self._expected = max(taken, FORGETTING * self._expected)

    def until(self, end: float) -> Callable[[], bool]:
        """Return what is asked after each piece, from now on, whether there is time for another.

        There is none once the clock shows ``end`` [s].
        """
        begin = self._clock()

        def may_go_on() -> bool:
            nonlocal begin
            now = self._clock()
            self.note(now - begin)
            begin = now
            return now + self._expected < end

        return may_go_on

    def is_short(self, end: float) -> bool:
        """Return whether a piece that begins now is likely to end before ``end`` [s]."""
        return self._clock() + self._expected < end


def steady_timer(node: Node, period: float, callback: Callable[[], object]) -> Timer:
    """Have ``callback`` called each ``period`` [s] of a clock that nobody sets."""
    return node.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


LINES_PER_SECOND = 1  # of errors in the log, at most


class ErrorLog:
    """Logs what was dropped because of an error that whoever sent it has made."""

    def __init__(self, node: Node) -> None:
        """Log as ``node``."""
        self._node = node
        logger = node.get_logger()
        # Each place that logs has one severity, as rclpy refuses another one: this one is its own.
        self._reasons = ReasonLog(lambda text: logger.error(text), LINES_PER_SECOND)
        steady_timer(node, 1.0, self._reasons.end_of_second)

    def add(self, error: Exception) -> None:
        """Tell of an ``error``, unless the node is being shut down."""
        if self._node.context.ok():
            self._reasons.add(f"dropped a request: {type(error).__name__}: {error}")
