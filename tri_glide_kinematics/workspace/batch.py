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
from tri_glide_kinematics.workspace.limits import WorkspaceBounds, WorkspaceLimits, slacks

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
            place itself and of one that is nearer to the axis by ``PLACE_TOLERANCE``. Shape (n,).
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
    positions = machine.forward_batch(rows)
    bounds = WorkspaceBounds.from_limits(machine.geometry, limits)
    # The shapes of the three arms come first.
    reach, place = slacks(bounds.shapes[:3], positions), slacks(bounds.shapes[3:], positions)
    inwards = positions * np.array((1.0, 1.0, 0.0))
    sizes = np.maximum(np.hypot(*positions[:, :2].T), PLACE_TOLERANCE)
    nearer = positions - inwards * (PLACE_TOLERANCE / sizes)[:, np.newaxis]
    conditions = np.minimum(*map(machine.condition_number_batch, (positions, nearer)))
    condition = conditions / limits.max_condition_number - 1.0
    return Overruns(-bounds.travel_slacks(rows), -reach, -place, condition)


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
