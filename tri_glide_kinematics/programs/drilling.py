"""Drilling cycles: how the tool goes in one hole, as RS274/NGC has it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

# Tenfold numbers of the cycles that are understood: G73 and G83 go down in steps, G82 rests at the
# bottom, G85 leaves the hole as slowly as it came.
CYCLES = (730, 810, 820, 830, 850)
_BREAKS, _RESTS, _CLEARS, _REAMS = 730, 820, 830, 850

# So far above what is drilled already the tool stops, before it goes on at its feed [m].
BACK = 2.54e-4

# Neither a hole has more steps, nor a line more holes.
MOST = 1000


class NoHoleError(Exception):
    """The numbers of a cycle determine no hole; says why."""


class Stroke(NamedTuple):
    """A straight move along z.

    Attributes:
        z: where it ends [m].
        rapid: whether at full speed.
        rest: behind it [s].
    """

    z: float
    rapid: bool = False
    rest: float = 0.0


@dataclass(frozen=True)
class Cycle:
    """A drilling cycle; heights are those of the platform.

    Attributes:
        code: one of ``CYCLES``.
        clear: from which the tool is led down at its feed, R [m].
        bottom: of the hole, Z [m].
        step: of a hole that is drilled in steps, Q [m].
        rest: at the bottom, P [s].
    """

    code: int
    clear: float
    bottom: float
    step: float | None = None
    rest: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NoHoleError: if one is missing or has no meaning.
        """
        if self.bottom > self.clear:
            raise NoHoleError("the bottom of the hole, Z, is above R, where it begins")
        if self.code in (_BREAKS, _CLEARS):
            if self.step is None or not self.step > 0.0:
                raise NoHoleError("it needs a Q above 0, the depth of one step")
            if self.clear - self.bottom > MOST * self.step:
                raise NoHoleError(f"its Q is so small that there are more than {MOST} steps")
        if self.code == _RESTS and (self.rest is None or self.rest < 0.0):
            raise NoHoleError("it needs a P, the time at the bottom, which is at least 0")

    def strokes(self) -> Iterator[Stroke]:
        """Yield the moves from ``clear`` to the bottom, and up again where they are slow."""
        steps = 1
        if self.code in (_BREAKS, _CLEARS) and self.step:
            # A last step of nothing, by rounding, is none.
            steps = max(ceil((self.clear - self.bottom) / self.step - 1e-6), 1)
        for number in range(1, steps):
            depth = self.clear - number * (self.step or 0.0)
            yield Stroke(depth)
            above = min(depth + BACK, self.clear)
            if self.code == _CLEARS:
                yield Stroke(self.clear, rapid=True)
            yield Stroke(above, rapid=True)
        yield Stroke(self.bottom, rest=self.rest or 0.0 if self.code == _RESTS else 0.0)
        if self.code == _REAMS:
            yield Stroke(self.clear)
