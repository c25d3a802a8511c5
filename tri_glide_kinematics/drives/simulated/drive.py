"""A simulated servo drive by CiA 402 on CANopen: it is told the time, and frames of a bus.

It has the object dictionary of ``config/simulated_drive.eds``; PDOs as written there, for SYNC;
SDO, NMT, heartbeats in both directions, EMCY; and faults on request.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil, inf

from tri_glide_kinematics.drives.bus import BOOTING, OPERATIONAL, PRE_OPERATIONAL, STOPPED
from tri_glide_kinematics.drives.frames import CobId, Frame
from tri_glide_kinematics.drives.simulated.axis import HEARTBEAT_LOST, SimulatedAxis, Slider
from tri_glide_kinematics.drives.simulated.dictionary import Abort, AbortError, Address, described

# A step of the simulation is no longer than this [s].
LONGEST_STEP = 0.001
# From power or a reset to the boot-up message [s].
BOOT_TIME = 0.05

RPDOS, TPDO = (0x1400, 0x1401), 0x1800
MAPPING = 0x200
INVALID = 1 << 31


@dataclass
class DriveFaults:
    """What is wrong with a drive; it may change at any time.

    Attributes:
        read_only: entries that cannot be written.
        absent: entries that are not there.
        rounded: entries of which only multiples of a number are stored.
        abort_at: number of the write that is aborted, counted from 1; 0 for none.
        answer_delay: how long an answer to an SDO takes [s].
        lost_statuses: so many of the next TPDOs get lost.
        is_mute: sends no heartbeat any more.
        vendor_bits: bits of the status word that are set besides.
    """

    read_only: set[Address] = field(default_factory=set)
    absent: set[Address] = field(default_factory=set)
    rounded: dict[Address, int] = field(default_factory=dict)
    abort_at: int = 0
    answer_delay: float = 0.0
    lost_statuses: int = 0
    is_mute: bool = False
    vendor_bits: int = 0


class SimulatedDrive:
    """A drive with its slider.

    Attributes:
        node: its number on the bus.
        faults: what is wrong with it.
        axis: its state and its motion; a new one after a reset.
        objects: values of its object dictionary; new ones after a reset.
        network_state: of NMT; 0 while it boots.
        history: what has happened: times [s], and texts for people.
    """

    def __init__(
        self, node: int, slider: Slider | None = None, position: float = 0.0, now: float = 0.0
    ) -> None:
        """Have power from ``now`` [s] on.

        Args:
            node: its number on the bus, 1 to 127.
            slider: that it moves.
            position: of the slider, in counts.
            now: time of now [s].
        """
        self.node = node
        self.faults = DriveFaults()
        self.history: deque[tuple[float, str]] = deque(maxlen=1000)
        self._described = described(node)
        self._now = now
        self._writes = 0
        self._out: list[tuple[float, Frame]] = []
        self._start(slider or Slider(), position)

    def _start(self, slider: Slider, position: float) -> None:
        self.objects = {address: each.default for address, each in self._described.items()}
        self.axis = SimulatedAxis(self.objects, slider, position)
        self.network_state = BOOTING
        self._boots_at = self._now + BOOT_TIME
        self._beats_at = inf
        # When the heartbeat of the computer is missed.
        self._missed_at = inf
        # Data of RPDOs that wait for SYNC, by the object of their parameters.
        self._waiting: dict[int, bytes] = {}
        self._syncs = 0
        self._told = self.axis.state

    @property
    def answers(self) -> bool:
        """Whether it answers to an SDO."""
        return self.network_state not in (BOOTING, STOPPED)

    def reboot(self) -> None:
        """Lose all settings, and where the slider is."""
        self.history.append((self._now, "reset"))
        self._start(self.axis.slider, self.axis.position)

    def advance(self, now: float) -> list[Frame]:
        """Go on to ``now`` [s].

        Returns:
            What the drive has sent meanwhile.
        """
        count = max(ceil((now - self._now) / LONGEST_STEP - 1e-6), 1)
        dt = (now - self._now) / count
        for left in reversed(range(count if dt > 0.0 else 0)):
            self._now = now - left * dt
            self.axis.step(dt)
            self._live()
            self._tell()
        due = [frame for time, frame in self._out if time <= now]
        self._out = [each for each in self._out if each[0] > now]
        return due

    def receive(self, frame: Frame) -> None:
        """Take in a frame, at the time to which it has been advanced."""
        cob_id, data = frame
        if self.network_state == BOOTING:
            return
        consumed = self.objects[0x1016, 1]
        if cob_id == CobId.NMT and len(data) == 2 and data[1] in (0, self.node):
            self._change_network_state(data[0])
        elif cob_id == CobId.REQUEST + self.node and self.answers:
            self._serve(data.ljust(8, b"\0"))
        elif consumed & 0xFFFF and cob_id == CobId.HEARTBEAT + (consumed >> 16 & 0x7F):
            self._missed_at = self._now + 0.001 * (consumed & 0xFFFF)
        elif self.network_state == OPERATIONAL:
            if cob_id == self.objects[0x1005, 0] & 0x7FF:
                self._synchronize()
            for pdo in RPDOS:
                parameter = self.objects[pdo, 1]
                if cob_id == parameter & 0x7FF and not parameter & INVALID:
                    self._waiting[pdo] = data

    def read(self, index: int, subindex: int) -> bytes:
        """Return an entry, as an SDO does.

        Raises:
            AbortError: if it is not there.
        """
        address = self._there(index, subindex)
        self._refresh()
        return self._described[address].entry.data(self.objects[address])

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an entry, as an SDO does.

        Raises:
            AbortError: if it is refused.
        """
        address = self._there(index, subindex)
        self._writes += 1
        if self._writes == self.faults.abort_at:
            raise AbortError(Abort.GENERAL)
        if address in self.faults.read_only:
            raise AbortError(Abort.READ_ONLY)
        described = self._described[address]
        if len(data) != described.entry.size:
            raise AbortError(Abort.WRONG_LENGTH)
        number = described.entry.number(data)
        described.check(number)
        if 0x1400 <= index < 0x1C00:
            self._check_mapping(index, subindex, number)
        step = self.faults.rounded.get(address, 1)
        self._set(address, number // step * step)
        if address == (0x1017, 0):
            self._beats_at = self._now if number else inf

    def _refresh(self) -> None:
        self.axis.refresh()
        self.objects[0x6041, 0] |= self.faults.vendor_bits

    def _there(self, index: int, subindex: int) -> Address:
        address = index, subindex
        if address not in self._described or address in self.faults.absent:
            raise AbortError(Abort.ABSENT)
        return address

    def _check_mapping(self, index: int, subindex: int, number: int) -> None:
        """Check a write to the parameters of a PDO: it has to be switched off for most of them."""
        if self.network_state != PRE_OPERATIONAL:
            raise AbortError(Abort.NOT_NOW)
        if not index & MAPPING:
            return
        if not self.objects[index - MAPPING, 1] & INVALID or (subindex and self.objects[index, 0]):
            raise AbortError(Abort.NOT_NOW)
        if subindex:
            mapped = self._described.get((number >> 16, number >> 8 & 0xFF))
            if mapped is None or not mapped.is_mappable or 8 * mapped.entry.size != number & 0xFF:
                raise AbortError(Abort.NOT_MAPPABLE)

    def _set(self, address: Address, number: int) -> None:
        self.objects[address] = number
        if address == (0x6040, 0):
            self.axis.command(number)

    def _mapped(self, pdo: int) -> Iterator[Address]:
        for number in range(self.objects[pdo + MAPPING, 0]):
            mapped = self.objects[pdo + MAPPING, number + 1]
            yield mapped >> 16, mapped >> 8 & 0xFF

    def _take(self, pdo: int) -> None:
        """Carry out an RPDO."""
        data, at = self._waiting.pop(pdo), 0
        # The control word last: what it enables finds the target that came with it.
        values = []
        for address in self._mapped(pdo):
            entry = self._described[address].entry
            values.append((address, entry.number(data[at:])))
            at += entry.size
        for address, number in sorted(values, reverse=True):
            self._set(address, number)

    def _synchronize(self) -> None:
        """Carry out what came before this SYNC, and answer it."""
        for pdo in tuple(self._waiting):
            self._take(pdo)
        self.axis.latch()
        self._syncs += 1
        every = self.objects[TPDO, 2]
        if 1 <= every <= 240 and self._syncs % every == 0:
            self._send_status()

    def _send_status(self) -> None:
        parameter = self.objects[TPDO, 1]
        if parameter & INVALID:
            return
        if self.faults.lost_statuses > 0:
            self.faults.lost_statuses -= 1
            return
        self._refresh()
        parts = (
            self._described[each].entry.data(self.objects[each]) for each in self._mapped(TPDO)
        )
        self._send(parameter & 0x7FF, b"".join(parts))

    def _send(self, cob_id: int, data: bytes, delay: float = 0.0) -> None:
        self._out.append((self._now + delay, (cob_id, data)))

    def _serve(self, request: bytes) -> None:
        """Answer an SDO; all entries are short enough for an expedited one."""
        command, address = request[0], request[1:4]
        index, subindex = int.from_bytes(address[:2], "little"), address[2]
        kind = command >> 5
        try:
            if kind == 2:
                data = self.read(index, subindex)
                answer = bytes([0x43 | 4 - len(data) << 2]) + address + data.ljust(4, b"\0")
            elif kind == 1 and command & 2:
                size = 4 - (command >> 2 & 3) if command & 1 else 4
                self.write(index, subindex, request[4 : 4 + size])
                answer = b"\x60" + address + bytes(4)
            elif kind == 4:
                return
            else:
                raise AbortError(Abort.UNKNOWN_COMMAND)
        except AbortError as error:
            answer = b"\x80" + address + error.code.to_bytes(4, "little")
        self._send(CobId.ANSWER + self.node, answer, self.faults.answer_delay)

    def _change_network_state(self, command: int) -> None:
        state = {1: OPERATIONAL, 2: STOPPED, 128: PRE_OPERATIONAL}.get(command)
        if command in (129, 130):
            self.reboot()
        elif state is not None:
            if state == STOPPED != self.network_state:
                self.axis.lose_connection()
            self.network_state = state

    def _live(self) -> None:
        """Boot, send heartbeats, and miss those of the computer."""
        if self.network_state == BOOTING:
            if self._now >= self._boots_at:
                self.network_state = PRE_OPERATIONAL
                self.history.append((self._now, "booted"))
                self._send(CobId.HEARTBEAT + self.node, b"\0")
            return
        if self._now >= self._beats_at:
            self._beats_at += 0.001 * self.objects[0x1017, 0]
            if not self.faults.is_mute:
                self._send(CobId.HEARTBEAT + self.node, bytes([self.network_state]))
        if self._now >= self._missed_at:
            self._missed_at = inf
            self.history.append((self._now, "heartbeat lost"))
            if self.objects[0x6007, 0] != 1:
                self.axis.tell(HEARTBEAT_LOST)
            self.axis.lose_connection()
            if self.network_state == OPERATIONAL and self.objects[0x1029, 1] != 1:
                stops = self.objects[0x1029, 1] == 2
                self.network_state = STOPPED if stops else PRE_OPERATIONAL

    def _tell(self) -> None:
        """Tell errors and a new state."""
        for code in self.axis.errors:
            data = code.to_bytes(2, "little") + bytes([self.objects[0x1001, 0]]) + bytes(5)
            self._send(CobId.EMERGENCY + self.node, data)
            self.history.append((self._now, f"EMCY 0x{code:04X}"))
        self.axis.errors.clear()
        if self.axis.state != self._told:
            self._told = self.axis.state
            self.history.append((self._now, self.axis.state.text))
