"""Maps of a machine: how well it does its work at each place.

The Jacobian does not depend on the height of the platform, so a map of one level is that of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import array_of_shape
from tri_glide_kinematics.sizing.fields import Cells
from tri_glide_kinematics.sizing.mesh import height_ranges
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace


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
