"""Arcs and drilled holes, by the numbers that a program gives for them, as RS274/NGC has it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from tri_glide_kinematics.motion.path import SHORTEST
from tri_glide_kinematics.programs.dialects import MILLIMETRE
from tri_glide_kinematics.vectors import Point
from tri_glide_kinematics.wording import number_text

# Arcs: their centre and angle, of numbers that are rounded.

# The ends of an arc may differ so much in their distances from the centre, as numbers are rounded:
# a length [m], and a part of the radius.
ARC_MISMATCH = 1e-5
RELATIVE_MISMATCH = 1e-3

# The ends of a full circle are no farther apart [m].
SAME_POINT = 1e-9


class NoArcError(Exception):
    """The numbers of an arc determine none; says why."""


def centre_of_radius(start: Point, end: Point, radius: float, clockwise: bool) -> Point:
    """Return the centre of the arc with a ``radius``, negative if it is more than half a turn [m].

    Raises:
        NoArcError: if there is none.
    """
    chord = math.dist(start, end)
    if chord < SAME_POINT:
        raise NoArcError("R says nothing of a whole circle: write its centre with I, J and K")
    half, size = 0.5 * chord, abs(radius)
    if size < half - _mismatch(half):
        raise NoArcError(
            f"its radius {_millimetres(size)} must be at least half the distance of its ends, "
            f"{_millimetres(half)}"
        )
    # The centre is to the left of the way to the end if the arc turns left by less than half.
    aside = math.sqrt(max((size - half) * (size + half), 0.0)) / chord
    if clockwise != (radius < 0.0):
        aside = -aside
    x, y = end[0] - start[0], end[1] - start[1]
    return 0.5 * (start[0] + end[0]) - aside * y, 0.5 * (start[1] + end[1]) + aside * x


def arc(start: Point, end: Point, centre: Point, clockwise: bool) -> tuple[Point, float]:
    """Return the centre of an arc, as far from its end as from its start, and its angle [rad].

    Numbers in a program are rounded, so that a centre is not quite as far from both. It is moved
    to where it is; if that is far, as on a nearly whole circle, the end gives way instead.

    Raises:
        NoArcError: if the start is at the centre, or both differ by more than by rounding.
    """
    x, y = start[0] - centre[0], start[1] - centre[1]
    to_x, to_y = end[0] - centre[0], end[1] - centre[1]
    radius, other = math.hypot(x, y), math.hypot(to_x, to_y)
    allowed = _mismatch(radius)
    if radius < SHORTEST:
        raise NoArcError("it begins at its centre")
    if not abs(radius - other) <= allowed:
        raise NoArcError(
            f"its start is {_millimetres(radius)} from its centre and its end "
            f"{_millimetres(other)}: they must be the same within {_millimetres(allowed)}"
        )
    whole = -2.0 * math.pi if clockwise else 2.0 * math.pi
    chord = math.dist(start, end)
    if chord < SAME_POINT:
        return centre, whole
    move = (other - radius) * (other + radius) / (2.0 * chord)
    if abs(move) <= allowed:
        part = move / chord
        centre = centre[0] + part * (end[0] - start[0]), centre[1] + part * (end[1] - start[1])
        x, y = start[0] - centre[0], start[1] - centre[1]
        to_x, to_y = end[0] - centre[0], end[1] - centre[1]
    angle = math.atan2(x * to_y - y * to_x, x * to_x + y * to_y)
    if (angle < 0.0) != clockwise or angle == 0.0:
        angle += whole
    return centre, angle


def _mismatch(radius: float) -> float:
    """Return by how much the ends of an arc may differ in their distances from its centre [m]."""
    return ARC_MISMATCH + RELATIVE_MISMATCH * radius


def _millimetres(length: float) -> str:
    return f"{number_text(length / MILLIMETRE, 6)} mm"


# Drilling cycles: how the tool goes in one hole.

# The cycles that are understood: G73 and G83 go down in steps, G82 rests at the
# bottom, G85 leaves the hole as slowly as it came.
CYCLES = ("G73", "G81", "G82", "G83", "G85")
_BREAKS, _, _RESTS, _CLEARS, _REAMS = CYCLES

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

    code: str
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
            steps = max(math.ceil((self.clear - self.bottom) / self.step - 1e-6), 1)
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
