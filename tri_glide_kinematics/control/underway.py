"""Setpoints on their way to the motors, which takes some time. No clock in here."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from operator import itemgetter
from typing import Any

from tri_glide_kinematics.vectors import Vector3, combined

# Two times that differ by less are the same: rounding [s].
SAME_TIME = 1e-9


class Underway:
    """Knows which setpoint is at the motors, and which outputs the sliders have passed.

    Attributes:
        delay: from a setpoint to the motors [s].
        moves: whether the motors were not yet where the latest setpoint is when it was sent.
        outputs: that the motors have not passed yet, and when they were sent [s].
    """

    def __init__(self, delay: float = 0.0) -> None:
        """Have nothing on its way."""
        self.delay = delay
        self._ring: deque[tuple[float, Vector3]] = deque()
        self.moves = False
        self.outputs: deque[tuple[float, Any]] = deque()
        self._sent = self._moved = -math.inf

    def send(self, heights: Vector3, now: float) -> None:
        """Note that a setpoint with these heights [m] is sent ``now`` [s]."""
        ring, self._sent = self._ring, now
        if ring and ring[-1][1] != heights:
            self._moved = now
        self.moves = now - self._moved < self.delay
        ring.append((now, heights))
        while len(ring) > 1 and ring[1][0] <= now - self.delay:
            ring.popleft()

    def clear(self) -> None:
        """Forget the setpoints, as no more are sent, and outputs: none changes at an enabling."""
        self._ring.clear()
        self.outputs.clear()

    def at_motors(self, now: float) -> Vector3 | None:
        """Return the heights of the setpoint of then, between two of them. Shape (3,) [m].

        None while there is none.
        """
        ring, then = self._ring, now - self.delay
        if not ring:
            return None
        if self.delay == 0.0 or then >= ring[-1][0]:
            return ring[-1][1]
        place = bisect_right(ring, then, key=itemgetter(0))
        if place == 0:
            return ring[0][1]
        (begin, before), (end, after) = ring[place - 1], ring[place]
        part = (then - begin) / (end - begin)
        return combined(1.0 - part, before, part, after)

    def pass_output(self, output: Any) -> None:
        """Note an ``output`` that changes where the latest setpoint is."""
        self.outputs.append((self._sent, output))

    def passed_outputs(self) -> list[Any]:
        """Return the outputs that the motors have passed since, as the latest setpoint is sent."""
        passed = []
        while self.outputs and self._sent - self.outputs[0][0] >= self.delay - SAME_TIME:
            passed.append(self.outputs.popleft()[1])
        return passed
