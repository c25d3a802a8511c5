"""What is asked of a motion becomes commands, states and ends of goals; there is no cycle here."""

from __future__ import annotations

import pytest
from controller_rig import HOME, LIMITS, MACHINE, TARGET, Parts

from tri_glide_kinematics.control import (
    IDLE,
    MOVING,
    STOPPING,
    TEACH_SPEED,
    WAITING,
    CommandRefusedError,
)
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.motion.engine import GoalCode, Move
from tri_glide_kinematics.motion.limits import ForceLimits, PlatformSpeedLimit


def test_a_command_is_carried_out_when_it_is_its_turn():
    parts = Parts(IDLE)
    parts.engine.start(HOME)
    parts.motion.set_limits(parts.engine.limits, 0.5)
    goal = parts.motion.pursue_position(TARGET)
    # Limits had the turn of this cycle.
    assert parts.states.state is IDLE and goal.outcome is None
    parts.queue.next_cycle(0.0)
    parts.motion.go_on()
    assert parts.states.state is MOVING and parts.motion.leads_to(goal)
    assert parts.engine.target == TARGET


def test_the_teach_mode_bounds_all_limits_that_come_and_leaves_lower_ones():
    parts = Parts(IDLE)
    parts.engine.start(HOME)

    def in_force():
        parts.queue.next_cycle(0.0)
        parts.motion.go_on()
        return parts.engine.limits

    parts.motion.set_teach_mode(True)
    assert in_force().added == (PlatformSpeedLimit(MACHINE, TEACH_SPEED),)
    forces = ForceLimits(
        SliderForces(MACHINE, Masses.uniform(2.0, 0.3, 1.0)), (90.0,) * 3, (90.0,) * 3
    )
    fast = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.4), forces)
    parts.motion.set_limits(fast, 1.0)
    assert in_force().added == (PlatformSpeedLimit(MACHINE, TEACH_SPEED), forces)
    slow = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.1))
    parts.motion.set_limits(slow, 1.0)
    assert in_force() == slow
    parts.motion.set_limits(fast, 1.0)
    parts.motion.set_teach_mode(False)
    assert in_force() == fast


def test_a_cancelled_motion_brakes():
    parts = Parts(IDLE)
    parts.engine.start(HOME)
    goal = parts.motion.pursue_position(TARGET)
    for _ in range(20):
        parts.queue.step()
    parts.motion.cancel(goal)
    assert parts.states.state is STOPPING and goal.is_cancelled


def test_what_is_refused_ends_its_goal_and_changes_nothing():
    parts = Parts(WAITING)
    with pytest.raises(CommandRefusedError) as caught:
        parts.motion.pursue_position(TARGET)
    assert caught.value.refusal is Refusal.WAITING
    assert parts.queue.target is None


def test_after_a_failure_nothing_is_carried_out():
    parts = Parts(IDLE)
    parts.engine.start(HOME)
    goal = parts.motion.pursue_position(TARGET)
    parts.operation.fail(ValueError("broken"))
    assert goal.outcome.code is GoalCode.FAULT
    parts.queue.put(Move(TARGET))
    parts.queue.next_cycle(0.0)
    parts.motion.go_on()
    assert parts.queue.target is not None and parts.engine.target is None
