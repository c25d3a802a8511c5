"""The executables themselves: how they end, and what they say about bad parameters."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters

from tri_glide_kinematics.nodes.parameters import NODES
from tri_glide_kinematics.nodes.processes import executable

TIMEOUT = 60.0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_every_node_in_silence(client, nodes, number):
    started = [nodes.start(name) for name in NODES]
    for name in NODES:
        client.wait_for(
            lambda name=name: (
                name
                in [
                    found
                    for found, namespace in client.node.get_node_names_and_namespaces()
                    if namespace == client.namespace
                ]
            ),
            name,
        )
    for node in started:
        assert node.signal(number) == 0
        assert "Traceback" not in node.output


@pytest.mark.parametrize(
    ("name", "arguments", "reason"),
    [
        ("ik_node", ["-p", "base_radius:=0.05"], "anchors of arms 1 and 2 coincide"),
        ("ik_node", ["-p", "rate:=5.0"], "rate"),
        ("ik_node", ["-p", "rate:=500"], "'INTEGER', expecting type 'DOUBLE'"),
        (
            "ik_node",
            ["-p", "jerk_limits:=[200.0, 200.0]"],
            "jerk_limits has 2 elements, expected 3",
        ),
        (
            "ik_node",
            ["-p", "motion:=sideways"],
            "motion = 'sideways' must be one of linear, slider",
        ),
        ("fk_node", ["-p", "joint_names:=[a, b, a]"], "three different names"),
        ("simulator_node", ["-p", "initial_heights:=[0.6, 0.6, 1.0]"], "initial_heights[2] = 1 m"),
        ("simulator_node", ["-r", "nonsense"], "nonsense"),
    ],
)
def test_bad_parameters_get_one_line(ros_domain, name, arguments, reason):
    run = subprocess.run(
        [executable(name), "--ros-args", *arguments],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    )
    assert run.returncode == 1
    errors = [line for line in run.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert reason in errors[0]
    assert "Traceback" not in run.stderr


def test_missing_ruckig_gets_one_line(ros_domain, tmp_path):
    # A module of the same name that fails as a missing one does, found first.
    (tmp_path / "ruckig.py").write_text(
        "raise ModuleNotFoundError(\"No module named 'ruckig'\", name='ruckig')\n"
    )
    path = os.pathsep.join(filter(None, [str(tmp_path), os.environ.get("PYTHONPATH")]))
    run = subprocess.run(
        [executable("ik_node")],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert run.returncode == 1
    assert run.stderr == (
        "error: the Python module 'ruckig' is missing: python3 -m pip install ruckig\n"
    )


def test_parameters_are_described_with_unit_and_bounds(client, nodes):
    nodes.start("ik_node")
    names = [entry.name for entry in NODES["ik_node"]]
    response = client.call(
        DescribeParameters, "ik_node/describe_parameters", DescribeParameters.Request(names=names)
    )
    described = {descriptor.name: descriptor for descriptor in response.descriptors}
    for entry in NODES["ik_node"]:
        descriptor = described[entry.name]
        assert descriptor.description == entry.description
        assert descriptor.read_only is not entry.live
        assert descriptor.additional_constraints == entry.bounds
    assert "[1/s]" in described["rate"].description
    assert described["rate"].floating_point_range[0].to_value == 2000.0
    assert described["velocity_limits"].type == ParameterType.PARAMETER_DOUBLE_ARRAY


def test_documentation_of_the_parameters_is_printed(ros_domain):
    run = subprocess.run(
        [sys.executable, "-m", "tri_glide_kinematics.nodes.parameters"],
        capture_output=True,
        text=True,
        check=True,
        timeout=TIMEOUT,
    )
    assert "| `twist_timeout` | double | `0.1` | s |" in run.stdout


def test_byte_code_is_installed():
    # Without it each start compiles all modules, which takes as long as to import rclpy.
    prefix = Path(get_package_prefix("tri_glide_kinematics"))
    assert list(prefix.rglob("nodes/__pycache__/ik_node.*.pyc"))
