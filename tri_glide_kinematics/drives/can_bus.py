"""Drives on CAN, by python-can and canopen: the only module that knows them.

Frames are sent and read in the calls alone. Each drive has a thread that waits for answers to SDOs:
what it sends is taken along by the next call. So whoever does not call any more is silent.
"""

from __future__ import annotations

import logging
import os
import termios
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import Any, TypeVar

from tri_glide_kinematics.drives.bus import (
    BusError,
    Command,
    Entry,
    Event,
    Foreign,
    Transfer,
)
from tri_glide_kinematics.drives.frames import (
    CobId,
    Frame,
    LineReader,
    cycle_frames,
    encoded,
    event_of,
)

MISSING = (
    "canopen and python-can are missing: pip install 'tri_glide_kinematics[can]', or install "
    "canopen and python-can[serial]"
)

# How long an answer of a drive is waited for, and after what time a lost bus is tried again [s].
PATIENCE = 1.0
RETRY = 1.0
# What opens a serial adapter is five commands, which it may refuse where it is open already.
MOST_REFUSALS = 5
# In an error frame of python-can: the controller is off the bus.
BUS_OFF = 0x40
# First byte of an SDO that ends a transfer.
ABORT = 0x80

Result = TypeVar("Result")


class _Adapter:
    """Any interface of python-can."""

    def __init__(self, bus: Any) -> None:
        self._bus = bus

    def send(self, frames: Sequence[Frame]) -> None:
        from can import Message

        for cob_id, data in frames:
            message = Message(arbitration_id=cob_id, data=data, is_extended_id=False)
            self._bus.send(message, timeout=0)

    def read(self) -> list[Frame]:
        found: list[Frame] = []
        while (message := self._bus.recv(0)) is not None:
            if message.is_error_frame and message.arbitration_id & BUS_OFF:
                raise OSError("the controller is off the bus")
            if not (message.is_error_frame or message.is_extended_id or message.is_remote_frame):
                found.append((message.arbitration_id, bytes(message.data)))
        return found

    def forget(self) -> None:
        """Forget what has not left this computer, where that can be done."""

    def close(self) -> None:
        self._bus.shutdown()


class _SerialAdapter(_Adapter):
    """The interface slcan: python-can would wait for the line, and take a call for each byte."""

    def __init__(self, bus: Any) -> None:
        import can

        super().__init__(bus)
        # Else it would write to the line when nobody needs it any more, and wait for that.
        can.BusABC.shutdown(bus)
        self._file = bus.fileno()
        self._reader = LineReader()
        # Nothing to read is told apart from a line that is gone.
        settings = termios.tcgetattr(self._file)
        settings[6][termios.VMIN] = 1
        termios.tcsetattr(self._file, termios.TCSANOW, settings)

    def send(self, frames: Sequence[Frame]) -> None:
        text = encoded(frames)
        if os.write(self._file, text) < len(text):
            raise OSError("the adapter takes no frame any more")

    def read(self) -> list[Frame]:
        try:
            data = os.read(self._file, 65536)
        except BlockingIOError:
            return []
        if not data:
            raise OSError("the adapter is gone")
        frames = self._reader.frames(data)
        if self._reader.refusals > MOST_REFUSALS:
            raise OSError("the adapter refuses frames")
        return frames

    def forget(self) -> None:
        with suppress(termios.error):
            termios.tcflush(self._file, termios.TCOFLUSH)

    def close(self) -> None:
        with suppress(OSError):
            os.write(self._file, b"C\r")
        self._bus.serialPortOrig.close()


class CanBus:
    """Drives on a CAN bus; it implements ``Bus``. Its times are those of ``time.monotonic``."""

    def __init__(
        self,
        interface: str,
        channel: str,
        bitrate: int,
        nodes: Sequence[int],
        own: int = 127,
    ) -> None:
        """Open the bus.

        Args:
            interface: of python-can, for example ``socketcan`` or ``slcan``.
            channel: of this interface, for example ``can0`` or ``/dev/ttyACM0``.
            bitrate: of the bus [bit/s].
            nodes: of the drives.
            own: node of this computer.

        Raises:
            BusError: if it cannot be opened, or what is needed for it is not installed.
        """
        try:
            import can
            import canopen
        except ImportError as error:
            raise BusError(MISSING) from error
        # What fails is told by this class.
        for name in ("can", "canopen"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self._errors = (can.CanError, OSError)
        self._abort = canopen.SdoAbortedError
        self._interface, self._channel, self._bitrate = interface, channel, bitrate
        self._nodes = nodes
        self._own = own
        self._adapter: _Adapter | None = None
        self._tried_at = -inf
        # Why the bus was lost, and how often.
        self._lost = ""
        self._losses = 0
        # What the threads have to send.
        self._requests: deque[Frame] = deque()
        # Nodes from which an answer to an SDO is to come.
        self._asked: set[int] = set()
        network: Any = canopen.Network()
        network.bus = self
        self._network = network
        self._workers = {}
        for node in nodes:
            remote = self._network.add_node(node, canopen.ObjectDictionary())
            remote.sdo.RESPONSE_TIMEOUT = PATIENCE
            self._workers[node] = ThreadPoolExecutor(1)
        self._opened()

    def send(self, message: Any) -> None:
        """Keep a message of canopen until the next call; called in any thread."""
        self._requests.append((message.arbitration_id, bytes(message.data)))

    def read(self, node: int, entry: Entry) -> Transfer:
        """Begin to read an entry."""
        return self._begin(node, Transfer(entry), writes=False)

    def write(self, node: int, entry: Entry, value: int) -> Transfer:
        """Begin to write an entry."""
        return self._begin(node, Transfer(entry, value), writes=True)

    def send_state(self, node: int, command: int) -> None:
        """Send a command of NMT."""
        self._send([(CobId.NMT, bytes([command, node]))])

    def send_heartbeat(self, state: int) -> None:
        """Send the heartbeat of this computer."""
        self._send([(CobId.HEARTBEAT + self._own, bytes([state]))])

    def send_cycle(self, commands: Sequence[Command]) -> None:
        """Send all commands and SYNC."""
        self._send(cycle_frames(commands))

    def received(self) -> list[Event]:
        """Return what has come in."""
        frames = self._tried(lambda adapter: adapter.read())
        now = time.monotonic()
        events: list[Event] = []
        for frame in frames:
            node = frame[0] - CobId.ANSWER
            if node not in self._nodes:
                event = event_of(frame, now, self._nodes, self._own)
                events += [event] if event is not None else []
            elif node in self._asked:
                self._asked.discard(node)
                self._network.notify(*frame, now)
            else:
                events.append(Foreign(now, frame[0]))
        self._send([])
        return events

    def close(self) -> None:
        """Let go of the bus."""
        for worker in self._workers.values():
            worker.shutdown(wait=False, cancel_futures=True)
        self._drop("the bus is closed")
        self._tried_at = inf

    def _begin(self, node: int, transfer: Transfer, *, writes: bool) -> Transfer:
        self._tried(lambda adapter: None)
        self._workers[node].submit(self._carry_out, node, transfer, writes, self._losses)
        return transfer

    def _carry_out(self, node: int, transfer: Transfer, writes: bool, losses: int) -> None:
        """Read or write an entry; called in the thread of a drive."""
        sdo, entry = self._network[node].sdo, transfer.entry
        try:
            if losses != self._losses:
                raise BusError(self._lost)
            if writes:
                sdo.download(entry.index, entry.subindex, entry.data(transfer.value))
            else:
                transfer.value = entry.number(sdo.upload(entry.index, entry.subindex))
        except self._abort as error:
            transfer.error, transfer.abort_code = str(error), error.code
        except Exception as error:
            # Nobody else would see it in this thread.
            transfer.error = str(error) or type(error).__name__
        transfer.is_done = True

    def _send(self, frames: list[Frame]) -> None:
        """Send frames, and behind them what the threads have to send."""
        while self._requests:
            cob_id, data = self._requests.popleft()
            if data[0] != ABORT:
                self._asked.add(cob_id - CobId.REQUEST)
            frames.append((cob_id, data))
        if frames:
            self._tried(lambda adapter: adapter.send(frames))

    def _tried(self, action: Callable[[_Adapter], Result]) -> Result:
        """Return what an ``action`` returns; open the bus before it where it was lost."""
        adapter = self._adapter or self._opened()
        try:
            return action(adapter)
        except self._errors as error:
            adapter.forget()
            self._drop(f"{self._channel}: {error}")
            raise BusError(self._lost) from error

    def _drop(self, reason: str) -> None:
        """Forget the bus, and all that was to be sent."""
        self._lost = reason
        self._losses += 1
        adapter, self._adapter = self._adapter, None
        if adapter is not None:
            with suppress(*self._errors):
                adapter.close()

    def _opened(self) -> _Adapter:
        """Open the bus, if the last time that this was tried is long ago."""
        import can

        if time.monotonic() < self._tried_at + RETRY:
            raise BusError(self._lost)
        options: dict[str, Any] = {}
        if self._interface == "slcan":
            options["timeout"] = 0
            # An adapter may start anew when it is opened; a pseudo-terminal does not.
            is_pseudo = Path(self._channel).resolve().is_relative_to("/dev/pts")
            if is_pseudo or self._tried_at > -inf:
                options["sleep_after_open"] = 0
        self._tried_at = time.monotonic()
        try:
            options |= {"bitrate": self._bitrate, "ignore_config": True}
            bus = can.Bus(self._channel, self._interface, **options)
        except Exception as error:
            self._lost = f"{self._channel} cannot be opened: {error}"
            raise BusError(self._lost) from error
        self._requests.clear()
        self._asked.clear()
        self._adapter = _SerialAdapter(bus) if self._interface == "slcan" else _Adapter(bus)
        return self._adapter
