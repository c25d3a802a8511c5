"""The demonstration as a user starts it."""

import os
import signal
import subprocess
from pathlib import Path

import pytest

from testing.processes import processes_in, wait_for_end_of_processes_in
from tri_glide_kinematics.ros.starting import executable

TIMEOUT = 120.0  # s


@pytest.fixture
def demo(ros_domain: int, tmp_path: Path):
    process = subprocess.Popen(
        [str(executable("demo")), "--output", str(tmp_path / "out")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        # A shell lets what runs in the background ignore it.
        preexec_fn=lambda: signal.signal(signal.SIGQUIT, signal.SIG_DFL),
    )
    yield process
    if process.poll() is None:
        process.kill()
        process.wait()


def namespace_of(demo: subprocess.Popen) -> str:
    """Return the namespace of the nodes of a demonstration."""
    return f"/tri_glide_demo_{demo.pid}"


def test_it_reaches_every_target_and_draws_them(demo: subprocess.Popen, tmp_path: Path) -> None:
    output, _ = demo.communicate(timeout=TIMEOUT)
    assert demo.returncode == 0, output
    assert "every target reached, no limit broken" in output
    rows = [line.split()[0] for line in output.splitlines() if " µm " in line]
    assert rows == ["A", "B", "C", "D", "E", "home", "path"]
    assert (tmp_path / "out" / "demo.png").read_bytes().startswith(b"\x89PNG")
    assert not processes_in(namespace_of(demo))


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGQUIT, signal.SIGKILL])
def test_no_process_outlives_it_however_it_ends(demo: subprocess.Popen, number: int) -> None:
    while "pose A" not in demo.stdout.readline():
        assert demo.poll() is None
    os.kill(demo.pid, number)
    demo.stdout.close()
    code = 128 + signal.SIGTERM if number == signal.SIGHUP else -number
    assert demo.wait(TIMEOUT) == code
    wait_for_end_of_processes_in(namespace_of(demo))


@pytest.mark.parametrize("impatience", [1, 3], ids=["once", "thrice"])
def test_ctrl_c_leaves_no_process_behind(demo: subprocess.Popen, impatience: int) -> None:
    lines = []
    for line in demo.stdout:
        lines.append(line)
        if "pose B" in line:
            break
    assert len(processes_in(namespace_of(demo))) == 3, lines
    for _ in range(impatience):
        os.killpg(demo.pid, signal.SIGINT)
    output = "".join(lines) + demo.communicate(timeout=TIMEOUT)[0]
    assert demo.returncode == 128 + signal.SIGINT, output
    assert "Traceback" not in output
    wait_for_end_of_processes_in(namespace_of(demo))
