"""Two ik_nodes on one set of topics: each names the other, and at most one leads."""

import signal

from sensor_msgs.msg import JointState

from testing.client import LATCHED
from testing.machine import PATIENCE, name_of
from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.errors import Refusal

FAR = (0.08, 0.03, 0.4)


class Other:
    """A second ik_node beside that of the machine."""

    def __init__(self, client, nodes, parameters=None):
        self.name = f"{client.namespace}/other"
        self.states = client.record(MachineState, "other/machine_state", LATCHED)
        self.node = nodes.start(
            "ik_node", {**PATIENCE, **(parameters or {})}, arguments=("-r", "__node:=other")
        )

    @property
    def state(self):
        return name_of(self.states[-1]) if self.states else ""

    @property
    def reason(self):
        return self.states[-1].reason if self.states else ""


def publishes(name, client, topic="joint_commands"):
    return f"{name} publishes {client.namespace}/{topic} as well"


def test_one_that_leads_faults_and_none_can_be_enabled(machine, client, nodes):
    machine.start({"speed_scale": 0.05})
    machine.wait_for_new_state("moving", lambda: client.send_pose(FAR))
    other = Other(client, nodes, {"start_disabled": True})
    machine.wait_for_state("fault")
    assert machine.cause is Cause.OTHER_PUBLISHER
    assert publishes(other.name, client) in machine.reason
    client.wait_for(lambda: not machine.states[-1].sends_setpoints, "the end of the ramp")
    assert publishes(other.name, client) in client.enable().message
    ours = publishes(f"{client.namespace}/ik_node", client)
    client.wait_for(lambda: ours in client.enable(node="other").message, "the other's reason")
    # The last one that stays may lead again.
    assert other.node.signal(signal.SIGINT) == 0
    client.wait_for(lambda: client.enable().success, "the first to be enabled")
    assert client.set_parameters("ik_node", {"speed_scale": 1.0}).successful
    machine.move(FAR)


def test_none_begins_to_lead_beside_another(machine, client, nodes):
    machine.start_ik()
    other = Other(client, nodes)
    ours = publishes(f"{client.namespace}/ik_node", client)
    client.wait_for(lambda: publishes(other.name, client) in machine.reason, "its reason")
    client.wait_for(lambda: ours in other.reason, "the other's reason")
    machine.start_simulator()
    client.wait_for(lambda: len(machine.measured) > 40, "measured heights")
    assert machine.state == "waiting"
    assert other.state == "waiting"
    assert not machine.commands
    assert machine.ik.signal(signal.SIGINT) == 0
    client.wait_for(lambda: other.state == "idle", "the other to lead")


def test_a_publisher_that_is_no_ik_node(running_machine):
    machine, client = running_machine, running_machine.client
    publisher = client.publisher(JointState, "joint_commands")
    machine.wait_for_state("fault")
    assert f"{client.namespace}/client publishes " in machine.reason
    client.wait_for(lambda: not machine.states[-1].sends_setpoints, "the end of the ramp")
    machine.wait_for_refusal(Refusal.OTHER_PUBLISHER, lambda: client.enable())
    client.node.destroy_publisher(publisher)
    client.wait_for(lambda: client.enable().success, "the machine to be enabled")
