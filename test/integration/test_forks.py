"""Nodes of the tests are forks: they do, say and return what the installed executables do."""

import signal
import subprocess
from pathlib import Path

import pytest

from testing.client import Client
from testing.forks import ForkedNodes
from testing.processes import TIMEOUT, Launcher, python_path
from tri_glide_kinematics.ros.starting import executable

WORDS = [
    pytest.param(["fk_node", "--help"], 0, id="help"),
    pytest.param(["simulator_node", "--ros-args", "-p", "rate:=-1.0"], 1, id="bad value"),
]


@pytest.mark.parametrize(("command", "code"), WORDS)
def test_they_write_and_return_the_same(
    ros_domain: int, tmp_path: Path, command: list[str], code: int
) -> None:
    whole, log = [str(executable(command[0])), *command[1:]], tmp_path / "fork.log"
    run = subprocess.run(whole, capture_output=True, text=True, timeout=TIMEOUT)
    # Words go where a shell expects them.
    silent, told = (run.stdout, run.stderr) if code else (run.stderr, run.stdout)
    assert (run.returncode, silent) == (code, "")
    with ForkedNodes({"PYTHONPATH": python_path()}) as processes:
        assert processes.start_command(whole, log).wait(TIMEOUT) == code
    assert told == log.read_text() != ""


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
