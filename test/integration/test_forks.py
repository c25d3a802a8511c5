"""Nodes of the tests are forks: they do, say and return what the installed executables do."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from testing.client import Client
from testing.forks import ForkedNodes
from testing.processes import TIMEOUT, Launcher, python_path
from tri_glide_kinematics.ros.starting import NodeProcesses, executable

WORDS = [
    pytest.param(["fk_node", "--help"], 0, id="help"),
    pytest.param(["ik_node", "--ros-args", "-p", "speed_scal:=0.1"], 1, id="unknown parameter"),
    pytest.param(["simulator_node", "--ros-args", "-p", "rate:=-1.0"], 1, id="bad value"),
]


def ended(kind: type[NodeProcesses], command: Sequence[str], log: Path) -> tuple[int, str]:
    """Run a command to its end, and return its exit code and what it has written."""
    with kind({"PYTHONPATH": python_path()}) as processes:
        process = processes.start_command([str(executable(command[0])), *command[1:]], log)
        return process.wait(TIMEOUT), log.read_text()


@pytest.mark.parametrize(("command", "code"), WORDS)
def test_words_go_where_a_shell_expects_them(
    ros_domain: int, command: list[str], code: int
) -> None:
    name, *arguments = command
    run = subprocess.run(
        [executable(name), *arguments], capture_output=True, text=True, timeout=TIMEOUT
    )
    silent, told = (run.stdout, run.stderr) if code else (run.stderr, run.stdout)
    assert run.returncode == code
    assert told
    assert not silent


@pytest.mark.parametrize(("command", "code"), WORDS)
def test_they_write_and_return_the_same(
    ros_domain: int, tmp_path: Path, command: list[str], code: int
) -> None:
    process = ended(NodeProcesses, command, tmp_path / "process.log")
    assert process[0] == code
    assert ended(ForkedNodes, command, tmp_path / "fork.log") == process


def test_their_ends_are_told(client: Client, nodes: Launcher) -> None:
    first, second = (nodes.start("fk_node") for _ in range(2))
    with pytest.raises(subprocess.TimeoutExpired):
        first.process.wait(0.1)
    assert first.is_running
    assert first.signal(signal.SIGKILL) == -signal.SIGKILL
    assert second.is_running
    # It has to get so far that it handles signals.
    client.wait_for(lambda: "TRI_GLIDE_TRANSPORT" in second.output, "the node")
    assert second.signal(signal.SIGINT) == 0
    assert not second.is_running
