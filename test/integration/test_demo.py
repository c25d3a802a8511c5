"""The demonstrations as a user starts them."""

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

from testing.ends import run_in_real_time
from testing.processes import processes_in, wait_for_end_of_processes_in
from testing.waiting import wait_until
from tri_glide_kinematics.calibration.fit import load_measurements
from tri_glide_kinematics.calibration.session import solved
from tri_glide_kinematics.ros.starting import executable

TIMEOUT = 280.0  # s, for what takes 40 s at most on a computer that does nothing else
PNG = b"\x89PNG"

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start(ros_domain: int, tmp_path: Path) -> Iterator[Start]:
    """Return a function that starts a demonstration, which writes into ``tmp_path``."""
    processes = []

    def started(name: str, *arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [str(executable(name)), "--output", str(tmp_path), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        processes.append(process)
        return process

    yield started
    for process in processes:
        if process.poll() is None:
            process.kill()
            process.wait()


def output_of(demo: subprocess.Popen[str]) -> str:
    """Wait for the end of a demonstration that succeeds, and return what it has written."""
    output, _ = demo.communicate(timeout=TIMEOUT)
    assert demo.returncode == 0, output
    return output


def namespace_of(demo: subprocess.Popen[str]) -> str:
    """Return the namespace of the nodes of a demonstration."""
    return f"/tri_glide_demo_{demo.pid}"


def test_a_shaper_calms_each_motion(start: Start, tmp_path: Path) -> None:
    demo = start("calm_demo")
    # Beside other tests a stop may not be ready in time, and brakes without the shaper then.
    wait_until(lambda: len(processes_in(namespace_of(demo))) == 2, "the nodes")
    for number in processes_in(namespace_of(demo)):
        run_in_real_time(number)
    output = output_of(demo)
    assert "calm, and sooner there" in output
    rows = [line.split()[:2] for line in output.splitlines()]
    for motion in ("move", "path", "stop"):
        assert [motion, "none"] in rows
        assert [motion, "ei"] in rows
    assert (tmp_path / "calm_demo.png").read_bytes().startswith(PNG)


@pytest.mark.slow
def test_parts_are_picked_and_placed(start: Start, tmp_path: Path) -> None:
    output = output_of(start("pick_demo", "--count", "2", "--speed", "0.02"))
    assert output.count("picked and placed, ") == 2
    assert "demo: 2 placed, " in output
    assert f"demo: picture: {tmp_path}/pick_demo.png" in output
    assert (tmp_path / "pick_demo.png").read_bytes().startswith(PNG)


@pytest.mark.slow
def test_a_wrong_machine_is_put_right(start: Start, tmp_path: Path) -> None:
    output = output_of(start("calibration_demo", "--touches", "7", "--seed", "2"))
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
    assert (tmp_path / "calibration_demo.png").read_bytes().startswith(PNG)


def test_it_reaches_every_target_and_draws_them(start: Start, tmp_path: Path) -> None:
    demo = start("demo")
    output = output_of(demo)
    assert "every target reached, no limit broken" in output
    rows = [line.split()[0] for line in output.splitlines() if " µm " in line]
    assert rows == ["A", "B", "C", "D", "E", "home", "path"]
    assert (tmp_path / "demo.png").read_bytes().startswith(PNG)
    assert not processes_in(namespace_of(demo))


@pytest.mark.slow
def test_no_process_outlives_it_however_it_ends(start: Start) -> None:
    ends = {signal.SIGHUP: 128 + signal.SIGTERM, signal.SIGKILL: -signal.SIGKILL}
    demos = {number: start("demo") for number in ends}
    for demo in demos.values():
        read_until(demo, "pose A")
    for number, demo in demos.items():
        os.kill(demo.pid, number)
        assert demo.stdout is not None
        demo.stdout.close()
    for number, demo in demos.items():
        assert demo.wait(TIMEOUT) == ends[number]
        wait_for_end_of_processes_in(namespace_of(demo))


def read_until(demo: subprocess.Popen[str], words: str) -> str:
    """Read to the line with some ``words``, and return all that was read."""
    assert demo.stdout is not None
    lines = [demo.stdout.readline()]
    while words not in lines[-1]:
        assert lines[-1], lines
        lines.append(demo.stdout.readline())
    return "".join(lines)


def test_ctrl_c_leaves_no_process_behind(start: Start) -> None:
    """The other demonstrations have it from the same module, too."""
    demo = start("demo")
    told = read_until(demo, "pose A")
    assert len(processes_in(namespace_of(demo))) >= 3, told
    # Of an impatient person.
    for _ in range(3):
        os.killpg(demo.pid, signal.SIGINT)
    output = told + demo.communicate(timeout=TIMEOUT)[0]
    assert demo.returncode == 128 + signal.SIGINT, output
    assert "Traceback" not in output
    wait_for_end_of_processes_in(namespace_of(demo))
