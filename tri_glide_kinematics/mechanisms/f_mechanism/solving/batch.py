"""All positions of the moving triangle at many crank angles at once.

The same steps as for one crank angle, on flat arrays with one entry for each root. Rows with a
special case in them (a double root, a degenerate linear system, a self-motion) are rare, and are
solved one by one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.errors import SelfMotionError
from tri_glide_kinematics.mechanisms.f_mechanism.results.pose import FMechanismPoses
from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import (
    ROUNDING,
    Closure,
    CrankPins,
    Cubic,
    Linear,
    Linkage,
    closure,
    crank_pins,
    rod_jacobian,
    rotation,
    singularity_unit,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.positions import (
    DEGENERATE,
    motion,
    newton_step,
    poses_at,
    special_pins,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.roots import (
    CELL_WIDTH,
    NODES,
    SLACK,
    Ends,
    derivative_bound,
    derivatives,
    judge,
    possible_cells,
    sample,
)
from tri_glide_kinematics.rounding import directions

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Rows solved together: their samples fit into the processor's cache.
_CHUNK = 1024
# Halvings of unclear cells before a row is solved by itself.
_HALVINGS = 6
# Neighbouring roots closer than this [rad] may be one double root.
_CLOSE = 1e-3
# Largest rod residual left by the batch, relative to the size; other rows are solved by themselves.
_RESIDUAL = 1e-12
# A bracketed Newton iteration ends with a step below this [rad], or after so many rounds: beside a
# double root rounding alone moves it farther, and the row is solved by itself.
_CONVERGED = 1e-10
_ROUNDS = 20


class _Spans(NamedTuple):
    """Intervals of the platform angle, each in one row of the batch."""

    row: Index
    low: Array
    start: Ends
    end: Ends

    def where(self, mask: Mask) -> _Spans:
        start, end = (Ends(*(part[mask] for part in ends)) for ends in (self.start, self.end))
        return _Spans(self.row[mask], self.low[mask], start, end)


class _Brackets(NamedTuple):
    """Intervals with exactly one zero each, and a first guess of it."""

    row: Index
    low: Array
    high: Array
    positive: Mask
    guess: Array


class _Roots(NamedTuple):
    row: Index
    angle: Array


def solve_batch(linkage: Linkage, crank_angles: Array) -> FMechanismPoses:
    """All positions at the given crank angles, shape (n,) [rad]."""
    n = len(crank_angles)
    result = FMechanismPoses(
        crank_angles=crank_angles,
        counts=np.zeros(n, dtype=np.int64),
        angle=np.full((n, 6), np.nan),
        position=np.full((n, 6, 2), np.nan),
        angular_velocity=np.full((n, 6), np.nan),
        velocity=np.full((n, 6, 2), np.nan),
        residual=np.full((n, 6), np.nan),
        singularity=np.full((n, 6), np.nan),
        self_motion=np.zeros(n, dtype=np.bool_),
        linkage=linkage,
    )
    for first in range(0, n, _CHUNK):
        rows = slice(first, min(first + _CHUNK, n))
        special = _solve_chunk(linkage, crank_angles[rows], result, first)
        for row in (first + np.flatnonzero(special)).tolist():
            _solve_row(linkage, result, row)
    return result


def _solve_chunk(linkage: Linkage, angles: Array, result: FMechanismPoses, first: int) -> Mask:
    """Write the positions of ordinary rows to ``result``; return which rows are special."""
    a, b, c = (
        _unit(speed * angles + phase) for speed, phase in zip(linkage.speeds, linkage.phases)
    )
    pins = crank_pins(linkage, (a, b, c))
    condition = closure(linkage, pins)
    tolerance = ROUNDING * condition.scale
    special: Mask = special_pins(linkage, pins, condition)
    roots = _roots(condition.polynomial, tolerance, special)

    row = roots.row
    z = _unit(roots.angle)
    pins = CrankPins(*(part[row] for part in pins))
    v, degenerate = _rod_vectors(linkage, pins, condition, row, z)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing, turn = newton_step(rod_jacobian(linkage, pins, z, v))
        z, v = z * rotation(turn), v * rotation(swing)
        jacobian = rod_jacobian(linkage, pins, z, v)
        inverse = 1.0 / jacobian.determinant
        origin, joints, velocity, turn_rate = motion(linkage, pins, z, v, jacobian, inverse)
        gaps = [abs(abs(q - p) - length) for q, p, length in zip(joints, pins, linkage.rods)]
        residual = np.maximum(np.maximum(gaps[0], gaps[1]), gaps[2])
        failed = degenerate | ~(residual <= _RESIDUAL * linkage.size)
    special[row[failed]] = True

    angle = directions(z)
    ordinary = np.flatnonzero(~special[row])
    ordinary = ordinary[_row_order(row[ordinary], angle[ordinary])]
    row = row[ordinary]
    counts = np.bincount(row, minlength=len(angles))
    slot = np.arange(len(row)) - (np.cumsum(counts) - counts)[row]
    place = (first + row, slot)
    result.counts[first : first + len(angles)] = counts
    result.angle[place] = angle[ordinary]
    result.position[place] = _points(origin[ordinary])
    result.angular_velocity[place] = turn_rate[ordinary]
    result.velocity[place] = _points(velocity[ordinary])
    result.residual[place] = residual[ordinary]
    result.singularity[place] = jacobian.determinant[ordinary] / singularity_unit(linkage)
    return special


def _solve_row(linkage: Linkage, result: FMechanismPoses, row: int) -> None:
    """Solve one row by itself."""
    try:
        poses = poses_at(linkage, float(result.crank_angles[row]))
    except SelfMotionError:
        result.self_motion[row] = True
        return
    result.counts[row] = len(poses)
    for slot, pose in enumerate(poses):
        result.angle[row, slot] = pose.angle
        result.position[row, slot] = pose.position
        result.angular_velocity[row, slot] = pose.angular_velocity
        result.velocity[row, slot] = pose.velocity
        result.residual[row, slot] = pose.residual
        result.singularity[row, slot] = pose.singularity


def _unit(angle: Array) -> Complex:
    unit = np.empty(angle.shape, dtype=np.complex128)
    np.cos(angle, out=unit.real)
    np.sin(angle, out=unit.imag)
    return unit


def _points(numbers: Complex) -> Array:
    return numbers.view(np.float64).reshape(-1, 2)


def _rod_vectors(
    linkage: Linkage, pins: CrankPins, condition: Closure, row: Index, z: Complex
) -> tuple[Complex, Mask]:
    """Rod vectors v of the roots ``z``, and where the linear system for them is degenerate."""
    determinant, m_b, m_c = (
        Linear(part.constant[row], part.first[row]).at(z)
        for part in (condition.determinant, condition.product_b, condition.product_c)
    )
    w_b = z * linkage.platform_b - (pins.b - pins.a)
    w_c = z * linkage.platform_c - (pins.c - pins.a)
    largest = np.maximum(abs(w_b), abs(w_c))
    degenerate = ~(abs(determinant) > DEGENERATE * linkage.size * largest)
    # Only the direction is needed: its length is that of rod A, its sense that of D.
    v = (m_b * w_c - m_c * w_b) * (-1j * np.sign(determinant))
    with np.errstate(divide="ignore", invalid="ignore"):
        v *= linkage.rods[0] / abs(v)
    return v, degenerate


def _roots(polynomial: Cubic, tolerance: Array, special: Mask) -> _Roots:
    """Roots of the ordinary rows, by row and angle; rows with a double root become ``special``."""
    brackets = _isolate(polynomial, tolerance, special)
    row = np.concatenate([part.row for part in brackets])
    merged = _Brackets(row, *(np.concatenate(parts) for parts in list(zip(*brackets))[1:]))
    angle = _bracketed_newton(_rows(polynomial, row), 0, merged)
    order = _row_order(row, angle)
    row, angle = row[order], angle[order]
    close = (row[1:] == row[:-1]) & (angle[1:] - angle[:-1] < _CLOSE)
    special[row[1:][close]] = True
    # The first and the last root of a row may be neighbours across pi.
    lowest, highest = row[angle < _CLOSE - np.pi], row[angle > np.pi - _CLOSE]
    special[np.intersect1d(lowest, highest)] = True
    return _Roots(row, angle)


def row_roots(polynomial: Cubic) -> tuple[Index, Array]:
    """Simple roots of many polynomials: their rows, ascending, and their angles [rad].

    Rows with a double root are missing.
    """
    tolerance = ROUNDING * sum(abs(coefficient) for coefficient in polynomial)
    special = np.zeros(len(tolerance), dtype=np.bool_)
    roots = _roots(polynomial, tolerance, special)
    simple = ~special[roots.row]
    return roots.row[simple], roots.angle[simple]


def _row_order(row: Index, angle: Array) -> Index:
    """Order by row, then by angle."""
    return np.argsort(angle + 8.0 * row)


def _rows(polynomial: Cubic, row: Index) -> Cubic:
    return Cubic(*(coefficients[row] for coefficients in polynomial))


def _isolate(polynomial: Cubic, tolerance: Array, special: Mask) -> list[_Brackets]:
    """Brackets of all roots; rows that need a closer look become ``special``."""
    samples = sample(polynomial)
    row, cell = np.nonzero(possible_cells(polynomial, samples, tolerance))
    start, end = (Ends(*(part[row, cell + k] for part in samples)) for k in (0, 1))
    spans = _Spans(row, NODES[cell], start, end)
    width = CELL_WIDTH
    brackets = []
    for halving in range(_HALVINGS + 1):
        if halving:
            width *= 0.5
            spans = _halve(polynomial, spans, width)
        of_row = _rows(polynomial, spans.row)
        third, fourth = derivative_bound(of_row, 3), derivative_bound(of_row, 4)
        verdict = judge(spans.start, spans.end, width, third, fourth, tolerance[spans.row])
        brackets.append(_secant_brackets(spans.where(verdict.single), width))
        dips = spans.where(verdict.dip)
        brackets += _dip_brackets(polynomial, dips, width, tolerance, special)
        spans = spans.where(verdict.unclear)
        if not spans.row.size:
            break
    special[spans.row] = True
    return brackets


def _halve(polynomial: Cubic, spans: _Spans, width: float) -> _Spans:
    """Both halves of each span, now of the given ``width``."""
    middle = Ends(*derivatives(_rows(polynomial, spans.row), _unit(spans.low + width)))
    start, end = (
        Ends(*(np.concatenate(pair) for pair in zip(*ends)))
        for ends in ((spans.start, middle), (middle, spans.end))
    )
    return _Spans(
        np.concatenate([spans.row, spans.row]),
        np.concatenate([spans.low, spans.low + width]),
        start,
        end,
    )


def _secant_brackets(spans: _Spans, width: float) -> _Brackets:
    low, high = spans.start.value, spans.end.value
    guess = spans.low + width * low / (low - high)
    return _Brackets(spans.row, spans.low, spans.low + width, low >= 0.0, guess)


def _dip_brackets(
    polynomial: Cubic, spans: _Spans, width: float, tolerance: Array, special: Mask
) -> list[_Brackets]:
    """Brackets on both sides of the extremum where the polynomial passes through zero there."""
    row, low = spans.row, spans.low
    if not len(row):
        return []
    of_row = _rows(polynomial, row)
    slopes = spans.start.slope, spans.end.slope
    guess = low + width * slopes[0] / (slopes[0] - slopes[1])
    extremum = _bracketed_newton(
        of_row, 1, _Brackets(row, low, low + width, slopes[0] >= 0.0, guess)
    )
    value, _, curvature = derivatives(of_row, _unit(extremum))
    special[row[abs(value) <= tolerance[row]]] = True
    positive = spans.start.value >= 0.0
    through = (value >= 0.0) != positive
    row, low, extremum, positive = row[through], low[through], extremum[through], positive[through]
    reach = np.sqrt(-2.0 * value[through] / curvature[through])
    high = low + width
    return [
        _Brackets(row, low, extremum, positive, np.maximum(low, extremum - reach)),
        _Brackets(row, extremum, high, ~positive, np.minimum(high, extremum + reach)),
    ]


def _bracketed_newton(
    polynomial: Cubic, order: int, brackets: _Brackets, rounds: int = _ROUNDS
) -> Array:
    """Zeros of the derivative of the given order (0 or 1), one in each bracket.

    Each round of three iterations goes on with those only that still move.
    """
    row, left, right, positive, angle = brackets
    for _ in range(3):
        evaluated = derivatives(polynomial, _unit(angle))
        value, slope = evaluated[order], evaluated[order + 1]
        before = (value >= 0.0) == positive
        left, right = np.where(before, angle, left), np.where(before, right, angle)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = angle - value / slope
        kept = (following >= left - SLACK) & (following <= right + SLACK)
        following = np.where(kept, following, 0.5 * (left + right))
        moved = abs(following - angle)
        angle = following
    unfinished = np.flatnonzero((moved > _CONVERGED) & (right - left > _CONVERGED))
    if unfinished.size and rounds:
        rest = _Brackets(
            row[unfinished],
            left[unfinished],
            right[unfinished],
            positive[unfinished],
            angle[unfinished],
        )
        angle[unfinished] = _bracketed_newton(
            _rows(polynomial, unfinished), order, rest, rounds - 1
        )
    return angle
