"""What is verified of trajectories: extremes of heights, peaks below limits, the way inside."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_machine import MACHINE
from motion_plans import LIMITS, dense, heights, moving_plan, peaks
from strategies import reproducible

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    MotionKind,
    PlatformPath,
    SliderTravelError,
    plan_move,
    time_path,
)
from tri_glide_kinematics.motion.errors import SliderLimitError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.trajectory import SequencePlan, Trajectory
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits


@reproducible
@given(heights(), heights(), st.floats(0.0, 0.95), st.floats(0.0, 1.0))
def test_extremes_are_those_of_dense_samples(first, second, part, since):
    plan = moving_plan(first, second, part)
    sampled = dense(plan)
    lowest, highest = plan.height_extremes()
    assert (lowest <= sampled.heights.min(axis=0) + 1e-12).all()
    assert (highest >= sampled.heights.max(axis=0) - 1e-12).all()
    slack = 12.0 / 8.0 * sampled.times[1] ** 2 + 1e-12
    assert (lowest >= sampled.heights.min(axis=0) - slack).all()
    assert (highest <= sampled.heights.max(axis=0) + slack).all()
    # What is left of the plan has the extremes of what is left of the samples.
    left = sampled.times >= since * plan.duration
    lowest, highest = plan.height_extremes(since * plan.duration)
    assert (highest >= sampled.heights[left].max(axis=0) - 1e-12).all()
    assert (highest <= sampled.heights[left].max(axis=0) + sampled.times[1] * 1.1).all()


@reproducible
@given(heights(), st.integers(0, 2), st.sampled_from(("velocity", "acceleration", "jerk")))
def test_limits_are_compared_with_exact_peaks(target, slider, quantity):
    plan = moving_plan((0.45, 0.75, 0.4), target, 0.5)
    plan.check_limits(LIMITS)
    peak = peaks(plan)[("velocity", "acceleration", "jerk").index(quantity), slider]
    values = list(getattr(LIMITS, quantity))
    values[slider] = peak * 0.999 + 1e-9
    lower = replace(LIMITS, **{quantity: tuple(values)})
    if peak > 1e-3:
        with pytest.raises(SliderLimitError) as caught:
            plan.check_limits(lower)
        assert (caught.value.slider, caught.value.quantity) == (slider, quantity)
        assert caught.value.limit == values[slider]
    between_samples = 400.0 * dense(plan).times[1]
    values[slider] = max(peak * 1.001 + between_samples, 1e-3)
    plan.check_limits(replace(LIMITS, **{quantity: tuple(values)}))


@pytest.mark.parametrize("slider", range(3))
@pytest.mark.parametrize(("end", "beyond"), [(0.3, -1e-6), (0.9, 1e-6)])
def test_travel_is_checked_at_both_ends(slider, end, beyond):
    workspace = Workspace(MACHINE, INSIDE)
    plan = plan_move(workspace, LIMITS, *PLACES)
    heights = np.array((plan.at(0.0).heights, plan.at(0.0).heights))
    heights[1, slider] = end
    plan.check_travel(heights.min(axis=0), heights.max(axis=0), workspace)
    heights[1, slider] += beyond
    with pytest.raises(SliderTravelError) as caught:
        plan.check_travel(heights.min(axis=0), heights.max(axis=0), workspace)
    assert caught.value.slider == slider


PLACES = ((0.0, 0.0, 0.3), (0.08, 0.02, 0.35))
INSIDE = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
BOX = replace(INSIDE, box_lower=(-0.1, -0.1, 0.2), box_upper=(0.05, 0.1, 0.5))


def trajectories() -> dict[str, Trajectory]:
    """Return one of each kind, from one place to the other."""
    workspace, limits = Workspace(MACHINE, INSIDE), SliderLimits.uniform(1.0, 10.0, 200.0)
    path = PlatformPath.start(PLACES[0]).line_to(PLACES[1])
    sliders = plan_move(workspace, limits, *PLACES)
    line = plan_move(workspace, limits, *PLACES, kind=MotionKind.LINEAR)
    return {
        "sliders": sliders,
        "line": line,
        "path": time_path(path, workspace, limits),
        "sequence": SequencePlan((line, plan_move(workspace, limits, PLACES[1], PLACES[0]))),
    }


@pytest.mark.parametrize("kind", ["sliders", "line", "path", "sequence"])
def test_every_trajectory_can_be_asked_whether_it_keeps_limits_and_stays_inside(kind):
    plan, limits = trajectories()[kind], SliderLimits.uniform(1.0, 10.0, 200.0)
    assert plan.keeps_limits(limits)
    slow = SliderLimits.uniform(0.05, 10.0, 200.0)
    assert not plan.keeps_limits(slow)
    # What is past is not checked.
    plan.check_limits(slow, plan.duration - 1e-3)
    plan.check_inside(Workspace(MACHINE, INSIDE), limits)
    with pytest.raises(KinematicsError):
        plan.check_inside(Workspace(MACHINE, BOX), limits)
