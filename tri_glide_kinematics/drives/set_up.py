"""What is set in a drive before it may have torque; each entry is read back."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from fractions import Fraction

from tri_glide_kinematics.drives.axis import Axis
from tri_glide_kinematics.drives.bus import Entry
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
PDOS = 4

# Command of NMT to be pre-operational.
PREPARE = 128

# Profile velocity: no mode that is used needs it, and a drive without power forgets it.
MARK = Entry(0x6081, 0, 4)


class Need(Enum):
    """What follows where a drive has not an entry."""

    REFUSED = auto()
    TOLD = auto()
    NOTHING = auto()
    # Only a step towards other entries, which are read back.
    STEP = auto()


@dataclass(frozen=True)
class Setting:
    """A value for an entry.

    Attributes:
        entry: that is written and read back.
        value: for it.
        name: for people.
        need: what follows where it is absent.
        kept: bits that stay as they are in the drive.
    """

    entry: Entry
    value: int
    name: str
    need: Need = Need.TOLD
    kept: int = 0


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


def travel(drive: DriveSettings, is_homed: bool) -> Iterable[Setting]:
    """Return the limits of the software: before homing their numbers would mean nothing."""
    ends = drive.travel if is_homed else (-(1 << 31), (1 << 31) - 1)
    for subindex, (end, name) in enumerate(zip(ends, ("smallest", "largest")), 1):
        yield Setting(Entry(0x607D, subindex, 4, True), end, f"{name} position")


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
        if setting.need is Need.REFUSED:
            raise axis.error(f"lacks {named}, without which it may not come to rest by itself")
        return f"lacks {named}" if setting.need is Need.TOLD else ""
    why = f" ({written.error})" if written.error else ""
    if found.error:
        raise axis.error(f"does not tell {named}: {found.error}; {value} was asked for{why}")
    if found.value != value:
        raise axis.error(f"has {found.value} for {named}, {value} was asked for{why}")
    return ""


def _settings(axis: Axis, power: int) -> Iterable[Setting]:
    """Return all settings in their order; ``power`` of ten of the period as it is in the drive."""
    refused, nothing = Need.REFUSED, Need.NOTHING
    drive, group = axis.settings, axis.group
    node, period = drive.node, group.exact_period
    milliseconds = int(1000 * group.consumer_time)
    yield Setting(Entry(0x1005, 0, 4), 0x80, "COB-ID of SYNC, not sent", nothing, kept=INVALID)
    yield Setting(Entry(0x1014, 0, 4), 0x80 + node, "COB-ID of EMCY", nothing)
    yield Setting(
        Entry(0x1016, 1, 4), group.own_node << 16 | milliseconds, "heartbeat consumer", refused
    )
    yield Setting(Entry(0x1017, 0, 2), milliseconds // 3, "heartbeat producer")
    # Who has lost the computer shall not take targets from it when it comes back.
    yield Setting(Entry(0x1029, 1, 1), 0, "pre-operational after a communication error")
    yield Setting(Entry(0x1006, 0, 4), int(period * 10**6), "communication cycle period")
    yield from _pdo(0x1400, 0x200 + node, (0x60400010, 0x607A0020))
    yield from _pdo(0x1800, 0x180 + node, (0x60410010, 0x60640020))
    if group.sends_velocity:
        yield from _pdo(0x1401, 0x300 + node, (0x60B10020,))
    for number in range(1, PDOS):
        if number > 1 or not group.sends_velocity:
            yield _unused(0x1400 + number)
        yield _unused(0x1800 + number)
    yield from (
        Setting(Entry(index, 0, 2, True), value, name, need)
        for index, value, name, need in (
            (0x6007, 3, "quick stop where the connection is lost", refused),
            (0x605A, 6, "quick stop that holds", refused),
            (0x605B, 1, "shutdown brakes", Need.TOLD),
            (0x605C, 1, "disable operation brakes", Need.TOLD),
            (0x605E, 2, "fault reaction is a quick stop", Need.TOLD),
        )
    )
    # The power of ten that the drive has is kept where it can tell the period.
    for exponent in (power, -3, -4):
        time = period * Fraction(10) ** -exponent
        if time.denominator == 1 and 1 <= time <= 255:
            break
    yield Setting(Entry(0x60C2, 1, 1), int(time), "interpolation time")
    yield Setting(Entry(0x60C2, 2, 1, True), exponent, "power of ten of the interpolation time")
    rates = (
        (0x6084, 0, drive.brake, "profile deceleration"),
        (0x6085, 0, drive.brake, "quick stop deceleration"),
        (0x6099, 1, group.homing_speed, "homing speed"),
        (0x6099, 2, group.homing_slow_speed, "homing speed at the switch"),
        (0x609A, 0, group.homing_acceleration, "homing acceleration"),
    )
    for index, subindex, rate, name in rates:
        yield Setting(Entry(index, subindex, 4), drive.units.rate_of(rate), name)
    yield Setting(Entry(0x6098, 0, 1, True), drive.method, "homing method")
    yield Setting(Entry(0x607C, 0, 4, True), 0, "home offset")
    yield from travel(drive, axis.is_homed)
    if drive.largest_torque is not None:
        yield Setting(Entry(0x6072, 0, 2), drive.largest_torque, "largest torque")
    if drive.largest_error is not None:
        error = drive.units.rate_of(drive.largest_error)
        yield Setting(Entry(0x6065, 0, 4), error, "following error window")


def _pdo(parameters: int, cob_id: int, mapped: Sequence[int]) -> Iterable[Setting]:
    """Return what has a PDO carry ``mapped`` objects, for each SYNC."""
    mapping = parameters + 0x200
    used, count = Entry(parameters, 1, 4), Entry(mapping, 0, 1)
    yield Setting(used, cob_id | INVALID, "off", Need.STEP, kept=NO_REMOTE)
    yield Setting(count, 0, "empty", Need.STEP)
    for subindex, what in enumerate(mapped, 1):
        yield Setting(Entry(mapping, subindex, 4), what, "mapped object", Need.REFUSED)
    yield Setting(count, len(mapped), "number of mapped objects", Need.REFUSED)
    yield Setting(Entry(parameters, 2, 1), 1, "transmission type", Need.REFUSED)
    yield Setting(used, cob_id, "COB-ID", Need.REFUSED, kept=NO_REMOTE)


def _unused(parameters: int) -> Setting:
    """Return what switches a PDO off, whose COB-ID another one might have."""
    name = "COB-ID of an unused PDO"
    return Setting(Entry(parameters, 1, 4), INVALID, name, Need.NOTHING, kept=INVALID - 1)
