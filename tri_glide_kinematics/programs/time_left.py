"""How long a program still takes: by its check, the overrides, and what was driven so far."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.programs.check import ProgramCheck
from tri_glide_kinematics.programs.program import Program
from tri_glide_kinematics.vectors import FloatArray

# What was driven counts against what was told of it with so much time that was as told [s].
AS_TOLD = 5.0
# Where so many times the time that passes is gained, something was skipped, or waited for.
MOST_GAINED = 4.0


class Scales(NamedTuple):
    """By what the speeds of a program are multiplied.

    Attributes:
        feed: of F.
        rapid: of the largest velocity, where no F holds; 1 is for no such bound.
    """

    feed: float = 1.0
    rapid: float = 1.0


class TimeLeft:
    """The time that is left of a program."""

    def __init__(self, program: Program, check: ProgramCheck) -> None:
        """Take a ``program`` that was checked."""
        self._steps, self._check = program.steps, check
        self._ends = np.array([step.line_at(-1) for step in program.steps])
        self._begins = np.array([step.line_at() for step in program.steps])
        # When it was looked at, with which scales, and what was left then; and how long the
        # platform was driven since the first look, in fact and as told [s].
        self._last: tuple[float, Scales, float] | None = None
        self._driven = self._told = 0.0

    def at(self, line: int, way: float, scales: Scales) -> float:
        """Return how long it takes from a ``line`` on, waiting for nobody [s].

        ``way`` is what is left of the present path [m]; NaN if that is not known.
        """
        first = int(np.searchsorted(self._ends, line))
        last = int(np.searchsorted(self._begins, line, "right"))
        left = float(self._behind(scales)[max(first, last)])
        for index in range(first, last):
            timed = self._check.timed[index]
            if timed is None:
                left += self._check.durations[index]
                continue
            to_go = float(timed.to_go[0])
            if math.isfinite(way):
                to_go = min(way, to_go)
            else:
                (run,) = self._steps[index].runs
                behind = len(run.lines) - int(np.searchsorted(run.lines, line))
                to_go *= behind / len(run.lines)
            left += timed.left(to_go, *scales)
        return left

    @lru_cache(maxsize=2)  # noqa: B019
    def _behind(self, scales: Scales) -> FloatArray:
        """Return how long each step and all behind it take, and 0 at the end. Shape (n + 1,)."""
        each = [
            duration if timed is None else timed.left(float(timed.to_go[0]), *scales)
            for timed, duration in zip(self._check.timed, self._check.durations)
        ]
        return np.append(np.cumsum(each[::-1])[::-1], 0.0)

    def look(self, now: float, line: int, way: float, scales: Scales) -> float:
        """Return the same, corrected by how long it has taken so far; called again and again.

        Args:
            now: of any clock [s].
            line: that is driven.
            way: as for ``at``.
            scales: in force.
        """
        left = self.at(line, way, scales)
        if self._last is not None and self._last[1] == scales:
            passed, gained = now - self._last[0], self._last[2] - left
            # A platform that is paused, or on its way to the start, gains nothing.
            if 0.0 < gained < MOST_GAINED * passed:
                self._driven += passed
                self._told += gained
        self._last = now, scales, left
        return left * (self._driven + AS_TOLD) / (self._told + AS_TOLD)
