"""Brakings of a transfer, without an engine: none leads deeper than the transfer does."""

from dataclasses import replace

import pytest
from motion_machine import LIMITS, WORKSPACE

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import plan_move
from tri_glide_kinematics.motion.engine import DriveLimits, HeldMotion, PlanRole
from tri_glide_kinematics.motion.engine.transfer_braking import TransferBraking
from tri_glide_kinematics.motion.transfer import Station, TransferPlanner

HOME, PART, HEIGHT = (0.0, -0.1, 0.25), (0.0, 0.1, 0.25), 0.275


@pytest.mark.parametrize(("depth", "is_taken"), [(0.0, True), (1e-4, False)])
def test_a_braking_that_leads_deeper_is_not_taken(depth, is_taken):
    stations = [Station(PART), Station(HOME)]
    planned = TransferPlanner(WORKSPACE, HEIGHT, 0.005).planned(HOME, stations, 0.0, LIMITS)
    plan = at_once(planned)
    braking, slowed = (
        plan_move(WORKSPACE, LIMITS, (*PART[:2], HEIGHT), (*PART[:2], 0.25 - deeper))
        for deeper in (depth, 0.0)
    )

    def anywhere(held, _time, _stays):
        yield
        return replace(held, plan=braking, role=PlanRole.BRAKES)

    def on_way(_held, _time):
        yield
        return slowed

    held = HeldMotion(plan, None, PlanRole.EARLIER, WORKSPACE, DriveLimits(LIMITS, 1.0))
    making = TransferBraking(WORKSPACE, anywhere, on_way).braked(held, plan, plan.arrival(0) - 0.05)
    found = at_once(making)
    assert found.brakes
    assert found.plan is (braking if is_taken else slowed)
