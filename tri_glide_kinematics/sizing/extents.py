"""Where the platform may be in a workspace: upright cylinders, heights above places, and maps.

Travel and reach are kept in a whole cylinder if they are kept at its places that are nearest to
each anchor and farthest from it. How near to the axis the condition number is too large is found by
halving cells, so nothing lies between samples.

The Jacobian does not depend on the height of the platform, so a map of one level is that of all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import array_of_shape
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.sizing.fields import Cells, quartered
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import ROUNDING, Workspace, slacks

# A radius is found to this [m].
RADIUS_TOLERANCE = 1e-7

# Cells along each side at first, and how often they are halved: it ends by the tolerance before.
FIRST_CELLS = 16
MOST_HALVINGS = 60


class NoCylinderError(KinematicsError):
    """No cylinder of a size is inside a workspace."""


def inscribed_height(
    workspace: Workspace, radius: float, center: tuple[float, float] = (0.0, 0.0)
) -> tuple[float, float]:
    """Return the lower and upper end of the tallest cylinder of a radius inside a workspace.

    Args:
        workspace: of the machine.
        radius: [m].
        center: its axis [m].

    Returns:
        Both ends [m].

    Raises:
        NoCylinderError: if there is none.
    """
    bottom, top = _ends(workspace, radius, center)
    if radius > level_room(workspace, center) or not top > bottom:
        raise NoCylinderError(f"no cylinder with a radius of {radius:g} m is inside the workspace")
    if radius > _condition_room(workspace, center, radius):
        raise NoCylinderError(
            f"a cylinder with a radius of {radius:g} m breaks the largest condition number, "
            f"{workspace.limits.max_condition_number:g}"
        )
    return bottom, top


def inscribed_radius(
    workspace: Workspace, height: float = 0.0, center: tuple[float, float] = (0.0, 0.0)
) -> float:
    """Return the radius of the widest cylinder of a height inside a workspace [m].

    Args:
        workspace: of the machine.
        height: [m].
        center: its axis [m].

    Raises:
        NoCylinderError: if there is none.
    """
    low, high = 0.0, level_room(workspace, center)
    bottom, top = _ends(workspace, 0.0, center)
    if not (high > 0.0 and top - bottom >= height):
        raise NoCylinderError(f"no cylinder of {height:g} m is inside the workspace there")
    while high - low > 1e-3 * RADIUS_TOLERANCE:
        middle = 0.5 * (low + high)
        bottom, top = _ends(workspace, middle, center)
        if top - bottom >= height:
            low = middle
        else:
            high = middle
    room = _condition_room(workspace, center, low)
    if not room > 0.0:
        raise NoCylinderError("the condition number is too large at the center")
    return room


def level_room(workspace: Workspace, center: tuple[float, float]) -> float:
    """Return how far reach and the sides of a box and a cylinder let the platform go, level [m]."""
    return min(
        shape.slack((*center, 0.0)) for shape in workspace.bounds.shapes if not shape.is_level
    )


def _ends(workspace: Workspace, radius: float, center: tuple[float, float]) -> tuple[float, float]:
    """Return between which heights travel, box and cylinder let a whole disc be [m]."""
    lower, upper = workspace.bounds.level_ends
    limits = workspace.limits
    geometry = workspace.machine.geometry
    for (x, y), length, low, high in zip(
        geometry.anchors, geometry.arm_lengths, limits.lower_heights, limits.upper_heights
    ):
        distance = math.hypot(x - center[0], y - center[1])
        nearest, farthest = max(distance - radius, 0.0), distance + radius
        nearest, farthest = min(nearest, length), min(farthest, length)
        lower = max(lower, low - math.sqrt((length - farthest) * (length + farthest)))
        upper = min(upper, high - math.sqrt((length - nearest) * (length + nearest)))
    return lower, upper


def _condition_room(workspace: Workspace, center: tuple[float, float], radius: float) -> float:
    """Return up to which distance the condition number is kept, at most ``radius`` [m]."""
    geometry, largest = workspace.machine.geometry, workspace.bounds.condition
    axis = np.array(center)
    room = radius
    half = np.full(2, radius / FIRST_CELLS)
    steps = half[0] * np.arange(1.0 - FIRST_CELLS, FIRST_CELLS, 2.0)
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    for _ in range(MOST_HALVINGS):
        around = float(np.hypot(*half))
        distances = np.hypot(*places.T)
        broken = Cells.of(geometry, axis + places, 0.0).conditions() > largest
        room = min(room, float(distances[broken].min(initial=room)))
        nearer = distances - around < room - RADIUS_TOLERANCE
        places = places[nearer]
        may_break = Cells.of(geometry, axis + places, around).conditions() > largest
        places = places[may_break]
        if not len(places):
            break
        places, half = quartered(places, half)
    return max(room - RADIUS_TOLERANCE, 0.0) if room < radius else radius


def height_ranges(workspace: Workspace, places: FloatArray) -> FloatArray:
    """Return between which heights the platform may be above places of a level.

    Args:
        workspace: of the machine.
        places: x and y. Shape (n, 2) [m].

    Returns:
        Lowest and highest height, NaN where there is none. Shape (2, n) [m].
    """
    bounds, cells = workspace.bounds, Cells.of(workspace.machine.geometry, places)
    sides = [shape for shape in bounds.shapes if not shape.is_level]
    with np.errstate(invalid="ignore"):
        low, high = ends_over(workspace, cells)
        inside = (high > low) & (cells.conditions() <= bounds.condition * (1.0 + ROUNDING))
    inside &= slacks(sides, places) >= -ROUNDING
    return np.where(inside, np.stack((low, high)), np.nan)


def ends_over(workspace: Workspace, cells: Cells) -> tuple[FloatArray, FloatArray]:
    """Return between which heights travel, box and cylinder let the platform be. (n,) each [m]."""
    limits, (lower, upper) = workspace.limits, workspace.bounds.level_ends
    low = (np.array(limits.lower_heights)[:, np.newaxis] - cells.rises).max(axis=0)
    high = (np.array(limits.upper_heights)[:, np.newaxis] - cells.rises).min(axis=0)
    return np.maximum(low, lower), np.minimum(high, upper)


def level_corners(workspace: Workspace) -> tuple[FloatArray, FloatArray]:
    """Return the corners of a rectangle around a workspace, seen from above. (2,) each [m]."""
    geometry, limits = workspace.machine.geometry, workspace.limits
    anchors = np.array(geometry.anchors)
    reach = np.array(geometry.arm_lengths)[:, np.newaxis] - limits.reach_margin
    lower, upper = (anchors - reach).max(axis=0), (anchors + reach).min(axis=0)
    if limits.box_lower is not None:
        lower = np.maximum(lower, limits.box_lower[:2])
    if limits.box_upper is not None:
        upper = np.minimum(upper, limits.box_upper[:2])
    if limits.cylinder is not None:
        center = np.array((limits.cylinder.center_x, limits.cylinder.center_y))
        lower = np.maximum(lower, center - limits.cylinder.radius)
        upper = np.minimum(upper, center + limits.cylinder.radius)
    return lower, upper


class Maps(NamedTuple):
    """Quantities of a machine at places of a level; NaN where the platform may not be.

    Attributes:
        heights: lowest and highest height of the platform there. Shape (2, n) [m].
        conditions: condition number of the Jacobian. Shape (n,).
        speeds: that the platform reaches in every direction, as the sliders' limits allow. (n,)
            [m/s].
        forces: with which the platform can push in every direction, if each slider has a force of 1
            in both. Shape (n,).
        resolutions: twice the largest position error, if each slider is up to half a step beside
            its setpoint. Shape (n,) [m].
        stiffnesses: of the platform in its softest direction, if each drive has a stiffness of 1.
            Shape (n,).
    """

    heights: FloatArray
    conditions: FloatArray
    speeds: FloatArray
    forces: FloatArray
    resolutions: FloatArray
    stiffnesses: FloatArray


def maps(
    workspace: Workspace, places: ArrayLike, velocities: Sequence[float], resolution: float
) -> Maps:
    """Return the maps of a machine.

    Args:
        workspace: of the machine.
        places: x and y. Shape (n, 2) [m].
        velocities: largest one of each slider. Shape (3,) [m/s].
        resolution: step of the drives [m].

    Raises:
        WrongShapeError: if ``places`` has another shape.
    """
    level = array_of_shape("places", places, (None, 2))
    heights = height_ranges(workspace, level)
    cells = Cells.of(workspace.machine.geometry, level)
    with np.errstate(invalid="ignore", divide="ignore"):
        quantities = (
            cells.conditions(),
            (np.array(velocities)[:, np.newaxis] / cells.speed_ratios()).min(axis=0),
            1.0 / np.sqrt(np.square(cells.inverse).sum(axis=0)).max(axis=0),
            resolution * cells.position_errors(),
            1.0 / cells.softnesses(),
        )
    outside = np.isnan(heights[0])
    return Maps(heights, *(np.where(outside, np.nan, values) for values in quantities))
