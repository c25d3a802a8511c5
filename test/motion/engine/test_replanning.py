"""How a stop, and a goal while limits wait, replace what is held; the other rows the engine has."""

from __future__ import annotations

from dataclasses import replace

import pytest
from motion_machine import HOME, LIMITS, OTHER, TARGET, WORKSPACE, each_kind

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import MotionKind, SliderLimits
from tri_glide_kinematics.motion.engine import HeldMotion, Move, PlanRole, Replanning
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits


def on_the_way(kind: MotionKind) -> tuple[Replanning, HeldMotion, float]:
    """Return a move, and a time at which it is fast."""
    replanning = Replanning(WORKSPACE, kind)
    resting = replanning.at_rest(HOME, DriveLimits(LIMITS, 1.0))
    held = at_once(replanning.with_goal(resting, 0.0, Move(TARGET)))
    return replanning, held, 0.4 * held.plan.duration


@each_kind
def test_a_stop_brakes_without_a_goal_and_one_that_is_under_way_is_kept(kind):
    replanning, held, time = on_the_way(kind)
    after = at_once(replanning.braked(held.with_goal(None), time))
    assert (after.goal, after.role) == (None, PlanRole.BRAKES)
    # The held plan, which leads to rest as well, goes on if no braking is over sooner.
    assert after.plan is held.plan or after.plan.duration < held.plan.duration - time
    if after.plan is not held.plan:
        for values, expected in zip(after.plan.at(0.0), held.plan.at(time)):
            assert values == pytest.approx(expected, abs=1e-8)
    assert at_once(replanning.braked(after, time)).plan is after.plan


@each_kind
def test_a_goal_that_comes_while_limits_wait_is_only_noted(kind):
    replanning, held, time = on_the_way(kind)
    slow = DriveLimits(SliderLimits.uniform(0.01, 1.0, 20.0), 1.0)
    waiting, _ = at_once(replanning.tried_again(replace(held, pending=slow), time))
    assert waiting.role is not PlanRole.LEADS_TO_GOAL
    goal = Move(OTHER)
    noted = at_once(replanning.with_goal(waiting, 0.01, goal))
    assert (noted.plan, noted.goal, noted.pending) == (waiting.plan, goal, slow)
