"""The tutorials, followed to the letter: commands are run, and what they print is compared."""

import math
import os
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from documents import ROOT, all_blocks

from testing.client import Client
from testing.domain import own_context, own_domain
from testing.machine import PATIENCE, RATE, Machine
from testing.processes import TIMEOUT
from testing.waiting import wait_until

TUTORIALS = ROOT / "docs" / "tutorials"
# These have tests of their own.
TESTED_ELSEWHERE = re.compile(
    r"^(make env|source env.sh|ros2 run \w+ (panel|panel_node|calibration_demo|pick_demo) .*)\n",
    re.MULTILINE,
)
STAYS = re.compile(r"^(ros2 run \w+ ik_node|python3 out/my_drives\.py)", re.MULTILINE)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
NAP = 0.05  # s
# A busy computer takes long to start some of them, one after the other.
PATIENCE_WITH_A_COMMAND = 5.0 * TIMEOUT


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a script that makes a shell one after env.sh."""
    shell = tmp_path_factory.mktemp("shell") / "shell"
    script = f'. "{ROOT}/env.sh"; declare -f ros2; declare -p _tri_glide_commands; true'
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    shell.write_text(done.stdout)
    return shell


@pytest.fixture
def folder(shell: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder that looks like the repository to commands, in a shell after env.sh."""
    for name in ("config", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "out").mkdir()
    monkeypatch.setenv("BASH_ENV", str(shell))
    return tmp_path


class Terminal:
    """A command that stays until Ctrl-C."""

    def __init__(self, code: str, folder: Path) -> None:
        self._log = folder / f"terminal_{len(list(folder.glob('terminal_*')))}"
        with self._log.open("wb") as output:
            self._process = subprocess.Popen(
                ["bash", "-c", code],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def output(self) -> str:
        return self._log.read_text()

    def interrupt(self) -> None:
        """Press Ctrl-C, and wait for the end."""
        os.killpg(self._process.pid, signal.SIGINT)
        self._process.wait(TIMEOUT)
        assert "Traceback" not in self.output, self.output


@contextmanager
def terminal(code: str, folder: Path) -> Iterator[Terminal]:
    running = Terminal(code, folder)
    try:
        yield running
    finally:
        running.interrupt()


def run(program: list[str], folder: Path) -> tuple[int, str]:
    """Run a program to its end; return its exit code and what it has printed."""
    done = subprocess.run(
        program,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=PATIENCE_WITH_A_COMMAND,
    )
    assert "Traceback" not in done.stdout, done.stdout
    return done.returncode, done.stdout


def is_told(expected: str, output: str) -> bool:
    """Tell whether the lines of ``expected`` stand in ``output``, in this order.

    ``...`` stands for any lines. Of what depends on the time, only the words are compared; a
    deviation, which ends a row, depends a little on the parts in which a path was planned in time.
    """
    lines = iter(output.splitlines())
    return all(
        any(_is_same(wanted.split(), line.split()) for line in lines)
        for wanted in expected.splitlines()
        if wanted.strip() not in ("", "...")
    )


def _is_same(wanted: list[str], words: list[str]) -> bool:
    if len(wanted) != len(words):
        return False
    units = [*wanted[1:], ""]
    deviation = len(wanted) - 2 if wanted[-1] == "mm" else None
    return all(
        _is_alike(
            one, other, unit.rstrip(",") in ("s", "mm/s"), 0.05 if place == deviation else 1e-3
        )
        for place, (one, other, unit) in enumerate(zip(wanted, words, units))
    )


def _is_alike(wanted: str, word: str, is_timed: bool, tolerance: float) -> bool:
    if NUMBER.sub("#", wanted) != NUMBER.sub("#", word):
        return False
    pairs = zip(NUMBER.findall(wanted), NUMBER.findall(word))
    return is_timed or all(
        math.isclose(float(a), float(b), rel_tol=tolerance, abs_tol=2e-4) for a, b in pairs
    )


def follow(page: str, folder: Path) -> None:
    """Do what a tutorial says."""
    code, output = 0, ""
    for language, block in all_blocks(TUTORIALS / f"{page}.md"):
        if language == "text":
            assert not output or is_told(block, output), f"{block}\n--- is not in\n{output}"
            code = 0
            continue
        assert code == 0, output
        if language == "python":
            code, output = run(["python3", "-c", block], folder)
        elif left := TESTED_ELSEWHERE.sub("", block):
            if STAYS.search(left):
                output = first_words_of(left, folder)
            else:
                code, output = run(["bash", "-c", left], folder)
        else:
            output = ""
    assert code == 0, output


def first_words_of(code: str, folder: Path) -> str:
    """Start a node, and return what it prints until it has told how it starts."""
    with terminal(code, folder) as node:
        wait_until(lambda: " starts with " in node.output, "the node", NAP)
        return node.output


def test_all_tutorials_are_followed():
    others = "my_drives", "can_drives", "pick_and_place"
    followed = {*WITHOUT_A_MACHINE, *WITH_A_MACHINE, *others}
    assert {page.stem for page in TUTORIALS.glob("*.md")} == followed


WITHOUT_A_MACHINE = ("calibrate", "mechanisms")
WITH_A_MACHINE = ("first_motion", "my_path", "follow_a_conveyor")


@pytest.mark.parametrize("page", WITHOUT_A_MACHINE)
def test_tutorials_without_a_machine(page, folder, ros_domain):
    follow(page, folder)


@pytest.mark.parametrize("page", WITH_A_MACHINE)
def test_tutorials_with_the_simulated_machine(page, folder, ros_context, nodes):
    nodes.start("simulator_node", {"rate": RATE}, namespace="/")
    nodes.start("ik_node", {"rate": RATE, **PATIENCE}, namespace="/")
    client = Client(ros_context, "")
    Machine(client, nodes, listen=False).wait_for_state("idle")
    client.close()
    follow(page, folder)


def test_the_tutorial_about_drives(folder, ros_domain):
    blocks = [code for _, code in all_blocks(TUTORIALS / "my_drives.md")]
    prepare, copy, drives, ik_node, page, pose, reached, fault = blocks
    assert page.startswith("ros2 run tri_glide_kinematics panel_node ")
    # A computer with more to do keeps a machine waiting for longer than a machine should.
    ik_node = _with(ik_node, PATIENCE)
    for code in (prepare, copy):
        assert run(["bash", "-c", TESTED_ELSEWHERE.sub("", code)], folder)[0] == 0
    with own_domain(), own_context() as context, terminal(ik_node, folder):
        client = Client(context, "")
        machine = Machine(client, None, listen=False)
        with terminal(drives, folder):
            machine.wait_for_state("disabled")
            client.wait_for(lambda: client.enable().success, "a machine that may move")
            code, output = run(["bash", "-c", pose], folder)
            assert (code, is_told(reached, output)) == (0, True), output
        machine.wait_for_state("fault")
        assert is_told(fault, machine.reason), machine.reason
        with terminal(drives, folder):
            client.wait_for(lambda: client.enable().success, "a machine that may move again")
            machine.wait_for_state("idle")
        client.close()


def test_the_tutorial_about_drives_on_a_bus(folder, ros_domain):
    pytest.importorskip("canopen")
    blocks = [code for _, code in all_blocks(TUTORIALS / "can_drives.md")]
    prepare, cia402_node, off, home, homed, ik_node, page = blocks
    assert page.startswith("ros2 run tri_glide_kinematics panel_node ")
    patience = {"heartbeat_timeout": 0.5, "playout_delay": 0.2}
    cia402_node = _with(cia402_node, patience)
    ik_node = _with(ik_node, {**PATIENCE, "drive_delay": 0.2})
    # Near the switches, so that it does not take long.
    drives = f"{TESTED_ELSEWHERE.sub('', prepare).strip()} --heights 0.88 0.89 0.9"
    with own_domain(), own_context() as context, terminal(drives, folder):
        wait_until((folder / "out" / "can").exists, "the adapter", NAP)
        with terminal(cia402_node, folder) as node:
            wait_until(lambda: off.strip() in node.output, "the drives", NAP)
            code, output = run(["bash", "-c", home], folder)
            assert (code, is_told(homed, output)) == (0, True), output
            with terminal(ik_node, folder):
                client = Client(context, "")
                machine = Machine(client, None, listen=False)
                machine.wait_for_state("disabled")
                client.wait_for(lambda: client.enable().success, "torque")
                machine.wait_for_state("idle")
                client.send_twist((0.0, 0.0, -0.01))
                machine.wait_for_state("jogging")
                client.close()


def test_the_tutorial_about_picking(folder, ros_context, nodes):
    blocks = [code for _, code in all_blocks(TUTORIALS / "pick_and_place.md")]
    demo, _, belt, pick_node, program, told = blocks
    assert not TESTED_ELSEWHERE.sub("", demo)
    # A computer with more to do is late.
    belt = _with(belt, {"gripper_reach": 0.05, "part_distance": 0.15})
    pick_node = _with(pick_node, {"allowed_error": 0.05, "belt_timeout": 1.0})
    nodes.start("simulator_node", {"rate": 2.0 * RATE}, namespace="/")
    nodes.start("ik_node", {"rate": 2.0 * RATE, **PATIENCE}, namespace="/")
    client = Client(ros_context, "")
    Machine(client, nodes, listen=False).wait_for_state("idle")
    client.close()
    with terminal(belt, folder), terminal(pick_node, folder):
        code, output = run(["bash", "-c", program], folder)
        assert (code, is_told(told, output)) == (0, True), output


def _with(code: str, parameters: dict[str, float]) -> str:
    """Return the line that starts a node, with more parameters."""
    return " -p ".join((code.strip(), *(f"{name}:={parameters[name]}" for name in parameters)))


def test_what_is_told_is_compared():
    assert is_told("a 1.0 b\n...\nc", "first\na 1.0001 b\nx\nc")
    assert not is_told("a 1.0 b", "a 1.1 b")
    assert not is_told("a 1.0 b", "a 1.0 c")
    assert not is_told("b\na", "a\nb")
    assert is_told("186.2 mm 1.951 mm", "186.2 mm 1.93 mm")
    assert not is_told("186.2 mm 1.951 mm", "185.2 mm 1.951 mm")
    assert is_told("after 1.0 s, more than 0.2 m", "after 3.5 s, more than 0.2 m")
