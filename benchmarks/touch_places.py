"""How exact heights can get at best: the places of thirteen touches that leave the least error.

In the linear model the mean of what is probable has the smallest error of all estimates: normally
distributed, with the inverse of all information, that of the priors included, as its covariance.
So only the places are left to choose. ``python -m benchmarks.touch_places`` searches for them from
many starts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from benchmarks.command_line import numbers
from testing.wrong_machines import (
    DISTANCE,
    IN_RINGS,
    NOMINAL,
    PLACES,
    RADIUS,
    REGION,
    TOUCH,
    WRONG_BY,
)
from tri_glide_kinematics.calibration.fit import position_derivatives
from tri_glide_kinematics.vectors import FloatArray

COUNT = len(PLACES)
# Errors that are drawn to search with, the same for all places, and others to judge what is found.
DRAWS, FRESH = 1000, 100_000
# Of the sorted largest errors, the mean of the middle ones changes more smoothly than the median.
MIDDLE = slice(int(0.4 * DRAWS), int(0.6 * DRAWS))
STEPS = 100
# A search begins just inside the rim, where the sine of ``_on_disc`` has a slope.
INSIDE = 0.999


@dataclass(frozen=True, eq=False)
class Found:
    """Places that a search has led to.

    Attributes:
        start: where it began, in words.
        before: median over the machines of the largest error of a height, at the start [m].
        after: the same where it ended [m].
        places: there. Shape (13, 2) [m].
    """

    start: str
    before: float
    after: float
    places: FloatArray


def _rows(places: FloatArray, axis: int) -> FloatArray:
    """Return how a coordinate changes at x, y with the machine, by its priors. Shape (n, 12)."""
    level = np.column_stack((places[:, :2], np.zeros(len(places))))
    rows = position_derivatives(NOMINAL.vector, level)[:, axis]
    return np.asarray(rows * WRONG_BY.deviations())


_ENDS = _rows(np.array([(-RADIUS, 0.0), (RADIUS, 0.0)]), axis=0)
_LENGTH = (_ENDS[1] - _ENDS[0]) / DISTANCE
# Of the priors and of the one distance, which is not to be chosen.
_GIVEN = np.eye(12) + np.outer(_LENGTH, _LENGTH)
_JUDGED = _rows(REGION.places, axis=2)


def largest_errors(places: FloatArray, draws: FloatArray) -> FloatArray:
    """Return the largest error of a height over the disc, of each draw.

    Args:
        places: that are touched. Shape (n, 2) [m].
        draws: independent and normally distributed, one row for each machine. Shape (m, 12).

    Returns:
        Shape (m,) [m].
    """
    touched = _rows(places, axis=2) / TOUCH
    # With information = L L^T, the inverse of L^T turns draws into errors of the machine.
    factor = np.linalg.cholesky(_GIVEN + touched.T @ touched)
    return np.asarray(np.abs(draws @ np.linalg.solve(factor, _JUDGED.T)).max(axis=1))


def searched(count: int, rng: np.random.Generator) -> Iterator[Found]:
    """Yield what searches lead to from two usual layouts, and from ``count`` random ones."""
    draws, fresh = rng.standard_normal((DRAWS, 12)), rng.standard_normal((FRESH, 12))
    for start, places in _starts(count, rng):
        found = _improved(places, draws)
        before, after = (float(np.median(largest_errors(one, fresh))) for one in (places, found))
        if after > before:
            # Few errors to search with lead a little beside what is best for all.
            found, after = places, before
        yield Found(start, before, after, found)


def least_median(count: int, rng: np.random.Generator) -> float:
    """Return the least median of the largest error of a height that searches find [m]."""
    return min(one.after for one in searched(count, rng))


def _starts(count: int, rng: np.random.Generator) -> Iterator[tuple[str, FloatArray]]:
    yield "in the middle and on the rim", np.array(PLACES)
    yield "in rings", np.array(IN_RINGS)
    for number in range(1, count + 1):
        yield f"at random, {number}", random_places(COUNT, rng)


def random_places(count: int, rng: np.random.Generator) -> FloatArray:
    """Return places evenly spread over the disc. Shape (count, 2) [m]."""
    angles, radii = rng.uniform(0.0, 2.0 * np.pi, count), RADIUS * np.sqrt(rng.uniform(size=count))
    return _places(radii, angles)


def _improved(places: FloatArray, draws: FloatArray) -> FloatArray:
    """Return the places to which a search from these leads. Shape (n, 2) [m]."""

    def error(numbers: FloatArray) -> float:
        errors = largest_errors(_on_disc(numbers), draws)
        return 1e6 * float(np.sort(errors)[MIDDLE].mean())

    x, y = places.T
    tilts = np.arcsin(np.minimum(np.hypot(x, y) / RADIUS, INSIDE))
    begin = np.concatenate((tilts, np.arctan2(y, x)))
    options = {"maxiter": STEPS, "maxfun": 10**6}
    return _on_disc(minimize(error, begin, method="L-BFGS-B", options=options).x)


def _on_disc(numbers: FloatArray) -> FloatArray:
    """Return places on the disc, whatever the numbers are. Shape (n, 2) [m]."""
    tilts, angles = numbers.reshape(2, -1)
    return _places(RADIUS * np.sin(tilts), angles)


def _places(radii: FloatArray, angles: FloatArray) -> FloatArray:
    return np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))


def main() -> None:
    """Search and print what is found."""
    count = 20, "searches from random places"
    options = numbers(__doc__, count=count, seed=(1, "of places and errors"))
    all_found = []
    for one in searched(options.count, np.random.default_rng(options.seed)):
        all_found.append(one)
        print(f"{one.start}: {1e6 * one.before:.2f} to {1e6 * one.after:.2f} µm", flush=True)
    best = min(all_found, key=lambda one: one.after)
    print(f"the least, {1e6 * best.after:.2f} µm, with touches at")
    for x, y in sorted(best.places.tolist(), key=lambda place: float(np.hypot(*place))):
        print(f"  {1e3 * float(np.hypot(x, y)):5.1f} mm, {np.degrees(np.arctan2(y, x)):4.0f}°")


if __name__ == "__main__":
    main()
