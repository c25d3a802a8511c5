"""The loop of a node that has a cycle: it sleeps until an absolute time, and never waits else."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from time import monotonic, sleep
from typing import Any

from rclpy.node import Node

from tri_glide_kinematics.ros.loop.other_turns import OtherTurns
from tri_glide_kinematics.ros.loop.urgent_inputs import Input, Survive, UrgentInputs

# After this part of a period, what has come in and is not handled yet waits for the next cycle.
INPUT_PART = 0.25
# In a sleep that would go on for longer than this, others get their turns, too [s].
ROOM = 0.005
# Background work ends this long before the next cycle [s]: a sleep may end that much too late.
WORK_MARGIN = 0.0002


@dataclass(frozen=True)
class Cycle:
    """The work that a node repeats.

    Attributes:
        urgent: what is looked at in each cycle, in this order.
        period: from cycle to cycle [s]; None for a cycle whenever something urgent comes in.
        step: is done in each cycle, once all that came in is handled.
        work: is called after each cycle with the time.monotonic() until which it may work [s],
            which is past where there is no time left. It is not called without a period.
        early: of what is urgent, what takes so long that it is begun in the sleep: the first that
            comes in between two cycles is handled at once.
        may_end: is asked before each further cycle once the loop is to stop, and returns whether it
            may: what moves has to come to rest before.
        end: is done once, after the last cycle, unless nothing can be sent any more.
    """

    urgent: tuple[Input, ...]
    period: float | None = None
    step: Callable[[], None] = lambda: None
    work: Callable[[float], None] | None = None
    early: tuple[Input, ...] = ()
    may_end: Callable[[], bool] = lambda: True
    end: Callable[[], None] = lambda: None


class CycleLoop:
    """Handles what is urgent, steps, works, and gives turns to all else.

    Times are those of the steady clock: a clock that is set changes nothing. Cycles that a stall
    has made impossible are left out; the next ones come when they would have come without it.
    """

    def __init__(self, node: Node, cycle: Cycle, survive: Survive) -> None:
        """Prepare to run the ``cycle`` of ``node``.

        Args:
            node: whose subscriptions, services and timers are served.
            cycle: what is done.
            survive: gets what a callback raises, and raises what ends the node.
        """
        # Kept, so that to ask it takes no more than a call.
        context: Any = node.context.handle
        self._kept = ExitStack()
        self._kept.enter_context(context)
        self._is_context_valid: Callable[[], bool] = context.ok
        self._is_stopped = False
        self._cycle = cycle
        self._survive = survive
        self._inputs = UrgentInputs(cycle.urgent, node.context, survive)
        self._early = UrgentInputs(cycle.early, node.context, survive) if cycle.early else None
        self._others = OtherTurns(node, cycle.urgent)
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
        self._inputs.close()
        if self._early is not None:
            self._early.close()
        self._others.shutdown()
        self._kept.close()

    def _react(self) -> None:
        """Handle what is urgent as soon as it comes in, until others have their turn."""
        inputs, others = self._inputs, self._others
        while (left := others.due - monotonic()) > 0.0:
            try:
                inputs.wait(left)
            except Exception as error:
                self._survive(error)
            # One of each: to wait for more costs no more than to look for it in vain.
            inputs.handle(until=0.0)
            self._do(self._cycle.step)
        # Also when what is not urgent takes so long that its next turn is due already.
        inputs.handle(until=0.0)
        self._do(self._cycle.step)
        self._do(others.give)

    def _run_cycle(self, period: float) -> None:
        """Wait for the next cycle, and run it."""
        if not self._wait():
            return
        now = monotonic()
        self._next += period * (1 + math.floor((now - self._next) / period))
        self._inputs.handle(now + INPUT_PART * period)
        self._do(self._cycle.step)
        self._give_turn()
        self._work()

    def _work(self) -> None:
        """Do background work until shortly before the next cycle."""
        work = self._cycle.work
        if work is not None:
            self._do(partial(work, self._next - WORK_MARGIN))

    def _wait(self) -> bool:
        """Sleep until the next cycle, and return whether there is to be one.

        Others get their turns in a sleep that is long enough for them.
        """
        early = self._early
        while (left := self._next - (now := monotonic())) > 0.0:
            nap = max(self._others.due - now, 0.0)
            is_turn = left - nap > ROOM
            pause = nap if is_turn else left
            if early is None:
                sleep(pause)
            else:
                self._do(partial(early.wait, pause))
                if monotonic() < now + pause:
                    early.handle(until=0.0)
                    self._work()
                    # One in a cycle: a flood is no reason not to sleep.
                    early = None
            if is_turn:
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

    def _do(self, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:
            self._survive(error)
