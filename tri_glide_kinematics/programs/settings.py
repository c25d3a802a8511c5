"""What a program does not say: its dialect, and the offsets, tools and places of a machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from tri_glide_kinematics.checks import finite_vector, member, non_negative, positive
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.files import SETTINGS, find_file
from tri_glide_kinematics.keys import FileError
from tri_glide_kinematics.motion.path import LARGEST_PLACE, LARGEST_SPEED, LEAST_SPEED
from tri_glide_kinematics.vectors import Vector3, scaled

MINUTE = 60.0  # s
MILLIMETRE = 1e-3  # m


class Dialect(Enum):
    """Whose words a program is written in (docs/programs.md)."""

    NIST = "nist"
    MARLIN = "marlin"
    REPRAP = "reprap"
    KLIPPER = "klipper"
    DELTA_X = "delta_x"
    GRBL = "grbl"


class Customs(NamedTuple):
    """What a dialect means where the dialects differ.

    Attributes:
        dwell_unit: of the P of G4 [s].
        feed_time: F is a length per this time [s].
        first_feed: speed before the first F; 0 for none [m/s].
        rapid_at_feed: whether G0 moves at F, as G1 does.
        homes_whole: whether G28 takes all axes home, whichever are named, and ends G92.
        resets_without_axes: whether G92 without an axis means all three, at 0.
        turns_given: turns of an arc that P counts besides the last, not whole one: P less this.
            None if P has no meaning there.
        restores_at_61: whether G61 goes back to a stored place, which is not understood.
        extrudes: whether an E right behind a number is a word.
        told: commands that do not concern the motion.
        told_letters: letters beside G0 to G3 that do not, either.
        names: commands of several letters that do not, either, by their begins.
    """

    dwell_unit: float
    feed_time: float
    first_feed: float
    rapid_at_feed: bool
    homes_whole: bool
    resets_without_axes: bool
    turns_given: int | None
    restores_at_61: bool
    extrudes: bool
    told: frozenset[str]
    told_letters: str = "E"
    names: tuple[str, ...] = ()


def _codes(letter: str, *numbers: int | range) -> frozenset[str]:
    each = (number if isinstance(number, range) else (number,) for number in numbers)
    return frozenset(f"{letter}{number}" for some in each for number in some)


def _parts(command: str, most: int) -> frozenset[str]:
    return frozenset(f"{command}.{part}" for part in range(1, most + 1))


# Temperatures, filament, motors on and off, files, messages; limits that the machine has itself.
_PRINTING = (
    _codes("M", 17, 18, range(20, 23), 27, 31, 73, range(75, 79), range(80, 86), 104, 105)
    | _codes("M", *(108, 109, 110, 111, 113, 114, 115, 116, 117, 118, 119, 120, 121, 140, 141))
    | _codes("M", *(143, 144, 150, 155, 190, 191, 200, 201, 203, 204, 205, 207, 208, 209, 211))
    | _codes("M", *(221, 300, 301, 302, 303, 304, 400, range(403, 408), 412, 413, 486, 500, 503))
    | _codes("M", *(504, 555, range(566, 569), 572, 593, 702, 703, 862, 900, 906, 907))
    | _codes("M", *(910, 911, 912, 913, 914, 915))
    | _parts("M862", 6)
    | _codes("G", 10, 11)
)
# In RepRapFirmware these restore a state (as of G90 and F), and bound the axes.
_NOT_OF_REPRAP = _codes("M", 120, 121, 208)

_EXTENDED = (
    *("EXCLUDE_OBJECT_", "SET_VELOCITY_LIMIT", "SET_PRESSURE_ADVANCE", "SET_RETRACTION"),
    *("SET_HEATER_TEMPERATURE", "TEMPERATURE_WAIT", "TURN_OFF_HEATERS", "SET_FAN_SPEED"),
    *("SET_PRINT_STATS_INFO", "TIMELAPSE_", "BED_MESH_CLEAR", "RESPOND", "SET_DISPLAY_TEXT"),
)

CUSTOMS: Mapping[Dialect, Customs] = MappingProxyType(
    {
        Dialect.NIST: Customs(
            *(1.0, MINUTE, 0.0, False, False, False, 1, False, False, frozenset())
        ),
        Dialect.MARLIN: Customs(
            *(MILLIMETRE, MINUTE, 25.0 * MILLIMETRE, True, True, False, 0, True, True),
            _PRINTING | _codes("M", 420),
        ),
        Dialect.REPRAP: Customs(
            *(MILLIMETRE, MINUTE, 50.0 * MILLIMETRE, True, True, True, None, False, True),
            _PRINTING - _NOT_OF_REPRAP,
        ),
        Dialect.KLIPPER: Customs(
            *(MILLIMETRE, MINUTE, 25.0 * MILLIMETRE, True, True, True, None, False, True),
            _PRINTING,
            names=_EXTENDED,
        ),
        Dialect.GRBL: Customs(
            *(1.0, MINUTE, 0.0, False, False, False, None, False, False, frozenset()),
            names=("$",),
        ),
        Dialect.DELTA_X: Customs(
            *(MILLIMETRE, 1.0, 0.0, True, True, False, None, False, False),
            _codes("M", 17, 18, 84, 203, 204, 205, 210, 211),
            told_letters="AESJ",
        ),
    }
)

# Told commands that concern the motion with some words: with these letters (G10), or with one of
# them that is not 0: a lift of Z with each retraction, the map of a bed.
CONCERNING = MappingProxyType({"G10": "LXYZ", "M207": "Z", "M420": "S"})

# They switch the motors off, but for an S, which is a time, or E, an extruder.
MOTORS_OFF = _codes("M", 18, 81, 84)

# Commands whose line is a text, even if they are not understood.
TEXTS = _codes("M", 16, 23, 28, 32, 36, 98, 117, 118, 486)

WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
# An offset or a place that nothing names [m].
NOWHERE: Vector3 = (0.0, 0.0, 0.0)


class SettingsError(FileError):
    """A file of settings cannot be read, or something in it has no meaning."""


@dataclass(frozen=True)
class ProgramSettings:
    """What a program does not say itself; all places are of the platform.

    Attributes:
        dialect: that it is written in; None for the one that it shows (``guess_dialect``).
        start: where the platform is when it begins; where G28 leads, if none is named [m].
        home: where G28 leads; None if there is no such place [m].
        offsets: where the zero of G54 and the others is; that of the machine if not named [m].
        tools: offset of each tool by its number, which G43 adds [m].
        tolerance: largest deviation from the path where the program names none [m].
        feed: speed before the first F; None for that of the dialect [m/s].
        block_delete: whether lines that begin with a slash are left out.
        optional_stop: whether M1 stops.
        ignored: commands, such as ``M104``, that do not concern the motion.
    """

    dialect: Dialect | None = None
    start: Vector3 | None = None
    home: Vector3 | None = None
    offsets: Mapping[str, Vector3] = field(default_factory=dict)
    tools: Mapping[int, Vector3] = field(default_factory=dict)
    tolerance: float = 5e-5
    feed: float | None = None
    block_delete: bool = True
    optional_stop: bool = True
    ignored: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        """Check them.

        Raises:
            KinematicsError: if a number is none or out of bounds, or an offset has no such name.
        """
        if self.dialect is not None:
            member("dialect", self.dialect, Dialect)
        places = {"start": self.start, "home": self.home, **self.offsets}
        places |= {f"tool {number}": offset for number, offset in self.tools.items()}
        for name, place in places.items():
            if place is not None:
                for number in finite_vector(name, place, 3):
                    if abs(number) > LARGEST_PLACE:
                        bound = f"within {LARGEST_PLACE:g}"
                        raise OutOfBoundsError(name, number, bound, "m", LARGEST_PLACE)
        for name in self.offsets:
            if name not in WORK_OFFSETS:
                raise KinematicsError(f"offset {name} must be one of {', '.join(WORK_OFFSETS)}")
        for number in self.tools:
            if not isinstance(number, int) or isinstance(number, bool) or number < 1:
                raise KinematicsError(f"tool {number!r} must be a whole number, at least 1")
        if non_negative("tolerance", self.tolerance, "m") > LARGEST_PLACE:
            raise OutOfBoundsError("tolerance", self.tolerance, f"at most {LARGEST_PLACE:g}", "m")
        if (
            self.feed is not None
            and positive("feed", self.feed, "m/s", LARGEST_SPEED) < LEAST_SPEED
        ):
            raise OutOfBoundsError("feed", self.feed, f"at least {LEAST_SPEED:g}", "m/s")

    @property
    def begin(self) -> Vector3:
        """Where the platform is when the program begins [m]."""
        return self.start or self.home or NOWHERE


def load_settings(file: str | Path, others: ProgramSettings | None = None) -> ProgramSettings:
    """Read settings from a YAML file.

    Its lengths are in the unit that it names. If it names none, they are in mm if it names a
    dialect whose programs are in mm, else in m.

    Args:
        file: to be read.
        others: that hold where the file names nothing; None for those by default.

    Raises:
        SettingsError: if it cannot be read, or something in it has no meaning.
    """
    keys = SettingsError.keys_of(file)
    plain = others or ProgramSettings()
    name = keys.choice("dialect", [dialect.value for dialect in Dialect], "")
    dialect = Dialect(name) if name else plain.dialect
    unit = keys.unit("mm" if name and dialect is not Dialect.NIST else "m")

    def places(key: str, plainly: Mapping[Any, Vector3]) -> dict[Any, Vector3]:
        values = keys.value(key, {})
        named = keys.within(key, values)
        return {**plainly, **{name: scaled(named.vector(name), unit) for name in values}}

    def place(key: str, plainly: Vector3 | None) -> Vector3 | None:
        return scaled(keys.vector(key), unit) if keys.has(key) else plainly

    def length(key: str, plainly: float | None) -> float | None:
        return unit * keys.number(key, least=0.0) if keys.has(key) else plainly

    try:
        settings = ProgramSettings(
            dialect,
            place("start", plain.start),
            place("home", plain.home),
            places("offsets", plain.offsets),
            places("tools", plain.tools),
            length("tolerance", plain.tolerance) or 0.0,
            length("feed", plain.feed) or None,
            keys.switch("block_delete", plain.block_delete),
            keys.switch("optional_stop", plain.optional_stop),
            frozenset(each.upper() for each in keys.texts("ignored", sorted(plain.ignored))),
        )
    except SettingsError:
        raise
    except KinematicsError as error:
        raise keys.error(str(error)) from error
    keys.finish()
    return settings


def load_own_settings(file: str | Path) -> ProgramSettings:
    """Read settings; where the ``file`` names nothing, those that come with this package hold.

    Raises:
        SettingsError: if one of them cannot be read, or something in it has no meaning.
    """
    return load_settings(find_file(Path(file)), load_settings(find_file(Path(SETTINGS))))
