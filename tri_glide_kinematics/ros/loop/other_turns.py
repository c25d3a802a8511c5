"""Work that is not urgent in a node with a fast cycle: one callback at a time."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable
from time import monotonic
from typing import Any

from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.timer import Timer
from rclpy.waitable import NumberOfEntities


class ReadyLook:
    """A list of what a node waits for, which is made once.

    The executor makes its list anew each time, which takes 0.1 to 0.2 ms for one of our nodes; a
    look at a list that is there takes 0.03 ms. It holds as long as the node has the same entities.
    """

    def __init__(self, node: Node, left_out: Container[Any]) -> None:
        """List all that ``node`` waits for, save what is ``left_out``."""
        subscriptions = [each for each in node.subscriptions if each not in left_out]
        services = [each for each in node.services if each not in left_out]
        timers, clients, guards = list(node.timers), list(node.clients), list(node.guards)
        self._waitables: list[Any] = list(node.waitables)
        count = NumberOfEntities(
            len(subscriptions), len(guards), len(timers), len(clients), len(services)
        )
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
        kinds: tuple[tuple[str, Callable[[Any], object], list[Any]], ...] = (
            ("subscription", wait_set.add_subscription, subscriptions),
            ("guard_condition", wait_set.add_guard_condition, guards),
            ("timer", wait_set.add_timer, timers),
            ("client", wait_set.add_client, clients),
            ("service", wait_set.add_service, services),
        )
        self._kinds = [name for name, _, entities in kinds if entities]
        self._adding = [(add, each.handle) for _, add, entities in kinds for each in entities]

    def is_any_ready(self) -> bool:
        """Tell whether a message, a request, an answer, a timer or an event is there."""
        wait_set = self._wait_set
        wait_set.clear_entities()
        for add, handle in self._adding:
            add(handle)
        for waitable in self._waitables:
            waitable.add_to_wait_set(wait_set)
        wait_set.wait(0)
        return any(map(wait_set.get_ready_entities, self._kinds)) or any(
            waitable.is_ready(wait_set) for waitable in self._waitables
        )


# How long what is not urgent waits at most, beside the callbacks that are due [s].
LONGEST_WAIT = 0.02

# Who asked for something often asks again. So for a while one looks more often [s].
ATTENTION = 0.01
SHORT_WAIT = 0.002


class OtherTurns(SingleThreadedExecutor):
    """An executor of all that a node has, save what is urgent, for a loop that has other work.

    Attributes:
        due: time.monotonic() of the next turn [s].
    """

    def __init__(self, node: Node, urgent: Iterable[Any]) -> None:
        """Look at all of ``node`` but the subscriptions and services that are ``urgent``."""
        self.due = 0.0
        self._node = node
        self._urgent = frozenset(urgent)
        self._attentive_until = 0.0
        # Of one look of the executor there may be callbacks left, or tasks of its own.
        self._has_more = False
        self._look: ReadyLook | None = None
        super().__init__(context=node.context)
        self.add_node(node)

    def can_execute(self, entity: Any) -> bool:
        """Tell whether to look at ``entity``."""
        return entity not in self._urgent and super().can_execute(entity)

    def wake(self) -> None:
        """Look at other things than before, as the node has made or destroyed some."""
        self._look = None
        super().wake()

    def create_task(self, *arguments: Any, **named: Any) -> Any:
        """Run a callback in one of the next turns."""
        self._has_more = True
        return super().create_task(*arguments, **named)

    def give(self) -> None:
        """Run one callback, if one is ready, and set when the next turn is due.

        Raises:
            Exception: what the callback raises.
        """
        ready = self._next_ready() if self._has_more or self._is_any_ready() else None
        self._has_more = ready is not None
        now = monotonic()
        if ready is not None and not isinstance(ready[1], Timer):
            self._attentive_until = now + ATTENTION
        is_short = self._has_more or now < self._attentive_until
        self.due = now + (SHORT_WAIT if is_short else LONGEST_WAIT)
        if ready is not None:
            handler, _ = ready
            handler()
            # Raises what the callback has raised.
            handler.result()

    def _is_any_ready(self) -> bool:
        if self._look is None:
            self._look = ReadyLook(self._node, self._urgent)
        return self._look.is_any_ready()

    def _next_ready(self) -> tuple[Any, Any] | None:
        """Return a callback that is ready and what it belongs to, None if there is none."""
        # After the last callback of one look, the executor ends that look with a timeout, too.
        for _ in range(2 if self._has_more else 1):
            try:
                ready: Any = self.wait_for_ready_callbacks(timeout_sec=0.0)
                return ready[:2]
            except (TimeoutException, ShutdownException):
                pass
        return None
