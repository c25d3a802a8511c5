"""The setpoint of a line plan at one instant, by its own formulas, is that of its samples."""

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE
from motion_plans import assert_states_are_samples

from tri_glide_kinematics.motion.limits import AT_REST, SliderState
from tri_glide_kinematics.motion.moves import LinearMotion
from tri_glide_kinematics.motion.trajectory import CubicPlan, LinePlan, StraightLine
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

MOTION = LinearMotion(MACHINE)


def assert_plain(plan: LinePlan) -> None:
    """Compare at instants in random order, within the plan and after it."""
    times = np.random.default_rng(7).uniform(0.0, 1.1 * plan.duration, 500)
    times = np.concatenate((times, plan.scaling.times, plan.scaling.times[::-1], [plan.duration]))
    assert_states_are_samples(plan, times, (1e-13, 1e-13, 1e-12))


@pytest.mark.parametrize("sideways", [1e-3, 1e-8, 1e-11, 1e-12, 1e-13, 1e-16, 1e-200, 0.0])
@pytest.mark.parametrize("rise", [0.1, -0.1])
def test_near_vertical_and_vertical_lines(sideways, rise):
    line = StraightLine(DEFAULT_GEOMETRY, (0.05, -0.02, 0.2), (sideways, 0.0, rise / 0.1), 0.1)
    assert_plain(MOTION.from_rest(line, LIMITS))


@pytest.mark.parametrize("end", [(0.06, -0.04, 0.2), (-0.05, 0.05, 0.3), (0.0, 0.09, 0.15)])
def test_level_and_slanted_lines_with_and_without_a_blend(end):
    line = StraightLine.between(DEFAULT_GEOMETRY, (-0.06, -0.05, 0.2), end)
    plan = MOTION.from_rest(line, LIMITS)
    assert_plain(plan)
    phases = [(0.05, jerk) for jerk in (4.0, -8.0, 4.0)]
    blend = CubicPlan(SliderState((0.0, 1e-4, 0.0), AT_REST, AT_REST), (phases, phases, phases))
    assert_plain(LinePlan(line, plan.scaling, blend))
