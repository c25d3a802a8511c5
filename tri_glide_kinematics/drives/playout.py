"""Plays setpoints out some time behind their stream: exactly one target for each SYNC.

The head is the moment of the stream that is played. Each SYNC it moves on by the period of the
drives times the rate, and the target is there on the cubic through two setpoints and their
velocities. The rate is 1, but for two things: it brings the delay back to what it shall be, slowly,
and it gives way where the store runs low. So a target never leaves the way of the stream, and
none is repeated or skipped, until the store is empty. Then the sliders brake along the tangent of
their way.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

from tri_glide_kinematics.checks import checked_vector, finite_vector, positive
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.vectors import Vector3, combined, scaled, three
from tri_glide_kinematics.wording import number_text

# The delay goes back to what it shall be within about twice the first time, and the rate follows
# within the second: damped, and so slow that targets hardly feel it [s].
RETURN_TIME, RATE_TIME = 0.06, 0.03
# So much faster than the stream, at most, a delay that is too long is made good.
FASTEST = 1.02
# Changes of the rate take no more than this part of the accelerations for braking.
SHARE = 0.5
# The rate gives way once the store is lower than the delay by more than a half, or by this [s].
MARGIN = 0.015
# Steps of the stamps that differ by no more than this part are those of one period, which is the
# mean of this many of them.
ALIKE, LEARNED = 0.02, 1000
# What sliders are moved by without being told to, where a stream begins anew at rest [m].
JUMP = 1e-3


class SetpointRefusedError(KinematicsError):
    """A setpoint that is not played out."""


@dataclass(frozen=True)
class Setpoint:
    """Where the sliders are to be at a time.

    Attributes:
        time: nominal, by its stamp, from any moment on: where the seconds are many, a float of
            them is too coarse to tell a microsecond [s].
        heights: Shape (3,) [m].
        velocities: Shape (3,) [m/s].
    """

    time: float
    heights: Vector3
    velocities: Vector3

    @property
    def rests(self) -> bool:
        """Whether the sliders are to stand still."""
        return not any(self.velocities)


class _Step:
    """The nominal time between two setpoints, learned from their stamps.

    These may be rounded, and from one to the next they may be up to a sixteenth of a period farther
    apart where they catch up with the clock (``NominalTime``).
    """

    def __init__(self) -> None:
        self._period, self._count = math.inf, 0

    def counted(self, passed: float) -> float:
        """Return how many periods have ``passed`` from one stamp to another, in seconds."""
        if passed <= 0.0:
            return passed
        if passed < (1.0 - ALIKE) * self._period:
            self._period, self._count = passed, 0
        if passed < (1.0 + ALIKE) * self._period:
            self._count += 1
            self._period += (passed - self._period) / min(self._count, LEARNED)
        return self._period * math.floor(passed / self._period + ALIKE)


class Playout:
    """Targets of the drives, made of setpoints.

    Attributes:
        delay: from a setpoint to the drives at this moment [s].
        has_run_dry: whether the sliders had to brake, as there was no setpoint any more.
    """

    def __init__(self, delay: float, period: float, brake: Vector3) -> None:
        """Wait for the first setpoint.

        Args:
            delay: from a setpoint to the drives, as long as none is late [s].
            period: of the drives, from SYNC to SYNC [s].
            brake: accelerations with which the sliders can brake. Shape (3,) [m/s^2].

        Raises:
            KinematicsError: if a number is not positive.
        """
        self._delay = positive("delay", delay, "s")
        self._low = max(0.5 * delay, delay - MARGIN)
        self._period = positive("period", period, "s")
        self._brake = checked_vector("brake", brake, positive, "m/s^2")
        self.restart()

    def restart(self) -> None:
        """Forget all; the next setpoint is the first one."""
        self.delay, self.has_run_dry = self._delay, False
        self._store: deque[Setpoint] = deque()
        self._stamp, self._received = 0.0, 0.0  # of the newest setpoint
        self._step = _Step()
        self._rests_from = 0.0  # time in the store from which on all are at the same rest
        self._head, self._rate = 0.0, 1.0
        self._looked = -math.inf
        self._target: tuple[Vector3, Vector3] | None = None

    @property
    def rests(self) -> bool:
        """Whether the targets stand still."""
        return self._target is None or not any(self._target[1])

    @property
    def _is_still(self) -> bool:
        """Whether nothing in the store moves."""
        return not self._store or self._store[0].time >= self._rests_from

    def put(self, setpoint: Setpoint, now: float) -> None:
        """Store a setpoint that comes in ``now`` [s].

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            SetpointRefusedError: if it is late, or not the next one of a stream that began at rest.
        """
        finite_vector("setpoint", (setpoint.time, *setpoint.heights, *setpoint.velocities), 7)
        if self.has_run_dry:
            raise SetpointRefusedError("setpoints have come too late: drives need a new enabling")
        if not (self._store or setpoint.rests):
            raise SetpointRefusedError("the first setpoint must be at rest")
        last = self._store[-1] if self._store else replace(setpoint, time=0.0)
        is_still, time = self._is_still, last.time
        if self._store:
            time += self._passed(last, setpoint, now)
        if not setpoint.rests or setpoint.heights != last.heights:
            self._rests_from = time
        elif len(self._store) > 1 and self._store[-2].time >= self._rests_from:
            self._store.pop()
        if is_still:
            # From rest, all of the delay lies before what moves, counted to the next SYNC.
            self._head = min(time - self._delay, last.time)
            self._head -= min(now - self._looked, self._period)
        self._stamp, self._received = setpoint.time, now
        self._store.append(replace(setpoint, time=time))

    def _passed(self, last: Setpoint, setpoint: Setpoint, now: float) -> float:
        """Return the time from the ``last`` one to a new setpoint [s].

        Raises:
            SetpointRefusedError: if the new one cannot follow it.
        """
        passed = self._step.counted(setpoint.time - self._stamp)
        jumps = [abs(b - a) for a, b in zip(last.heights, setpoint.heights)]
        # What has begun to move has not got farther than its acceleration allows.
        way = 0.0 if setpoint.rests else max(self._brake) * min(passed, self._delay) ** 2
        if last.rests and max(jumps) > JUMP + way:
            raise SetpointRefusedError(f"a jump at rest of {max(jumps):.6f} m")
        if last.rests and setpoint.rests:
            # At rest, stamps may be set, and a stream may begin anew where the sliders are seen.
            glide = math.sqrt(max(6.0 / SHARE * j / b for j, b in zip(jumps, self._brake)))
            return max(glide, passed if 0.0 < passed <= self._delay else now - self._received)
        if not 0.0 < passed <= self._delay:
            if self._is_still:
                self._run_dry((last.heights, last.velocities))
            raise SetpointRefusedError(
                f"a setpoint comes {number_text(passed, 4)} s after the one before it, by its "
                f"stamp: more than 0 and at most {self._delay:g} s can be made good"
            )
        return passed

    def next(self, now: float) -> tuple[Vector3, Vector3] | None:
        """Return the target of the SYNC that comes ``now`` [s]; call it once for each SYNC.

        Returns:
            Heights of shape (3,) [m] and velocities of shape (3,) [m/s]; None before a setpoint.
        """
        self._looked = now
        if not self._store:
            return None
        if not self.has_run_dry:
            newest = self._store[-1]
            self._rate = 1.0 if self._is_still else self._next_rate(now, newest)
            head = self._head + self._rate * self._period
            if head >= newest.time and self._target is not None and not newest.rests:
                self._run_dry(self._target)
            else:
                self._head = min(head, newest.time)
                self.delay = newest.time + now - self._received - self._head
                self._target = self._at_head()
        if self.has_run_dry:
            self._target = self._braking_on()
        return self._target

    def _next_rate(self, now: float, newest: Setpoint) -> float:
        """Return how fast the stream is played up to this SYNC."""
        period, rate = self._period, self._rate
        excess = newest.time + now - self._received - self._head - period - self._delay
        wanted = min(1.0 + excess / RETURN_TIME, FASTEST)
        wanted = rate + (wanted - rate) * min(period / RATE_TIME, 1.0)
        at_head = self._target[1] if self._target is not None else newest.velocities
        to_brake = max(self._to_brake(newest.velocities), self._to_brake(at_head) / rate)
        if to_brake > 0.0:
            if not newest.rests:
                low = min(to_brake / (2.0 * SHARE), self._low)
                wanted = min(wanted, math.sqrt(max(newest.time - self._head, 0.0) / low))
            change = SHARE * period / to_brake
            wanted = min(max(wanted, rate - change), rate + change)
        return wanted

    def _at_head(self) -> tuple[Vector3, Vector3]:
        """Return heights and velocities on the cubic at the head."""
        store = self._store
        while len(store) > 1 and store[1].time <= self._head:
            store.popleft()
        first = store[0]
        if len(store) == 1 or self._head <= first.time:
            return first.heights, scaled(first.velocities, self._rate)
        second = store[1]
        span = second.time - first.time
        u = (self._head - first.time) / span
        heights, velocities = [], []
        # Relative to the first heights: at rest, a sum of weights would differ in its last bit.
        for i, h in enumerate(first.heights):
            p, q = span * first.velocities[i], span * second.velocities[i]
            way = second.heights[i] - h
            b, c = 3.0 * way - 2.0 * p - q, p + q - 2.0 * way
            heights.append(h + u * (p + u * (b + u * c)))
            velocities.append(self._rate / span * (p + u * (2.0 * b + u * 3.0 * c)))
        return three(heights), three(velocities)

    def _to_brake(self, velocities: Vector3) -> float:
        """Return the time in which all sliders brake from their ``velocities`` [s]."""
        return max(abs(v) / b for v, b in zip(velocities, self._brake))

    def _run_dry(self, target: tuple[Vector3, Vector3]) -> None:
        """Begin to brake from a ``target``: its heights and velocities."""
        self.has_run_dry, self._from = True, target
        self._braking, self._braked = self._to_brake(target[1]), 0.0

    def _braking_on(self) -> tuple[Vector3, Vector3]:
        """Return the next target of a braking: all sliders come to rest at the same time."""
        heights, velocities = self._from
        if self._braking == 0.0:
            return self._from
        self._braked = min(self._braked + self._period, self._braking)
        left = 1.0 - self._braked / self._braking
        time = self._braked * (1.0 + left) / 2.0
        return combined(1.0, heights, time, velocities), scaled(velocities, left)
