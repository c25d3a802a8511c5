"""One enable for the operator: that of ik_node gives the drives torque first, and takes it last."""

import pytest
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool

SERVICE = "my_drives/enable"


class Drives:
    """An enable service, which notes what it is asked for and how the machine moves then."""

    def __init__(self, machine):
        self.machine, self.client = machine, machine.client
        self.asked, self.refuses, self._times = [], "", []
        self.client.node.create_service(SetBool, SERVICE, self._answer)

    def _answer(self, request, response):
        self.asked.append(request.data)
        self._times.append(self.client.now())
        response.success = not self.refuses
        response.message = self.refuses or "operation is enabled"
        return response

    @property
    def still(self):
        """Whether the newest setpoint was one of rest, each time that they were asked."""
        before = (
            [each for each in self.machine.commands if self.client.time_of(each) <= time][-1:]
            for time in self._times
        )
        return [not any(each.velocity) for newest in before for each in newest or [JointState()]]

    def wait_until_known(self, still):
        """Wait for what was sent before they were asked."""
        self.client.wait_for(lambda: self.still == still, "setpoints of rest")

    def enable(self, on):
        return enabled(self.client, on)


def enabled(client, on):
    request, answers = SetBool.Request(data=on), []

    def is_answered():
        answers.append(client.call(SetBool, "ik_node/enable", request))
        # For a second, ik_node looks who else is there, and asks nobody.
        return "looks for other" not in answers[-1].message

    client.wait_for(is_answered, "an answer")
    return answers[-1]


@pytest.fixture
def drives(machine):
    drives = Drives(machine)
    machine.start_simulator()
    machine.start_ik({"drives_enable": SERVICE})
    machine.wait_for_state("disabled")
    return drives


def test_drives_get_torque_first_and_lose_it_last(drives):
    machine, client = drives.machine, drives.client
    assert not machine.commands and not drives.asked
    answer = drives.enable(True)
    assert answer.success and "operation is enabled" in answer.message
    assert drives.asked == [True] and drives.still == [True]
    machine.wait_for_state("idle")
    client.wait_for(lambda: machine.commands, "setpoints")
    assert "enabled already" in drives.enable(True).message and drives.asked == [True]
    client.send_pose((0.1, 0.0, 0.1))
    client.wait_for(lambda: any(machine.commands[-1].velocity), "a motion")
    assert drives.enable(False).success
    client.wait_for(lambda: drives.asked == [True, False], "the drives to let go")
    drives.wait_until_known([True, True])
    machine.wait_for_state("disabled")

    # A fault takes torque away, too, once the ramp is over.
    assert drives.enable(True).success
    client.send_pose((0.0, 0.0, 0.25))
    client.wait_for(lambda: any(machine.commands[-1].velocity), "a motion")
    client.set_parameters("simulator_node", {"encoder_offsets": [0.3, 0.0, 0.0]})
    machine.wait_for_state("fault")
    client.wait_for(lambda: drives.asked == [True, False] * 2, "the drives to let go")
    drives.wait_until_known([True] * 4)


def test_without_torque_the_machine_is_not_led_and_the_reason_is_told(drives):
    machine, client = drives.machine, drives.client
    drives.refuses = "axis 2: brake supply is missing"
    answer = drives.enable(True)
    assert not answer.success and "axis 2: brake supply" in answer.message
    # Whatever went wrong in it, what was asked for is taken back.
    client.wait_for(lambda: drives.asked == [True, False], "the drives to let go")
    assert not machine.commands and machine.state == "disabled"


def test_without_drives_or_heights_it_is_told_and_with_both_it_goes_on(machine, client):
    machine.start_ik({"drives_enable": SERVICE})
    machine.wait_for_state("disabled")
    answer = enabled(client, True)
    assert not answer.success and f"no service {SERVICE}" in answer.message
    drives = Drives(machine)

    def is_asked():
        answers.append(drives.enable(True))
        return drives.asked

    answers = []
    client.wait_for(is_asked, "ik_node to know of the drives")
    assert not answers[-1].success and "no measured slider heights" in answers[-1].message
    # Torque is taken away again.
    client.wait_for(lambda: drives.asked == [True, False], "the drives to let go")
    machine.start_simulator()
    client.wait_for(lambda: machine.measured, "heights")
    assert drives.enable(True).success
    machine.wait_for_state("idle")


def test_a_node_does_not_start_with_a_name_that_no_service_can_have(nodes):
    node = nodes.start("ik_node", {"drives_enable": "a-b"})
    node.exit_codes = (1,)
    assert node.process.wait(60.0) == 1
    assert "ik_node: drives_enable = 'a-b': Invalid service name" in node.output
