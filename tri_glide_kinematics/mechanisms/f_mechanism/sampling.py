"""Samples of a followed branch at requested values of the drive."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.f_mechanism.arcs import Arc
from tri_glide_kinematics.mechanisms.f_mechanism.curve import Curve
from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import (
    direction,
    newton_step,
    pins_at,
    rod_jacobian,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Values of the drive closer than this are one: an arc meets its end to rounding only [rad].
SPLIT = 1e-12


def passed(stations: FloatArray, start: float, stop: float) -> FloatArray:
    """Those of ascending stations that lie in (start, stop], rising or falling, in this order.

    One that is missed by rounding only belongs to the interval that ends there.
    """
    if stop > start:
        first, last = np.searchsorted(stations, (start + SPLIT, stop + SPLIT), side="right")
        return stations[first:last]
    first, last = np.searchsorted(stations, (stop - SPLIT, start - SPLIT), side="left")
    return stations[first:last][::-1]


# Points of a followed branch at requested values of the drive, all at once.

# Halvings of an arc, which end below the rounding of its parts; and those before Newton's method,
# which are as good as its start has to be.
_BISECTIONS = 60
_NEWTON_STEPS = 4
_INVERSIONS = 30
# Gap of the rod equations, relative to the size and the reach, of a sample on the curve.
_ON_CURVE = 1e-13


def sample_arcs(curve: Curve, arcs: Sequence[Arc], requests: Sequence[FloatArray]) -> FloatArray:
    """Points (direction of rod A, platform angle, drive) of all requests, shape (m, 3) [rad].

    Each arc has its values of the drive. From the cubic through both ends of the arc a point is
    corrected at its fixed drive. It counts only if it lies in the tube and between the ends of the
    arc, where no other branch is; otherwise it is found again by bisection along the arc.
    """
    which = np.repeat(np.arange(len(arcs)), [len(request) for request in requests])
    if not which.size:
        return np.empty((0, 3))
    s = np.concatenate(requests)
    points = _cubic_points(arcs, which, s)
    pins = pins_at(curve.linkage, curve.drive.crank_angles(s))
    tolerance = _ON_CURVE * curve.linkage.size * curve.linkage.reach
    # At a singular sample the corrections are infinite; it is then found by bisection.
    with np.errstate(divide="ignore", invalid="ignore"):
        for step in range(_NEWTON_STEPS + 1):
            v, z = curve.linkage.rods[0] * direction(points[:, 0]), direction(points[:, 1])
            jacobian = rod_jacobian(curve.linkage, pins, z, v)
            gap = np.maximum(abs(jacobian.gap_b), abs(jacobian.gap_c))
            if step < _NEWTON_STEPS:
                corrections = np.stack(newton_step(jacobian), axis=1)
                points[:, :2] += np.where((gap > 0.01 * tolerance)[:, np.newaxis], corrections, 0.0)
        solved = (gap <= tolerance) & _on_arc(arcs, which, points)
    for index in np.flatnonzero(~solved).tolist():
        points[index] = point_on_arc(curve, arcs[which[index]], float(s[index]))
    return points


def point_on_arc(curve: Curve, arc: Arc, s: float) -> Vector3:
    """Point of one arc where the drive is ``s``, by bisection along the arc."""
    part = abs(s - arc.start[2]) / max(abs(arc.end[2] - arc.start[2]), 1e-300)
    if arc.frame is None or not 0.0 < part < 1.0:
        # Beside a bifurcation the arc is straight to its length squared, which is tiny.
        p, q = (1.0 - min(part, 1.0)), min(part, 1.0)
        start, end = arc.start, arc.end
        return p * start[0] + q * end[0], p * start[1] + q * end[1], s
    low, high = arc.low, arc.high
    rising = arc.end[2] > arc.start[2]
    best = arc.start if part < 0.5 else arc.end
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        corrected = curve.correct(arc.frame, middle)
        if corrected is None:
            break
        best = corrected[0]
        if (best[2] < s) == rising:
            low = middle
        else:
            high = middle
    return best


def _on_arc(arcs: Sequence[Arc], which: NDArray[np.int64], points: FloatArray) -> NDArray[np.bool_]:
    """Whether points lie in the tube of their arc and between its ends."""
    centre = np.array([arc.frame.x if arc.frame else arc.start for arc in arcs])[which]
    tangent = np.array([arc.frame.tangent if arc.frame else (0.0, 0.0, 0.0) for arc in arcs])[which]
    radius, low, high = np.array([(arc.radius, *sorted((arc.low, arc.high))) for arc in arcs])[
        which
    ].T
    offset = points - centre
    along = np.sum(offset * tangent, axis=1)
    aside = np.sum(offset * offset, axis=1) - along * along
    inside: NDArray[np.bool_] = np.sqrt(np.maximum(aside, 0.0)) <= radius + 1e-9
    return inside & (along >= low - 1e-9) & (along <= high + 1e-9)


def _cubic_points(arcs: Sequence[Arc], which: NDArray[np.int64], s: FloatArray) -> FloatArray:
    """Points on the Hermite cubics of the arcs where the drive is ``s``."""
    start = np.array([arc.start for arc in arcs])
    end = np.array([arc.end for arc in arcs])
    chord = np.sqrt(np.sum((end - start) ** 2, axis=1))[:, np.newaxis]
    leaving = chord * np.array([arc.start_tangent for arc in arcs])
    arriving = chord * np.array([arc.end_tangent for arc in arcs])
    # x(u) = start + u (leaving + u (second + u third))
    second = 3.0 * (end - start) - 2.0 * leaving - arriving
    third = leaving + arriving - 2.0 * (end - start)
    start, leaving, second, third = (part[which] for part in (start, leaving, second, third))
    rising = end[which, 2] > start[:, 2]
    low, high = np.zeros(len(s)), np.ones(len(s))
    for _ in range(_INVERSIONS):
        u = 0.5 * (low + high)
        drive = start[:, 2] + u * (leaving[:, 2] + u * (second[:, 2] + u * third[:, 2]))
        before = (drive < s) == rising
        low, high = np.where(before, u, low), np.where(before, high, u)
    u = (0.5 * (low + high))[:, np.newaxis]
    points: FloatArray = start + u * (leaving + u * (second + u * third))
    points[:, 2] = s
    return points


def same_position(p: Vector3, q: Vector3, tolerance: float) -> bool:
    """Whether two points differ by whole turns of rod and platform only."""
    return all(abs(math.remainder(a - b, 2.0 * math.pi)) <= tolerance for a, b in zip(p[:2], q[:2]))
