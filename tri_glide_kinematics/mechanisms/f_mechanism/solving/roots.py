"""Real roots of a trigonometric polynomial of degree three, none lost and none invented.

Cells that must be looked at closely (``cells``) are halved until the polynomial is monotone or
convex in each part. In a convex part the sign of the polynomial at its extremum tells two roots
from none, and an extremum that is zero to rounding is one double root.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.mechanisms.f_mechanism.solving.cells import NODES, possible_cells, sample
from tri_glide_kinematics.mechanisms.f_mechanism.solving.polynomial import (
    Cubic,
    derivative_bound,
    evaluate,
)

# A cell this narrow is not halved again: within it a triple root cannot be told from a simple one.
_NARROWEST = 1e-5
# Roots closer than this are looked at as the possible halves of one double root.
_CLUSTER_WIDTH = 1e-3
# A Newton step may leave its bracket by rounding, which also decides the signs at a converged root.
SLACK = 1e-13


class Root(NamedTuple):
    """A real root ``angle`` [rad]; ``double`` where the polynomial touches zero to rounding."""

    angle: float
    double: bool


class _Sample(NamedTuple):
    angle: float
    value: float
    slope: float
    curvature: float


class _Bounds(NamedTuple):
    """Upper bounds of the third and fourth derivative, and the rounding error."""

    third: float
    fourth: float
    tolerance: float


def real_roots(polynomial: Cubic, tolerance: float) -> list[Root]:
    """All real roots in [-pi, pi], ascending.

    Args:
        polynomial: coefficients as plain numbers; not identically zero.
        tolerance: rounding error of the polynomial. Roots between which it does not exceed this
            are one double root.
    """
    samples = sample(polynomial)
    value, slope, curvature = samples
    third, fourth = derivative_bound(polynomial, 3), derivative_bound(polynomial, 4)
    bounds = _Bounds(float(third), float(fourth), tolerance)
    roots: list[Root] = []
    for index in np.flatnonzero(possible_cells(polynomial, samples, tolerance)).tolist():
        after = index + 1
        low = _Sample(
            float(NODES[index]), float(value[index]), float(slope[index]), float(curvature[index])
        )
        high = _Sample(
            float(NODES[after]), float(value[after]), float(slope[after]), float(curvature[after])
        )
        roots += _isolate(polynomial, low, high, bounds)
    if len(roots) > 1:
        return _merge_touching(polynomial, roots, tolerance)
    return roots


def _newton(polynomial: Cubic, low: _Sample, high: float, start: float) -> float:
    """Root between ``low`` and ``high``, of which exactly one is known to be there."""
    left, right, angle = low.angle, high, start
    positive = low.value >= 0.0
    for _ in range(60):
        value, slope, curvature = evaluate(polynomial, angle)
        if (value >= 0.0) == positive:
            left = angle
        else:
            right = angle
        step = -value / slope if slope else math.inf
        if not left - SLACK <= angle + step <= right + SLACK:
            angle = 0.5 * (left + right)
            continue
        angle += step
        if step * step * abs(curvature) <= 1e-16 * abs(slope):
            break
    return angle


def _extremum(polynomial: Cubic, low: _Sample, high: _Sample) -> float:
    """Zero of the derivative between two samples where it is monotone and changes its sign."""
    left, right = low.angle, high.angle
    angle = left + (right - left) * low.slope / (low.slope - high.slope)
    for _ in range(60):
        _, slope, curvature = evaluate(polynomial, angle)
        if (slope >= 0.0) == (low.slope >= 0.0):
            left = angle
        else:
            right = angle
        following = angle - slope / curvature if curvature else math.inf
        if not left - SLACK <= following <= right + SLACK:
            following = 0.5 * (left + right)
        if abs(following - angle) < 1e-12:
            return following
        angle = following
    return angle


def _isolate(polynomial: Cubic, low: _Sample, high: _Sample, bounds: _Bounds) -> list[Root]:
    """Roots between two samples, halving until each part is monotone or convex.

    The judgement is that of ``judge``, where its bounds are explained.
    """
    width = high.angle - low.angle
    bend = width * width / 8.0
    curvature_bound = bend * bounds.fourth
    change = (low.value >= 0.0) != (high.value >= 0.0)
    if not change:
        steepest = max(abs(low.curvature), abs(high.curvature)) + curvature_bound
        if min(abs(low.value), abs(high.value)) > bend * steepest + bounds.tolerance:
            return []
    if (
        min(low.slope, high.slope) > bend * bounds.third
        or max(low.slope, high.slope) < -bend * bounds.third
        or min(low.curvature, high.curvature) > curvature_bound
        or max(low.curvature, high.curvature) < -curvature_bound
    ):
        if change:
            start = low.angle + width * low.value / (low.value - high.value)
            return [Root(_newton(polynomial, low, high.angle, start), False)]
        rising = high.slope >= 0.0
        if (low.slope >= 0.0) != rising and rising == (low.value >= 0.0):
            return _roots_beside_extremum(polynomial, low, high, bounds.tolerance)
        return []
    angle = 0.5 * (low.angle + high.angle)
    middle = _Sample(angle, *evaluate(polynomial, angle))
    if width < _NARROWEST:
        if change:
            return [Root(_newton(polynomial, low, high.angle, angle), False)]
        return [Root(angle, True)] if abs(middle.value) <= bounds.tolerance else []
    return _isolate(polynomial, low, middle, bounds) + _isolate(polynomial, middle, high, bounds)


def _roots_beside_extremum(
    polynomial: Cubic, low: _Sample, high: _Sample, tolerance: float
) -> list[Root]:
    """Two, one double or no root about the one extremum in a convex part."""
    angle = _extremum(polynomial, low, high)
    value, _, curvature = evaluate(polynomial, angle)
    if abs(value) <= tolerance:
        return [Root(angle, True)]
    if (value >= 0.0) == (low.value >= 0.0):
        return []
    reach = math.sqrt(max(-2.0 * value / curvature, 0.0)) if curvature else 0.0
    extremum = _Sample(angle, value, 0.0, curvature)
    return [
        Root(_newton(polynomial, low, angle, max(low.angle, angle - reach)), False),
        Root(_newton(polynomial, extremum, high.angle, min(high.angle, angle + reach)), False),
    ]


def _merge_touching(polynomial: Cubic, roots: list[Root], tolerance: float) -> list[Root]:
    """Replace neighbours between which the polynomial is zero to rounding by one double root."""
    roots = sorted(roots)
    clusters = [[roots[0]]]
    for root in roots[1:]:
        if _touches(polynomial, clusters[-1][-1].angle, root.angle, tolerance):
            clusters[-1].append(root)
        else:
            clusters.append([root])
    wrapped = roots[0].angle + 2.0 * math.pi
    if len(clusters) > 1 and _touches(polynomial, clusters[-1][-1].angle, wrapped, tolerance):
        tail = [Root(root.angle - 2.0 * math.pi, root.double) for root in clusters.pop()]
        clusters[0] = tail + clusters[0]
    merged = []
    for cluster in clusters:
        if len(cluster) == 1:
            merged.append(cluster[0])
        else:
            angle = 0.5 * (cluster[0].angle + cluster[-1].angle)
            merged.append(Root(math.remainder(angle, 2.0 * math.pi), True))
    return sorted(merged)


def _touches(polynomial: Cubic, left: float, right: float, tolerance: float) -> bool:
    if right - left > _CLUSTER_WIDTH:
        return False
    return abs(evaluate(polynomial, 0.5 * (left + right))[0]) <= tolerance
