r"""Solver of timing problems: a primal-dual interior point method with banded linear algebra.

Each constraint looks at three neighbouring coefficients, so the matrix of Newton's method has two
bands beside its diagonal, and a step costs an effort in proportion to the number of cells. Steps
are those of Mehrotra's predictor and corrector.

The duration $\int du / \sqrt b$ is flat: Newton's method would raise a b that is far too small by
two thirds in each step. As nearly everywhere some constraint is active, the curvature of the
duration hardly matters for where the optimum is found: far away a tenth of it is used. Near the
optimum more than all of it damps the steps, as the constraints of the jerk are not linear.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from types import ModuleType
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.path_timing.problem import TimingProblem
from tri_glide_kinematics.vectors import FloatArray, Indices


def _lapack() -> ModuleType:
    """Return scipy's wrapper of LAPACK."""
    name = "scipy.linalg._flapack"
    if name not in sys.modules and (package := find_spec("scipy")) is not None:
        folders = [f"{folder}/linalg" for folder in package.submodule_search_locations or ()]
        spec = PathFinder.find_spec(name, folders)
        if spec is not None and spec.loader is not None:
            # scipy itself sees to it that libraries that came with it are found.
            import scipy  # noqa: F401

            module = module_from_spec(spec)
            spec.loader.exec_module(module)
            # So that scipy.linalg does not load it once more.
            sys.modules[name] = module
    if name in sys.modules:
        return sys.modules[name]
    # A scipy that keeps it elsewhere.
    from scipy.linalg import lapack

    return lapack


dpbtrf = _lapack().dpbtrf
dpbtrs = _lapack().dpbtrs


# Steps after which a problem counts as one without a solution.
MOST_STEPS = 60

# The solution takes longer than the optimum by less than this part.
GAP = 5e-4

# By how much constraints, as parts of their limits, may be broken.
MISS = 1e-4

# Part of Newton's step below which a step is too short, and number of such steps in a row that mean
# that there is no solution.
_STUCK = 0.02
_STUCK_STEPS = 5

# Part of the way to where a slack, a multiplier or b is zero that a step goes at most.
_NEARNESS = 0.99

# Parts of the duration's curvature that are used, far from the optimum and near it; and which gap
# is near, as a part of the duration.
_CURVATURES = (0.1, 5.0)
_NEAR = 0.05

# The first gap over the duration, and the least slack at first: without a hint where the optimum
# is, and from the solution of a similar problem.
_COLD = (10.0, 0.1)
_WARM = (0.5, 0.03)


class Solution(NamedTuple):
    """Coefficients of the spline, and how they were found.

    Attributes:
        coefficients: Shape (n + 2,).
        steps: how many it took.
        converged: whether the constraints hold and the optimum is near.
    """

    coefficients: FloatArray
    steps: int
    converged: bool


def solutions(
    problem: TimingProblem, guess: FloatArray, is_near: bool = False
) -> Iterator[Solution]:
    """Yield what is found, twice in each step; the last one tells whether it is the solution.

    Args:
        problem: to be solved.
        guess: positive coefficients of the spline. Shape (n + 2,).
        is_near: whether the guess solves a similar problem.
    """
    rows = problem.rows
    count = len(problem.spans)
    c = guess.copy()
    # At rest the coefficient of the end has no effect; in motion the first two are given.
    given = np.array((0, -1) if problem.start is None else (0, 1, -1))
    if problem.start is not None:
        c[:2] = problem.start
    watched = np.concatenate((problem.values, rows.inside), axis=1)
    weights = 0.5 * problem.spans
    b = np.maximum(_applied(watched, c), 1e-12 * float(guess.max()))
    # The rows of jerks are multiplied by a typical sqrt(b).
    scale = np.sqrt(b[:2])
    places = 0.5 * scale * problem.values
    table = np.concatenate(
        (problem.linear, problem.jerks * np.repeat(scale, 3, axis=0)[_TWICE]), axis=1
    )
    # Number of the rows before those of the jerks.
    steady = problem.linear.shape[1]
    linear = table.copy()
    size = table.shape[1] * count

    def values_at(c: FloatArray, b: FloatArray) -> FloatArray:
        values = _applied(linear, c)
        values[:steady] -= 1.0
        values[steady:] -= (scale / np.sqrt(b[:2]))[_OF_ROW]
        return values

    first_gap, least_slack = _WARM if is_near else _COLD
    s = np.maximum(-values_at(c, b), least_slack)
    lam = (first_gap / size) * float((weights / np.sqrt(b[2:])).sum()) / s
    stuck = 0
    for step in range(MOST_STEPS):
        yield Solution(c, step, False)
        table[:, steady:] = linear[:, steady:] + (places * b[:2] ** -1.5)[:, _OF_ROW]
        root = weights / np.sqrt(b[2:])
        total = float(root.sum())
        primal = values_at(c, b) + s
        dual = _gathered(table, lam) + _gathered(rows.inside, -0.5 * root / b[2:])
        dual[given] = 0.0
        gap = float((s * lam).sum())
        miss = float(np.abs(primal).max())
        rough = float((np.abs(dual) * c).max())
        if gap < GAP * total and miss < MISS and rough < GAP * total:
            yield Solution(c, step, True)
            return
        ratio = lam / s
        curvature = 0.75 * _CURVATURES[gap < _NEAR * total]
        bands = _bands(table, ratio, rows.inside, curvature * root / np.square(b[2:]))
        yield Solution(c, step, False)
        # Nothing multiplies these: right sides are zero.
        bands[0, given] = 1.0
        bands[1:, given[:-1]] = 0.0
        factor, info = dpbtrf(bands, lower=1, overwrite_ab=1)
        if info != 0:
            break
        complementarity = s * lam
        newton = partial(_newton, factor, table, given, dual, primal, ratio)
        _, ds, dl = newton(lam)
        after = (s + _longest(s, ds) * ds) * (lam + _longest(lam, dl) * dl)
        mu = gap / size
        centring = max(min(float(after.sum()) / gap, 1.0) ** 3, 0.01) * mu
        centring = max(centring, min(mu, 0.1 * rough / size))
        dc, ds, dl = newton((complementarity + ds * dl - centring) / s)
        db = _applied(watched, dc)
        length = min(_NEARNESS * _longest(s, ds), 0.9 * _longest(b, db))
        stuck = stuck + 1 if length < _STUCK else 0
        if stuck == _STUCK_STEPS:
            break
        c = c + length * dc
        b = b + length * db
        s = s + length * ds
        lam = lam + _NEARNESS * _longest(lam, dl) * dl
    yield Solution(c, MOST_STEPS, False)


# The rows of jerks at both places, upwards and downwards; and which b is theirs.
_TWICE = np.array((0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5))
_OF_ROW = np.array((0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1))


def _newton(
    factor: FloatArray,
    table: FloatArray,
    given: Indices,
    dual: FloatArray,
    primal: FloatArray,
    ratio: FloatArray,
    excess: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the changes of coefficients, slacks and multipliers by a step of Newton's method.

    Args:
        factor: Cholesky's, of its matrix.
        table: rows of the constraints. Shape (3, r, n).
        given: which coefficients stay.
        dual: by how much the gradient is not zero. Shape (n + 2,).
        primal: by how much constraints and slacks do not match. Shape (r, n).
        ratio: multipliers over slacks. Shape (r, n).
        excess: of the products of slacks and multipliers over what they are to be, divided by the
            slacks. Shape (r, n).
    """
    right = -dual - _gathered(table, ratio * primal - excess)
    right[given] = 0.0
    dc, _ = dpbtrs(factor, right, lower=1)
    ds = -primal - _applied(table, dc)
    return dc, ds, -excess - ratio * ds


def _applied(rows: FloatArray, c: FloatArray) -> FloatArray:
    """Return values of ``rows``, shape (3, r, n), for coefficients (n + 2,). Shape (r, n)."""
    result = rows[0] * c[:-2]
    result += rows[1] * c[1:-1]
    result += rows[2] * c[2:]
    return result


def _gathered(rows: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the sum of ``rows``, shape (3, r, n), times ``weights`` (r, n). Shape (n + 2,)."""
    sums = np.einsum("irn,rn->in", rows, weights)
    result = np.zeros(sums.shape[1] + 2)
    result[:-2] = sums[0]
    result[1:-1] += sums[1]
    result[2:] += sums[2]
    return result


def _longest(values: FloatArray, changes: FloatArray) -> float:
    """Return which part of the ``changes`` leads the first of the ``values`` to zero, at most 1."""
    steepest = -float((changes / values).min())
    return 1.0 / steepest if steepest > 1.0 else 1.0


def _bands(
    table: FloatArray, weights: FloatArray, inside: FloatArray, bends: FloatArray
) -> FloatArray:
    """Return diagonal and lower bands of the matrix of Newton's method. Shape (3, n + 2)."""
    count = table.shape[2]
    weighted = table * weights
    own = inside * bends
    bands = np.zeros((3, count + 2))
    for i in range(3):
        for j in range(i + 1):
            block = np.einsum("rn,rn->n", weighted[i], table[j])
            block += np.einsum("rn,rn->n", own[i], inside[j])
            bands[i - j, j : count + j] += block
    return bands
