"""What is asked of a motion becomes commands, states and ends of goals; there is no cycle here."""

from controller_rig import LIMITS, MACHINE, TARGET, Rig

from tri_glide_kinematics.control import TEACH_SPEED
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion.engine import GoalCode, Move
from tri_glide_kinematics.motion.limits import ForceLimits, PlatformSpeedLimit


def test_the_teach_mode_bounds_all_limits_that_come_and_leaves_lower_ones():
    rig = Rig()
    rig.cycle(2)

    def in_force():
        rig.cycle(2)
        return rig.engine.limits

    rig.controller.set_teach_mode(True)
    assert in_force().added == (PlatformSpeedLimit(MACHINE, TEACH_SPEED),)
    forces = ForceLimits(
        SliderForces(MACHINE, Masses.uniform(2.0, 0.3, 1.0)), (90.0,) * 3, (90.0,) * 3
    )
    fast = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.4), forces)
    rig.controller.set_limits(fast, 1.0)
    assert in_force().added == (PlatformSpeedLimit(MACHINE, TEACH_SPEED), forces)
    slow = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.1))
    rig.controller.set_limits(slow, 1.0)
    assert in_force() == slow
    rig.controller.set_limits(fast, 1.0)
    rig.controller.set_teach_mode(False)
    assert in_force() == fast


def test_after_a_failure_nothing_is_carried_out():
    rig = Rig()
    rig.cycle(2)
    goal = rig.controller.pursue_position(TARGET)
    rig.cycle(20)
    rig.controller.fail(ValueError("broken"))
    assert goal.outcome.code is GoalCode.FAULT
    plans = rig.engine.plan_number
    waiting = Move((0.0, 0.0, 0.3))
    rig.controller._queue.put(waiting)
    rig.cycle(5)
    assert rig.controller._queue.target is waiting
    assert rig.engine.plan_number == plans
