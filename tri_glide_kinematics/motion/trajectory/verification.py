"""Verification of plans: travel of the sliders, and the workspace, up to rest.

Each check raises the error that names what would be broken, where and by how much.
"""

from __future__ import annotations

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


def check_inside(
    plan: CubicPlan | LinePlan, limits: SliderLimits, travel: WorkspaceLimits, region: Workspace
) -> Interruptible[None]:
    """Check travel and the path of the platform; lines are checked before they are timed.

    Args:
        plan: to be checked.
        limits: of the sliders, which the plan keeps.
        travel: limits of the workspace without what ``region`` is widened by.
        region: where the platform may be.

    Raises:
        SliderTravelError: if a slider leaves its travel.
        KinematicsError: if the platform leaves the ``region``.
    """
    way = plan.way_to_check(limits)
    if way is None:
        return
    check_travel(way.lowest, way.highest, plan, travel)
    yield
    yield from region.path_check(way.at, way.length, way.acceleration)


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
