"""From where a machine can be led, and how that ends."""

from __future__ import annotations

import math

import pytest
from controller_rig import HOME, LIMITS, MACHINE, TARGET, Parts

from tri_glide_kinematics.control import (
    DISABLED,
    FAULT,
    IDLE,
    MOVING,
    STOPPING,
    TRAVEL_TOLERANCE,
    WAITING,
    Cause,
    CommandRefusedError,
    Reason,
    StartingPlace,
    SupervisionBounds,
    Supervisor,
)
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.motion import CannotHoldError, ForceLimits, MotionPhase

SOMETHING = Reason(Cause.TRACKING_ERROR, "something is wrong")
LOWER, UPPER = (0.3, 0.3, 0.3), (0.9, 0.9, 0.9)
TIMEOUT, NOW = 0.2, 10.0


def place(heights=(0.6, 0.5, 0.4)):
    """A place after ``heights`` were measured ``NOW``."""
    supervisor = Supervisor(SupervisionBounds(TIMEOUT, 0.02, 0.05, (1.0,) * 3), ("a", "b", "c"))
    supervisor.measured(heights, None, NOW)
    start = StartingPlace(supervisor, (LOWER, UPPER))
    start.measured(heights)
    return start


def test_it_is_where_the_machine_was_measured_last():
    assert place().checked(NOW + TIMEOUT) == (0.6, 0.5, 0.4)


def test_an_old_measurement_is_none():
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        place().checked(NOW + 1.01 * TIMEOUT)


@pytest.mark.parametrize("height", [math.nan, math.inf])
def test_what_is_not_finite_is_no_place(height):
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        place((0.6, height, 0.6)).checked(NOW)


def test_an_obstacle_keeps_the_machine_from_being_led_until_it_is_gone():
    start = place()
    start.obstacle = Reason(Cause.OTHER_PUBLISHER, "somebody else leads")
    with pytest.raises(CommandRefusedError, match="somebody else leads") as caught:
        start.checked(NOW)
    assert caught.value.refusal is Refusal.OTHER_PUBLISHER
    start.obstacle = None
    start.checked(NOW)


@pytest.mark.parametrize("slider", range(3))
@pytest.mark.parametrize(("end", "sign"), [(0.3, -1.0), (0.9, 1.0)])
def test_only_a_little_beyond_the_travel_is_allowed(slider, end, sign):
    def at(excess):
        heights = [0.6, 0.6, 0.6]
        heights[slider] = end + sign * excess
        return place(tuple(heights))

    at(0.9 * TRAVEL_TOLERANCE).checked(NOW)
    with pytest.raises(CommandRefusedError, match=rf"slider {slider + 1} .* outside its travel"):
        at(1.1 * TRAVEL_TOLERANCE).checked(NOW)


def led():
    """Parts that lead a machine, in a move."""
    parts = Parts(WAITING)
    parts.measure(HOME)
    parts.operation.begin(parts.now)
    # The first setpoint is one of rest.
    parts.queue.step()
    parts.motion.move_to(TARGET)
    for _ in range(20):
        parts.queue.step()
    assert parts.operation.leads and parts.states.state is MOVING
    return parts


def come_to_rest(parts):
    while parts.engine.phase is not MotionPhase.IDLE:
        parts.queue.step()
    parts.operation.end_ramp()


def test_it_begins_where_the_machine_is_measured_unless_there_is_an_obstacle():
    parts = Parts(WAITING)
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        parts.operation.begin(parts.now)
    parts.measure(HOME)
    parts.operation.set_obstacle(SOMETHING)
    parts.operation.begin(parts.now)
    assert not parts.operation.leads and parts.states.reason is SOMETHING
    parts.operation.set_obstacle(None)
    parts.operation.begin(parts.now)
    assert parts.operation.leads and parts.states.state is IDLE
    assert parts.operation.commanded == parts.engine.state.heights == HOME


def test_it_waits_where_force_limits_cannot_hold_the_weight():
    parts = Parts(WAITING)
    parts.measure(HOME)
    forces = SliderForces(MACHINE, Masses.uniform(1.0, 0.1, 1.0))
    weak = LIMITS.with_added(ForceLimits(forces, (10.0,) * 3, (50.0,) * 3))
    parts.engine.set_limits(weak)
    with pytest.raises(CannotHoldError, match=r"force_limit_up\[\d\] = 10 N cannot hold"):
        parts.operation.begin(parts.now)
    assert not parts.operation.leads and parts.states.state is WAITING
    parts.engine.set_limits(LIMITS)
    parts.operation.begin(parts.now)
    assert parts.operation.leads


def test_a_fault_ends_the_lead_after_a_ramp():
    parts = led()
    parts.operation.fault(SOMETHING)
    assert parts.operation.leads and parts.states.state is FAULT
    with pytest.raises(CommandRefusedError, match="not over yet"):
        parts.operation.enable(parts.now)
    come_to_rest(parts)
    assert not parts.operation.leads and parts.operation.commanded is None
    assert parts.operation.enable(parts.now) == "enabled"


def test_an_end_is_for_good():
    parts = led()
    parts.operation.end("the end")
    assert parts.states.state is STOPPING
    come_to_rest(parts)
    assert not parts.operation.leads and parts.states.state is DISABLED
    with pytest.raises(CommandRefusedError, match="the end"):
        parts.operation.enable(parts.now)


def test_a_failure_keeps_the_first_cause_and_comes_to_rest():
    parts = led()
    failure = parts.operation.fail(ValueError("first"))
    assert parts.operation.fail(ValueError("second")) is failure is parts.operation.failure
    assert "first" in parts.states.reason.text and parts.states.state is FAULT
    come_to_rest(parts)
    with pytest.raises(type(failure), match="first"):
        parts.operation.enable(parts.now)
