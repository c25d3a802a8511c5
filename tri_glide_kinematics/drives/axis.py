"""One of the three drives: what it has told, and entries of it that are read and written."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator

from tri_glide_kinematics.drives.bus import (
    BOOTING,
    OPERATIONAL,
    Bus,
    Emergency,
    Entry,
    Event,
    Heartbeat,
    Status,
    Transfer,
)
from tri_glide_kinematics.drives.cia402 import ERROR_CODE, FAULTS, DriveError, DriveState, state_of
from tri_glide_kinematics.drives.group_settings import LARGEST_COUNT, GroupSettings

# A drive that leaves out so many answers to SYNC, while another one answers, is lost.
LOST_IN_A_ROW = 5

# So often a transfer is tried that is not answered.
ATTEMPTS = 3

# Noise of the encoder is averaged over so many positions.
AVERAGED = 32

# More answers than SYNCs, by so many, come of a second drive; those of so many SYNCs may be late.
SURPLUS, LATE = 20, 500

Steps = Generator[None, None, None]


class Axis:
    """A drive as it is known from the bus.

    Attributes:
        number: of the axis, from 1.
        group: settings of all drives.
        settings: of this one.
        per_metre: counts for each metre.
        state: by its newest status word; None before the first one or where it tells none.
        status_word: the newest.
        position: the newest, in counts.
        positions: the newest ones that are averaged, the newest at last.
        velocity: from one SYNC to the next [m/s].
        fastest: largest of these that came at once, without a sign [m/s].
        target: what it is told, in counts; None for where it is.
        rate: velocity that it is told, in counts/s.
        network_state: by its newest heartbeat; None before the first one.
        answered_at: time of its newest answer to SYNC [s].
        has_restarted: whether it has told its start.
        is_homed: whether its counts tell the height.
        mark: number in it that is gone if it has been without power; 0 for none.
        was_lost: whether it may have been without power and nobody has heard of it.
    """

    def __init__(self, number: int, bus: Bus, group: GroupSettings) -> None:
        """Know nothing yet."""
        self.number = number
        self.group = group
        self.settings = group.drives[number - 1]
        self.per_metre = float(self.settings.units.per_metre)
        self.is_homed = self.was_lost = False
        self.mark = 0
        self._bus = bus
        self.forget()

    def forget(self) -> None:
        """Forget what the drive has told: it will be set up."""
        self.state: DriveState | None = None
        self.status_word = 0
        self.position, self.velocity, self.fastest = 0, 0.0, 0.0
        self.target: int | None = None
        self.rate = 0
        self.positions: deque[int] = deque(maxlen=AVERAGED)
        self.network_state: int | None = None
        self.has_restarted = False
        self._error_code: Transfer | None = None
        self.answered_at = 0.0
        # Times of the newest heartbeat and status.
        self._beat_at = self._measured_at = 0.0
        self._surplus = 0
        self.forget_emergency()

    def forget_emergency(self) -> None:
        """Take no EMCY of before for a new one."""
        self._emergency, self._has_alarm = 0, False

    @property
    def name(self) -> str:
        """What people call it."""
        return f"axis {self.number} (node {self.settings.node})"

    @property
    def text(self) -> str:
        """What it is, for people, with the codes of its errors."""
        text = f"{self.name}: {self.state.text if self.state is not None else 'not heard'}"
        code = self._error_code
        if code is not None:
            told = f"0x{code.value:04X}" if code.is_done and not code.error else "not read"
            text += f", error code (0x603F) {told}"
        if self._emergency or code is not None:
            text += f", EMCY 0x{self._emergency:04X}" if self._emergency else ", no EMCY"
        return text

    @property
    def is_up(self) -> bool:
        """Whether it answers to SYNC."""
        return self.state is not None and self.network_state in (None, OPERATIONAL)

    def height_of(self, count: int) -> float:
        """Return the height of the slider, if it is homed [m]."""
        return self.settings.units.height_of(count, self.settings.home_height)

    def count_of(self, height: float) -> int:
        """Return the count at a height; beyond the ends of the travel it is that of the end."""
        low, high = self.settings.ends
        return self.settings.units.counts_of(min(max(height, low), high), self.settings.home_height)

    def rate_of(self, velocity: float) -> int:
        """Return a velocity [m/s] in counts/s, as far as the drive has numbers for it."""
        rate = round(self.settings.units.direction * velocity * self.per_metre)
        return min(max(rate, -LARGEST_COUNT), LARGEST_COUNT)

    def take(self, events: list[Event], now: float, is_cycling: bool) -> None:
        """Take in what has come; with ``is_cycling``, a SYNC was sent since the last call."""
        answers, self.fastest = 0, 0.0
        for event in events:
            if getattr(event, "node", 0) != self.settings.node:
                continue
            if isinstance(event, Status):
                answers += 1
                self._measure(event)
            elif isinstance(event, Emergency):
                self._emergency = event.code or self._emergency
                self._has_alarm |= event.code != 0
            elif isinstance(event, Heartbeat):
                self.network_state, self._beat_at = event.state, event.time
                if event.state == BOOTING:
                    self.has_restarted, self.is_homed = True, False
        if answers or not is_cycling:
            self.answered_at = now
        self._surplus = max(-LATE, self._surplus + answers - is_cycling)

    def _measure(self, status: Status) -> None:
        self.status_word, self.state = status.status_word, state_of(status.status_word)
        # In between, some may have been lost.
        periods = max(1, round((status.time - self._measured_at) / self.group.period))
        way = self.settings.units.direction * (status.position - self.position)
        self.velocity = way / (self.per_metre * periods * self.group.period)
        self.fastest = max(self.fastest, abs(self.velocity))
        self.position = status.position
        self.positions.append(status.position)
        self._measured_at = status.time

    def trouble(self, now: float, heard_at: float, is_enabled: bool) -> str:
        """Return what is wrong with it, or nothing.

        Args:
            now: time of now [s].
            heard_at: time of the newest answer to SYNC of any drive: so the one that is lost is
                told at once from a computer or an adapter that was busy [s].
            is_enabled: whether it ought to have torque.
        """
        group = self.group
        if self.has_restarted:
            return "has started anew"
        is_mute = self.network_state is not None and now - self._beat_at > group.consumer_time
        silent = now - self.answered_at
        missed = round((heard_at - self.answered_at) / group.period)
        if is_mute or silent > group.consumer_time or missed >= LOST_IN_A_ROW:
            self.was_lost = True
            times = round(silent / group.period)
            return "tells no heartbeat" if is_mute else f"has not answered SYNC {times} times"
        if self.network_state not in (None, OPERATIONAL):
            return f"has left the network state OPERATIONAL for {self.network_state}"
        if self._surplus > SURPLUS:
            return "answers a SYNC twice: two drives have this node id, or two PDOs a COB-ID"
        if self.state in FAULTS:
            return "has a fault"
        if self._has_alarm:
            return "tells an error"
        if is_enabled and self.state is not DriveState.OPERATION_ENABLED:
            return "has left OPERATION ENABLED"
        return ""

    def ask_error_code(self) -> None:
        """Begin to read object 0x603F, which ``text`` tells."""
        self._error_code = self._bus.read(self.settings.node, ERROR_CODE)

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
