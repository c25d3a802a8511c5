"""By how much many heights of the sliders pass the limits of a workspace, and places inside.

This is for what has been commanded, as arrays; a ``Workspace`` checks one place, or a whole way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.checks import array_of_shape
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace.limits import WorkspaceLimits

# Largest way out of the workspace that tracing leaves between its samples [m].
PLACE_TOLERANCE = 6e-5

# Places of a grid along each axis.
PLACES_ALONG = 9


class Overruns(NamedTuple):
    """By how much each row passes the limits; what is negative is inside. Not finite is outside.

    Attributes:
        travel: of the sliders. Shape (n,) [m].
        reach: of the arms. Shape (n,) [m].
        place: of box and cylinder; -inf where there is neither. Shape (n,) [m].
        condition: condition number, as a part of the largest one, less 1: the smaller one of the
            place itself and of one that is nearer to the axis by ``PLACE_TOLERANCE``. Where a
            bound shows that it is small, -1. Shape (n,).
    """

    travel: FloatArray
    reach: FloatArray
    place: FloatArray
    condition: FloatArray

    @property
    def are_outside(self) -> NDArray[np.bool_]:
        """Whether each row passes a limit by more than its tolerance. Shape (n,)."""
        are_inside = [values <= most for values, most in zip(self, OVERRUN_TOLERANCES)]
        return ~np.logical_and.reduce(are_inside)


# A motion that was verified passes no limit by more: travel is checked exactly.
OVERRUN_TOLERANCES = (1e-8, PLACE_TOLERANCE, PLACE_TOLERANCE, 1e-6)


def overruns(machine: TriGlide, limits: WorkspaceLimits, heights: ArrayLike) -> Overruns:
    """Return by how much slider heights pass ``limits``.

    Args:
        machine: whose sliders they are.
        limits: of travel and workspace.
        heights: Shape (n, 3) [m].

    Raises:
        WrongShapeError: if ``heights`` has another shape.
    """
    rows = array_of_shape("heights", heights, (None, 3))
    travel = np.maximum(
        np.array(limits.lower_heights) - rows, rows - np.array(limits.upper_heights)
    ).max(axis=1)
    positions = machine.forward_batch(rows)
    x, y, z = positions.T
    geometry = machine.geometry
    across = np.array(geometry.anchors) - positions[:, np.newaxis, :2]
    longest = np.array(geometry.arm_lengths) - limits.reach_margin
    reach = (np.linalg.norm(across, axis=-1) - longest).max(axis=1)
    place = np.full(len(rows), -math.inf)
    if limits.box_lower is not None:
        place = np.maximum(place, (np.array(limits.box_lower) - positions).max(axis=1))
    if limits.box_upper is not None:
        place = np.maximum(place, (positions - np.array(limits.box_upper)).max(axis=1))
    if limits.cylinder is not None:
        cylinder = limits.cylinder
        radii = np.hypot(x - cylinder.center_x, y - cylinder.center_y)
        ends = np.maximum(cylinder.z_min - z, z - cylinder.z_max)
        place = np.maximum(place, np.maximum(radii - cylinder.radius, ends))
    inwards = positions * np.array((1.0, 1.0, 0.0))
    sizes = np.maximum(np.hypot(x, y), PLACE_TOLERANCE)
    nearer = positions - inwards * (PLACE_TOLERANCE / sizes)[:, np.newaxis]
    largest = limits.max_condition_number
    conditions = np.minimum(
        _conditions(machine, positions, largest), _conditions(machine, nearer, largest)
    )
    return Overruns(travel, reach, place, conditions / largest - 1.0)


def places_inside(machine: TriGlide, limits: WorkspaceLimits) -> FloatArray:
    """Return places of the platform inside ``limits``, spread over all of it with its corners.

    They are those of a grid over the travel of the sliders, and of one over box or cylinder.

    Returns:
        Shape (n, 3) [m].
    """
    travel = zip(limits.lower_heights, limits.upper_heights)
    heights = _grid(*(np.linspace(*ends, PLACES_ALONG) for ends in travel))
    if limits.box_lower is not None and limits.box_upper is not None:
        ends = zip(limits.box_lower, limits.box_upper)
        positions = _grid(*(np.linspace(*pair, PLACES_ALONG) for pair in ends))
        heights = np.concatenate((heights, machine.inverse_batch(positions)))
    if limits.cylinder is not None:
        cylinder = limits.cylinder
        radii = cylinder.radius * np.array((0.0, 0.5, 1.0))
        angles = np.linspace(0.0, 2.0 * math.pi, 2 * PLACES_ALONG, endpoint=False)
        levels = np.linspace(cylinder.z_min, cylinder.z_max, PLACES_ALONG)
        radius, angle, z = _grid(radii, angles, levels).T
        x = cylinder.center_x + radius * np.cos(angle)
        y = cylinder.center_y + radius * np.sin(angle)
        heights = np.concatenate((heights, machine.inverse_batch(np.stack((x, y, z), axis=1))))
    heights = heights[np.isfinite(heights).all(axis=1)]
    inside = heights[~overruns(machine, limits, heights).are_outside]
    return machine.forward_batch(inside)


def _grid(*axes: FloatArray) -> FloatArray:
    """Return all combinations of numbers of three ``axes``. Shape (n, 3)."""
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)


def _conditions(machine: TriGlide, positions: FloatArray, largest: float) -> FloatArray:
    """Return condition numbers, 0 where a bound shows that they are less than the ``largest``."""
    geometry = machine.geometry
    across = np.array(geometry.anchors) - positions[:, np.newaxis, :2]
    squares = np.square(np.array(geometry.arm_lengths)) - np.square(across).sum(axis=-1)
    matrices = np.ones((len(positions), 3, 3))
    # Out of reach, no number is finite.
    with np.errstate(invalid="ignore", divide="ignore"):
        matrices[..., :2] = across / np.sqrt(squares)[..., np.newaxis]
        # The Frobenius norm and the determinant bound the condition number from above.
        norms = np.sqrt(np.square(matrices).sum(axis=(1, 2)))
        bounds = 2.0 * (norms / math.sqrt(3.0)) ** 3 / np.abs(np.linalg.det(matrices))
    conditions = np.zeros(len(positions))
    near = ~(bounds <= largest)
    conditions[near] = machine.condition_number_batch(positions[near])
    return conditions
