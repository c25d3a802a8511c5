"""The command behind make panel: all nodes, patient ones, and none of them is left."""

from __future__ import annotations

import signal
import subprocess

import pytest
from rclpy.parameter_client import AsyncParameterClient

from testing.processes import TIMEOUT, processes_in, wait_for_end_of_processes_in
from tri_glide_kinematics.ros.processes import executable

pytest.importorskip("viser")

NODES = {"simulator_node", "ik_node", "fk_node", "mechanism_node", "panel_node"}


def test_a_simulated_machine_waits_longer_for_its_measurements_and_ends_with_the_command(client):
    with subprocess.Popen([str(executable("panel")), "--port", "0"]) as process:
        namespace = f"/tri_glide_panel_{process.pid}"

        def nodes():
            found = client.node.get_node_names_and_namespaces()
            return {name for name, space in found if space == namespace}

        try:
            client.wait_for(lambda: nodes() >= NODES, "all nodes")
            assert len(processes_in(namespace)) == len(NODES)
            parameters = AsyncParameterClient(client.node, f"{namespace}/ik_node")
            client.wait_for(parameters.services_are_ready, "the parameters")
            asked = parameters.get_parameters(["measured_timeout"])
            client.wait_for(asked.done, "the answer")
            assert asked.result().values[0].double_value == 2.0
        finally:
            process.send_signal(signal.SIGINT)
            try:
                code = process.wait(TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
    assert code == 128 + signal.SIGINT
    wait_for_end_of_processes_in(namespace)
