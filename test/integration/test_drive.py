"""The command that drives a file, as a user starts it."""

from __future__ import annotations

import os
import signal
import subprocess
import threading

import pytest
import yaml

from testing.commands import KINEMATICS
from tri_glide_kinematics.nodes import drive as drive_command
from tri_glide_kinematics.nodes.drive import NoMachineError, StepDriver
from tri_glide_kinematics.programs import DriveFile, ProgressLine, WaitStep
from tri_glide_kinematics.ros.goal_sender import GoalSender
from tri_glide_kinematics.ros.starting import executable

TIMEOUT = 60.0  # s


class Command:
    """A running ``drive``, whose output is read as it comes."""

    def __init__(self, file, namespace):
        self.output = ""
        self.process = subprocess.Popen(
            [str(executable("drive")), str(file), "--ros-args", "-r", f"__ns:={namespace}"],
            env=os.environ,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.output += line

    def end(self):
        """Wait for the end, and return the exit code."""
        code = self.process.wait(TIMEOUT)
        self._reader.join(TIMEOUT)
        return code

    def rows(self):
        """Return the words of the lines of the table."""
        lines = self.output.partition("largest deviation\n")[2].splitlines()
        return [line.split() for line in lines if line[:4].strip().isdigit()]

    def close(self):
        self.process.kill()
        self.end()


@pytest.fixture
def drive(running_machine, tmp_path):
    """Return a function that drives a file, or steps in metres."""
    commands = []

    def started(steps, **keys):
        file = steps
        if isinstance(steps, list):
            file = tmp_path / "drive.yaml"
            file.write_text(yaml.safe_dump({"steps": steps, **keys}))
        commands.append(Command(file, running_machine.namespace))
        return commands[-1]

    yield started
    for command in commands:
        command.close()


def test_the_example_is_driven_to_its_end(running_machine, drive):
    machine = running_machine
    # Found by its name alone.
    command = drive("drive_example.yaml")
    assert command.end() == 0, command.output
    rows = command.rows()
    assert [row[:3] for row in rows] == [
        ["1", "move", "succeeded"],
        ["2", "path", "succeeded"],
        ["3", "wait", "succeeded"],
        ["4", "path", "succeeded"],
        ["5", "move", "succeeded"],
    ]
    # Three sides and half a circle with rounded corners, of which one may be 5 mm away.
    assert 170.0 < float(rows[1][5]) < 40.0 * 3 + 63.0
    assert 4.0 < float(rows[1][9]) <= 5.0
    # Each step has a line of its own where there is no terminal.
    assert command.output.count("\ndrive: step ") == 4
    assert "\033" not in command.output
    machine.catch_up()
    place = KINEMATICS.forward(machine.heights())
    assert place == pytest.approx((0.0, 0.0, 0.25), abs=1e-6)


def test_ctrl_c_lets_the_platform_rest_on_its_path(running_machine, drive):
    machine, client = running_machine, running_machine.client
    machine.move((0.0, 0.0, 0.25))
    line = {"line": {"to": [0.1, 0.0, 0.25], "speed": 0.03}}
    command = drive([{"path": {"segments": [line]}}, {"wait": {"seconds": 1}}])

    def place():
        return KINEMATICS.forward(machine.heights())

    client.wait_for(lambda: place()[0] > 0.005, "some way on the path")
    command.process.send_signal(signal.SIGINT)
    client.wait_for(lambda: command.process.poll() is not None, "the command to end")
    assert command.end() == 128 + signal.SIGINT, command.output
    assert "interrupted: the platform comes to rest" in command.output
    assert [row[2] for row in command.rows()] == ["canceled", "not"]
    machine.catch_up()
    x, *others = place()
    assert 0.005 < x < 0.05
    assert others == pytest.approx((0.0, 0.25), abs=1e-6)
    assert not any(machine.commands[-1].velocity)
    assert "Traceback" not in command.output


def test_a_step_that_is_refused_ends_the_drive_with_its_reason(drive):
    steps = [{"move": {"to": [0.5, 0.0, 0.25]}}, {"move": {"to": [0.0, 0.0, 0.3]}}]
    command = drive(steps)
    assert command.end() == 1
    assert [row[2] for row in command.rows()] == ["refused", "not"]
    assert "drive: step 1 of 2: " in command.output
    assert "(0.5, 0, 0.25) m" in command.output


def test_a_path_that_is_refused_has_no_deviation(drive):
    command = drive([{"path": {"segments": [{"line": {"to": [0.5, 0.0, 0.25]}}]}}])
    assert command.end() == 1
    assert [row[2] for row in command.rows()] == ["refused"]
    assert "nan" not in command.output
    assert "drive: step 1 of 1: " in command.output


def test_a_file_with_a_mistake_moves_nothing(drive):
    command = drive([{"move": {"to": [0.0, 0.0, 0.3]}}, {"wait": {"seconds": "long"}}])
    assert command.end() == 1
    assert "drive.yaml: step 2 (wait), seconds: is 'long', must be a finite num" in command.output
    assert "Traceback" not in command.output


def test_without_a_machine_it_says_what_is_missing(client, monkeypatch):
    monkeypatch.setattr(drive_command, "START_TIMEOUT", 0.3)
    waiting = StepDriver(GoalSender(client.node), client.spin_once, ProgressLine(), lambda: 0)
    with pytest.raises(NoMachineError, match=f"actions of {client.namespace}/ik_node after 0.3 s"):
        waiting.drive(DriveFile("", (WaitStep(1.0),)))
