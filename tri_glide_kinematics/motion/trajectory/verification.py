"""Verification of plans: travel of the sliders, and the workspace, up to rest.

Each check raises the error that names what would be broken, where and by how much.
"""

from __future__ import annotations

import math

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.trajectory.along_curve import LinePlan
from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan, Trajectory
from tri_glide_kinematics.motion.trajectory.errors import SliderLimitError, SliderTravelError
from tri_glide_kinematics.motion.trajectory.limits import TRAVEL_ROUNDING, SliderLimits
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

# A motion ends this far from the edge of the workspace, and needs as much room to begin [m].
EDGE_CLEARANCE = 1e-6


def keeps_limits(plan: Trajectory, limits: SliderLimits, since: float) -> bool:
    """Return whether what is left of ``plan`` at a time [s] is inside ``limits``."""
    try:
        plan.check_limits(limits, since)
    except SliderLimitError:
        return False
    return True


def check_slider_path(
    plan: CubicPlan, travel: WorkspaceLimits, region: Workspace
) -> Interruptible[None]:
    """Check travel, by the exact extremes of the heights, and the path of the platform.

    Args:
        plan: to be checked.
        travel: limits of the workspace without what ``region`` is widened by.
        region: where the platform may be.

    Raises:
        SliderTravelError: if a slider leaves its travel.
        KinematicsError: if the platform leaves the ``region``.
    """
    lowest, highest = plan.height_extremes()
    check_travel(lowest, highest, plan, travel)
    yield
    yield from region.path_check(*plan.path())


def check_blend(
    plan: LinePlan, limits: SliderLimits, travel: WorkspaceLimits, region: Workspace
) -> Interruptible[None]:
    """Check travel and path for as long as the platform is beside the line of the plan.

    Args:
        plan: to be checked; without a blend there is nothing to check.
        limits: of the sliders, which the plan keeps.
        travel: limits of the workspace without what ``region`` is widened by.
        region: where the platform may be.

    Raises:
        SliderTravelError: if a slider leaves its travel.
        KinematicsError: if the platform leaves the ``region``.
    """
    # A plan that begins at rest, as one of the present setpoint before the first step, has none.
    if plan.blend is None or plan.blend.duration == 0.0:
        return
    duration = plan.blend.duration
    times = plan.scaling.times[: np.searchsorted(plan.scaling.times, duration) + 1]
    heights = plan.sample(times).heights
    # What a slider can move beyond both ends of a piece under its largest acceleration.
    excess = np.square(np.diff(times)).max() / 8.0 * np.array(limits.acceleration)
    check_travel(heights.min(axis=0) - excess, heights.max(axis=0) + excess, plan, travel)
    yield
    yield from region.path_check(plan.at, duration, math.hypot(*limits.acceleration))


def check_travel(
    lowest: FloatArray, highest: FloatArray, plan: Trajectory, travel: WorkspaceLimits
) -> None:
    """Raise an error if a slider leaves its travel, or goes on where it is outside already.

    Args:
        lowest: heights of the sliders on the plan. Shape (3,) [m].
        highest: likewise. Shape (3,) [m].
        plan: begins where the sliders are.
        travel: holds the ends of the travel.

    Raises:
        SliderTravelError: names the slider.
    """
    heights = plan.at(0.0).heights
    for i in range(3):
        lower = min(travel.lower_heights[i], heights[i]) - TRAVEL_ROUNDING
        upper = max(travel.upper_heights[i], heights[i]) + TRAVEL_ROUNDING
        if not lower <= lowest[i]:
            raise SliderTravelError(i, float(lowest[i]), travel.lower_heights[i])
        if not highest[i] <= upper:
            raise SliderTravelError(i, float(highest[i]), travel.upper_heights[i])
