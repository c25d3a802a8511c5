"""The second simulated drive, which knows only the standards, as a master sees it on the wire."""

import json
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

pytestmark = pytest.mark.nodes
CYCLE = 0.01
BOUND = 60.0  # s, for what takes a fraction of this


class Master:
    """Frames made by hand."""

    def __init__(self, link: Path, report: Path, process: subprocess.Popen[bytes]) -> None:
        self.report, self.process = report, process
        self.bus = can.Bus(
            interface="slcan", channel=str(link), bitrate=1_000_000, sleep_after_open=0.0
        )

    def send(self, identifier: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def wait_for(self, identifier: int, first: bytes = b"", bound: float = BOUND) -> bytes:
        end = time.monotonic() + bound
        while time.monotonic() < end:
            frame = self.bus.recv(0.1)
            if frame and frame.arbitration_id == identifier and frame.data.startswith(first):
                return bytes(frame.data)
        raise AssertionError(f"no frame 0x{identifier:X} {first.hex()} in {bound} s")

    def upload(self, index: int, sub: int = 0) -> int:
        place = struct.pack("<HB", index, sub)
        self.send(0x602, b"\x40" + place + bytes(4))
        answer = self.wait_for(0x582)
        assert answer[1:4] == place
        return int.from_bytes(answer[4:], "little")  # an abort code, too

    def download(self, index: int, sub: int, value: int, size: int) -> int:
        """Return the abort code, or 0."""
        head = struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub)
        self.send(0x602, head + (value & 0xFFFFFFFF).to_bytes(4, "little"))
        answer = self.wait_for(0x582)
        return int.from_bytes(answer[4:], "little") if answer[0] == 0x80 else 0

    def command(self, word: int, mask: int, status: int) -> None:
        assert self.download(0x6040, 0, word, 2) == 0
        end = time.monotonic() + BOUND
        while self.upload(0x6041) & mask != status:
            assert time.monotonic() < end, f"status {self.upload(0x6041):04X} after {word:04X}"


@pytest.fixture
def master(tmp_path: Path) -> Iterator[Master]:
    link, report = tmp_path / "can", tmp_path / "report"
    options = ["--link", str(link), "--report", str(report), "--nodes", "2"]
    with subprocess.Popen(
        [sys.executable, "-m", "testing.other_drive", *options], stdin=subprocess.PIPE
    ) as process:
        end = time.monotonic() + BOUND
        while not link.exists():
            assert process.poll() is None and time.monotonic() < end
            time.sleep(0.01)
        master = Master(link, report, process)
        yield master
        master.bus.shutdown()
        process.communicate(b"quit\n", timeout=BOUND)
        assert process.returncode == 0


def test_a_drive_is_enabled_and_follows_targets(master: Master) -> None:
    master.send(0, b"\x81\x00")
    assert master.wait_for(0x702) == b"\0"  # boot-up
    assert master.upload(0x6041) & 0x4F == 0x40  # switch on disabled
    assert master.upload(0x6042) == 0x06020000
    assert master.upload(0x60C2, 9) == 0x06090011
    assert master.download(0x6041, 0, 0, 2) == 0x06010002
    assert master.download(0x6040, 0, 0, 4) == 0x06070010
    assert master.download(0x6060, 0, 3, 1) == 0x06090030
    assert master.download(0x1600, 0, 0, 1) == 0x08000022  # the PDO is valid
    for index, sub, value, size in (
        (0x1400, 1, 0x80000202, 4),
        (0x1600, 0, 0, 1),
        (0x1600, 1, 0x60400010, 4),
        (0x1600, 2, 0x607A0020, 4),
        (0x1600, 0, 2, 1),
        (0x1400, 2, 1, 1),
        (0x1400, 1, 0x202, 4),
        (0x60C2, 1, 10, 1),
        (0x6060, 0, 8, 1),
    ):
        assert master.download(index, sub, value, size) == 0, f"{index:04X}:{sub}"
    master.send(0, b"\x01\x02")
    master.command(0x06, 0x6F, 0x21)
    master.command(0x07, 0x6F, 0x23)
    master.command(0x0F, 0x6F, 0x27)
    target = 0
    next_cycle = time.monotonic()
    for k in range(100):
        target += 500 * min(k, 99 - k)  # a triangle of speeds up to 0.24 m/s, over 0.12 m
        master.send(0x202, struct.pack("<Hi", 0x0F, target))
        master.send(0x80, b"")
        next_cycle += CYCLE
        time.sleep(max(next_cycle - time.monotonic(), 0.0))
    end = time.monotonic() + BOUND
    while abs(master.upload(0x6064) - target) > 10:
        assert time.monotonic() < end
    assert master.process.stdin
    master.process.stdin.write(b"fault 2 0x7305\n")
    master.process.stdin.flush()
    assert master.wait_for(0x82)[:3] == b"\x05\x73\x21"
    master.command(0x00, 0x4F, 0x08)
    master.command(0x80, 0x4F, 0x40)
    events = [json.loads(line) for line in master.report.open()]
    states = [event["state"] for event in events if event["event"] == "state"]
    assert states[-6:] == ["ready", "switched on", "enabled", "fault reaction", "fault", "disabled"]
    assert not [event for event in events if event["event"] == "targets"]
