"""Dialects of G-code: what they mean where they differ, and by what a program shows its own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

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
    """What a dialect means where the dialects differ; by default, as most mills do.

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

    dwell_unit: float = 1.0
    feed_time: float = MINUTE
    first_feed: float = 0.0
    rapid_at_feed: bool = False
    homes_whole: bool = False
    resets_without_axes: bool = False
    turns_given: int | None = None
    restores_at_61: bool = False
    extrudes: bool = False
    told: frozenset[str] = frozenset()
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

_PRINTER = Customs(
    dwell_unit=MILLIMETRE,
    first_feed=25.0 * MILLIMETRE,
    rapid_at_feed=True,
    homes_whole=True,
    extrudes=True,
    told=_PRINTING,
)

CUSTOMS: Mapping[Dialect, Customs] = MappingProxyType(
    {
        Dialect.NIST: Customs(turns_given=1),
        Dialect.MARLIN: _PRINTER._replace(
            turns_given=0, restores_at_61=True, told=_PRINTING | _codes("M", 420)
        ),
        Dialect.REPRAP: _PRINTER._replace(
            first_feed=50.0 * MILLIMETRE, resets_without_axes=True, told=_PRINTING - _NOT_OF_REPRAP
        ),
        Dialect.KLIPPER: _PRINTER._replace(resets_without_axes=True, names=_EXTENDED),
        Dialect.GRBL: Customs(names=("$",)),
        Dialect.DELTA_X: Customs(
            dwell_unit=MILLIMETRE,
            feed_time=1.0,
            rapid_at_feed=True,
            homes_whole=True,
            told=_codes("M", 17, 18, 84, 203, 204, 205, 210, 211),
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


# The dialect of a program by what only one dialect has: a generator's comment, or words.

# So much of a file is looked at: heads hold pictures, and some generators write how they were set
# into the last lines. Comments tell whom they are for in the first ones [bytes].
HEAD, TAIL, FIRST = 1 << 19, 1 << 16, 1 << 14

# What slicers call the firmware that they write for. Slic3r and those made of it say "reprap" for
# the older firmware that Marlin was made of; Cura says it for RepRapFirmware.
_FLAVORS = {
    "marlin": Dialect.MARLIN,
    "marlin2": Dialect.MARLIN,
    "marlin(volumetric)": Dialect.MARLIN,
    "reprap": Dialect.MARLIN,
    "repetier": Dialect.MARLIN,
    "klipper": Dialect.KLIPPER,
    "reprapfirmware": Dialect.REPRAP,
    "rrf": Dialect.REPRAP,
    "mach3": Dialect.NIST,
    "machinekit": Dialect.NIST,
    "no-extrusion": Dialect.NIST,
}
_FLAVOR_OF_CURA = {**_FLAVORS, "reprap": Dialect.REPRAP}
_LINE = rb"(?:\A|[\r\n])[ \t]*(?:N[0-9]+[ \t]*)?"
# A comment that says so in its first words: to look farther in a damaged file takes too long.
_COMMENT = rb"[;(][^\r\n]{0,100}"
# What Klipper alone obeys; slicers write it also where they are told to write for Marlin.
_NAMES = "|".join(CUSTOMS[Dialect.KLIPPER].names).encode()
_OF_KLIPPER = re.compile(_LINE + rb"((?:" + _NAMES + rb")\w*)")
_OF_SLICER = re.compile(rb";[ \t]*gcode_flavor[ \t]*=[ \t]*([^\r\n]+)")
_OF_CURA = re.compile(rb";FLAVOR:([^\r\n]+)")

# What only one dialect has, where it is looked for; the first that is found counts.
_SIGNS = (
    (Dialect.KLIPPER, _LINE + rb"([A-Z]+_[A-Z_]+)", HEAD),
    (Dialect.REPRAP, _LINE + rb"(M(?:98|56[678]))\b", HEAD),
    (Dialect.GRBL, _LINE + rb"(\$[A-Z0-9$#]+)", HEAD),
    (Dialect.GRBL, _COMMENT + rb"\b(grbl)", FIRST),
    (Dialect.KLIPPER, _COMMENT + rb"\b(klipper)\b", FIRST),
    (Dialect.REPRAP, _COMMENT + rb"\b(reprapfirmware)\b", FIRST),
    (Dialect.MARLIN, _LINE + rb"(M(?:8[234]|20[0-9]|900)\b|M73 [PQRS])", HEAD),
    # On a mill, these might be anything, but have no S of their own: fan and temperatures.
    (Dialect.MARLIN, _LINE + rb"(M1(?:0[469]|[49]0) ?(?:[PT]\d+ ?)?S\d+)", HEAD),
    (
        Dialect.MARLIN,
        _COMMENT + rb"\b(marlin(?:_post| device| firmware)\b|preprocessor\b.{0,40}: ?marlin)",
        FIRST,
    ),
    (Dialect.MARLIN, _LINE + rb"(?:G92[ \t]*|G0?[0-3]\b[^\r\n;(]*)(E-?[0-9.]+)", HEAD),
)
_PATTERNS = tuple((dialect, re.compile(sign, re.IGNORECASE), end) for dialect, sign, end in _SIGNS)


class Guess(NamedTuple):
    """A dialect, and what it was seen by.

    Attributes:
        dialect: of the program.
        line: that shows it, from 1.
        sign: in this line.
    """

    dialect: Dialect
    line: int
    sign: str

    def __str__(self) -> str:
        """Say both."""
        return (
            f"read as {self.dialect.value}, as line {self.line} has {self.sign!r}: if it is "
            "another, name its dialect in the settings"
        )


def guess_dialect(data: bytes) -> Guess | None:
    """Return the dialect that a program shows; None for that of RS274/NGC, which has no sign."""
    named = _OF_KLIPPER.search(data, 0, HEAD)
    if named:
        return Guess(Dialect.KLIPPER, _line_at(data, named.start(1)), named[1].decode())
    begin = max(len(data) - TAIL, 0)
    for pattern, flavors, places in (
        (_OF_SLICER, _FLAVORS, ((data[:HEAD], 0), (data[begin:], begin))),
        (_OF_CURA, _FLAVOR_OF_CURA, ((data[:HEAD], 0),)),
    ):
        for part, offset in places:
            found = pattern.search(part)
            if found:
                name = found[1].decode(errors="replace").strip().lower()
                if name in flavors:
                    sign = found[0].decode().strip()
                    return Guess(flavors[name], _line_at(data, offset + found.start()), sign)
    for dialect, pattern, end in _PATTERNS:
        found = pattern.search(data, 0, end)
        if found:
            return Guess(dialect, _line_at(data, found.start(1)), found[1].decode())
    return None


def _line_at(data: bytes, place: int) -> int:
    return len((data[:place] + b".").splitlines())
