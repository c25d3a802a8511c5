"""The least time about a square whose path may be anywhere within a tolerance of it.

Path and timing are sought together, so no rounding of corners is faster. The unknowns are the
places of the platform at instants of the same distance in time, at one height. The slider heights
are linearised around the places found before, which leaves a linear program: the least part of the
jerk limit with which the motion is possible. The time between two instants is changed by the cubic
root of that part, until it is one. What comes out is the best that was found, not a proof.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray

# Part of the time at which the first corner is passed; that of the last one is as far from the end.
FIRST_CORNERS = (0.26, 0.27, 0.28, 0.29, 0.30)
MOST_ROUNDS = 8
SETTLED = 2e-4  # relative change of the time with which the search ends
AT_REST = 3  # instants at each end at which the platform does not move


def least_time(
    machine: TriGlide,
    corners: FloatArray,
    limits: SliderLimits,
    tolerance: float,
    outside: float,
    steps: int = 240,
) -> float:
    """Return the least time from rest in the first corner to rest there again [s].

    More steps find a little less: 480 find 0.3 to 0.4 % less than 240.

    Args:
        machine: whose sliders are limited.
        corners: of the square, counterclockwise, the first one again at the end. Shape (5, 3) [m].
        limits: of the sliders.
        tolerance: how far inside a side the platform may be [m].
        outside: how far outside a side it may be [m].
        steps: in time.

    Raises:
        RuntimeError: if a linear program is not solved.
    """
    return min(
        _least_time(machine, corners, limits, (tolerance, outside), steps, first)
        for first in FIRST_CORNERS
    )


def _least_time(
    machine: TriGlide,
    corners: FloatArray,
    limits: SliderLimits,
    freedoms: tuple[float, float],
    steps: int,
    first: float,
) -> float:
    passed = round(first * steps)
    instants = (0, passed, steps // 2, steps - passed, steps)
    places = np.concatenate(
        [
            np.linspace(begin, end, until - since, endpoint=False)
            for (begin, end), (since, until) in zip(pairwise(corners), pairwise(instants))
        ]
        + [corners[-1:]]
    )
    places[:AT_REST] = places[-AT_REST:] = corners[0]
    # The time in which an unlimited acceleration and the limited jerk get from corner to corner.
    side = float(np.linalg.norm(corners[1] - corners[0]))
    period = 4.0 * (32.0 * side / max(limits.jerk)) ** (1.0 / 3.0) / steps
    bounds = list(_sides(corners, instants, freedoms))
    for _ in range(MOST_ROUNDS):
        places, part = _solved(machine, limits, places, bounds, period)
        factor = part ** (1.0 / 3.0)
        period *= factor
        if abs(factor - 1.0) < SETTLED:
            break
    return period * steps


def _sides(
    corners: FloatArray, instants: tuple[int, ...], freedoms: tuple[float, float]
) -> Iterator[tuple[range, FloatArray, FloatArray, FloatArray]]:
    """Yield of each side: its instants, the two directions, and the least and largest places."""
    inside, outside = freedoms
    for (begin, end), (since, until) in zip(pairwise(corners), pairwise(instants)):
        along = (end - begin)[:2]
        side = float(np.hypot(*along))
        along = along / side
        directions = np.array((along, (-along[1], along[0])))
        origin = directions @ begin[:2]
        least = origin - outside
        most = origin + np.array((side + outside, inside))
        yield range(since, until + 1), directions, least, most


def _solved(
    machine: TriGlide,
    limits: SliderLimits,
    places: FloatArray,
    bounds: list[tuple[range, FloatArray, FloatArray, FloatArray]],
    period: float,
) -> tuple[FloatArray, float]:
    """Return better places, and the part of the jerk limit that they need."""
    count = len(places)
    heights = machine.inverse_batch(places)
    slopes = np.array([machine.jacobian(place) for place in places])[:, :, :2]
    # Of places in units of ``scale`` all differences are of the order of one.
    scale = max(limits.jerk) * period**3
    rows, most = [], []
    for order in (1, 2, 3):
        differences = _differences(count, order)
        for slider in range(3):
            slope = slopes[:, slider]
            linear = differences @ sparse.hstack([sparse.diags(slope[:, k]) for k in range(2)])
            constant = differences @ (heights[:, slider] - (slope * places[:, :2]).sum(axis=1))
            limit = limits.table[order - 1, slider] * period**order
            # The last unknown is the part of the jerk limit.
            part = np.full((linear.shape[0], 1), -limit / scale if order == 3 else 0.0)
            free = 0.0 if order == 3 else limit
            for sign in (1.0, -1.0):
                rows.append(sparse.hstack([sign * linear, part]))
                most.append((free - sign * constant) / scale)
    for instants, directions, least, largest in bounds:
        inner = [k for k in instants if AT_REST <= k < count - AT_REST]
        chosen = sparse.identity(count, format="csr")[inner]
        for direction, low, high in zip(directions, least, largest):
            place = sparse.hstack([direction[0] * chosen, direction[1] * chosen])
            none = sparse.csr_matrix((len(inner), 1))
            rows += [sparse.hstack([place, none]), sparse.hstack([-place, none])]
            most += [np.full(len(inner), high / scale), np.full(len(inner), -low / scale)]
    at_rest = np.r_[:AT_REST, count - AT_REST : count]
    ranges = np.full((2 * count + 1, 2), (-np.inf, np.inf))
    for axis in range(2):
        ranges[axis * count + at_rest] = (places[at_rest, axis] / scale)[:, np.newaxis]
    costs = np.zeros(2 * count + 1)
    costs[-1] = 1.0
    found = linprog(
        costs, sparse.vstack(rows).tocsc(), np.concatenate(most), bounds=ranges, method="highs-ipm"
    )
    if found.status != 0:
        raise RuntimeError(f"the linear program of {count} places was not solved: {found.message}")
    better = places.copy()
    better[:, :2] = scale * found.x[:-1].reshape(2, count).T
    return better, float(found.x[-1])


def _differences(count: int, order: int) -> sparse.csr_matrix:
    """Return the matrix of the ``order``-th differences of ``count`` numbers."""
    matrix = sparse.identity(count, format="csr")
    for _ in range(order):
        matrix = matrix[1:] - matrix[:-1]
    return matrix
