"""Verification of plans: limits and travel of the sliders, and the workspace, up to rest.

Each check raises the error that names what would be broken, where and by how much.
"""

from __future__ import annotations

import math

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.trajectory.along_curve import LinePlan, PathPlan
from tri_glide_kinematics.motion.trajectory.cubic import (
    CubicPlan,
    SequencePlan,
    StraightPlan,
    TrackedStep,
    Trajectory,
)
from tri_glide_kinematics.motion.trajectory.curve_bounds import check_path_limits
from tri_glide_kinematics.motion.trajectory.errors import (
    PlanningError,
    SliderLimitError,
    SliderTravelError,
)
from tri_glide_kinematics.motion.trajectory.limits import (
    QUANTITIES,
    RELATIVE_ROUNDING,
    TRAVEL_ROUNDING,
    SliderLimits,
)
from tri_glide_kinematics.motion.trajectory.line_bounds import (
    NO_BACKWARD_SPEED,
    DerivativeBounds,
    check_bounds,
    derivative_bounds,
)
from tri_glide_kinematics.motion.trajectory.phases import after
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

# A motion ends this far from the edge of the workspace, and needs as much room to begin [m].
EDGE_CLEARANCE = 1e-6


def keeps_limits(plan: Trajectory, limits: SliderLimits, since: float) -> bool:
    """Return whether what is left of ``plan`` at a time [s] is inside ``limits``."""
    try:
        if isinstance(plan, SequencePlan):
            return all(keeps_limits(part, limits, past) for part, past in plan.parts(since))
        if isinstance(plan, TrackedStep):
            plan = plan.as_cubic()
        if isinstance(plan, LinePlan):
            check_line_limits(plan, limits, since)
        elif isinstance(plan, PathPlan):
            check_path_limits(plan.heights, plan.scaling.since(since), limits)
        elif isinstance(plan, CubicPlan):
            check_slider_limits(plan, limits, since)
    except SliderLimitError:
        return False
    return True


def check_slider_limits(plan: CubicPlan, limits: SliderLimits, since: float = 0.0) -> None:
    """Compare the exact extremes of a plan with the limits.

    Args:
        plan: to be checked.
        limits: of the sliders.
        since: what lies before this time is past, and not checked [s].

    Raises:
        SliderLimitError: if a limit is exceeded by more than rounding.
    """
    lengths, (height, velocity, acceleration, jerk) = plan.pieces_since(since)
    if not len(lengths):
        return
    _, end_velocity, end_acceleration = after(
        lengths[:, np.newaxis], height, velocity, acceleration, jerk
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        turning = np.where(
            acceleration * end_acceleration < 0.0,
            velocity - acceleration * acceleration / (2.0 * jerk),
            velocity,
        )
    peaks = (
        np.abs(np.concatenate((velocity, turning, end_velocity))).max(axis=0),
        np.abs(np.concatenate((acceleration, end_acceleration))).max(axis=0),
        np.abs(jerk).max(axis=0),
    )
    bounds = (limits.velocity, limits.acceleration, limits.jerk)
    for (quantity, unit), peak, bound in zip(QUANTITIES, peaks, bounds):
        for slider in range(3):
            if not peak[slider] <= bound[slider] * (1.0 + RELATIVE_ROUNDING):
                raise SliderLimitError(quantity, slider, float(peak[slider]), bound[slider], unit)


def check_line_limits(plan: LinePlan, limits: SliderLimits, since: float = 0.0) -> None:
    """Compare the bounds of the derivatives on a line with the limits.

    Args:
        plan: to be checked.
        limits: of the sliders.
        since: pieces that end before this time are past, and not checked [s].

    Raises:
        SliderLimitError: if a limit may be exceeded.
        PlanningError: if the platform would go back along the line.
    """
    # A braking may lead out of reach; the NaN that this gives fails every comparison below.
    scaling = plan.scaling.since(since)
    with np.errstate(invalid="ignore"):
        bounds = derivative_bounds(plan.line, scaling, plan.blend)
    check_line_bounds(bounds, scaling.times, limits)


def check_line_bounds(bounds: DerivativeBounds, times: FloatArray, limits: SliderLimits) -> None:
    """Compare ``bounds`` in the pieces of a plan on a line with the limits.

    Args:
        bounds: of each piece.
        times: at which they begin, and the end. Shape (k + 1,) [s].
        limits: of the sliders.

    Raises:
        SliderLimitError: if a limit may be exceeded.
        PlanningError: if the platform would go back along the line.
    """
    if not bounds.backwards <= NO_BACKWARD_SPEED:
        raise PlanningError("the platform cannot stop before the end of the line")
    check_bounds(bounds[:3], times, limits)


def height_extremes(plan: CubicPlan, since: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest height of each slider from ``since`` [s] to the end.

    They are at the ends of a piece or where the velocity, a quadratic of time, passes zero.

    Returns:
        Two arrays, each of shape (3,) [m].
    """
    final = np.array(plan.at(plan.duration).heights)[np.newaxis]
    lengths, (height, velocity, acceleration, jerk) = plan.pieces_since(since)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(acceleration * acceleration - 2.0 * jerk * velocity)
        sum_of_terms = -(acceleration + np.copysign(root, acceleration))
        turnings = np.stack((sum_of_terms / jerk, 2.0 * velocity / sum_of_terms))
        inside = (turnings > 0.0) & (turnings < lengths[:, np.newaxis])
    time = np.where(inside, turnings, 0.0)
    turns, _, _ = after(time, height, velocity, acceleration, jerk)
    heights = np.concatenate((final, height, *turns))
    return heights.min(axis=0), heights.max(axis=0)


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
    lowest, highest = height_extremes(plan)
    check_travel(lowest, highest, plan, travel)
    yield
    if isinstance(plan, StraightPlan):
        # Over the way there is no acceleration, whatever there is over time.
        yield from region.path_check(plan.at_way, plan.length, 0.0)
    else:
        # Accelerations are largest where pieces begin.
        peaks = np.abs(plan.pieces[2]).max(axis=0, initial=0.0)
        yield from region.path_check(plan.at, plan.duration, math.hypot(*peaks.tolist()))


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
