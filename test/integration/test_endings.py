"""What ends ik_node in motion ends it after a ramp."""

import signal

import pytest

from testing.commands import KINEMATICS, assert_within_limits
from testing.machine import PATIENCE
from tri_glide_kinematics.control import Cause

FAR = (0.08, 0.03, 0.35)
NEAR = (0.0, 0.0, 0.25)


@pytest.fixture
def breakable(machine, nodes):
    """Return a running machine whose planner breaks with SIGUSR1."""
    machine.start_simulator()
    machine.ik = nodes.start_module("testing.broken_ik_node", (), "ik_node", PATIENCE)
    machine.wait_until_connected()
    return machine


def ended_at_rest(machine):
    """Wait for the end of ik_node; check that it was a ramp, and return the last state told."""
    machine.client.wait_for(lambda: not machine.ik.is_running, "the end of ik_node")
    # What was sent last may still be on its way.
    machine.client.wait_for(lambda: not any(machine.commands[-1].velocity), "rest")
    assert_within_limits(machine)
    return machine.state


def test_a_signal_ends_it_after_a_ramp(machine):
    # Slow enough to be far from the end when the signal comes on a busy computer.
    machine.start({"speed_scale": 0.03})
    machine.get_going(FAR, 0.02)
    machine.ik.process.send_signal(signal.SIGTERM)
    machine.ik.process.send_signal(signal.SIGTERM)
    assert ended_at_rest(machine) == "disabled"
    assert machine.cause is Cause.NODE_ENDS
    machine.client.wait_for(lambda: machine.reason == "at rest: the node ends", "the last state")
    assert machine.ik.process.returncode == 0
    assert machine.heights() != pytest.approx(KINEMATICS.inverse(FAR), abs=1e-3)


@pytest.mark.parametrize("command", ["pose", "signal"])
def test_a_broken_planner_ends_it_with_an_error_at_the_end_of_the_held_plan(
    breakable, client, command
):
    machine = breakable
    machine.get_going(FAR, 0.3)
    machine.ik.process.send_signal(signal.SIGUSR1)
    machine.ik.exit_codes = (1,)
    if command == "signal":
        machine.ik.process.send_signal(signal.SIGTERM)
    else:
        client.send_pose(NEAR)
    assert ended_at_rest(machine) == "fault"
    assert machine.cause is Cause.PROGRAM_ERROR
    assert "RuntimeError: the planner is broken" in machine.reason
    assert machine.ik.process.returncode == 1
    assert "RuntimeError: the planner is broken" in machine.ik.output
    assert machine.heights() == pytest.approx(KINEMATICS.inverse(FAR), abs=1e-5)
