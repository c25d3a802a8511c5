"""However a controller ends, it ends after a ramp: setpoints to rest, inside the limits."""

import random
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from controller_rig import LIMITS, PERIOD, violations_of
from machine_states import FAR, STATES
from soak import many

import tri_glide_kinematics
from tri_glide_kinematics.control import DISABLED, FAULT, BrokenError, Cause, Reason
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode, Replanning, Tracker

PACKAGE = Path(tri_glide_kinematics.__file__).parent
ROOMS = tuple(str(PACKAGE / room) for room in ("control", "motion", "workspace"))
# What calls all else in a cycle; and what the simulated measuring calls, which is no part of it.
ENTRANCES = frozenset(("cycle", "plan", "_step", "<genexpr>"))
IN_MOTION = ("moving", "jogging", "tracking", "path", "stopping", "fault")
MOST = 2000  # cycles of a ramp: more than any held plan here


class BrokenPlannerError(Exception):
    """Stands for any error of the program."""


def break_planner(monkeypatch):
    """Let all planning fail from now on."""

    def fail(*_, **__):
        raise BrokenPlannerError("no plan")

    for name in ("with_goal", "braked", "tried_again", "continued", "planned"):
        monkeypatch.setattr(Replanning, name, fail)
    monkeypatch.setattr(Tracker, "next", fail)


@contextmanager
def failing_at_call(number):
    """Let one call of a function fail: the one with this ``number``, of those that are made."""
    left = [number]

    def trace(frame, event, _):
        code = frame.f_code
        if code.co_filename.startswith(ROOMS) and code.co_name not in ENTRANCES:
            left[0] -= 1
            if not left[0]:
                raise BrokenPlannerError(f"in {code.co_name}")

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(before)


def surviving(call):
    """Return a ``call`` as a callback of a node, of which errors are survived."""

    def survive():
        with suppress(BrokenPlannerError):
            call()

    return survive


def drive_to_the_end(machine):
    """Run until there is no setpoint; return the heights."""
    heights = [machine.heights]
    for _ in range(MOST):
        setpoint = machine.cycle()
        if setpoint is None:
            assert not (machine.engine.started and any(machine.engine.state.velocities))
            return heights
        heights.append(setpoint.heights)
    raise AssertionError(f"no end: {machine.controller.state}, {setpoint}")


@pytest.mark.parametrize("state", STATES)
def test_an_end_leads_to_rest_and_takes_nothing_more(state):
    machine = STATES[state]()
    leads = machine.controller.leads
    before = machine.controller.state
    machine.controller.end("the node ends")
    for command in (
        lambda: machine.controller.move_to(FAR),
        lambda: machine.controller.enable(machine.now),
    ):
        with pytest.raises(KinematicsError):
            command()
    machine.renew = lambda: None
    heights = drive_to_the_end(machine)
    assert not machine.controller.leads
    if before is FAULT:
        assert machine.controller.state is FAULT
    else:
        assert machine.controller.state is DISABLED
        assert "the node ends" in machine.controller.reason.text
    if leads and state not in ("idle", "paused"):
        assert not violations_of(heights)
        # A brake is soon over.
        assert len(heights) * PERIOD < 0.6
    machine.measures = True
    machine.cycle(5)
    assert not machine.controller.leads


@pytest.mark.parametrize("state", STATES)
def test_a_broken_planner_ends_the_machine_at_the_end_of_the_held_plan(state, monkeypatch):
    machine = STATES[state]()
    controller = machine.controller
    goal = None
    if state == "moving":
        goal = controller.pursue_position(FAR)
    leads, before = controller.leads, controller.state
    end = machine.engine.sample_plan([machine.engine.remaining]).heights[0] if leads else None
    break_planner(monkeypatch)
    failure = controller.fail(BrokenPlannerError("somewhere"))
    assert controller.fail(ValueError("second")) is failure
    heights = drive_to_the_end(machine) if leads else []
    assert controller.failure is failure
    assert controller.state is (FAULT if leads else before)
    assert controller.reason == Reason(Cause.PROGRAM_ERROR, str(failure))
    assert "BrokenPlannerError: somewhere" in controller.reason.text
    if leads:
        assert heights[-1] == pytest.approx(end, abs=1e-12)
    if state in IN_MOTION:
        assert not violations_of(heights)
    if goal is not None:
        assert goal.outcome == (GoalCode.FAULT, controller.reason.text)
    with pytest.raises(BrokenError):
        controller.enable(machine.now)


@pytest.mark.parametrize("state", ["jogging", "tracking", "moving", "path"])
@pytest.mark.parametrize("command", ["move", "jog", "track", "follow", "stop", "pause", "limits"])
def test_whatever_is_asked_of_a_broken_planner_the_machine_ramps_down(state, command, monkeypatch):
    machine = STATES[state]()
    controller = machine.controller
    machine.renew = lambda: None
    break_planner(monkeypatch)
    with suppress(KinematicsError):
        {
            "move": lambda: controller.move_to((0.0, 0.0, 0.3)),
            "jog": lambda: machine.jog((0.0, 0.1, 0.0)),
            "track": machine.track,
            "follow": machine.follow,
            "stop": controller.stop,
            "pause": controller.pause,
            "limits": lambda: controller.set_limits(LIMITS, 0.5),
        }[command]()
    heights = [machine.heights]
    for _ in range(100):
        machine.cycle()
        heights.append(machine.heights)
    # What needs no plan has not found out that there is none.
    if controller.failure is None:
        assert command in ("pause", "limits", "track", "jog", "stop")
        controller.end("the test ends")
    heights += drive_to_the_end(machine)[1:]
    assert not violations_of(heights)


@pytest.mark.slow
@pytest.mark.parametrize("state", IN_MOTION)
def test_wherever_the_program_fails_the_machine_ramps_down(state):
    """One call fails, any that is made in some cycles, and all after it works."""
    source = random.Random(state)
    failures = 0
    for _ in range(many(6)):
        machine = STATES[state]()
        controller = machine.controller
        controller.set_limits(LIMITS, source.choice((0.7, 1.0)))
        machine.renew = surviving(machine.renew)
        heights = [machine.heights]
        with failing_at_call(source.randrange(1, 1500)):
            for index in range(12):
                if index == 3:
                    with suppress(BrokenPlannerError, KinematicsError):
                        source.choice(
                            (
                                controller.stop,
                                lambda m=machine: m.controller.move_to((0.0, 0.03, 0.27)),
                                lambda: None,
                            )
                        )()
                with suppress(BrokenPlannerError):
                    machine.cycle()
                heights.append(machine.heights)
        machine.renew = lambda: None
        controller.end("the test ends")
        heights += drive_to_the_end(machine)[1:]
        assert not violations_of(heights)
        failures += controller.failure is not None
    assert failures >= 2
