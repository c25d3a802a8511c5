"""The demonstration as a user starts it."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tri_glide_kinematics.ros.processes import executable

TIMEOUT = 120.0  # s


@pytest.fixture
def demo(ros_domain: int, tmp_path: Path):
    process = subprocess.Popen(
        [str(executable("demo")), "--output", str(tmp_path / "out")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    yield process
    if process.poll() is None:
        process.kill()
        process.wait()


def nodes_of(pid: int) -> list[str]:
    """Command lines of the processes in the namespace of the demonstration ``pid``."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            line = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:  # it has ended meanwhile
            continue
        if f"__ns:=/tri_glide_demo_{pid} " in line:
            found.append(line)
    return found


def test_it_reaches_every_target_and_draws_them(demo: subprocess.Popen, tmp_path: Path) -> None:
    output, _ = demo.communicate(timeout=TIMEOUT)
    assert demo.returncode == 0, output
    assert "every target reached, no limit broken" in output
    rows = [line.split()[0] for line in output.splitlines() if " µm " in line]
    assert rows == ["A", "B", "C", "D", "E", "home", "path"]
    assert (tmp_path / "out" / "demo.png").read_bytes().startswith(b"\x89PNG")
    assert not nodes_of(demo.pid)


@pytest.mark.parametrize("impatience", [1, 3], ids=["once", "thrice"])
def test_ctrl_c_leaves_no_process_behind(demo: subprocess.Popen, impatience: int) -> None:
    lines = []
    for line in demo.stdout:
        lines.append(line)
        if "pose B" in line:
            break
    assert len(nodes_of(demo.pid)) == 3, lines
    for _ in range(impatience):
        os.killpg(demo.pid, signal.SIGINT)
    output = "".join(lines) + demo.communicate(timeout=TIMEOUT)[0]
    assert demo.returncode == 128 + signal.SIGINT, output
    assert "Traceback" not in output
    end = time.monotonic() + TIMEOUT
    while left := nodes_of(demo.pid):
        assert time.monotonic() < end, left
