"""The executables themselves: how they end, and what they say about bad parameters."""

import itertools
import os
import runpy
import signal
import subprocess
import time
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters

from testing.forks import ForkedNodes
from testing.processes import TIMEOUT, launched, python_path
from tri_glide_kinematics.ros.starting import executable
from tri_glide_kinematics.settings import NODES

EXECUTABLES = executable("ik_node").parent


@pytest.fixture
def installed_nodes(ros_domain, tmp_path, namespace):
    """Start nodes as a user does, and not as forks."""
    with launched(tmp_path, namespace) as launcher:
        yield launcher


def test_signals_end_every_node_in_silence(client, installed_nodes):
    # A panel may be running on the usual port.
    port = {"panel_node": {"port": 0}}
    # That of drives ends by itself without a bus: its own tests have one.
    names = [name for name in NODES if name != "cia402_node"]
    started = [installed_nodes.start(name, port.get(name)) for name in names]
    known = client.node.get_node_names_and_namespaces
    client.wait_for(
        lambda: {(name, client.namespace) for name in names} <= set(known()),
        "all nodes",
    )
    for node, number in zip(started, itertools.cycle((signal.SIGINT, signal.SIGHUP))):
        assert node.signal(number) == 0
        assert "Traceback" not in node.output


@pytest.mark.slow
def test_a_second_signal_at_any_moment_of_the_end_changes_nothing(client, installed_nodes):
    ending = []
    pauses = (0.01, 0.03, 0.06, 0.1, 0.15)
    started = [
        installed_nodes.start("fk_node", namespace=f"{client.namespace}/{number}")
        for number in ("first", "second", "third", "fourth", "fifth")
    ]
    for pause, node in zip(pauses, started):
        # Its loop has begun when it answers.
        client.set_parameters(f"{node.namespace}/fk_node", {})
        node.process.send_signal(signal.SIGINT)
        client.spin_for(pause)
        ending.append(node.signal(signal.SIGINT))
    assert not any(ending), ending


@pytest.mark.parametrize("name", ["fk_node", "mechanism_node"])
def test_a_signal_ends_a_node_in_silence_that_is_just_getting_ready(client, nodes, name):
    for _ in range(4):
        node = nodes.start(name)
        client.wait_for(
            lambda node=node: "TRI_GLIDE_TRANSPORT" in node.output, "the node", longest_nap=1e-3
        )
        assert node.signal(signal.SIGINT) == 0
        assert "Traceback" not in node.output


@pytest.mark.parametrize(
    ("name", "arguments", "reason"),
    [
        ("ik_node", ["-p", "base_radius:=0.05"], "anchors of arms 1 and 2 coincide"),
        ("ik_node", ["-p", "velocity_limits:=[1, 1.0, 1]"], "with a decimal point, or none"),
        ("simulator_node", ["-r", "nonsense"], "nonsense"),
    ],
)
def test_bad_parameters_get_one_line(run_node, name, arguments, reason):
    check_refused(run_node(name, "--ros-args", *arguments), reason)


def test_bad_parameter_files_get_one_line(run_node, tmp_path):
    path = tmp_path / "parameters.yaml"
    path.write_text("ik_node:\n  ros__parameters:\n    speed_scale: 0.1\n")
    arguments = ("--ros-args", "--params-file", str(path), "-r", "__ns:=/cell_1")
    reason = "is for /ik_node, and this node is /cell_1/ik_node"
    check_refused(run_node("ik_node", *arguments), reason)


def test_the_demo_refuses_what_it_would_ignore(run_node):
    code, output = run_node("demo", "--ros-args", "-p", "speed_scale:=0.1")
    assert code == 2
    assert "unrecognized arguments: --ros-args -p speed_scale:=0.1" in output


# test/settings/test_arguments.py has the text of each node.
@pytest.mark.parametrize(("name", "option"), [("ik_node", "-h"), ("demo", "--help")])
def test_help_helps(run_node, name, option):
    code, output = run_node(name, option)
    assert code == 0
    assert f"{name} [" in output
    for entry in NODES.get(name, ()):
        assert f"  {entry.name} (" in output


@pytest.fixture
def run_node(ros_domain, tmp_path):
    """Run an executable to its end, and return its exit code and what it has written."""

    def run(name, *arguments):
        log = tmp_path / "output.log"
        with ForkedNodes({"PYTHONPATH": python_path()}) as processes:
            process = processes.start_command([str(executable(name)), *arguments], log)
            return process.wait(TIMEOUT), log.read_text()

    return run


def check_refused(run, reason):
    code, output = run
    assert code == 1
    errors = [line for line in output.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert reason in errors[0]
    assert "Traceback" not in output


def test_a_node_tells_what_it_works_with_and_what_changes(client, nodes):
    node = nodes.start("ik_node", {"speed_scale": 0.25, "rate": 250})
    client.wait_for(lambda: "waiting" in node.output, "the first state")
    starts = [line for line in node.output.splitlines() if " starts with " in line]
    assert len(starts) == 1
    for text in (
        f"{client.namespace}/ik_node starts with geometry symmetric, ",
        "rate 250 1/s (default 500 1/s), velocity_limits [1, 1, 1] m/s, ",
        "speed_scale 0.25 (default 1), path_speed_scale 1, rapid_scale 1, motion linear, "
        "all else as by default",
    ):
        assert text in starts[0]
    # Another thing to log, as a warning.
    client.send_pose((0.0, 0.0, 0.0), "elsewhere")
    client.wait_for(lambda: "refused a target pose" in node.output, "the refusal")
    assert client.set_parameters(
        "ik_node", {"velocity_limits": [1, 2, 1], "speed_scale": 1}
    ).successful
    line = "velocity_limits: [1, 1, 1] m/s -> [1, 2, 1] m/s, speed_scale: 0.25 -> 1\n"
    client.wait_for(lambda: line in node.output, "the change to be logged")
    assert client.set_parameters("ik_node", {"speed_scale": 1.0}).successful
    assert not client.set_parameters("ik_node", {"speed_scale": 2}).successful
    assert node.output.count(" -> ") == 2


def test_a_storm_of_changes_does_not_flood_the_log(client, nodes):
    node = nodes.start("simulator_node")
    begin = time.monotonic()
    for number in range(200):
        assert client.set_parameters("simulator_node", {"lag": 0.001 * number}).successful
    last = "lag: 0.198 s -> 0.199 s"
    client.wait_for(lambda: last in node.output, "the last change")
    assert "more in the last second; the latest: lag: " in node.output
    # Five in a second, and one for the others; seconds begin and end anywhere.
    seconds = time.monotonic() - begin
    assert node.output.count("lag: ") <= 6 * (seconds + 2)


def test_integers_may_stand_for_doubles(client, nodes):
    """Live too; what other nodes are told is a double."""
    nodes.start(
        "simulator_node", {"rate": 100, "initial_heights": [1, 1, 1], "upper_heights": [2, 2, 2]}
    )
    assert client.set_parameters("simulator_node", {"encoder_offsets": [0, 1, 0]}).successful
    for mistake in ({"encoder_offsets": 1}, {"lag": [1, 2]}, {"lag": "1"}):
        assert not client.set_parameters("simulator_node", mistake).successful
    names = ["rate", "initial_heights", "encoder_offsets"]
    request = GetParameters.Request(names=names)
    rate, heights, offsets = client.call(
        GetParameters, "simulator_node/get_parameters", request
    ).values
    assert (rate.type, rate.double_value) == (ParameterType.PARAMETER_DOUBLE, 100.0)
    assert list(heights.double_array_value) == [1.0, 1.0, 1.0]
    assert list(offsets.double_array_value) == [0.0, 1.0, 0.0]


def test_a_section_that_looks_like_the_nodes_own_is_told(client, nodes, tmp_path):
    path = tmp_path / "parameters.yaml"
    path.write_text(
        "/**:\n  ros__parameters:\n    lag: 0.0\nsimulator_nod:\n  ros__parameters:\n    lag: 0.1\n"
    )
    node = nodes.start("simulator_node", arguments=["--params-file", str(path)])
    text = f"/simulator_nod is not this node, {client.namespace}/simulator_node"
    client.wait_for(lambda: text in node.output, "the warning")


def test_ctrl_c_while_modules_are_loaded_ends_in_silence(ros_domain, tmp_path):
    # Found first, and one of them is imported: as if somebody had pressed it just then.
    press = "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(60.0)\n"
    environment = finding_first(tmp_path, {"numpy": press, "argparse": press})
    names = sorted(path.name for path in EXECUTABLES.iterdir() if path.name != "tri-glide")
    started = [
        subprocess.Popen([executable(name)], stderr=subprocess.PIPE, text=True, env=environment)
        for name in names
    ]
    for name, process in zip(names, started):
        _, errors = process.communicate(timeout=TIMEOUT)
        is_node = "starting.run import run" in (EXECUTABLES / name).read_text()
        code = 0 if is_node else 128 + signal.SIGINT
        assert (process.returncode, errors) == (code, ""), name


def finding_first(folder, modules):
    """Return an environment in which these ``modules`` are found before others of their names."""
    for name, text in modules.items():
        (folder / f"{name}.py").write_text(text)
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    return {**os.environ, "PYTHONPATH": path}


def test_missing_ruckig_gets_one_line(ros_domain, tmp_path):
    # Modules of the same names that fail as missing ones do.
    missing = {
        name: f"raise ModuleNotFoundError(\"No module named '{name}'\", name='{name}')\n"
        for name in ("ruckig", "tri_glide_ruckig")
    }
    run = subprocess.run(
        [executable("ik_node")],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        env=finding_first(tmp_path, missing),
    )
    assert run.returncode == 1
    assert run.stderr == (
        "error: the Python module 'ruckig' is missing: build the package tri_glide_ruckig of the "
        "same repository, or python3 -m pip install ruckig\n"
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


@pytest.mark.filterwarnings("ignore:.*found in sys.modules")
def test_documentation_of_the_parameters_is_printed(capsys):
    runpy.run_module("tri_glide_kinematics.settings.tables", run_name="__main__")
    assert "| `twist_timeout` | double | `0.1` | s |" in capsys.readouterr().out


def test_byte_code_is_installed():
    # Without it each start compiles all modules, which takes as long as to import rclpy.
    prefix = Path(get_package_prefix("tri_glide_kinematics"))
    assert list(prefix.rglob("nodes/__pycache__/ik_node.*.pyc"))
