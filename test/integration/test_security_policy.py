"""The policies of SROS 2 allow each node what it uses, and nothing else.

They are not enforced here: Fast DDS as it comes in wheels has no DDS-Security.
"""

import os
import signal
import subprocess
from collections import defaultdict
from contextlib import closing, suppress
from xml.etree import ElementTree

import pytest
from policies import POLICY, Uses, allowed, used
from rclpy.node import NodeNameNonExistentError

from testing.panel import Panel
from testing.text_page import TextPage
from tri_glide_kinematics.ros.starting import executable


@pytest.fixture
def everything(client, nodes, tmp_path, namespace):
    """All nodes and commands of this package, each at what it does now and then."""
    panel = Panel(client, nodes, tmp_path)
    panel.machine.ik.signal(signal.SIGINT)
    start = {"command_outputs": ["joint_state", "forward_command", "joint_trajectory"]}
    panel.machine.wait_for_new_state("idle", lambda: panel.machine.start_ik(start))
    for name in ("fk_node", "mechanism_node"):
        nodes.start(name)
    nodes.start("calibration_node", {"folder": str(tmp_path)})
    nodes.start("pick_node", {"has_sensor": True})
    nodes.start("simulated_cell_node")
    adapter, channel = os.openpty()
    nodes.start("cia402_node", {"channel": os.ttyname(channel)})
    program = tmp_path / "program.gcode"
    program.write_text("G4 P600\nM2\n")
    # A search for modes lets calibration_node listen to the machine; the program waits.
    ros = ("--ros-args", "-r", f"__ns:={namespace}")
    commands = (
        (executable("ringdown"), "--machine", *ros),
        (executable("drive"), program, *ros),
    )
    processes = [subprocess.Popen(each, stdout=subprocess.DEVNULL) for each in commands]
    # An accelerometer is heard while a page shows it.
    with closing(TextPage(panel.address, "Swing")):
        yield
    for process in processes:
        process.kill()
        process.wait()
    for file in (adapter, channel):
        os.close(file)


def test_each_node_uses_what_it_is_allowed_to_and_no_more(everything, client, namespace):
    policies = allowed()
    seen: dict[str, Uses] = {name: defaultdict(set) for name in policies}

    def all_seen() -> bool:
        for name, uses in seen.items():
            with suppress(NodeNameNonExistentError):
                for permission, names in used(client.node, name, namespace).items():
                    uses[permission] |= names
        return all(
            names <= seen[name][permission]
            for name, uses in policies.items()
            for permission, names in uses.items()
        )

    try:
        client.wait_for(all_seen, "all that is allowed to be used")
    finally:
        assert seen == policies


def test_the_policies_have_the_form_that_sros2_reads():
    policy = ElementTree.parse(POLICY).getroot()
    assert (policy.tag, policy.attrib) == ("policy", {"version": "0.2.0"})
    assert [child.tag for child in policy] == ["enclaves"]
    rules = {
        "topics": ("topic", {"publish", "subscribe"}),
        "services": ("service", {"reply", "request"}),
        "actions": ("action", {"call", "execute"}),
    }
    for enclave in policy[0]:
        profile = enclave.find("profiles/profile")
        assert profile is not None
        assert set(profile.attrib) == {"ns", "node"}
        assert enclave.attrib == {"path": f"/tri_glide/{profile.attrib['node']}"}
        for names in profile:
            kind, permissions = rules[names.tag]
            assert names.attrib.items() <= {(each, "ALLOW") for each in permissions}
            assert len(names)
            assert {name.tag for name in names} == {kind}
