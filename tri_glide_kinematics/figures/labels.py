"""Places labels beside points of a picture so that they cover neither each other nor a line."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

DIRECTIONS = 16
# Nearest and farthest distance of a label from its point, as parts of its height.
DISTANCES = (0.7, 1.2, 1.8, 2.6)
# Two labels that cover each other are as bad as this many covered points of a line.
COVERED_LABEL = 1000.0


def label_centres(
    points: FloatArray, sizes: FloatArray, line: FloatArray, margin: float
) -> FloatArray:
    """Return where the centres of labels are best placed, one after the other.

    Args:
        points: that are labelled, in any unit. Shape (n, 2).
        sizes: width and height of each label. Shape (n, 2).
        line: points of what is drawn, close to each other. Shape (m, 2).
        margin: distance that labels keep from all else.

    Returns:
        Shape (n, 2).
    """
    centres: list[FloatArray] = []
    for index, (point, size) in enumerate(zip(points, sizes)):
        others = np.delete(points, index, axis=0)
        best, lowest = point, math.inf
        for candidate, distance in _candidates(point, size):
            half = size / 2.0 + margin
            cost = float(_inside(np.vstack((line, others)), candidate, half).sum()) + distance
            for other, other_size in zip(centres, sizes):
                if (np.abs(candidate - other) < half + other_size / 2.0).all():
                    cost += COVERED_LABEL
            if cost < lowest:
                best, lowest = candidate, cost
        centres.append(best)
    return np.array(centres).reshape(-1, 2)


def _candidates(point: FloatArray, size: FloatArray) -> Sequence[tuple[FloatArray, float]]:
    """Return places for a label around its point, near ones first."""
    found = []
    for distance in DISTANCES:
        for angle in 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS:
            direction = np.array((math.cos(angle), math.sin(angle)))
            # From the point, past its distance, to the middle of the label.
            way = distance * size[1] + np.abs(direction) @ size / 2.0
            found.append((point + way * direction, distance))
    return found


def _inside(points: FloatArray, centre: FloatArray, half: FloatArray) -> FloatArray:
    return np.asarray((np.abs(points - centre) < half).all(axis=1))
