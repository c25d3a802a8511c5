"""How each event replaces what is held: the table in the text of ``held_motion``, row by row."""

from __future__ import annotations

from dataclasses import replace

import pytest
from motion_machine import HOME, LIMITS, OTHER, TARGET, WORKSPACE, each_kind

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.engine import HeldMotion, Jog, Move, PlanRole, Replanning
from tri_glide_kinematics.motion.engine.commands import MotionPhase
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import MotionKind

FULL = DriveLimits(LIMITS, 1.0)
SLOW = DriveLimits(SliderLimits.uniform(0.01, 1.0, 20.0), 1.0)
GOALS = (Move(TARGET), Move(OTHER), Jog((0.06, 0.0, 0.08)))


def assert_goes_on(before: HeldMotion, time: float, after: HeldMotion) -> None:
    """A new plan begins where the one before is at that time."""
    if after.plan is not before.plan:
        for values, expected in zip(after.plan.at(0.0), before.plan.at(time)):
            assert values == pytest.approx(expected, abs=1e-8)


def on_the_way(kind: MotionKind) -> tuple[Replanning, HeldMotion, float]:
    """Return a move, and a time at which it is fast."""
    replanning = Replanning(WORKSPACE, kind)
    held = at_once(replanning.with_goal(replanning.at_rest(HOME, FULL), 0.0, GOALS[0]))
    return replanning, held, 0.4 * held.plan.duration


@each_kind
@pytest.mark.parametrize("goal", GOALS)
def test_goal_gets_a_plan_that_leads_there(kind, goal):
    replanning, held, time = on_the_way(kind)
    after = at_once(replanning.with_goal(held, time, goal))
    assert_goes_on(held, time, after)
    assert (after.goal, after.role, after.pending) == (goal, PlanRole.LEADS_TO_GOAL, None)
    assert after.limits == FULL


@each_kind
def test_goal_without_a_plan_is_refused(kind):
    replanning, held, time = on_the_way(kind)
    with pytest.raises(KinematicsError):
        at_once(replanning.with_goal(held, time, Move((0.5, 0.0, 0.3))))


@each_kind
def test_stop_brakes_and_has_no_goal(kind):
    replanning, held, time = on_the_way(kind)
    after = at_once(replanning.braked(held.with_goal(None), time))
    assert_goes_on(held, time, after)
    assert (after.goal, after.role) == (None, PlanRole.BRAKES)
    # The held plan, which leads to rest as well, goes on if no braking is over sooner.
    assert after.plan is held.plan or after.plan.duration < held.plan.duration - time
    # A stop that is under way is kept.
    assert at_once(replanning.braked(after, time)).plan is after.plan


@each_kind
def test_limits_that_can_be_kept_are_in_force_at_once(kind):
    replanning, held, time = on_the_way(kind)
    higher = DriveLimits(SliderLimits.uniform(2.0, 20.0, 400.0), 1.0)
    after, refusal = at_once(replanning.tried_again(replace(held, pending=higher), time))
    assert_goes_on(held, time, after)
    assert (after.limits, after.pending, after.goal) == (higher, None, held.goal)
    assert refusal is None


@each_kind
def test_limits_that_cannot_be_kept_wait_until_the_motion_is_slow(kind):
    replanning, held, time = on_the_way(kind)
    waiting, _ = at_once(replanning.tried_again(replace(held, pending=SLOW), time))
    assert_goes_on(held, time, waiting)
    assert (waiting.limits, waiting.pending, waiting.goal) == (FULL, SLOW, held.goal)
    assert waiting.role is not PlanRole.LEADS_TO_GOAL
    assert waiting.phase(waiting.plan.duration) is MotionPhase.MOVING
    # A goal that comes meanwhile is only noted.
    noted = at_once(replanning.with_goal(waiting, 0.01, GOALS[1]))
    assert (noted.plan, noted.goal, noted.pending) == (waiting.plan, GOALS[1], SLOW)
    end = waiting.plan.duration
    resumed, refusal = at_once(replanning.tried_again(noted, end))
    assert_goes_on(waiting, end, resumed)
    assert (resumed.limits, resumed.pending, resumed.goal) == (SLOW, None, GOALS[1])
    assert (resumed.role, refusal) == (PlanRole.LEADS_TO_GOAL, None)


@each_kind
def test_goal_that_has_no_plan_when_limits_are_in_force_is_given_up_with_the_reason(kind):
    replanning, held, time = on_the_way(kind)
    waiting, _ = at_once(replanning.tried_again(replace(held, pending=SLOW), time))
    impossible = at_once(replanning.with_goal(waiting, 0.01, Move((0.5, 0.0, 0.3))))
    after, refusal = at_once(replanning.tried_again(impossible, waiting.plan.duration))
    assert isinstance(refusal, KinematicsError)
    assert (after.goal, after.limits, after.pending) == (None, SLOW, None)
    assert after.phase(waiting.plan.duration) is MotionPhase.IDLE
