"""The transports as the system sees them: sockets and shared memory of real processes."""

import os
import signal
import socket
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from testing.domain import set_transport
from testing.forks import ForkedNodes
from testing.machine import Machine
from testing.processes import TIMEOUT, launched
from tri_glide_kinematics.ros.starting import CELL, COMPUTER, MIDDLEWARE_VARIABLES, VARIABLE

LISTENER = """
import sys, rclpy
from rclpy.task import Future
from sensor_msgs.msg import JointState
rclpy.init(args=[])
node, heard = rclpy.create_node("outsider"), Future()
node.create_subscription(JointState, sys.argv[1], lambda _: heard.done() or heard.set_result(0), 10)
rclpy.spin_until_future_complete(node, heard)
"""


def udp_addresses(pid: int) -> set[str]:
    """Return the addresses that the UDP sockets of a process are bound to."""
    folder = Path("/proc", str(pid))
    sockets = {os.readlink(path) for path in (folder / "fd").iterdir()}
    addresses = set()
    for table, family in (("udp", socket.AF_INET), ("udp6", socket.AF_INET6)):
        for line in (folder / "net" / table).read_text().splitlines()[1:]:
            fields = line.split()
            if f"socket:[{fields[9]}]" in sockets:
                digits = fields[1].partition(":")[0]
                words = [int(digits[at : at + 8], 16) for at in range(0, len(digits), 8)]
                addresses.add(socket.inet_ntop(family, struct.pack(f"={len(words)}I", *words)))
    return addresses


def uses_shared_memory(pid: int) -> bool:
    """Tell whether a process has shared memory of Fast DDS."""
    return "/dev/shm/fast" in Path("/proc", str(pid), "maps").read_text()


@pytest.fixture(params=[COMPUTER, CELL])
def chosen(request, ros_domain, client, namespace, tmp_path, monkeypatch):
    """Return a running machine that has one of the transports; the client has the loopback."""
    set_transport(monkeypatch, request.param)
    with launched(tmp_path, namespace, ForkedNodes) as launcher:
        yield request.param, Machine(client, launcher).start()


def test_nodes_have_the_chosen_transport_and_everybody_hears_them(chosen, monkeypatch):
    name, machine = chosen
    for node in (machine.ik, machine.simulator):
        lines = [line for line in node.output.splitlines() if f"{VARIABLE}={name}: UDP on " in line]
        assert len(lines) == 1
        assert "[INFO]" in lines[0]
        assert not uses_shared_memory(node.pid)
        addresses = udp_addresses(node.pid)
        assert addresses == {"127.0.0.1"} if name == COMPUTER else "0.0.0.0" in addresses
    # Another node, with all of its middleware's defaults.
    for variable in (*MIDDLEWARE_VARIABLES, VARIABLE):
        monkeypatch.delenv(variable, raising=False)
    topic = f"{machine.namespace}/joint_commands"
    subprocess.run([sys.executable, "-c", LISTENER, topic], check=True, timeout=TIMEOUT)


def test_on_one_computer_a_node_that_was_killed_is_soon_forgotten(client, nodes):
    node = nodes.start("fk_node")

    def is_known():
        names = client.node.get_node_names_and_namespaces()
        return ("fk_node", client.namespace) in names

    client.wait_for(is_known, "the node to be found")
    assert node.signal(signal.SIGKILL) == -signal.SIGKILL
    # By default of Fast DDS it would take 20 s.
    client.wait_for(lambda: not is_known(), "the node to be forgotten", timeout=15.0)


def test_what_brings_shared_memory_is_warned_of(
    ros_domain, client, namespace, tmp_path, monkeypatch
):
    for variable in (*MIDDLEWARE_VARIABLES, VARIABLE):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with launched(tmp_path, namespace, ForkedNodes) as launcher:
        node = launcher.start("mechanism_node")
        client.wait_for(lambda: "transport as chosen by" in node.output, "its transport")
        assert uses_shared_memory(node.pid)
    assert "[WARN]" in node.output
    assert "this brings shared memory" in node.output


def test_the_loopback_serves_the_highest_domain(
    ros_domain, client, namespace, tmp_path, monkeypatch
):
    monkeypatch.setenv("ROS_DOMAIN_ID", "232")
    with launched(tmp_path, namespace, ForkedNodes) as launcher:
        node = launcher.start("mechanism_node")
        client.wait_for(lambda: f"{VARIABLE}=computer" in node.output, "its transport")
