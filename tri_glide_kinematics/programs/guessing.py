"""The dialect of a program by what only one dialect has: a generator's comment, or words."""

from __future__ import annotations

import re
from typing import NamedTuple

from tri_glide_kinematics.programs.settings import Dialect

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
    (Dialect.MARLIN, _LINE + rb"(M1(?:0[49]|[49]0)[ \t]*[SR][0-9.]+)", HEAD),
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
