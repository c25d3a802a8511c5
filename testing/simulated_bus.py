"""A bus of simulated drives in virtual time, in one process."""

from collections import deque
from collections.abc import Callable, Sequence

from tri_glide_kinematics.drives import (
    AbortError,
    BusError,
    CobId,
    Command,
    Entry,
    Event,
    Frame,
    SimulatedDrive,
    Transfer,
    cycle_frames,
    event_of,
)

# How long an answer of a drive is waited for [s].
PATIENCE = 1.0


class SimulatedBus:
    """Drives, and the computer that leads them: ``advance`` lets the time go on.

    Attributes:
        drives: on the bus.
        now: time of now [s].
        transfer_time: how long a transfer takes at least [s].
        is_lost: tells of each frame whether it gets lost on its way to the drives or from them.
        is_off: the bus is off, or the adapter is gone: each call raises ``BusError``.
        sent: frames in the order in which they were sent, with their times [s].
    """

    def __init__(self, drives: Sequence[SimulatedDrive], now: float = 0.0, own: int = 127) -> None:
        """Begin at ``now`` [s]; ``own`` is the node of the computer."""
        self.drives = drives
        self.now = now
        self.transfer_time = 0.001
        self.is_lost: Callable[[Frame], bool] = lambda frame: False
        self.is_off = False
        self.sent: deque[tuple[float, Frame]] = deque(maxlen=100_000)
        self._own = own
        self._came: list[Event] = []
        # Transfers of each drive, and when the first of them is done at the earliest.
        self._transfers: dict[int, deque[tuple[Transfer, bool]]] = {}
        self._begun: dict[int, float] = {}

    def advance(self, now: float) -> None:
        """Let the drives go on to ``now`` [s]."""
        self.now = now
        for drive in self.drives:
            for frame in drive.advance(now):
                self.hear(frame)
            self._transfer(drive)

    def hear(self, frame: Frame) -> None:
        """Let the computer receive a frame, which somebody else has sent."""
        nodes = [drive.node for drive in self.drives]
        event = event_of(frame, self.now, nodes, self._own)
        if event is not None and not self.is_off and not self.is_lost(frame):
            self._came.append(event)

    def read(self, node: int, entry: Entry) -> Transfer:
        """Begin to read an entry."""
        return self._begin(node, Transfer(entry), writes=False)

    def write(self, node: int, entry: Entry, value: int) -> Transfer:
        """Begin to write an entry."""
        return self._begin(node, Transfer(entry, value), writes=True)

    def send_state(self, node: int, command: int) -> None:
        """Send a command of NMT."""
        self._send((CobId.NMT, bytes([command, node])))

    def send_heartbeat(self, state: int) -> None:
        """Send the heartbeat of the computer."""
        self._send((CobId.HEARTBEAT + self._own, bytes([state])))

    def send_cycle(self, commands: Sequence[Command]) -> None:
        """Send all commands and SYNC."""
        for frame in cycle_frames(commands):
            self._send(frame)

    def received(self) -> list[Event]:
        """Return what has come in."""
        self._check()
        came, self._came = self._came, []
        return came

    def close(self) -> None:
        """Do nothing: it holds nothing."""

    def _check(self) -> None:
        if self.is_off:
            raise BusError("the bus is off")

    def _send(self, frame: Frame) -> None:
        self._check()
        self.sent.append((self.now, frame))
        if not self.is_lost(frame):
            for drive in self.drives:
                drive.receive(frame)
        self.advance(self.now)

    def _begin(self, node: int, transfer: Transfer, *, writes: bool) -> Transfer:
        self._check()
        waiting = self._transfers.setdefault(node, deque())
        waiting.append((transfer, writes))
        if len(waiting) == 1:
            self._begun[node] = self.now
        return transfer

    def _transfer(self, drive: SimulatedDrive) -> None:
        waiting = self._transfers.get(drive.node)
        if not waiting:
            return
        transfer, writes = waiting[0]
        entry = transfer.entry
        time = self.now - self._begun[drive.node]
        is_lost = self.is_off or self.is_lost((CobId.ANSWER + drive.node, b""))
        is_silent = is_lost or not drive.answers
        delay = max(self.transfer_time, drive.faults.answer_delay)
        if time < (PATIENCE if is_silent else delay):
            return
        try:
            if is_silent or delay > PATIENCE:
                transfer.error = f"no answer within {PATIENCE:g} s"
            elif writes:
                drive.write(entry.index, entry.subindex, entry.data(transfer.value))
            else:
                transfer.value = entry.number(drive.read(entry.index, entry.subindex))
        except AbortError as error:
            transfer.error, transfer.abort_code = str(error), error.code
        transfer.is_done = True
        waiting.popleft()
        self._begun[drive.node] = self.now
