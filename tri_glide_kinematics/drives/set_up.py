"""What is set in a drive before it may have torque; each entry is read back."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from enum import Enum, auto

from tri_glide_kinematics.drives.axis import Axis
from tri_glide_kinematics.drives.bus import PREPARE, Entry
from tri_glide_kinematics.drives.cia402 import (
    CONTROL_WORD,
    QUICK_STOP,
    STATUS_WORD,
    DriveState,
    state_of,
)
from tri_glide_kinematics.drives.group_settings import DriveSettings

# An object or a subindex that the drive has not (CiA 301).
ABSENT = (0x06020000, 0x06090011)

# Of a COB-ID: the PDO is not used; it is not asked for by remote frames, as a drive likes.
INVALID = 1 << 31
NO_REMOTE = 1 << 30

# Profile velocity: no mode that is used needs it, and a drive without power forgets it.
MARK = Entry(0x6081, 0, 4)


class Need(Enum):
    """What follows where a drive lacks an entry.

    Attributes:
        REST: it is refused, as it might not come to rest.
        TOLD: a remark.
        NOTHING: nothing.
        STEP: nothing, and it is not read back: other entries, which are, need it before them.
    """

    REST = auto()
    TOLD = auto()
    NOTHING = auto()
    STEP = auto()


_REST = Need.REST


@dataclass(frozen=True)
class Setting:
    """A value for an entry.

    Attributes:
        index: of the object.
        subindex: in the object.
        kind: size in bytes, negative where its number has a sign.
        value: for it.
        name: for people.
        need: what follows where it is absent.
        kept: bits that stay as they are in the drive.
    """

    index: int
    subindex: int
    kind: int
    value: int
    name: str
    need: Need = Need.TOLD
    kept: int = 0

    @property
    def entry(self) -> Entry:
        """What is written and read back."""
        return Entry(self.index, self.subindex, abs(self.kind), self.kind < 0)


def set_up(axis: Axis, mark: int) -> Generator[None, None, list[str]]:
    """Set up a drive, which does not move for it; it waits for one that is not there.

    Args:
        axis: with the drive.
        mark: number to tell later whether the drive has been without power.

    Returns:
        What is absent and can be lived with.

    Raises:
        DriveError: if the drive refuses or changes a value, or lacks an entry that rest depends on.
    """
    axis.forget()
    while True:
        axis.send_state(PREPARE)
        status = yield from axis.read(STATUS_WORD)
        if not status.error or status.abort_code:
            break
    if state_of(status.value) is DriveState.OPERATION_ENABLED:
        # Somebody has left it so.
        yield from axis.write(CONTROL_WORD, QUICK_STOP)
    found = yield from axis.read(MARK)
    if axis.was_lost and (found.error or found.value != axis.mark):
        axis.is_homed = False
    axis.mark, axis.was_lost = mark, False
    yield from axis.write(MARK, mark)
    power = yield from axis.read(Entry(0x60C2, 2, 1, is_signed=True))
    return (yield from apply(axis, _settings(axis, power.value)))


def travel(drive: DriveSettings, is_homed: bool) -> list[Setting]:
    """Return the limits of the software: before homing their numbers would mean nothing."""
    smallest, largest = drive.travel if is_homed else (-(1 << 31), (1 << 31) - 1)
    return [
        Setting(0x607D, 1, -4, smallest, "smallest position"),
        Setting(0x607D, 2, -4, largest, "largest position"),
    ]


def apply(axis: Axis, settings: Iterable[Setting]) -> Generator[None, None, list[str]]:
    """Write ``settings`` and read them back; returns and raises as ``set_up`` does."""
    remarks = []
    for setting in settings:
        remark = yield from _apply(axis, setting)
        if remark:
            remarks.append(f"{axis.name} {remark}")
    return remarks


def _apply(axis: Axis, setting: Setting) -> Generator[None, None, str]:
    entry, value = setting.entry, setting.value
    named = f"0x{entry.index:04X}:{entry.subindex:02X} ({setting.name})"
    if setting.kept:
        found = yield from axis.read(entry)
        value |= found.value & setting.kept if not found.error else 0
    written = yield from axis.write(entry, value)
    if setting.need is Need.STEP:
        return ""
    found = yield from axis.read(entry)
    if found.abort_code in ABSENT:
        if setting.need is _REST:
            raise axis.error(f"lacks {named}, without which it may not come to rest by itself")
        return f"lacks {named}" if setting.need is Need.TOLD else ""
    why = f" ({written.error})" if written.error else ""
    if found.error:
        raise axis.error(f"does not tell {named}: {found.error}; {value} was asked for{why}")
    if found.value != value:
        raise axis.error(f"has {found.value} for {named}, {value} was asked for{why}")
    return ""


def _settings(axis: Axis, power: int) -> list[Setting]:
    """Return all settings in their order; ``power`` of ten of the period as it is in the drive."""
    drive, group, rate_of = axis.settings, axis.group, axis.settings.units.rate_of
    node, period, milliseconds = drive.node, group.microseconds, int(1000 * group.consumer_time)
    # It is kept where it can tell the period.
    for exponent in (power, -3, -4):
        time = round(period * 10.0 ** (-6 - exponent))
        if 1 <= time <= 255 and time * 10.0 ** (6 + exponent) == period:
            break
    settings = [
        Setting(0x1005, 0, 4, 0x80, "COB-ID of SYNC, not sent", Need.NOTHING, INVALID),
        Setting(0x1014, 0, 4, 0x80 + node, "COB-ID of EMCY", Need.NOTHING),
        Setting(0x1016, 1, 4, group.own_node << 16 | milliseconds, "heartbeat consumer", _REST),
        Setting(0x1017, 0, 2, milliseconds // 3, "heartbeat producer"),
        # Who has lost the computer shall not take targets from it when it comes back.
        Setting(0x1029, 1, 1, 0, "pre-operational after a communication error"),
        Setting(0x1006, 0, 4, period, "communication cycle period"),
        *_pdo(0x1400, 0x200 + node, 0x60400010, 0x607A0020),
        *_pdo(0x1800, 0x180 + node, 0x60410010, 0x60640020),
        *(_pdo(0x1401, 0x300 + node, 0x60B10020) if group.sends_velocity else ()),
        # Others are switched off: they might have a COB-ID of these.
        *(
            Setting(pdo, 1, 4, INVALID, "COB-ID of an unused PDO", Need.NOTHING, INVALID - 1)
            for pdo in (0x1401, 0x1402, 0x1403, 0x1801, 0x1802, 0x1803)
            if pdo != 0x1401 or not group.sends_velocity
        ),
        Setting(0x6007, 0, -2, 3, "quick stop where the connection is lost", _REST),
        Setting(0x605A, 0, -2, 6, "quick stop that holds", _REST),
        Setting(0x605B, 0, -2, 1, "shutdown brakes"),
        Setting(0x605C, 0, -2, 1, "disable operation brakes"),
        Setting(0x605E, 0, -2, 2, "fault reaction is a quick stop"),
        Setting(0x60C2, 1, 1, time, "interpolation time"),
        Setting(0x60C2, 2, -1, exponent, "power of ten of the interpolation time"),
        Setting(0x6084, 0, 4, rate_of(drive.brake), "profile deceleration"),
        Setting(0x6085, 0, 4, rate_of(drive.brake), "quick stop deceleration"),
        Setting(0x6098, 0, -1, drive.method, "homing method"),
        Setting(0x6099, 1, 4, rate_of(group.homing_speed), "homing speed"),
        Setting(0x6099, 2, 4, rate_of(group.homing_slow_speed), "homing speed at the switch"),
        Setting(0x609A, 0, 4, rate_of(group.homing_acceleration), "homing acceleration"),
        Setting(0x607C, 0, -4, 0, "home offset"),
        *travel(drive, axis.is_homed),
    ]
    if drive.largest_torque is not None:
        settings.append(Setting(0x6072, 0, 2, drive.largest_torque, "largest torque"))
    if drive.largest_error is not None:
        window = rate_of(drive.largest_error)
        settings.append(Setting(0x6065, 0, 4, window, "following error window"))
    return settings


def _pdo(parameters: int, cob_id: int, *mapped: int) -> list[Setting]:
    """Return what has a PDO carry ``mapped`` objects, for each SYNC."""
    mapping = parameters + 0x200
    count = len(mapped)
    return [
        Setting(parameters, 1, 4, cob_id | INVALID, "off", Need.STEP, NO_REMOTE),
        Setting(mapping, 0, 1, 0, "empty", Need.STEP),
        *(Setting(mapping, i, 4, each, "mapped object", _REST) for i, each in enumerate(mapped, 1)),
        Setting(mapping, 0, 1, count, "number of mapped objects", _REST),
        Setting(parameters, 2, 1, 1, "transmission type", _REST),
        Setting(parameters, 1, 4, cob_id, "COB-ID", _REST, NO_REMOTE),
    ]
