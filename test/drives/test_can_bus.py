"""A bus by python-can and canopen, over real pseudo-terminals with simulated drives behind."""

import os
import signal
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO

import pytest
from drive_rig import ENABLE, SETTINGS, START

from testing.waiting import wait_until
from tri_glide_kinematics.commands import simulated_drives
from tri_glide_kinematics.drives import (
    BusError,
    CanBus,
    Command,
    DriveState,
    Emergency,
    Event,
    Foreign,
    SimulatedDrive,
    Status,
    Terminals,
    described,
)

canopen = pytest.importorskip("canopen")
NODES = (1, 2, 3)
CYCLES = 500


class Computer:
    """One that leads drives, and keeps what it hears."""

    def __init__(self, channel: str):
        self.bus = CanBus("slcan", channel, 1_000_000, NODES)
        self.events: list[Event] = []

    def listens(self) -> bool:
        self.events += self.bus.received()
        return True

    def value(self, node: int, index: int, subindex: int = 0) -> int:
        transfer = self.bus.read(node, described(node)[index, subindex].entry)
        wait_until(lambda: self.listens() and transfer.is_done)
        assert not transfer.error
        return transfer.value

    def write(self, node: int, index: int, subindex: int, value: int) -> int:
        transfer = self.bus.write(node, described(node)[index, subindex].entry, value)
        wait_until(lambda: self.listens() and transfer.is_done)
        assert bool(transfer.error) == bool(transfer.abort_code), transfer.error
        return transfer.abort_code

    def set_up(self) -> None:
        for node in NODES:
            for index, subindex, value in SETTINGS:
                own = node if index in (0x1400, 0x1800) and subindex == 1 else 0
                # However busy this computer is, no drive stops for that.
                longer = 60_000 if index == 0x1016 else 0
                assert self.write(node, index, subindex, value + own + longer) == 0
        self.bus.send_state(0, START)

    def heard(self, kind: type) -> list[Event]:
        return [event for event in self.events if isinstance(event, kind)]


class Plugged:
    """Terminals whose drives are served in a thread."""

    def __init__(self, drives: list[SimulatedDrive], count: int = 1):
        self.drives = drives
        self.terminals = Terminals(count)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        self.terminals.serve(self.drives, lambda: not self._ended.is_set())

    def unplug(self) -> None:
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            self.terminals.close()


@pytest.fixture
def plug() -> Iterator[Callable[..., Plugged]]:
    plugged: list[Plugged] = []

    def plugs(*nodes: int, count: int = 1) -> Plugged:
        # They have long booted.
        now = time.monotonic() - 1.0
        plugged.append(Plugged([SimulatedDrive(node, now=now) for node in nodes], count))
        return plugged[-1]

    yield plugs
    for each in plugged:
        each.unplug()


def test_entries_are_read_and_written_and_refused_with_their_codes(plug):
    computer = Computer(plug(*NODES).terminals.paths[0])
    assert computer.value(2, 0x1000) == 0x00020192
    assert computer.write(2, 0x607A, 0, -5) == 0
    assert computer.value(2, 0x607A) == -5
    assert computer.write(2, 0x605A, 0, 9) == 0x06090031
    # Nobody else sends what is asked for here.
    assert not computer.heard(Foreign)
    computer.bus.close()


def test_an_answer_after_300_ms_is_waited_for(plug):
    plugged = plug(1)
    plugged.drives[0].faults.answer_delay = 0.3
    computer = Computer(plugged.terminals.paths[0])
    assert computer.value(1, 0x6502) == 0xA0
    computer.bus.close()


def test_two_drives_with_one_number_and_two_computers_on_a_bus_are_noticed(plug):
    plugged = plug(1, 1, count=2)
    one, other = (Computer(path) for path in plugged.terminals.paths)
    one.value(1, 0x1000)
    wait_until(lambda: one.listens() and Foreign in map(type, one.events))
    assert {event.cob_id for event in one.heard(Foreign)} == {0x581}
    one.events.clear()
    other.bus.send_cycle([Command(1, 0, 0)])
    other.bus.send_heartbeat(5)
    wait_until(lambda: one.listens() and len(one.events) >= 3)
    assert [event.cob_id for event in one.heard(Foreign)] == [0x201, 0x80, 0x77F]
    for each in (one, other):
        each.bus.close()


def test_who_opens_an_adapter_hears_nothing_old(plug):
    paths = plug(1, count=2).terminals.paths
    one = Computer(paths[0])
    for _ in range(20):
        for _ in range(50):
            one.bus.send_cycle([Command(node, 0, 0) for node in NODES])
        one.value(1, 0x1000)
    other = Computer(paths[1])
    other.value(1, 0x1000)
    assert not other.events
    for each in (one, other):
        each.bus.close()


def test_an_unplugged_adapter_is_told_at_once_and_by_every_call(plug):
    plugged = plug(*NODES)
    computer = Computer(plugged.terminals.paths[0])
    transfers = [computer.bus.read(1, described(1)[0x1000, 0].entry) for _ in range(3)]
    plugged.unplug()
    for _ in range(2):
        with pytest.raises(BusError, match="/dev/pts/"):
            computer.bus.send_cycle([Command(1, 0, 0)])
            computer.bus.received()
    with pytest.raises(BusError):
        computer.bus.read(1, described(1)[0x1000, 0].entry)
    wait_until(lambda: all(transfer.is_done for transfer in transfers))
    assert all(transfer.error for transfer in transfers)
    computer.bus.close()


def test_an_adapter_that_refuses_or_takes_nothing_is_lost_and_sends_nothing_late():
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    bus = CanBus("slcan", os.ttyname(theirs), 1_000_000, NODES)
    assert bus.received() == []
    # Some of the commands that open it may be refused: it may be open already.
    os.write(ours, b"\a" * 5)
    assert bus.received() == []
    os.write(ours, b"\a")
    with pytest.raises(BusError, match="refuses"):
        wait_until(lambda: bus.received() is None)
    bus.close()
    os.set_blocking(ours, False)
    while True:
        try:
            os.read(ours, 65536)
        except BlockingIOError:
            break
    bus = CanBus("slcan", os.ttyname(theirs), 1_000_000, NODES)
    with pytest.raises(BusError, match="takes no frame"):
        for _ in range(10_000):
            bus.send_cycle([Command(node, ENABLE, 7) for node in NODES])
    came = [b""]

    def is_closed() -> bool:
        with suppress(BlockingIOError):
            came.append(os.read(ours, 1 << 20))
        return came[-1].endswith(b"C\r")

    wait_until(is_closed)
    # No more than what the kernel has given to the other end already.
    assert sum(map(len, came)) < 5000
    bus.close()
    for file in (ours, theirs):
        os.close(file)


@pytest.mark.parametrize(
    ("interface", "channel"), [("nonsense", "x"), ("slcan", "/dev/none"), ("socketcan", "none0")]
)
def test_a_bus_that_cannot_be_opened_is_named(interface: str, channel: str):
    with pytest.raises(BusError, match=f"{channel} cannot be opened: "):
        CanBus(interface, channel, 1_000_000, NODES)


def test_a_missing_module_is_answered_with_what_to_type(monkeypatch):
    monkeypatch.setitem(sys.modules, "canopen", None)
    with pytest.raises(BusError, match=r"pip install 'tri_glide_kinematics\[can\]'"):
        CanBus("slcan", "/dev/pts/0", 1_000_000, NODES)


def test_the_object_dictionary_is_read_as_canopen_reads_it():
    kinds = canopen.objectdictionary.datatypes
    theirs = canopen.import_od("config/simulated_drive.eds", node_id=3)
    for address, ours in described(3).items():
        variable = theirs.get_variable(*address)
        assert variable is not None
        assert (len(variable), variable.default) == (8 * ours.entry.size, ours.default)
        assert variable.data_type in kinds.INTEGER_TYPES
        assert (variable.data_type in kinds.SIGNED_TYPES) == ours.entry.is_signed


class Process:
    """The command, with what it says."""

    def __init__(self, *arguments: str):
        self.process = subprocess.Popen(
            [sys.executable, "-m", simulated_drives.__name__, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._pipe(self.process.stdout).readline().startswith("drives at")
        self.wait_for("drive 3: booted")

    @staticmethod
    def _pipe(pipe: IO[str] | None) -> IO[str]:
        assert pipe is not None
        return pipe

    def say(self, line: str) -> None:
        self._pipe(self.process.stdin).write(f"{line}\n")
        self._pipe(self.process.stdin).flush()

    def wait_for(self, words: str) -> None:
        assert any(words in line for line in self._pipe(self.process.stdout))

    def end(self, number: signal.Signals) -> int:
        self.process.send_signal(number)
        self.process.communicate(timeout=60)
        return self.process.returncode


@pytest.mark.nodes
def test_between_processes_no_frame_is_lost_and_a_lost_bus_comes_back(tmp_path: Path):
    link = tmp_path / "can"
    drives = Process("--link", str(link), "--heights", "0.5", "0.6", "0.7", "--noise", "1")
    try:
        computer = Computer(str(link))
        computer.set_up()
        for number in range(1, CYCLES + 1):
            computer.bus.send_cycle([Command(node, ENABLE, 0) for node in NODES])
            computer.bus.send_heartbeat(5)
            awaited = 3 * number
            wait_until(lambda: computer.listens() and len(computer.heard(Status)) >= awaited)  # noqa: B023
        assert [event.node for event in computer.heard(Status)] == [*NODES] * CYCLES
        drives.say("2 nonsense")
        drives.wait_for("must be the node of a drive and one of")
        drives.say("2 fault 0x7500")
        drives.wait_for("drive 2: FAULT")
        wait_until(lambda: computer.listens() and bool(computer.heard(Emergency)))
        assert [(event.node, event.code) for event in computer.heard(Emergency)] == [(2, 0x7500)]
        # It is gone, with its link to it, and another one comes.
        assert drives.end(signal.SIGKILL)
        with pytest.raises(BusError):
            wait_until(lambda: computer.listens() and False)
        drives = Process("--link", str(link), "--fault", "3 absent 6007")

        def is_back() -> bool:
            try:
                return computer.listens()
            except BusError:
                return False

        computer.events.clear()
        wait_until(is_back)
        assert computer.write(3, 0x6007, 0, 3) == 0x06020000
        assert not computer.heard(Status)
        computer.bus.close()
    finally:
        assert drives.end(signal.SIGINT) == 0
    assert not link.is_symlink()


def test_faults_are_typed_as_they_are_called():
    drive = SimulatedDrive(2)
    for line in (
        "vendor_bits 0xC000",
        "read_only 60C2:1",
        "answer_delay 0.3",
        "switch never",
        "rounded 6085 9",
    ):
        simulated_drives.make_wrong({2: drive}, f"2 {line}")
    assert drive.faults.vendor_bits == 0xC000
    assert drive.faults.read_only == {(0x60C2, 1)}
    assert drive.faults.answer_delay == 0.3
    assert drive.faults.rounded == {(0x6085, 0): 9}
    assert drive.axis.slider.switch.value == "never"
    for line in ("", "2", "1 reset", "2 fault", "2 fault much", "2 switch", "two reset"):
        with pytest.raises(ValueError, match="must be the node of a drive"):
            simulated_drives.make_wrong({2: drive}, line)
    simulated_drives.make_wrong({2: drive}, "2 fault 0x7500")
    assert drive.axis.state is DriveState.FAULT
