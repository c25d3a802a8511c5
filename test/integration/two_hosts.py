"""Two hosts joined by a cable that is cut in mid-motion; run by test_two_hosts.py.

It has to run in a network and mount namespace of its own, where it is root: this is the host of
``ik_node`` and of the client. A second network namespace is the host of the simulator.
"""

import subprocess

import pytest

from testing.commands import KINEMATICS, assert_within_limits
from testing.domain import set_transport
from testing.waiting import wait_until
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.ros.starting import CELL

TARGET, FAR = (0.0, 0.0, 0.25), (0.08, 0.03, 0.35)
OTHER_HOST = ("ip", "netns", "exec", "machine")


def run(*command):
    subprocess.run(command, check=True)


def wait_until_running(host, end):
    command = (*host, "ip", "-o", "link", "show", end, "up")
    wait_until(lambda: "state UP" in subprocess.check_output(command, text=True), end, 0.02)


class Cable:
    """Joins this host to the other one; what is cut is the other end.

    So this host sees what it would see of a real cable: no carrier.
    """

    def __init__(self):
        run("mount", "-t", "tmpfs", "none", "/run")
        run("ip", "netns", "add", "machine")
        run("ip", "link", "add", "cable0", "type", "veth", "peer", "cable1", "netns", "machine")
        run("ip", "link", "set", "lo", "up")
        run("ip", "address", "add", "10.77.0.1/24", "dev", "cable0")
        run("ip", "link", "set", "cable0", "up")
        run("ip", "route", "add", "224.0.0.0/4", "dev", "cable0")
        run(*OTHER_HOST, "ip", "link", "set", "lo", "up")
        run(*OTHER_HOST, "ip", "address", "add", "10.77.0.2/24", "dev", "cable1")
        self.plug_in()
        # A node uses only what is running when it starts, and the kernel may tell that a while
        # after the cable is in.
        for host, end in (((), "cable0"), (OTHER_HOST, "cable1")):
            wait_until_running(host, end)

    def plug_in(self):
        run(*OTHER_HOST, "ip", "link", "set", "cable1", "up")
        run(*OTHER_HOST, "ip", "route", "add", "224.0.0.0/4", "dev", "cable1")

    def cut(self):
        run(*OTHER_HOST, "ip", "link", "set", "cable1", "down")


@pytest.fixture(scope="session")
def cable():
    return Cable()


@pytest.fixture(scope="session")
def ros_domain(cable):
    """Let nodes find each other over the cable, and over nothing else."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", "1")
        set_transport(patch, CELL)
        yield 1


def test_cable_is_cut_in_mid_motion(cable, machine, client):
    machine.start_simulator(prefix=OTHER_HOST)
    machine.start_ik({"speed_scale": 0.05})
    machine.wait_until_connected()
    machine.move(TARGET)

    machine.get_going(FAR, 0.04)
    cable.cut()
    machine.wait_for_state("fault")
    assert machine.cause is Cause.MEASUREMENTS_SILENT
    client.wait_for(lambda: not any(machine.commands[-1].velocity), "the end of the ramp")
    assert machine.heights() != pytest.approx(KINEMATICS.inverse(FAR), abs=1e-3)
    response = client.enable()
    assert not response.success
    assert response.message == "there are no measured slider heights to start from"
    now = client.now()
    assert_within_limits(machine)

    cable.plug_in()
    client.wait_for(lambda: client.enable().success, "the fault to be cleared")
    machine.wait_for_state("idle")
    machine.catch_up()
    resumed = machine.commands_since(now)
    assert max(map(abs, resumed[0].velocity)) < 0.01
    machine.move(TARGET)
    machine.wait_for_measured_rest()
    assert machine.heights(machine.measured[-1]) == pytest.approx(
        KINEMATICS.inverse(TARGET), abs=1e-5
    )
