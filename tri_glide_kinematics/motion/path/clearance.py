"""How far many places are from the edge of the workspace: ``workspace.tracing``, for arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.tri_glide.conditioning import extreme_singular_values_batch
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace.bounds import ROUNDING, Bound, Disc, Face
from tri_glide_kinematics.workspace.workspace import TOLERANCE, Workspace


class Clearances(NamedTuple):
    """What is known around places of the platform; without a meaning where they are outside.

    Attributes:
        inside: whether a place keeps all limits. Shape (n,).
        radius: no place within this distance breaks the condition number. Shape (n,) [m].
        slack: distance to the nearest bound of reach, box and cylinder. Shape (n,) [m].
        travel: distance to the nearest end of slider travel. Shape (n,) [m].
        gain: within the radius, no slider moves farther than the platform times this. Shape (n,).
        slope: within the radius, the Jacobian changes by at most this per metre. Shape (n,) [1/m].
    """

    inside: NDArray[np.bool_]
    radius: FloatArray
    slack: FloatArray
    travel: FloatArray
    gain: FloatArray
    slope: FloatArray


def clearances(workspace: Workspace, places: FloatArray) -> Clearances:
    """Return what is known around ``places`` of the platform, shape (n, 3) [m]."""
    bounds = workspace.bounds
    geometry = workspace.machine.geometry
    lengths = np.array(geometry.arm_lengths)
    across = np.array(geometry.anchors) - places[:, np.newaxis, :2]
    distances = np.hypot(across[:, :, 0], across[:, :, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        rises = np.sqrt((lengths - distances) * (lengths + distances))
        heights = places[:, 2:] + rises
        matrices = np.ones((3, 3, len(places)))
        np.divide(across.transpose(1, 2, 0), rises.T[:, np.newaxis], out=matrices[:, :2])
        largest, smallest = extreme_singular_values_batch(matrices)
        if geometry.doubled_area <= 0.0:
            smallest = -smallest
        margin = smallest - largest / bounds.condition
        kept = margin >= -ROUNDING * largest / bounds.condition
        factor = 1.0 + 1.0 / bounds.condition
        room = (lengths - distances).min(axis=1)
        radius = margin / (factor * _slope(lengths, distances))
        radius = np.minimum(np.maximum(radius, TOLERANCE), 0.5 * room)
        slope = _slope(lengths, distances + radius[:, np.newaxis])
        granted = np.minimum(TOLERANCE, 0.5 * smallest / slope)
        radius = np.minimum(radius, np.maximum(margin / (factor * slope), granted))
        farthest = distances + radius[:, np.newaxis]
        gain = (lengths / np.sqrt((lengths - farthest) * (lengths + farthest))).max(axis=1)
    lower = np.array([end.bound for end in bounds.travel[:3]])
    upper = np.array([end.bound for end in bounds.travel[3:]])
    travel = np.minimum(heights - lower, upper - heights).min(axis=1)
    slack = np.full(len(places), np.inf)
    for shape in bounds.shapes:
        np.minimum(slack, shape.side * (shape.bound - _values(shape, places)), out=slack)
    # Not a number is not inside, either.
    inside = kept & (slack >= -ROUNDING) & (travel >= -ROUNDING)
    return Clearances(inside, radius, slack, travel, gain, slope)


def _slope(lengths: FloatArray, distances: FloatArray) -> FloatArray:
    """Return the largest slope of the Jacobian at horizontal ``distances`` [1/m]."""
    squares = (lengths - distances) * (lengths + distances)
    return np.asarray(np.sqrt((lengths**4 / squares**3).sum(axis=1)))


def _values(shape: Bound, places: FloatArray) -> FloatArray:
    """Return the quantity that a shape bounds. Shape (n,) [m]."""
    if isinstance(shape, Face):
        return places[:, shape.axis]
    if isinstance(shape, Disc):
        return np.asarray(np.hypot(places[:, 0] - shape.x, places[:, 1] - shape.y))
    return np.array([shape.value(tuple(place)) for place in places.tolist()])
