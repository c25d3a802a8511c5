"""The command that drives a file, as a user starts it."""

import os
import re
import signal
import subprocess

import pytest

from testing.commands import KINEMATICS
from testing.forks import ForkedNodes
from testing.processes import TIMEOUT, RunningNode, python_path
from tri_glide_interfaces.msg import Output
from tri_glide_kinematics.control import WAS_STOPPED, Cause
from tri_glide_kinematics.programs import RunState, load_kept
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS
from tri_glide_kinematics.ros.starting import executable

START = (0.6, 0.6, 0.6)  # m


class Command(RunningNode):
    """A running ``drive``: a fork, as nodes are, or with ``streams`` a process of its own."""

    def __init__(self, file, namespace, log, options=(), **streams):
        command = [str(executable("drive")), str(file), *options]
        command += ["--ros-args", "-r", f"__ns:={namespace}"]
        if streams:
            with log.open("wb") as output:
                streams = {"stdout": output, "stderr": subprocess.STDOUT, **streams}
                process = subprocess.Popen(command, **streams)
        else:
            process = ForkedNodes({"PYTHONPATH": python_path()}).start_command(command, log)
        super().__init__("drive", namespace, process, log)

    def end(self):
        """Wait for the end, and return the exit code."""
        return self.process.wait(TIMEOUT)

    def rows(self):
        """Return the words of the lines of the table."""
        lines = self.output.partition("largest deviation\n")[2].splitlines()
        return [line.split() for line in lines if line[:4].strip().isdigit()]


@pytest.fixture
def drive(running_machine, tmp_path):
    """Return a function that drives a file, or the lines of a program."""
    commands = []

    def started(file, *options, **streams):
        if "\n" in file:
            (tmp_path / "part.gcode").write_text(file)
            file = tmp_path / "part.gcode"
        log = tmp_path / f"drive_{len(commands)}.log"
        commands.append(Command(file, running_machine.namespace, log, options, **streams))
        return commands[-1]

    yield started
    for command in commands:
        command.signal(signal.SIGKILL)


def test_a_stop_while_a_program_is_checked_lets_nothing_move(running_machine, drive):
    machine, client = running_machine, running_machine.client
    before = machine.heights()
    zigzag = "".join(f"G1 X{10 * (-1) ** k} Y{0.05 * k:.2f} F3000\n" for k in range(100))
    command = drive(f"G0 X0 Y0 Z40\n{zigzag}M2\n")
    client.wait_for(lambda: client.node.count_publishers("outputs") > 1, "the command")
    count = len(machine.states)
    # Nobody sees from outside when the check begins: one of these comes while it lasts.
    client.wait_for(lambda: client.stop() and not command.is_running, "the end")
    assert command.end() == 1, command.output
    assert machine.states_since(count) == []
    machine.catch_up()
    assert machine.heights() == pytest.approx(before, abs=1e-9)
    assert WAS_STOPPED in command.output, command.output


def told_duration(command):
    return float(re.search(r"inside the workspace: ([\d.]+) s", command.output)[1])


def test_the_example_program_is_driven_to_its_end(running_machine, drive):
    machine = running_machine
    # It may not know the command yet when the first output changes.
    outputs = machine.client.record(Output, "outputs", LATEST_OUTPUTS)
    # Found by its name alone.
    check = drive("program_example.gcode", "--check")
    assert check.end() == 0, check.output
    machine.catch_up()
    assert machine.heights() == pytest.approx(START, abs=1e-6)
    command = drive("program_example.gcode")
    assert command.end() == 0, command.output
    # The machine that runs is that of the packaged parameters.
    assert told_duration(command) == told_duration(check)
    rows = command.rows()
    assert [row[:3] for row in rows] == [
        ["3", "output", "succeeded"],
        ["4", "path", "succeeded"],
        ["10", "wait", "succeeded"],
        ["11", "output", "succeeded"],
        ["12", "path", "succeeded"],
        ["13", "stop", "succeeded"],
    ]
    # Corners are cut by G64 P1, and not by more.
    assert 0.9 < float(rows[1][9]) <= 1.0
    machine.client.wait_for(lambda: len(outputs) == 2, "both outputs")
    assert [(each.name, each.value) for each in outputs] == [("spindle", 1000.0), ("spindle", 0.0)]
    machine.catch_up()
    place = KINEMATICS.forward(machine.heights())
    assert place == pytest.approx((0.0, 0.0, 0.27), abs=1e-6)


def test_a_program_that_leads_outside_moves_nothing(running_machine, drive):
    machine = running_machine
    machine.forget()
    command = drive("G0 X0 Y0 Z40\nG1 X10 F600\nX900\nM2\n")
    assert command.end() == 1
    assert "part.gcode: line 3: " in command.output
    assert "Traceback" not in command.output
    machine.catch_up()
    assert all(each.position == machine.commands[0].position for each in machine.commands)


def test_without_a_terminal_a_stop_ends_the_program(running_machine, drive, tmp_path):
    program = "G0 X10 Y0 Z40\nM1\nX0\nM0\nX10\nM0\nX20\nM2\n"
    kept = ("--progress", str(tmp_path / "kept.yaml"))
    command = drive(program, *kept)
    assert command.end() == 1
    assert "drive: line 4: M0 waits for Enter, and there is no terminal" in command.output
    results = [row[:3] for row in command.rows()]
    # M1 does not stop unless that is wanted.
    assert results[:2] == [["1", "path", "succeeded"], ["4", "stop", "stopped"]]
    assert [row[2] for row in results[2:]] == ["not"] * 4
    running_machine.catch_up()
    assert KINEMATICS.forward(running_machine.heights()) == pytest.approx((0, 0, 0.29), abs=1e-6)
    # Whoever goes on lets that stop pass, and no other one.
    command = drive(program, *kept, "--go-on")
    assert command.end() == 1
    assert "drive: line 6: M0 waits for Enter, and there is no terminal" in command.output


def test_enter_lets_the_program_go_on(running_machine, drive):
    machine, client = running_machine, running_machine.client
    ours, theirs = os.openpty()
    try:
        program = "G0 X10 Y0 Z40\nT1 M6\nX0\nM1\nG3 X0 Y0 I5 F6000\nM2\n"
        command = drive(program, "--optional-stops", stdin=theirs)
        client.wait_for(lambda: "tool 1: press Enter" in command.output, "the first stop")
        # Whoever changes a tool moves the platform; the program goes on from where it was left.
        machine.move((0.03, 0.0, 0.3))
        assert command.is_running
        os.write(ours, b"\n")
        client.wait_for(lambda: "M1: press Enter" in command.output, "the second stop")
        os.write(ours, b"\n")
        assert command.end() == 0, command.output
    finally:
        os.close(ours)
        os.close(theirs)
    assert command.output.count("to the start of the path") == 3
    machine.catch_up()
    assert KINEMATICS.forward(machine.heights()) == pytest.approx((0, 0, 0.29), abs=1e-6)


# A long line, and short ones behind it; outputs change on the path.
LASTING = "M3 S500\nG0 X0 Y0 Z40\nG1 X40 F6000\nM62 P1\nX0 F900\nM63 P1\nX40 F6000\nM2\n"


def told(outputs):
    """Return what has changed; ik_node tells other digital outputs of before."""
    each_one = [(each.name, each.number, each.value) for each in outputs]
    return [each for each in each_one if each[:2] in (("spindle", 0), ("digital", 1))]


def test_what_is_interrupted_switches_off_and_goes_on(running_machine, drive, tmp_path):
    machine, client = running_machine, running_machine.client
    outputs = client.record(Output, "outputs", LATEST_OUTPUTS)
    kept = tmp_path / "kept.yaml"
    command = drive(LASTING, "--progress", str(kept))

    def is_on_its_way():
        # An earlier try of this test may be told, too: the newest outputs count, of this command.
        is_on = told(outputs)[-1:] == [("digital", 1, 1.0)] and "inside" in command.output
        # The command itself may know later where it is.
        knows = kept.exists() and load_kept(kept).line == 5
        return is_on and knows and KINEMATICS.forward(machine.heights())[0] < 0.03

    client.wait_for(is_on_its_way, "some way on line 5")
    command.process.send_signal(signal.SIGINT)
    assert command.end() == 128 + signal.SIGINT, command.output
    assert "interrupted: the platform comes to rest" in command.output
    assert "drive: interrupted at line 5" in command.output
    assert [row[2] for row in command.rows()][-1] == "not"
    client.wait_for(lambda: told(outputs)[-1] == ("spindle", 0, 0.0), "the spindle to be off")
    machine.catch_up()
    assert not any(machine.commands[-1].velocity)
    stopped = load_kept(kept)
    assert (stopped.line, stopped.state, stopped.is_whole) == (5, RunState.ENDED, False)
    # The spindle and the digital output are as they were in line 5, where the platform is then.
    outputs.clear()
    command = drive(LASTING, "--progress", str(kept), "--go-on")
    assert command.end() == 0, command.output
    assert "8 lines, from line 5 on, inside the workspace" in command.output
    client.wait_for(lambda: len(told(outputs)) >= 4, "the outputs")
    again = [("spindle", 0, 500.0), ("digital", 1, 1.0)]
    assert told(outputs) == [*again, ("digital", 1, 0.0), ("spindle", 0, 0.0)]
    assert load_kept(kept).is_whole


@pytest.mark.parametrize("how", ["twice", "nobody reads"])
def test_a_second_ctrl_c_and_a_closed_terminal_switch_off(
    running_machine, drive, tmp_path, monkeypatch, how
):
    # Where it is set, each line is written at once, and what cannot be written is told sooner.
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    machine, client = running_machine, running_machine.client
    outputs = client.record(Output, "outputs", LATEST_OUTPUTS)
    streams = {"stdin": subprocess.PIPE}
    if how == "nobody reads":
        streams["stdout"] = subprocess.PIPE
    command = drive("M3 S500\nG0 X0 Y0 Z40\nG1 X90 F300\nM2\n", **streams)
    client.wait_for(
        lambda: (
            ("spindle", 0, 500.0) in told(outputs)
            and machine.state == "moving"
            and KINEMATICS.forward(machine.heights())[0] > 0.001
        ),
        "some way on line 3",
    )
    if how == "nobody reads":
        pipe = command.process.stdout
        os.set_blocking(pipe.fileno(), False)
        pipe.read()
        os.set_blocking(pipe.fileno(), True)
    if how == "nobody reads":
        # A closed terminal may send it twice: the platform is waited for.
        for _ in range(2):
            command.process.send_signal(signal.SIGHUP)
        # One more line is read, and no other: the table cannot be written.
        pipe.readline()
        pipe.close()
        assert command.end() == 1, command.output
    else:
        # So the platform comes to rest after the second one, however late that is sent.
        with machine.ik.standing_still():
            command.process.send_signal(signal.SIGINT)
            client.wait_for(lambda: "interrupted" in command.output, "the first to be told")
            command.process.send_signal(signal.SIGINT)
            assert command.end() == 128 + signal.SIGINT, command.output
    client.wait_for(lambda: told(outputs)[-1] == ("spindle", 0, 0.0), "the spindle to be off")
    if how == "twice":
        # Nobody has waited for its end: ik_node makes sure.
        client.wait_for(lambda: machine.cause is Cause.PROGRAM_LOST, "the run to be lost")
    machine.wait_for_state("idle")
    machine.catch_up()
    assert KINEMATICS.forward(machine.heights())[0] < 0.089


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_where_the_command_dies_or_is_held_the_machine_rests_and_is_switched_off(
    running_machine, drive, tmp_path, how
):
    machine, client = running_machine, running_machine.client
    outputs = client.record(Output, "outputs", LATEST_OUTPUTS)
    true_outputs = client.record(Output, "true_outputs", LATEST_OUTPUTS)
    kept = tmp_path / "kept.yaml"
    lines = "".join(f"X{n % 2 + 0.1 * n:.1f}\n" for n in range(200))
    command = drive(f"M3 S500\nG0 X0 Y0 Z40\nG1 F600\n{lines}M2\n", "--progress", str(kept))

    def line():
        return load_kept(kept).line if kept.exists() else 0

    def is_on():
        # What earlier tests have switched is told, too.
        return told(true_outputs)[-1:] == [("spindle", 0, 500.0)]

    client.wait_for(lambda: line() > 12 and is_on(), "some lines", 3.0 * TIMEOUT)
    command.process.send_signal(how)
    driven = line()
    client.wait_for(lambda: not is_on(), "the spindle to stop")
    client.wait_for(lambda: machine.cause is Cause.PROGRAM_LOST, "the lost run")
    assert "part.gcode, line " in machine.reason
    machine.catch_up()
    assert not any(machine.commands[-1].velocity)
    # In two seconds and a stop the platform drives 22 mm, on lines of about one.
    place = KINEMATICS.forward(machine.heights())
    assert abs(1e3 * place[0] - 0.1 * (driven - 4)) < 22.0
    if how == signal.SIGSTOP:
        command.process.send_signal(signal.SIGCONT)
        assert command.end() == 1
        # What came first: the end of its goal, or its own look at the time.
        ends = ("has told nothing", "so the machine stops", WAS_STOPPED)
        assert any(text in command.output for text in ends), command.output
        machine.catch_up()
        assert KINEMATICS.forward(machine.heights()) == place
        assert told(outputs)[-1] == ("spindle", 0, 0.0)


def test_without_ik_node_the_simulated_machine_switches_off_and_stays_so(machine, client):
    true_outputs = client.record(Output, "true_outputs", LATEST_OUTPUTS)
    publisher = client.publisher(Output, "outputs", LATEST_OUTPUTS)
    machine.start()
    for name in ("spindle", "fan"):
        publisher.publish(Output(name=name, value=500.0))

    def values():
        return {each.name: each.value for each in true_outputs}

    client.wait_for(lambda: values() == {"spindle": 500.0, "fan": 500.0}, "both to be on")
    # At rest nothing changes: its state is told all the same.
    count = len(machine.states)
    client.wait_for(lambda: len(machine.states) > count + 3, "signs of life")
    assert values()["spindle"] == 500.0
    machine.ik.signal(signal.SIGKILL)
    client.wait_for(lambda: values()["spindle"] == 0.0, "the spindle to be off")
    assert values()["fan"] == 500.0
    publisher.publish(Output(name="mist", value=1.0))
    client.wait_for(lambda: "mist" in values(), "the mist")
    assert values()["mist"] == 0.0
