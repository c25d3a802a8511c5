"""The dialect that a program shows."""

import pytest

from tri_glide_kinematics.programs import Dialect, ProgramSettings, read_program
from tri_glide_kinematics.programs.dialects import guess_dialect

PRINTED = "G28\nG1 X1 E.5 F600\n"
SHOWN = {
    "words of printers": ("G21\nM83\nG1 X1\n", Dialect.MARLIN, 2, "M83"),
    "a number of a line": ("N1 G21\r\nN2 M104 S200\r\nN3 M84\r\n", Dialect.MARLIN, 3, "M84"),
    # A mill's own M104 has P and Q.
    "heaters": ("G28\nM104 S200\nG1 X1 F600\n", Dialect.MARLIN, 2, "M104 S200"),
    "extrusion": ("G21\n;M83\nG1 X1 E0.5\n", Dialect.MARLIN, 3, "E0.5"),
    "Cura": (";FLAVOR:Marlin\nSET_A B=1\n", Dialect.MARLIN, 1, ";FLAVOR:Marlin"),
    "names in a file of Cura": (
        ";FLAVOR:Marlin\nEXCLUDE_OBJECT_START NAME=a\n",
        Dialect.KLIPPER,
        2,
        "EXCLUDE_OBJECT_START",
    ),
    "a program for a board": ("; Marlin device profile\n", Dialect.MARLIN, 1, "Marlin device"),
    "a fish": ("(leaping marlin)\nM104 T0 S5\n", Dialect.MARLIN, 2, "M104 T0 S5"),
    "RepRap of Cura": (";FLAVOR:RepRap\n", Dialect.REPRAP, 1, ";FLAVOR:RepRap"),
    "Slic3r": (PRINTED + "; gcode_flavor = reprap\n", Dialect.MARLIN, 3, "; gcode_flavor = reprap"),
    "settings at the end": (
        PRINTED + "M400\n" * 500_000 + "; gcode_flavor = klipper\r\n",
        Dialect.KLIPPER,
        500_003,
        "; gcode_flavor = klipper",
    ),
    "mill by a slicer": (
        "; gcode_flavor = mach3\nM83\n",
        Dialect.NIST,
        1,
        "; gcode_flavor = mach3",
    ),
    "a flavor that nobody knows": ("M83\n; gcode_flavor = x3g\n", Dialect.MARLIN, 1, "M83"),
    "names": (PRINTED + "SET_FAN_SPEED FAN=a SPEED=1\n", Dialect.KLIPPER, 3, "SET_FAN_SPEED"),
    "a fan": ("G21\nM106 P1 S255\nG4 P500\n", Dialect.MARLIN, 2, "M106 P1 S255"),
    "other programs": ('M83\rM98 P"a.g"\r', Dialect.REPRAP, 2, "M98"),
    "orders": ("G21\n$X\nG0 X1\n", Dialect.GRBL, 2, "$X"),
    "a comment": ("(Grbl 1.1, metric)\nG0 X1\n", Dialect.GRBL, 1, "Grbl"),
}


@pytest.mark.parametrize("name", SHOWN)
def test_a_dialect_is_seen_by_what_only_it_has(name):
    text, dialect, line, sign = SHOWN[name]
    assert guess_dialect(text.encode()) == (dialect, line, sign)


@pytest.mark.parametrize(
    "text",
    [
        "%\nO1000\nG21 G90 G64 P0.02\nT1 M6\nG43 H1\nG1 X1 F600\nM30\n%\n",
        # M73 without a word keeps the modes of a subroutine in LinuxCNC.
        "M73\nG1 X1 F5\n",
        # Numbers of M that belong to whoever builds a mill.
        "M106\nG4 P2\nM107\nM104 P3\n",
        # Its F would be per second.
        "(roughing, delta x 0.2)\nG1 X1 F5\n",
        "(E5 M83)\nG1 X1 F5 ; E5\n",
        "",
    ],
)
def test_nothing_is_seen_in_a_program_of_a_mill(text):
    assert guess_dialect(text.encode()) is None


def test_a_program_is_read_as_it_shows_unless_the_settings_name_its_dialect():
    guessed = read_program("M83\nG4 P500\nG1 X1 E1\n", ProgramSettings(home=(0.0, 0.0, 0.3)))
    assert guessed.steps[0].duration == 0.5
    assert guessed.guess.startswith("read as marlin, as line 1 has 'M83': if it is another")
    told = read_program("M83\nG4 P500\nG1 X1 E1\n", ProgramSettings(Dialect.KLIPPER))
    assert told.guess == ""
    assert read_program("G0 X1\n").guess == "read as nist: nothing shows another dialect"
