"""Nodes that are killed, flooded and abused: none gives up, and none breaks a limit."""

import signal

import pytest
from geometry_msgs.msg import PoseStamped

from testing.commands import KINEMATICS, assert_stretches_within_limits
from testing.scenarios import (
    HOME,
    NORMAL_VALUES,
    assert_normal_target_is_reached,
    flood,
    parameter_storm,
)

FAR = (0.08, 0.03, 0.35)
FLOOD = 4_000  # targets


def test_each_node_is_killed_and_started_again_in_motion(machine, client, nodes):
    """The simulator is in test_process_faults.py, in every state."""
    machine.start()
    poses = client.record(PoseStamped, "platform_pose")
    fk = nodes.start("fk_node")
    client.wait_for(lambda: poses, "poses")

    machine.get_going(FAR, 0.2)
    fk.signal(signal.SIGKILL)
    machine.wait_for_state("idle")
    machine.catch_up()
    assert machine.heights() == pytest.approx(KINEMATICS.inverse(FAR), abs=1e-5)
    poses.clear()
    nodes.start("fk_node")
    client.wait_for(lambda: poses, "poses again")

    machine.move(HOME)
    machine.get_going(FAR, 0.2)
    machine.ik.signal(signal.SIGKILL)
    # The drive keeps the last command that it got, and the sliders come to rest there.
    machine.wait_for_measured_rest()
    resting = machine.heights(machine.measured[-1])
    now = client.now()
    machine.wait_for_new_state("idle", machine.start_ik)
    machine.catch_up()
    resumed = machine.commands_since(now)
    assert machine.heights(resumed[0]) == pytest.approx(resting, abs=1e-5)
    assert {machine.heights(each) for each in resumed} == {machine.heights(resumed[0])}
    assert not any(any(each.velocity) for each in resumed)
    machine.wait_until_connected()
    assert_normal_target_is_reached(machine)
    final = KINEMATICS.inverse(HOME)
    client.wait_for(
        lambda: abs(poses[-1].pose.position.z - HOME[2]) < 1e-4, "the pose measured back"
    )
    assert machine.heights() == pytest.approx(final, abs=1e-5)
    assert_stretches_within_limits(machine)


@pytest.mark.parametrize("kind", ["pose", "twist", "state"])
def test_flood_of_targets(running_machine, kind):
    machine = running_machine
    flood(machine, rate=10_000.0, number=FLOOD, kind=kind)
    assert machine.ik.is_running
    others = f"more in the last second; the latest: refused a target {kind}"
    machine.client.wait_for(lambda: others in machine.ik.output, "the end of a second")
    assert machine.ik.output.count(f"refused a target {kind}") < FLOOD / 50
    assert "fault" not in machine.states_since(0)
    assert_normal_target_is_reached(machine)
    assert_stretches_within_limits(machine)


def test_parameter_storm(running_machine):
    machine, client = running_machine, running_machine.client
    parameter_storm(machine, duration=1.0, least=20)
    assert client.set_parameters("ik_node", NORMAL_VALUES).successful
    assert_normal_target_is_reached(machine)
    assert_stretches_within_limits(machine)
