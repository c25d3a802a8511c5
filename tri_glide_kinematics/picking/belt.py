"""How a belt moves, by what its encoder reports: where it was, and where it will be.

A curve is fitted to the newest reports, to as long a time as it fits: a line, or one with a bend or
a kink. So rounding by the encoder matters the less, the longer a belt runs steadily; and an
acceleration that has just begun, or ended, is found by its instant and size alone, as the motion
before is known.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.checks import SMALLEST, finite, non_negative, positive
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

# How long reports are kept, at least, and to how much of them a curve is fitted [s]. Of more
# reports in this time, only some are used: as many again make it hardly better.
HISTORY = 4.0
LONGEST_FIT = 1.3
MOST_FITTED = 200

# Reports that come sooner after the last one than this are left out [s]: each takes a third of a
# millisecond of the processor.
CLOSEST = 0.003

# Reports that no curve fits are cut to this part of them, but a line has so many at least.
SHORTER = 0.7
FEWEST = 3

# A curve fits if no report is farther from it than this many times the noise. The noise is taken
# from this part of the reports: at the others, the speed may change.
OFF, STEADY_PART = 3.4, 0.9

# An acceleration begins, or ends, at one of so many instants of the last time [s], or lasts longer.
# The last reports do not tell yet.
RECENT, MOST_INSTANTS = 0.24, 24
UNTOLD = 2

# What is expected of a belt before it is seen: changes of acceleration of that size [m/s^2], as
# unlikely at each of the instants as that (logarithm of the odds). Reports are off by this part of
# the largest distance that fits: so the last bit of an encoder looks like no change.
USUAL_CHANGE = 0.3
ODDS = math.log(0.01)
USUALLY_OFF = 0.64

# A belt that changes its speed at once does so by as much as it usually changes in this time [s].
SWITCHED = 0.03

# No belt is faster [m/s]; or changes its speed faster [m/s^2], unless it is switched. An encoder
# that is off by so much more may have jumped [m].
FASTEST = 2.0
FASTEST_CHANGE = 10.0
LEAST_JUMP = 1e-3

# The next report decides about a doubted one, by how far it is off itself, as a part of how far
# that was off. Below WRONG, the doubted report was wrong. After a jump it is 1. After a change of
# speed it is more than 1, as time has passed: JUMPED is half of what is added at least.
WRONG, JUMPED = 0.5, 0.5

# The velocity in the past is the mean over so long before and after [s].
AROUND = 0.03


class BeltState(NamedTuple):
    """How a belt moves at a time.

    Attributes:
        position: along its direction, on a scale that never wraps [m].
        velocity: [m/s].
        acceleration: 0 in the past, where it is not asked for [m/s^2].
    """

    position: float
    velocity: float
    acceleration: float


class BeltUnknownError(KinematicsError):
    """It is not known where the belt was."""

    def __init__(self, time: float, first: float | None) -> None:
        """Store the ``time`` asked for, and the ``first`` that is known, if one is [s]."""
        why = "there is no report of it"
        if first is not None:
            why = f"the first report that is kept is {number_text(first - time)} s later"
        super().__init__(f"the belt at time = {number_text(time)} s is not known: {why}")
        self.time = time
        self.first = first


class BeltMotion:
    """The motion of a belt, from the reports of its encoder."""

    def __init__(
        self, resolution: float = 1e-4, wrap: float = 0.0, longest_silence: float = 0.1
    ) -> None:
        """Know no report yet.

        Args:
            resolution: one step of the encoder [m].
            wrap: way after which it begins again at the same position; 0 for never [m].
            longest_silence: without a report, before the encoder counts as silent [s].

        Raises:
            OutOfBoundsError: if one is negative, or the resolution or the silence zero.
        """
        self._resolution = positive("resolution", resolution, "m")
        self._wrap = non_negative("wrap", wrap, "m")
        self._longest_silence = positive("longest_silence", longest_silence, "s")
        self._times: list[float] = []
        self._positions: list[float] = []
        # How far the last report is off, if it is doubted [m]; the motion by the others.
        self._off = 0.0
        self._motion: BeltState | None = None
        # How far reports may be off a curve that fits them [m].
        self._tolerance = self._resolution

    def is_silent(self, now: float) -> bool:
        """Return whether the last report is not of the time just before ``now`` [s]."""
        return not self._times or abs(now - self._times[-1]) > self._longest_silence

    def report(self, time: float, position: float) -> bool:
        """Take a report; one that is hardly newer than the last is left out.

        Args:
            time: at which the encoder was read [s].
            position: of the belt then, wrapped or not [m].

        Returns:
            Whether the encoder has jumped. Then nothing of the time before is known any more, and
            what lies on the belt is lost.

        Raises:
            NotFiniteError: if one of them is NaN or infinite.
        """
        time, position = finite("time", time), finite("position", position)
        if not self._times:
            self._times, self._positions = [time], [position]
        gap = time - self._times[-1]
        if gap < CLOSEST:
            return False
        foreseen = self.at(time).position
        doubted, kept = self._off, 1
        largest = LEAST_JUMP + 2.0 * self._tolerance + 0.5 * FASTEST_CHANGE * gap**2
        has_jumped = False
        if self._wrap:
            # After a long silence nobody can say how often it has wrapped.
            has_jumped = largest > 0.5 * self._wrap
            position += self._wrap * round((foreseen - position) / self._wrap)
        off = position - foreseen
        if doubted:
            part, before = off / doubted, self._times[-1] - self._times[-2]
            if WRONG < part < 1.0 + JUMPED * gap / before:
                has_jumped, kept = True, 2
            elif abs(off) > FASTEST * (before + gap):
                has_jumped = True
            elif part <= WRONG:
                del self._times[-1], self._positions[-1]
                doubted = 0.0
        self._off = off if abs(off) > largest and not doubted and not has_jumped else 0.0
        self._times.append(time)
        self._positions.append(position)
        if not has_jumped:
            kept = len(self._times) + 1 - bisect_right(self._times, time - HISTORY)
        del self._times[:-kept], self._positions[:-kept]
        self._motion = None
        return has_jumped

    def at(self, time: float) -> BeltState:
        """Return how the belt moves at a ``time`` [s], before the last report or after it.

        A belt that slows down is foreseen to stop, not to turn round.

        Raises:
            BeltUnknownError: before the first report that is kept, as after a jump.
        """
        if not self._times or time < self._times[0]:
            raise BeltUnknownError(time, self._times[0] if self._times else None)
        known = len(self._times) - bool(self._off)
        times, positions = self._times[:known], self._positions[:known]
        if time >= times[-1]:
            return self._foreseen(time, times, positions)
        begin, end = max(time - AROUND, times[0]), min(time + AROUND, times[-1])
        before, position, behind = np.interp((begin, time, end), times, positions).tolist()
        return BeltState(position, (behind - before) / (end - begin), 0.0)

    def _foreseen(self, time: float, times: list[float], positions: list[float]) -> BeltState:
        """Return how the belt moves at a ``time`` [s] after the last of the reports."""
        if self._motion is None:
            begin = bisect_right(times, times[-1] - LONGEST_FIT, 0, len(times) - 1)
            each = -(-(len(times) - begin) // MOST_FITTED)
            until = np.array(times[begin:])[::-each][::-1] - times[-1]
            moved = np.array(positions[begin:])[::-each][::-1] - positions[-1]
            self._tolerance = max(1.1 * self._resolution, OFF * noise_of(until, moved))
            position, velocity, acceleration = fitted(until, moved, self._tolerance)
            self._motion = BeltState(positions[-1] + position, velocity, acceleration)
        dt = time - times[-1]
        position, velocity, acceleration = self._motion
        if velocity * acceleration < 0.0 and dt > -velocity / acceleration:
            return BeltState(position - 0.5 * velocity**2 / acceleration, 0.0, 0.0)
        position += (velocity + 0.5 * acceleration * dt) * dt
        return BeltState(position, velocity + acceleration * dt, acceleration)


def noise_of(times: FloatArray, positions: FloatArray) -> float:
    """Return the noise of reports, by how far they are off the chord of their neighbours [m].

    Args:
        times: of the reports, ascending. Shape (n,) [s].
        positions: of the belt then. Shape (n,) [m].
    """
    parts = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    bends = positions[1:-1] - positions[:-2] - parts * (positions[2:] - positions[:-2])
    steady = np.sort(bends**2)[: int(STEADY_PART * len(bends))]
    return math.sqrt(steady.mean()) if len(steady) else 0.0


def fitted(times: FloatArray, positions: FloatArray, tolerance: float) -> BeltState:
    """Return the motion at time 0, by the longest time until then that a curve fits.

    Args:
        times: of the reports, ascending to 0. Shape (n,) [s].
        positions: of the belt then. Shape (n,) [m].
        tolerance: how far they may be off [m].
    """
    count = len(times)
    while count > FEWEST:
        state = _curve(times[-count:], positions[-count:], tolerance)
        if state is not None:
            return state
        count = max(int(SHORTER * count), FEWEST)
    position, velocity = _line(times[-count:], positions[-count:, None])
    return BeltState(float(position[0]), float(velocity[0]), 0.0)


def _curve(times: FloatArray, positions: FloatArray, tolerance: float) -> BeltState | None:
    """Return the motion at time 0, as a mean of the curves that fit; None if none does.

    Each curve is a line plus a bend, from some instant on or until then, or plus a kink. By Bayes'
    rule each counts by how well it fits, and how likely it was before: sizes of bends are normally
    distributed. Arguments are those of ``fitted``.
    """
    recent = times[times > -RECENT][:-UNTOLD]
    instants = recent[:: max(len(recent) // MOST_INSTANTS, 1)]
    # No bend, one all the time, those that have begun, those that have ended, and kinks.
    since = np.concatenate(((0.0, times[0]), instants))
    behind, before = (
        np.maximum(times[:, None] - since, 0.0),
        np.maximum(instants - times[:, None], 0.0),
    )
    bends = np.hstack((0.5 * behind**2, 0.5 * before**2, SWITCHED * behind[:, 2:]))
    # What of both is no line.
    line, _ = np.linalg.qr(np.vander(times / (-times[0] or 1.0), 2))
    off, across = positions - line @ (line.T @ positions), bends - line @ (line.T @ bends)
    noise = USUALLY_OFF * tolerance
    unlikely = (noise / USUAL_CHANGE) ** 2
    squares = (across**2).sum(axis=0) + unlikely
    sizes = off @ across / squares
    gains = 0.5 * (squares * (sizes / noise) ** 2 + np.log(unlikely / squares))
    gains[2:] += ODDS
    gains[abs(off[:, None] - across * sizes).max(axis=0) > tolerance] = -math.inf
    best = int(gains.argmax())
    if math.isinf(gains[best]):
        return None
    # Without a sign of a change, nothing is mixed: small mistakes grow with the time ahead.
    weights = np.eye(len(gains))[best] if best < 2 else np.exp(gains - gains[best])
    states = np.vstack((*_line(times, positions[:, None] - bends * sizes), 0.0 * sizes))
    begun, kinks = slice(len(since)), slice(len(since) + len(instants), None)
    states[:, begun] += sizes[begun] * (0.5 * since**2, -since, np.ones(len(since)))
    states[:2, kinks] += SWITCHED * sizes[kinks] * (-instants, np.ones(len(instants)))
    return BeltState(*(states @ weights / weights.sum()).tolist())


def _line(times: FloatArray, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity at time 0 of lines through ``positions``. Shape (n, k)."""
    around = times - times.mean()
    velocity = around @ positions / max(float(around @ around), SMALLEST)
    return positions.mean(axis=0) - velocity * times.mean(), velocity
