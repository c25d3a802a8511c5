"""The seam between what leads the drives and a bus: nothing behind it is known here.

Times are seconds of one steady clock. A node is the number of a drive on the bus.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeAlias

from tri_glide_kinematics.errors import KinematicsError

# States of NMT, as heartbeats tell them, and commands to change them (CiA 301).
BOOTING, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0, 4, 5, 127
START, PREPARE = 1, 128


class BusError(KinematicsError):
    """The bus carries nothing any more: it is off, its adapter is gone or takes no frame."""


@dataclass(frozen=True)
class Entry:
    """An entry of the object dictionary of a drive.

    Attributes:
        index: of the object.
        subindex: in the object.
        size: in bytes: 1, 2 or 4.
        is_signed: whether its number has a sign.
    """

    index: int
    subindex: int
    size: int
    is_signed: bool = False

    def number(self, data: bytes) -> int:
        """Return the number that ``data`` of its size are."""
        return int.from_bytes(data[: self.size], "little", signed=self.is_signed)

    def data(self, number: int) -> bytes:
        """Return the bytes of a ``number``; what is too large for them begins anew."""
        return (number % (1 << 8 * self.size)).to_bytes(self.size, "little")


@dataclass
class Transfer:
    """An entry that is read or written in the background: ask it in each cycle.

    Attributes:
        entry: of the object dictionary.
        value: what was read; what was written, of a write.
        is_done: whether the drive has answered, or the answer will not come any more.
        error: why it failed, empty where it did not.
        abort_code: what the drive has refused it with (CiA 301); 0 if it has not.
    """

    entry: Entry
    value: int = 0
    is_done: bool = False
    error: str = ""
    abort_code: int = 0


class Command(NamedTuple):
    """What one drive is sent in a cycle.

    Attributes:
        node: the drive.
        control_word: object 0x6040.
        position: object 0x607A, in the drive's units.
        velocity: object 0x60B1, in the drive's units; None where it is not sent.
    """

    node: int
    control_word: int
    position: int
    velocity: int | None = None


@dataclass(frozen=True)
class Status:
    """What a drive has told in answer to a SYNC: objects 0x6041 and 0x6064, received at a time."""

    node: int
    time: float
    status_word: int
    position: int


@dataclass(frozen=True)
class Emergency:
    """An EMCY message; its code is 0 where an error has gone."""

    node: int
    time: float
    code: int


@dataclass(frozen=True)
class Heartbeat:
    """State of NMT that a drive tells; of BOOTING only that it has ended."""

    node: int
    time: float
    state: int


@dataclass(frozen=True)
class Foreign:
    """Somebody else sends what only one may send: SYNC, or what belongs to this computer.

    Or two drives with the same number answer one question: 0x580 and the number.
    """

    time: float
    cob_id: int


Event: TypeAlias = Status | Emergency | Heartbeat | Foreign


class Bus(Protocol):
    """A bus with drives. Every call but ``close`` may raise ``BusError``; none waits."""

    def read(self, node: int, entry: Entry) -> Transfer:
        """Begin to read an entry. Transfers of a drive are carried out one after the other."""

    def write(self, node: int, entry: Entry, value: int) -> Transfer:
        """Begin to write an entry."""

    def send_state(self, node: int, command: int) -> None:
        """Send a command of NMT: 1 start, 2 stop, 128 pre-operational, 129 reset; node 0 is all."""

    def send_heartbeat(self, state: int) -> None:
        """Tell the drives that this computer is alive, in a state of NMT."""

    def send_cycle(self, commands: Sequence[Command]) -> None:
        """Send all commands, and behind them one SYNC."""

    def received(self) -> list[Event]:
        """Return what has come in since the last call, the oldest first."""

    def close(self) -> None:
        """Let go of the bus."""
