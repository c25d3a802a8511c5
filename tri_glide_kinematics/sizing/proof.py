"""The largest value of a quantity over a whole volume, proved by halving cells.

Each cell has a bound for all its places, and its place a value. A cell whose bound is no more than
a little above the largest value that is known is done; all others are cut into four.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.sizing.wish import Volume, level_box, nearest_inside
from tri_glide_kinematics.vectors import FloatArray

# A proved bound is at most this part above a value that is reached somewhere.
TIGHTNESS = 2e-4

# Rounding errors are far below this part of a quantity.
ROUNDING = 1e-9

# Cells along each side at first, and how often they are halved.
FIRST_CELLS = 8
MOST_HALVINGS = 40

# Most cells that are looked at together; a quantity that needs more has no bound.
MOST_CELLS = 200_000

# From the center of a cell to those of its quarters, in half sides of a quarter.
_TO_QUARTERS = np.array([(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)])

# Places, shape (n, 2), and the radius of the cells about them; returns bounds, shape (k, n).
Bounds = Callable[[FloatArray, float], FloatArray]


class Extremes(NamedTuple):
    """Largest values of some quantities over a volume.

    Attributes:
        bounds: which are nowhere exceeded; infinite where nothing is proved. Shape (k,).
        values: that are reached. Shape (k,).
        places: where, x and y. Shape (k, 2) [m].
    """

    bounds: FloatArray
    values: FloatArray
    places: FloatArray


def quartered(centers: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the four quarters of each cell: their centers, shape (4 n, 2), and half sides.

    Args:
        centers: of the cells. Shape (n, 2) [m].
        half: half of their sides. Shape (2,) [m].
    """
    half = 0.5 * half
    return (centers[:, np.newaxis] + half * _TO_QUARTERS).reshape(-1, 2), half


def largest_over(volume: Volume, quantities: Bounds, tightness: float = TIGHTNESS) -> Extremes:
    """Return the largest values of some quantities, which do not depend on the height.

    Args:
        volume: convex.
        quantities: bounds of them around places of the volume.
        tightness: largest part by which a bound is above the value.
    """
    lower, upper = level_box(volume)
    half = 0.5 * (upper - lower) / FIRST_CELLS
    steps = np.arange(1.0, 2.0 * FIRST_CELLS, 2.0)
    centers = np.stack(np.meshgrid(*(lower[:, np.newaxis] + half[:, np.newaxis] * steps)), axis=-1)
    centers = centers.reshape(-1, 2)
    found = quantities(nearest_inside(volume, centers[:1]), 0.0)[:, 0]
    places = np.tile(nearest_inside(volume, centers[:1]), (len(found), 1))
    bounds = found.copy()
    for _ in range(MOST_HALVINGS):
        radius = float(np.hypot(*half))
        # The part of a cell that is inside is no farther from the nearest place inside than the
        # cell's own places are from its center.
        inside = nearest_inside(volume, centers)
        touches = np.hypot(*(centers - inside).T) <= radius
        centers, inside = centers[touches], inside[touches]
        values = quantities(inside, 0.0)
        best = values.argmax(axis=1)
        for k, index in enumerate(best):
            if values[k, index] > found[k]:
                found[k], places[k] = values[k, index], inside[index]
        reached = quantities(inside, radius)
        most = found * (1.0 + tightness)
        open_cells = (reached > most[:, np.newaxis]).any(axis=0)
        done = reached[:, ~open_cells]
        if done.shape[1]:
            bounds = np.maximum(bounds, done.max(axis=1))
        centers = centers[open_cells]
        if not len(centers):
            return Extremes(np.maximum(bounds, found) * (1.0 + ROUNDING), found, places)
        if 4 * len(centers) > MOST_CELLS:
            break
        centers, half = quartered(centers, half)
    return Extremes(np.full(len(found), np.inf), found, places)
