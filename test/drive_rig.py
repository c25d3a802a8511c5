"""Simulated drives on a bus in virtual time, led by hand: by no code that is to be tested."""

from collections.abc import Sequence

from testing.simulated_bus import SimulatedBus
from tri_glide_kinematics.drives import (
    Command,
    Event,
    SimulatedDrive,
    Slider,
    Status,
    Transfer,
    described,
)

PERIOD = 0.002
START, PRE_OPERATIONAL, RESET = 1, 128, 129
SHUT_DOWN, SWITCH_ON, ENABLE, QUICK_STOP = 0x06, 0x07, 0x0F, 0x02

# How the drives are set up here: addresses and values, in this order.
SETTINGS: list[tuple[int, int, int]] = [
    (0x1400, 1, 0x80000200),
    (0x1600, 0, 0),
    (0x1600, 1, 0x60400010),
    (0x1600, 2, 0x607A0020),
    (0x1600, 0, 2),
    (0x1400, 2, 1),
    (0x1400, 1, 0x200),
    (0x1800, 1, 0x80000180),
    (0x1A00, 0, 0),
    (0x1A00, 1, 0x60410010),
    (0x1A00, 2, 0x60640020),
    (0x1A00, 0, 2),
    (0x1800, 2, 1),
    (0x1800, 1, 0x40000180),
    (0x60C2, 1, 2),
    (0x6060, 0, 8),
    (0x1016, 1, 127 << 16 | 20),
    (0x1017, 0, 100),
    (0x6007, 0, 3),
    (0x605A, 0, 6),
    (0x6065, 0, 20_000),
]


class Rig:
    """Drives with the numbers 1, 2 and so on, and the time."""

    def __init__(self, positions: Sequence[float] = (300_000.0,), slider: Slider | None = None):
        self.drives = [
            SimulatedDrive(number, slider or Slider(), position)
            for number, position in enumerate(positions, 1)
        ]
        self.bus = SimulatedBus(self.drives)
        self.drive = self.drives[0]
        self.events: list[Event] = []
        self.statuses: dict[int, Status] = {}
        self.beats = True
        self.pass_time(0.1)

    def pass_time(self, duration: float) -> None:
        for _ in range(round(duration / PERIOD)):
            self.bus.advance(self.bus.now + PERIOD)
            if self.beats and not round(self.bus.now / PERIOD) % 5:
                self.bus.send_heartbeat(5)
            self._listen()

    def _listen(self) -> None:
        for event in self.bus.received():
            self.events.append(event)
            if isinstance(event, Status):
                self.statuses[event.node] = event

    def done(self, transfer: Transfer) -> Transfer:
        for _ in range(1000):
            if transfer.is_done:
                return transfer
            self.pass_time(PERIOD)
        raise AssertionError("the transfer does not end")

    def write(self, index: int, subindex: int, value: int, node: int = 1) -> Transfer:
        entry = described(node)[index, subindex].entry
        return self.done(self.bus.write(node, entry, value))

    def read(self, index: int, subindex: int = 0, node: int = 1) -> Transfer:
        return self.done(self.bus.read(node, described(node)[index, subindex].entry))

    def set_up(self) -> None:
        for drive in self.drives:
            for index, subindex, value in SETTINGS:
                cob_id = drive.node if index in (0x1400, 0x1800) and subindex == 1 else 0
                transfer = self.write(index, subindex, value + cob_id, drive.node)
                assert not transfer.error, (hex(index), subindex, transfer.error)
        self.bus.send_state(0, START)

    def cycle(self, word: int, *positions: int) -> Status:
        """Send all drives a control word and a position, and let a period pass."""
        self.pass_time(PERIOD)
        self.bus.send_cycle(
            [Command(drive.node, word, each) for drive, each in zip(self.drives, positions)]
        )
        self._listen()
        return self.statuses[1]

    def enable(self) -> None:
        """Enable operation where the sliders are."""
        self.cycle(0, *[0] * len(self.drives))
        for word in (SHUT_DOWN, SWITCH_ON, ENABLE, ENABLE):
            here = [self.statuses[drive.node].position for drive in self.drives]
            self.cycle(word, *here)
