"""The demonstration of a calibration as a user starts it: the machine is as right as predicted."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest
import yaml

from testing.processes import wait_for_end_of_processes_in
from tri_glide_kinematics.calibration.fit import load_measurements
from tri_glide_kinematics.calibration.session import solved
from tri_glide_kinematics.ros.starting import executable

TIMEOUT = 280.0  # s, for what takes 20 s on a computer that does nothing else


@pytest.fixture
def start(ros_domain: int, tmp_path: Path):
    """Return a function that starts the demonstration."""
    processes = []

    def started(*arguments: str) -> subprocess.Popen:
        command = [str(executable("calibration_demo")), "--output", str(tmp_path), *arguments]
        processes.append(
            subprocess.Popen(
                command,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,
            )
        )
        return processes[-1]

    yield started
    for process in processes:
        if process.poll() is None:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_wrong_machine_is_put_right(start, tmp_path: Path) -> None:
    demo = start("--touches", "7", "--seed", "2")
    output, _ = demo.communicate(timeout=TIMEOUT)
    assert demo.returncode == 0, output
    assert "as right as predicted" in output
    rows = [line.split() for line in output.splitlines() if line[:2] in ("x ", "y ", "z ")]
    table = {row[0]: [float(number) for number in row[1:]] for row in rows[-3:]}
    for before, after, _, in_itself, _ in table.values():
        assert after < before
        assert in_itself < 100.0
    content = load_measurements(tmp_path / "measurements.yaml")
    assert (len(content.touches), len(content.distances)) == (7, 3)
    # The node has written what the command makes of the same measurements.
    written = yaml.safe_load((tmp_path / "calibrated.yaml").read_text())["/**"]["ros__parameters"]
    assert written["height_offsets"] == pytest.approx(solved(content).height_offsets, abs=1e-7)
    assert (tmp_path / "calibration_demo.png").read_bytes().startswith(b"\x89PNG")


def test_ctrl_c_leaves_no_process_behind(start) -> None:
    demo = start()
    lines = []
    for line in demo.stdout:
        lines.append(line)
        if "looking where" in line:
            break
    os.killpg(demo.pid, signal.SIGINT)
    output = "".join(lines) + demo.communicate(timeout=TIMEOUT)[0]
    assert demo.returncode == 128 + signal.SIGINT, output
    assert "Traceback" not in output
    wait_for_end_of_processes_in(f"/tri_glide_demo_{demo.pid}")
