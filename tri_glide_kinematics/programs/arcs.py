"""Arcs of programs: centre and angle, of numbers that are rounded."""

from __future__ import annotations

import math

from tri_glide_kinematics.motion.path import SHORTEST
from tri_glide_kinematics.programs.settings import MILLIMETRE
from tri_glide_kinematics.wording import number_text

# The ends of an arc may differ so much in their distances from the centre, as numbers are rounded:
# a length [m], and a part of the radius.
ARC_MISMATCH = 1e-5
RELATIVE_MISMATCH = 1e-3

# The ends of a full circle are no farther apart [m].
SAME_POINT = 1e-9


class NoArcError(Exception):
    """The numbers of an arc determine none; says why."""


Point = tuple[float, float]


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
