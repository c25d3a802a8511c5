"""Stop, enable, state, supervision and live parameters of ik_node, with the simulator's faults."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from testing.client import LATCHED, values_of
from testing.commands import KINEMATICS, assert_within_limits, stream_of
from testing.scenarios import HEALTHY
from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.settings import IK_NODE

FAR, NEAR = (0.08, 0.03, 0.35), (0.0, 0.0, 0.25)
# Slow enough to be in motion still when a fault is noticed, or a service is called.
SLOW = {"speed_scale": 0.05, "jump_limit": 0.02, "tracking_error_limit": 0.05}


def reach_a_target(machine):
    machine.move(NEAR)
    assert machine.heights() == pytest.approx(KINEMATICS.inverse(NEAR), abs=1e-5)


def test_a_stop_and_a_fault_are_ramps_and_a_person_clears_the_fault(machine, client):
    """What else ends a motion, and when, test/control/test_controller.py shows."""
    reason = "measured heights are silent for"
    diagnostics = client.record(DiagnosticArray, "/diagnostics")
    machine.start(SLOW)
    machine.get_going(FAR, 0.04)
    count = len(machine.states)
    answer = client.stop()
    assert answer.message == "ramping to a stop: was moving, target (0.08, 0.03, 0.35) m"
    machine.wait_for_state("idle")
    assert machine.states_since(count) == ["stopping", "idle"]
    machine.get_going(FAR, 0.04)
    assert client.set_parameters("simulator_node", {"drop_out": 1.0}).successful
    machine.wait_for_state("fault")
    assert machine.cause is Cause.MEASUREMENTS_SILENT
    assert reason in machine.reason
    assert f"fault: {machine.reason}" in machine.ik.output
    client.wait_for(lambda: not any(machine.commands[-1].velocity), "the end of the ramp")
    assert machine.heights() != pytest.approx(KINEMATICS.inverse(FAR), abs=1e-3)
    assert_within_limits(machine)
    client.wait_for(
        lambda: any(
            status.level == DiagnosticStatus.ERROR and reason in status.message
            for status in client.statuses(diagnostics)
        ),
        "the fault in the diagnostics",
    )
    # Once at rest it is silent, and takes no target.
    now = client.now()
    machine.wait_for_refusal(Refusal.FAULT, lambda: client.send_pose(NEAR))
    assert not machine.commands_since(now)
    assert "no measured slider heights" in client.enable().message
    assert client.set_parameters("simulator_node", HEALTHY).successful
    # What was measured before may be far from what comes now, which would be the next fault.
    machine.wait_for_measured_rest()
    machine.wait_until_measurements_are_read()
    client.wait_for(lambda: client.enable().success, "the fault to be cleared")
    machine.wait_for_state("idle")
    reach_a_target(machine)
    # A target that comes before the first cycle makes the first setpoint one of motion.
    assert max(map(abs, machine.commands_since(now)[0].velocity)) < 0.01
    assert_within_limits(machine, len(machine.commands) - len(machine.commands_since(now)))


def test_state_is_latched_for_those_who_come_later(running_machine):
    machine, client = running_machine, running_machine.client
    reach_a_target(machine)
    count = len(machine.states)
    late = client.record(DiagnosticStatus, "ik_node/status", LATCHED)
    late_state = client.record(MachineState, "ik_node/machine_state", LATCHED)
    client.wait_for(lambda: late and late_state, "the latched state")
    (state,) = late_state
    assert state.header == machine.states[count - 1].header
    assert late[0].message == f"idle: {state.reason}"
    assert state.reason.startswith("at rest: target (0, 0, 0.25) m is reached, measured")
    assert (state.state, state.cause) == (MachineState.IDLE, MachineState.CAUSE_TARGET_REACHED)
    assert state.sends_setpoints and state.target_reached
    assert state.target_kind == MachineState.TARGET_POSITION
    assert (state.target.x, state.target.y, state.target.z) == (0.0, 0.0, 0.25)
    assert math.isnan(state.target_velocity.x)
    assert 0.0 <= state.target_distance < 0.0005
    assert state.header.frame_id == "tri_glide_base"
    # By these the client has found out that it is heard.
    values = values_of(late[0])
    assert str(state.refused) == values["refused commands"]
    assert state.refusal == Refusal.WRONG_FRAME
    assert state.refusal_text == values["last refusal"]


def test_diagnostics_tell_of_loop_and_refusals(running_machine):
    client = running_machine.client
    diagnostics = client.record(DiagnosticArray, "/diagnostics")
    client.wait_for(lambda: len(diagnostics) > 1, "diagnostics")
    client.send_pose((0.5, 0.0, 0.25))

    def refusal():
        told = client.statuses(diagnostics)
        return [status for status in told if "1 refused commands" in status.message]

    client.wait_for(refusal, "the refusal in the diagnostics")
    values = values_of(refusal()[0])
    assert refusal()[0].level == DiagnosticStatus.WARN
    assert values["state"] == "idle"
    assert int(values["refused commands"]) > 1
    assert "at (0.5, 0, 0.25) m" in values["last refusal"]
    assert 0.0 < float(values["loop rate [1/s]"]) < 600.0
    assert float(values["tracking error [m]"]) < 1e-5
    for key in ("jitter, root mean square [s]", "late cycles", "largest delay of a cycle [s]"):
        assert float(values[key]) >= 0.0
    assert diagnostics[0].header.stamp.sec > 0


def test_live_parameters_are_checked_as_a_set_and_hold_in_motion(running_machine):
    machine, client = running_machine, running_machine.client
    machine.get_going(FAR, 0.05)
    # test/settings/ has all that is refused.
    refused = [
        ({"speed_scale": 0.0}, "speed_scale"),
        ({"speed_scale": 0.5, "acceleration_limits": [0.0, 1.0, 1.0]}, "acceleration_limits[0]"),
        ({"arm_length": 0.41}, "read-only"),
    ]
    for change, reason in refused:
        result = client.set_parameters("ik_node", change)
        assert not result.successful
        assert reason in result.reason
    changes = {"speed_scale": 0.1, "velocity_limits": [0.8, 0.8, 0.8], "follow_horizon": 0.02}
    assert client.set_parameters("ik_node", changes).successful
    machine.wait_for_state("idle")
    machine.catch_up()
    assert machine.heights() == pytest.approx(KINEMATICS.inverse(FAR), abs=1e-5)
    assert_within_limits(machine)
    first = len(machine.commands)
    reach_a_target(machine)
    velocities = np.abs(stream_of(machine, first).velocities)
    assert 0.04 < velocities.max() <= 0.08 * (1.0 + 1e-6)
    defaults = {entry.name: entry.default for entry in IK_NODE if entry.name in changes}
    assert client.set_parameters("ik_node", defaults).successful
