"""The controller with the real engine and a clock of our own: no process, no waiting."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.limits import SliderLimits
from tri_glide_kinematics.motion import MotionEngine, MotionKind
from tri_glide_kinematics.nodes.controller import CommandRefusedError, MotionController
from tri_glide_kinematics.nodes.operating_state import (
    DISABLED,
    FAULT,
    IDLE,
    JOGGING,
    MOVING,
    STOPPING,
    WAITING,
)
from tri_glide_kinematics.nodes.supervision import SupervisionBounds, Supervisor
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.workspace import Workspace
from tri_glide_kinematics.workspace_limits import WorkspaceLimits

PERIOD, TWIST_TIMEOUT, MEASURED_TIMEOUT = 0.002, 0.1, 0.2
HOME = (0.6, 0.6, 0.6)
LOWER, UPPER = (0.3, 0.3, 0.3), (0.9, 0.9, 0.9)
MACHINE = TriGlide(TriGlideGeometry.symmetric(0.25, 0.05, 0.40))
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
TARGET = (0.05, 0.03, 0.3)


class Rig:
    """A controller with a machine that follows perfectly, or is told not to."""

    def __init__(self, start_disabled=False, start=HOME):
        self.now = 100.0
        self.changes = []
        self.refusals = []
        self.measures = True
        self.heights = start
        supervisor = Supervisor(
            SupervisionBounds(MEASURED_TIMEOUT, 0.02, 0.05, (1.0, 1.0, 1.0)),
            ("slider_1", "slider_2", "slider_3"),
        )
        workspace = Workspace(MACHINE, WorkspaceLimits(LOWER, UPPER, 0.005, 6.0))
        self.controller = MotionController(
            MotionEngine(workspace, LIMITS, kind=MotionKind.SLIDER),
            supervisor,
            period=PERIOD,
            twist_timeout=TWIST_TIMEOUT,
            start_disabled=start_disabled,
            travel=(LOWER, UPPER),
            on_change=lambda state, reason: self.changes.append((state, reason)),
            on_refusal=self.refusals.append,
        )

    def cycle(self, count=1):
        setpoint = None
        for _ in range(count):
            self.now += PERIOD
            setpoint = self.controller.cycle(self.now)
            if setpoint is not None:
                self.heights = setpoint.heights
            if self.measures:
                self.controller.measured(self.heights, self.now)
        return setpoint

    def cycle_until(self, state, most=5000):
        for _ in range(most):
            if self.controller.state is state:
                return
            self.cycle()
        raise AssertionError(f"{state} did not come, it is {self.controller.state}")

    def jog(self, velocity=(0.0, 0.0, 0.05)):
        self.controller.jog(velocity, self.now)

    @property
    def states(self):
        return [state for state, _ in self.changes]


@pytest.fixture
def rig():
    rig = Rig()
    rig.cycle(2)
    return rig


def test_it_waits_for_the_machine_and_gives_no_setpoint_before():
    rig = Rig()
    rig.measures = False
    assert rig.cycle(10) is None
    assert rig.controller.state is WAITING
    for command in (
        lambda: rig.controller.move_to(TARGET),
        lambda: rig.jog(),
    ):
        with pytest.raises(CommandRefusedError, match="no motion while waiting"):
            command()
    rig.measures = True
    rig.cycle()
    assert rig.controller.state is IDLE
    assert rig.cycle().heights == HOME


@pytest.mark.parametrize(
    ("heights", "reason"),
    [
        ((0.6, 0.6, 0.902), "slider 3 is measured at 0.902 m, outside its travel"),
        ((0.298, 0.6, 0.6), "slider 1 is measured at 0.298 m, outside its travel"),
        ((0.6, float("nan"), 0.6), "slider_2 is nan"),
        ((0.31, 0.89, 0.31), "put the platform above slider 1"),
    ],
)
def test_it_does_not_start_from_everywhere(heights, reason):
    rig = Rig()
    with pytest.raises(KinematicsError, match=reason):
        rig.controller.measured(heights, rig.now)
    assert rig.controller.state is WAITING
    rig.cycle(2)
    assert rig.controller.state is IDLE


def test_encoders_at_the_end_stop_may_read_a_little_beyond():
    rig = Rig(start=(0.9004, 0.9004, 0.9004))
    rig.cycle(2)
    assert rig.controller.state is IDLE


def test_a_move_ends_at_its_target_with_reasons(rig):
    rig.controller.move_to(TARGET)
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)
    assert rig.changes[-2:] == [
        (MOVING, "target (0.05, 0.03, 0.3) m"),
        (IDLE, "at rest: target (0.05, 0.03, 0.3) m"),
    ]


def test_a_refused_target_changes_nothing(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(20)
    with pytest.raises(KinematicsError, match="outside the workspace"):
        rig.controller.move_to((0.5, 0.0, 0.3))
    assert rig.controller.state is MOVING
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)


def test_a_jog_ends_without_renewal(rig):
    for _ in range(5):
        rig.jog()
        rig.cycle(25)
    assert rig.controller.state is JOGGING
    rig.cycle(30)
    assert rig.controller.state in (STOPPING, IDLE)
    rig.cycle_until(IDLE)
    assert (STOPPING, "no twist for 0.1 s") in rig.changes
    assert rig.cycle().velocities == (0.0, 0.0, 0.0)


def test_a_jog_rests_at_the_edge_without_ending(rig):
    for _ in range(1500):
        try:
            rig.jog((0.0, 0.0, 0.5))
        except KinematicsError as error:
            assert "edge" in str(error) or "room" in str(error)
            break
        rig.cycle(5)
    else:
        assert rig.controller.state is JOGGING
    assert max(rig.heights) <= 0.9
    assert rig.states.count(JOGGING) == 1


def test_a_zero_twist_ends_a_jog_and_nothing_else(rig):
    rig.jog()
    rig.cycle(25)
    rig.jog((0.0, 0.0, 0.0))
    assert rig.changes[-1] == (STOPPING, "twist of zero")
    rig.cycle_until(IDLE)
    rig.controller.move_to(TARGET)
    rig.cycle(10)
    rig.jog((0.0, 0.0, 0.0))
    assert rig.controller.state is MOVING


def test_a_stop_holds_against_twists_until_they_pause(rig):
    rig.jog()
    rig.cycle(25)
    assert rig.controller.stop() == "ramping to a stop"
    for _ in range(50):
        with pytest.raises(CommandRefusedError):
            rig.jog()
        rig.cycle(10)
    assert rig.controller.state is IDLE
    rig.cycle(55)
    rig.jog()
    assert rig.controller.state is JOGGING


def test_a_stop_refuses_poses_until_it_is_over(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    rig.controller.stop()
    with pytest.raises(CommandRefusedError, match="before the stop is over: stop was asked for"):
        rig.controller.move_to(TARGET)
    rig.cycle_until(IDLE)
    rig.controller.move_to(TARGET)
    assert rig.controller.stop() == "ramping to a stop"
    rig.cycle_until(IDLE)
    assert rig.controller.stop() == "nothing moves: idle"


def test_disabled_after_a_ramp_and_enabled_where_it_is_measured(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    rig.controller.disable()
    assert rig.controller.state is STOPPING
    rig.cycle_until(DISABLED)
    assert rig.cycle() is None
    rig.heights = (0.7, 0.65, 0.62)
    rig.cycle()
    assert rig.controller.enable(rig.now) == "enabled"
    assert rig.cycle().heights == (0.7, 0.65, 0.62)


def test_enabled_again_while_ramping_it_stays_enabled(rig):
    rig.controller.move_to(TARGET)
    rig.cycle(40)
    rig.controller.disable()
    assert rig.controller.enable(rig.now) == "stays enabled"
    rig.cycle_until(IDLE)


def test_started_disabled():
    rig = Rig(start_disabled=True)
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        rig.controller.enable(rig.now)
    rig.cycle(5)
    assert rig.controller.state is DISABLED
    with pytest.raises(CommandRefusedError, match="no motion while disabled"):
        rig.controller.move_to(TARGET)
    rig.controller.enable(rig.now)
    assert rig.controller.state is IDLE


def silent(rig):
    rig.measures = False
    rig.cycle(round(MEASURED_TIMEOUT / PERIOD) + 5)


def jumping(rig):
    rig.controller.measured((rig.heights[0] + 0.04, *rig.heights[1:]), rig.now)


def apart(rig):
    for k in range(10):
        heights = (rig.heights[0] - 0.006 * k, *rig.heights[1:])
        rig.controller.measured(heights, rig.now)


def not_finite(rig):
    rig.controller.measured((float("inf"), 0.6, 0.6), rig.now)


@pytest.mark.parametrize(
    ("fault", "reason"),
    [(silent, "silent"), (jumping, "jumped"), (apart, "apart"), (not_finite, "inf")],
)
def test_a_fault_is_a_ramp_and_then_silence_until_somebody_clears_it(rig, fault, reason):
    rig.controller.set_limits(LIMITS, 0.05)
    rig.controller.move_to(TARGET)
    rig.cycle(100)
    fault(rig)
    rig.measures = False
    assert rig.controller.state is FAULT
    assert reason in rig.controller.reason
    if fault is not silent:
        # The setpoint is still on its way down.
        with pytest.raises(CommandRefusedError, match="ramp to a stop is not over"):
            rig.controller.enable(rig.now)
        with pytest.raises(CommandRefusedError, match="ramp to a stop is not over"):
            rig.controller.disable()
    before = rig.heights
    last = None
    while (setpoint := rig.cycle()) is not None:
        last = setpoint
    if last is not None:
        assert last.velocities == (0.0, 0.0, 0.0)
        assert last.heights != before
    with pytest.raises(CommandRefusedError, match="no motion while fault"):
        rig.controller.move_to(TARGET)
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        rig.controller.enable(rig.now)
    rig.measures = True
    rig.cycle()
    assert rig.controller.state is FAULT
    rig.controller.enable(rig.now)
    assert rig.controller.state is IDLE
    rig.controller.move_to(TARGET)
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)


def test_a_machine_in_fault_can_be_disabled(rig):
    not_finite(rig)
    rig.cycle(2)
    assert rig.controller.disable() == "disabled"
    assert rig.controller.state is DISABLED


def test_no_silence_without_being_enabled(rig):
    rig.controller.disable()
    rig.measures = False
    rig.cycle(1000)
    assert rig.controller.state is DISABLED
