"""One of the three drives: what it has told, and entries of it that are read and written."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator

from tri_glide_kinematics.drives.bus import (
    Bus,
    Emergency,
    Entry,
    Event,
    Foreign,
    Heartbeat,
    Status,
    Transfer,
)
from tri_glide_kinematics.drives.cia402 import DriveError, DriveState, state_of
from tri_glide_kinematics.drives.group_settings import DriveSettings, GroupSettings

# So often a transfer is tried that is not answered.
ATTEMPTS = 3

# Noise of the encoder is averaged over so many positions.
AVERAGED = 32

# More answers than SYNCs, by so many: late ones leave no such surplus, a second drive does.
SURPLUS = 20

BOOT_UP, OPERATIONAL, PRE_OPERATIONAL, START = 0, 5, 127, 1
PREPARE = 128

Steps = Generator[None, None, None]


class Axis:
    """A drive as it is known from the bus.

    Attributes:
        number: of the axis, from 1.
        settings: of the drive.
        state: by its newest status word; None before the first one or where it tells none.
        status_word: the newest.
        positions: the newest ones, in counts; the newest is the last.
        network_state: by its newest heartbeat; None before the first one.
        emergency: code of its newest EMCY.
        is_homed: whether its counts tell the height.
        mark: number in it that is gone if it has been without power; 0 for none.
        has_restarted: whether it has told its start.
        per_metre: counts for each metre.
        was_lost: whether it may have been without power and nobody has heard of it.
    """

    def __init__(self, number: int, bus: Bus, settings: DriveSettings) -> None:
        """Know nothing yet."""
        self.number = number
        self.settings = settings
        self.is_homed = False
        self.mark = 0
        self.was_lost = False
        self.per_metre = float(settings.units.per_metre)
        self._bus = bus
        self.forget()

    def forget(self) -> None:
        """Forget what the drive has told: it will be set up."""
        self.state: DriveState | None = None
        self.status_word = 0
        self.positions: deque[int] = deque(maxlen=AVERAGED)
        self.network_state: int | None = None
        self.emergency = 0
        self._has_alarm = False
        self.has_restarted = False
        self._beat_at = 0.0
        self._missed = self._surplus = 0
        self._error_code: Transfer | None = None

    @property
    def name(self) -> str:
        """What people call it."""
        return f"axis {self.number} (node {self.settings.node})"

    @property
    def text(self) -> str:
        """What it is, for people, with the codes of its errors."""
        texts = [self.state.value if self.state else "not heard"]
        code = self._error_code
        if code is not None:
            told = f"0x{code.value:04X}" if code.is_done and not code.error else "not read"
            texts.append(f"error code (0x603F) {told}")
        if self.emergency or code is not None:
            texts.append(f"EMCY 0x{self.emergency:04X}" if self.emergency else "no EMCY")
        return f"{self.name}: " + ", ".join(texts)

    @property
    def is_up(self) -> bool:
        """Whether it answers to SYNC."""
        return self.state is not None and self.network_state in (None, OPERATIONAL)

    @property
    def is_averaged(self) -> bool:
        """Whether there are positions enough for ``mean_position``."""
        return len(self.positions) == AVERAGED

    @property
    def mean_position(self) -> int:
        """Mean of its newest positions, in counts."""
        return round(sum(self.positions) / len(self.positions))

    @property
    def newest_step(self) -> float:
        """Way from the position before the newest one [m]."""
        newest, before = self.positions[-1], self.positions[-min(2, len(self.positions))]
        return self.settings.units.direction * (newest - before) / self.per_metre

    def height_of(self, count: int) -> float:
        """Return the height of the slider, if it is homed [m]."""
        return self.settings.units.height_of(count, self.settings.home_height)

    def count_of(self, height: float) -> int:
        """Return the count at a height; at the ends of the travel it is that of the end."""
        low, high = self.settings.ends
        return self.settings.units.counts_of(min(max(height, low), high), self.settings.home_height)

    def rate_of(self, velocity: float) -> int:
        """Return a velocity [m/s] in counts/s."""
        return round(self.settings.units.direction * velocity * self.per_metre)

    def forget_emergency(self) -> None:
        """Take no EMCY of before for a new one."""
        self.emergency, self._has_alarm = 0, False

    def take(self, events: list[Event], expects_answer: bool) -> None:
        """Take in what has come in since the last SYNC, if a SYNC was sent (``expects_answer``)."""
        answers = 0
        for event in events:
            if isinstance(event, Foreign) or event.node != self.settings.node:
                continue
            if isinstance(event, Status):
                answers += 1
                self.status_word = event.status_word
                self.state = state_of(event.status_word)
                self.positions.append(event.position)
            elif isinstance(event, Emergency):
                self.emergency = event.code or self.emergency
                self._has_alarm = self._has_alarm or event.code != 0
            elif isinstance(event, Heartbeat):
                self.network_state = event.state
                self._beat_at = event.time
                if event.state == BOOT_UP:
                    self.has_restarted, self.is_homed = True, False
        self._missed = 0 if answers or not expects_answer else self._missed + 1
        # Answers that come late come all at once.
        self._surplus = max(-SURPLUS, self._surplus + answers - 1)

    def trouble(self, now: float, settings: GroupSettings, is_enabled: bool) -> str:
        """Return what is wrong with it, or nothing; ``is_enabled``: it ought to have torque."""
        silence = now - self._beat_at
        if self.has_restarted:
            return "has started anew"
        if self.network_state is not None and silence > settings.consumer_time:
            self.was_lost = True
            return f"tells no heartbeat for {silence:.3f} s"
        if self.network_state not in (None, OPERATIONAL):
            return f"has left the network state OPERATIONAL ({self.network_state})"
        if self._missed >= settings.lost_in_a_row:
            self.was_lost = True
            return f"has not answered {self._missed} SYNCs in a row"
        if self._surplus > SURPLUS:
            return "answers a SYNC twice: two drives have this node id, or two PDOs a COB-ID"
        if self.state in (DriveState.FAULT, DriveState.FAULT_REACTION):
            return "has a fault"
        if self._has_alarm:
            return "tells an error"
        if is_enabled and self.state is not DriveState.OPERATION_ENABLED:
            return "has left OPERATION ENABLED"
        return ""

    def ask_error_code(self) -> None:
        """Begin to read object 0x603F, which ``text`` tells."""
        self._error_code = self._bus.read(self.settings.node, Entry(0x603F, 0, 2))

    def send_state(self, command: int) -> None:
        """Send it a command of NMT."""
        self._bus.send_state(self.settings.node, command)

    def read(self, entry: Entry) -> Generator[None, None, Transfer]:
        """Read an entry, going on once in each cycle."""
        return self._done(lambda: self._bus.read(self.settings.node, entry))

    def write(self, entry: Entry, value: int) -> Generator[None, None, Transfer]:
        """Write an entry, going on once in each cycle."""
        return self._done(lambda: self._bus.write(self.settings.node, entry, value))

    def error(self, text: str) -> DriveError:
        """Return an error of this axis."""
        return DriveError(f"{self.name} {text}", self.number)

    def _done(self, begin: Callable[[], Transfer]) -> Generator[None, None, Transfer]:
        for _ in range(ATTEMPTS):
            transfer = begin()
            while not transfer.is_done:
                yield
            if not transfer.error or transfer.abort_code:
                break
        return transfer
