"""What lines of G-code mean, and what is said of those that mean nothing."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import SegmentKind
from tri_glide_kinematics.programs import (
    Dialect,
    Dwell,
    Output,
    ProgramError,
    ProgramSettings,
    ProgramStop,
    StopKind,
    load_program,
    read_program,
)

NIST, MARLIN, REPRAP, KLIPPER, DELTA_X, GRBL = Dialect
HOME = (0.0, 0.0, 0.3)
OFFSETS = {"G54": (0.01, 0.0, 0.25), "G55": (0.0, -0.02, 0.26)}


def read(text, dialect=NIST, **settings):
    given = {"start": HOME, "home": HOME, "tools": {1: (0.0, 0.0, 0.05)}, **settings}
    return read_program(text, ProgramSettings(dialect, **given))


def runs(text, dialect=NIST, **settings):
    """Return the paths of a program."""
    steps = read(f"{text}\n", dialect, **settings).steps
    return [run for step in steps for run in step.runs]


def ends(text, dialect=NIST, **settings):
    """Return where all segments of a program end [mm]."""
    found = []
    for run in runs(text, dialect, **settings):
        found += at_once(run.segments.path_from(run.start)).segments.points[1:].tolist()
    return np.round(1e3 * np.array(found), 6).tolist()


NINES = "9" * 400
# Where a hole leads whose R is above the place before: up at once, and along then.
BELOW = ((0, 305), (1, 305), (1, 290), (1, 305))

# Each with the places [mm] that it leads to, from (0, 0, 300).
MEANINGS = {
    "absolute": ("G90 G0 X1 Y2\nZ3", [[1, 2, 300], [1, 2, 3]]),
    "incremental": ("G91 G0 X1 Y2\nX1 Z-3", [[1, 2, 300], [2, 2, 297]]),
    "inches of some mills": ("G70 G0 X1 Z10\nG71 X1", [[25.4, 0, 254], [1, 0, 254]]),
    "inches": ("G20 G0 X1 Z10\nG21 X1", [[25.4, 0, 254], [1, 0, 254]]),
    "without spaces": ("g0x1y-2.5\nx.5", [[1, -2.5, 300], [0.5, -2.5, 300]]),
    "line numbers": ("N1 G0 X1\nN2 Y1", [[1, 0, 300], [1, 1, 300]]),
    "comments": ("(X5) G0 (Y5) X1 ; Z5\n;G0 X7\n(a;b) Y1", [[1, 0, 300], [1, 1, 300]]),
    "comment in a comment": ('(an (X2) end) G0 X1\nY1 (a"()")', [[1, 0, 300], [1, 1, 300]]),
    "an axis that stays": ("G0 X1 A0\nB0. C-0 Y1", [[1, 0, 300], [1, 1, 300]]),
    "nothing is turned": ("G15 G69\nO7 G0 X1", [[1, 0, 300]]),
    "block delete": ("G0 X1\n/X2\n /Y3\nX4", [[1, 0, 300], [4, 0, 300]]),
    "ends of lines": ("G0 X1\r\nX2\rX3\r\n\r\nX4", [[x, 0, 300] for x in (1, 2, 3, 4)]),
    "% with a name": ("%12 (of)\nG0 X1\n%%\nX2", [[1, 0, 300]]),
    "to %": ("%\nO1000\nG0 X1\n%\nnothing [of this", [[1, 0, 300]]),
    "to % behind an output": ("%\nM62 P1\n%\nG0 X9", []),
    "to M2": ("G0 X1\nM2\nnothing [of this", [[1, 0, 300]]),
    "to M30 in a line": ("G0 X1 M30\nX2", [[1, 0, 300]]),
    "nothing twice": ("G0 X1\nX1\nX1.0000001\nX2", [[1, 0, 300], [2, 0, 300]]),
    "tiny steps": ("G91 G0\n" + "X0.0004\n" * 10, [[0.0012 * n, 0, 300] for n in (1, 2, 3)]),
    "machine": ("G92 X10\nG53 G0 X1 Z5\nX11", [[1, 0, 5]]),
    "machine, once": ("G92 X10\nG53 G0 X1\nX12", [[1, 0, 300], [2, 0, 300]]),
    "machine, incremental": ("G91 G53 G0 X1\nX1", [[1, 0, 300], [2, 0, 300]]),
    "set off": ("G0 X5\nG92 X0 Z0\nX1 Z1\nG92.1\nX0", [[5, 0, 300], [6, 0, 301], [0, 0, 301]]),
    "not set off": ("G92 X10\nG92.1\nG0 X1", [[1, 0, 300]]),
    "set off again": ("G92 X10\nG92.2\nG0 X1\nG92.3\nX12", [[1, 0, 300], [2, 0, 300]]),
    "tool": ("T1 M6\nG43\nG0 Z200\nG49 Z200", [[0, 0, 250], [0, 0, 200]]),
    "tool by number": ("G43 H1 G0 Z200\nG43 H0 Z200", [[0, 0, 250], [0, 0, 200]]),
    "offset by the program": (
        "G10 L2 P2 X5\nG55 G0 X1\nG10 L20 P0 X3\nX4",
        [[6, 0, 300], [7, 0, 300]],
    ),
    "holes": (
        "F600 G81 X1 Z290 R298\nX2\nG80",
        [[x, 0, z] for x in (1, 2) for z in (300, 298, 290, 300)],
    ),
    "holes from R": (
        "F600 G99 G81 X1 Z290 R298\nX2 Z291\nG0 X3",
        [
            *([1, 0, z] for z in (300, 298, 290, 298)),
            *([2, 0, z] for z in (298, 291, 298)),
            [3, 0, 298],
        ],
    ),
    "holes from below R": ("F600 G81 X1 Z290 R305", [[x, 0, z] for x, z in BELOW]),
    "holes in steps": (
        "F600 G83 X1 Z290 R300 Q4",
        [[1, 0, z] for z in (300, 296, 300, 296.254, 292, 300, 292.254, 290, 300)],
    ),
    "holes that break chips": (
        "F600 G73 X1 Z290 R300 Q5",
        [[1, 0, z] for z in (300, 295, 295.254, 290, 300)],
    ),
    "holes with a rest": ("F600 G82 X1 Z290 R300 P.5", [[1, 0, z] for z in (300, 290, 300)]),
    "holes that are reamed": (
        "F600 G85 X1 Z290 R298",
        [[1, 0, z] for z in (300, 298, 290, 298, 300)],
    ),
    "holes in a row": (
        "G91 F600 G81 X1 Z-5 R-2 L2",
        [[x, 0, z] for x in (1, 2) for z in (300, 298, 293, 300)],
    ),
    "holes in a row from R": (
        "G91 F600 G99 G81 X1 Z-5 R-2 L2",
        [*([1, 0, z] for z in (300, 298, 293, 298)), *([2, 0, z] for z in (298, 293, 298))],
    ),
    "home": ("G0 X5 Y5\nG28", [[5, 5, 300], [0, 0, 300]]),
    "home by way of": ("G0 X5 Y5\nG28 X7", [[5, 5, 300], [7, 5, 300], [0, 5, 300]]),
    "no motion": ("G0 X5\nG80\nG1 F100\nX6", [[5, 0, 300], [6, 0, 300]]),
}


@pytest.mark.parametrize("name", MEANINGS)
def test_a_program_leads_where_it_says(name):
    text, places = MEANINGS[name]
    assert ends(text) == [pytest.approx(place) for place in places]


def test_offsets_are_those_of_the_settings():
    text = "G0 X1\nG55 X1 Y0 Z1\nG92 X0\nX5\nG54 X0"
    places = [[11, 0, 300], [1, -20, 261], [6, -20, 261], [11, -20, 261]]
    assert ends(text, offsets=OFFSETS) == [pytest.approx(place) for place in places]


def test_lines_with_a_slash_are_left_out_only_if_that_is_asked_for():
    assert ends("/G0 X1\nG0 X2", block_delete=False) == [[1, 0, 300], [2, 0, 300]]


def test_home_is_where_all_axes_go_on_a_printer():
    for dialect in (MARLIN, REPRAP, KLIPPER, DELTA_X):
        text = "G1 X5 Y5 F100\nG92 X0\nG28 X Y\nG1 X1"
        if dialect is DELTA_X:
            text = text.replace("F100", "F2")
        assert ends(text, dialect) == [[5, 5, 300], [0, 0, 300], [1, 0, 300]]
        first, _ = runs(text, dialect)
        # At full speed, whatever F says.
        assert first.segments.speeds[1] == math.inf


@pytest.mark.parametrize(
    ("dialect", "feed", "speed"),
    [(NIST, "F600", 0.01), (MARLIN, "F600", 0.01), (KLIPPER, "F600", 0.01), (DELTA_X, "F600", 0.6)],
)
def test_f_is_a_length_per_minute_or_per_second(dialect, feed, speed):
    (run,) = runs(f"G1 X1 {feed}\nX2\nG0 X3", dialect)
    rapid = math.inf if dialect is NIST else speed
    assert run.segments.speeds.tolist() == pytest.approx([speed, speed, rapid])
    assert run.rapid.tolist() == [False, False, True]
    assert run.lines.tolist() == [1, 2, 3]


def test_f_in_inches_and_its_part():
    (run,) = runs("G20 F60 G1 X1\nG21 X1\nF60 X2")
    assert run.segments.speeds.tolist() == pytest.approx([0.0254, 0.0254, 0.001])
    (run,) = runs("M220 S50\nG1 X1 F600\nM220 S100\nX2", MARLIN)
    assert run.segments.speeds.tolist() == pytest.approx([0.005, 0.01])


@pytest.mark.parametrize(("dialect", "speed"), [(MARLIN, 0.025), (REPRAP, 0.05), (KLIPPER, 0.025)])
def test_printers_have_a_speed_before_the_first_f(dialect, speed):
    (run,) = runs("G1 X1", dialect)
    assert run.segments.speeds.tolist() == [speed]
    (run,) = runs("G1 X1", dialect, feed=0.02)
    assert run.segments.speeds.tolist() == [0.02]


def test_tolerances_are_those_of_g64_and_g61():
    text = "G0 X1\nG64 P0.5\nX2\nG61\nX3\nG64\nX4\nG20 G64 P0.01\nX5"
    (run,) = runs(text, tolerance=2e-5)
    expected = [2e-5, 5e-4, 0.0, 2e-5, 2.54e-4]
    assert run.segments.tolerances.tolist() == pytest.approx(expected)


def test_dwells_are_seconds_or_milliseconds():
    for dialect, text in ((NIST, "G4 P0.5"), (MARLIN, "G4 P500"), (MARLIN, "G4 S0.5")):
        assert read(f"{text}\n", dialect).steps == (Dwell(0.5, 1),)


def test_outputs_change_at_their_place_on_the_path():
    text = "M3 S500\nG0 X1\nM62 P2\nX2\nM8\nS600\nX3\nM65 P2\nM9\nG4 P1\nM42 P3 S128\nM5\nM2\n"
    program = read(text)
    before, run, *after = program.steps
    assert before == Output("spindle", 0, 500.0, 1, 0)
    assert run.outputs == (
        Output("digital", 2, 1.0, 3, 1),
        Output("flood", 0, 1.0, 5, 2),
        Output("spindle", 0, 600.0, 6, 2),
    )
    assert after == [
        Output("digital", 2, 0.0, 8, 0),
        Output("mist", 0, 0.0, 9, 0),
        Output("flood", 0, 0.0, 9, 0),
        Dwell(1.0, 10),
        Output("pin", 3, 128.0, 11, 0),
        Output("spindle", 0, 0.0, 12, 0),
        ProgramStop(StopKind.END, 13),
    ]
    assert read("M4 S5\nM106 S255 P1\nM107\n", MARLIN).steps == (
        Output("spindle", 0, -5.0, 1, 0),
        Output("fan", 1, 255.0, 2, 0),
        Output("fan", 0, 0.0, 3, 0),
    )


def test_stops_and_their_kinds():
    steps = read("M0\nM1\nT1 M6\nM30\n").steps
    kinds = [StopKind.PAUSE, StopKind.OPTIONAL, StopKind.TOOL, StopKind.END]
    assert [step.kind for step in steps] == kinds
    assert [step.tool for step in steps] == [0, 0, 1, 0]
    assert len(read("M0\nM1\nM2\n", optional_stop=False).steps) == 2


def test_what_is_not_done_is_told_once():
    text = "M104 S200\nM117 Layer (1\nG1 X1 E5 F600\nM104 S210\nX2 E6\nG92 E0\nT0\nM82\n"
    told = {each.word: each.line for each in read(text, MARLIN).told}
    assert told == {"M104": 1, "M117": 2, "E": 3, "T": 7, "M82": 8}
    # A text may look like words.
    program = read("M117 G28 X1 X2\nG1 X1 F600\n", MARLIN)
    assert [(each.word, each.line) for each in program.told] == [("M117", 1)]
    program = read("G0 X1\nM1234\nM1234.5 Q7\n", ignored=frozenset({"M1234", "M1234.5"}))
    assert [each.word for each in program.told] == ["M1234", "M1234.5"]
    program = read("G1 X1 F5 A100 S5 E5 J9\n", DELTA_X)
    assert {each.word for each in program.told} == set("ASEJ")
    told = [f"M{number}" for number in (17, 18, 203, 204, 205, 210, 211)]
    assert [each.word for each in read("\n".join(["G1 X1 F5", *told]), DELTA_X).told] == told
    program = read("EXCLUDE_OBJECT_START NAME=a\nG1 X1\n", KLIPPER)
    assert program.told[0].word == "EXCLUDE_OBJECT_START"


# Words that concern the motion with some of their parameters, or always: dialect, text, reason.
CONCERNING = {
    "tool offset": (REPRAP, "G10 P0 X10 Z5", "with X it concerns the motion"),
    "tool offset, with a checksum": (REPRAP, "G10 P0 Z5*73", "with Z it concerns the motion"),
    "tool": (REPRAP, "G10 L1 P0 X10", "only L2 and L20"),
    "work offset of a retraction": (MARLIN, "G10 L2 P1 X10", "with L it concerns the motion"),
    "work offset of Klipper": (KLIPPER, "G10 L20 P1 X10", "with L it concerns the motion"),
    "lift": (MARLIN, "M207 S3 Z0.4", "with Z it concerns the motion"),
    "map": (MARLIN, "M420 S1", "no map of a bed"),
    "probing": (MARLIN, "G29", "no map of a bed"),
    "probing of RRF": (REPRAP, "G29 S1", "no map of a bed"),
    "map of Klipper": (KLIPPER, "BED_MESH_PROFILE LOAD=a", "not understood"),
    "object": (KLIPPER, "EXCLUDE_OBJECT NAME=a", "not understood"),
    "home offset": (MARLIN, "M206 X1", "name offsets and tools in the settings"),
    "home offset, here": (MARLIN, "M428", "name offsets and tools in the settings"),
    "nozzle": (MARLIN, "M218 T1 X10", "name offsets and tools in the settings"),
    "baby steps": (MARLIN, "M290 Z0.1", "name offsets and tools in the settings"),
    "stored offsets": (MARLIN, "M501", "it would change offsets"),
    "axes of RRF": (REPRAP, "M208 X100 S0", "the workspace is that of the machine"),
    "state of RRF": (REPRAP, "M121", "write G90 or G91"),
    "delta": (MARLIN, "M665 R100", "parameters of the machine"),
    "probe": (MARLIN, "M401", "nothing is probed"),
    "another file": (MARLIN, "M24", "no other file"),
    "motors": (MARLIN, "G1 X1 F600\nM84\nX2", "the motors are off since line 2"),
    "motors of axes": (KLIPPER, "M18 X Y E\nG1 X2", "the motors are off since line 1"),
}


@pytest.mark.parametrize("name", CONCERNING)
def test_what_concerns_the_motion_is_not_only_told(name):
    dialect, text, reason = CONCERNING[name]
    with pytest.raises(ProgramError, match=reason):
        read(f"G0 Y1\n{text}\n".removeprefix("G0 Y1\n" if "since" in reason else ""), dialect)


@given(
    st.permutations(['P"G1 X5"', "S1", "ö", "(G1", "(a)", "Tfile", "*", "[1]", "G1 X7"]), st.data()
)
@settings(max_examples=200, deadline=None, derandomize=True)
def test_a_command_behind_what_is_told_is_never_lost(parts, data):
    """Where such a line was not ordinary, its motion was left out without a word."""
    parts = parts[: 1 + max(parts.index("G1 X7"), data.draw(st.integers(0, 8)))]
    told = data.draw(st.sampled_from(("M104", "G4 P0 M140", "m84 S1", "M204")))
    with pytest.raises(ProgramError):
        read(f"G1 X1 F600\n{' '.join((told, *parts))}\nX2\n", MARLIN)


@pytest.mark.parametrize("behind", ["(hm", "ö", 'P"G28 X1"', "Sfile", "(G28) ö", "ö ;G28", "ö_G28"])
def test_what_belongs_to_a_told_command_may_be_no_word(behind):
    told = read(f"G1 X1 F600\nM104 {behind}\nX2\n", MARLIN).told
    assert [each.word for each in told] == ["M104"]


def test_told_words_that_leave_the_motion_alone():
    harmless = "M84 S60\nM84 E\nG10\nG11\nM207 S3 Z0\nM420 S0\nM420 V\nM208 S1\nG0 X1\nM84\n"
    assert ends(harmless, MARLIN) == [[1, 0, 300]]
    assert ends("G0 X1\nM84\nG28\nX2", MARLIN) == [[1, 0, 300], [0, 0, 300], [2, 0, 300]]
    assert ends("G10 P0 S200 R150\nG0 X1", REPRAP) == [[1, 0, 300]]
    assert ends("G29\nM84\nG0 X1", MARLIN, ignored=frozenset({"G29", "M84"})) == [[1, 0, 300]]


def test_work_offsets_of_reprap_firmware_are_set():
    assert ends("G10 L2 P1 X10 Y20\nG0 X1 Y1", REPRAP) == [[11, 21, 300]]
    assert ends("G10 L20 P1 X10\nG0 X11", REPRAP) == [[1, 0, 300]]


# Arcs, each from (0, 0, 300) with G21 G90 G17 and F: centre [mm], angle [degrees], rise [mm].
ARCS = {
    "centre": ("G2 X10 Y10 I10", (10, 0), -90, 0),
    "centre, the other way": ("G3 X10 Y10 I10", (10, 0), 270, 0),
    "radius": ("G3 X20 R10", (10, 0), 180, 0),
    "radius, less than half a turn": ("G2 X10 Y10 R10", (10, 0), -90, 0),
    "radius, more than half a turn": ("G2 X10 Y10 R-10", (0, 10), -270, 0),
    "radius, more the other way": ("G3 X10 Y10 R-10", (10, 0), 270, 0),
    "whole": ("G2 I10", (10, 0), -360, 0),
    "whole, with its end": ("G3 X0 Y0 J-5", (0, -5), 360, 0),
    "turns": ("G2 X10 Y10 I10 P3", (10, 0), -810, 0),
    "helix": ("G2 X10 Y10 I10 Z305", (10, 0), -90, 5),
    "helix of turns": ("G3 Z280 I5 P4", (5, 0), 1440, -20),
    "incremental": ("G91 G2 X10 Y10 I10", (10, 0), -90, 0),
    "centre absolute": ("G90.1 G2 X10 Y10 I10 J0", (10, 0), -90, 0),
    "all three": ("G2 X10 Y10 I10 J0 K0.000", (10, 0), -90, 0),
    "rounded centre": ("G3 X7.071 Y2.929 I0 J10", (0, 10), 45, 0),
    "rounded radius": ("G3 X20 R9.9999", (10, 0), 180, 0),
}


@pytest.mark.parametrize("name", ARCS)
def test_an_arc_is_the_one_that_is_written(name):
    text, (x, y), degrees, rise = ARCS[name]
    (run,) = runs(f"F600 {text}")
    path = at_once(run.segments.path_from(run.start))
    parts = np.linspace(0.0, 1.0, 100)
    first = math.atan2(-y, -x)
    turned = first + math.radians(degrees) * parts
    radius = math.hypot(x, y)
    places = (x + radius * np.cos(turned), y + radius * np.sin(turned), 300.0 + rise * parts)
    found = path.position(parts * path.length)
    near = 1e-6 if "rounded" in name else 1e-12
    assert found == pytest.approx(1e-3 * np.stack(places, axis=1), abs=near)
    expected = math.hypot(radius * math.radians(degrees), rise)
    assert path.length == pytest.approx(1e-3 * expected, abs=near)


@pytest.mark.parametrize(
    ("plane", "centre", "end", "axis"),
    [("G17", "I10", "X10 Y10", 2), ("G18", "K10", "Z310 X10", 1), ("G19", "J10", "Y10 Z310", 0)],
)
def test_arcs_turn_about_the_axis_of_their_plane(plane, centre, end, axis):
    (run,) = runs(f"{plane} G2 {end} {centre} F600")
    assert run.segments.kinds.tolist() == [SegmentKind.ARC_ABOUT]
    *_, angle = run.segments.numbers.tolist()
    assert run.segments.numbers.tolist()[3:6] == [float(each == axis) for each in range(3)]
    assert angle == pytest.approx(-0.5 * math.pi)


def test_a_nearly_whole_circle_keeps_its_centre_where_its_end_is_rounded():
    (run,) = runs("G0 X10\nG1 F600\nG3 X9.999 Y0 I-10 J0\nG1 X5")
    path = at_once(run.segments.path_from(run.start))
    assert path.segments.lengths[1] == pytest.approx(0.02 * math.pi, rel=1e-9)
    assert path.end == pytest.approx((0.005, 0.0, 0.3))


def test_a_marlin_arc_counts_whole_turns_besides():
    (run,) = runs("G2 X10 Y10 I10 P1", MARLIN)
    assert run.segments.numbers[-1] == pytest.approx(-2.5 * math.pi)


# Dialect, program, line and column of the error, the word, and a part of the reason.
WRONG = {
    "no number": (NIST, "G0 X1\nG0 XNaN", 2, 4, "XNaN", "'NaN' is none"),
    "infinite": (NIST, "G0 Xinf", 1, 4, "Xinf", "X has no number"),
    "cut off": (NIST, "G0 X1 Y", 1, 7, "Y", "Y has no number"),
    "sign alone": (NIST, "G0 X-", 1, 4, "X-", "X has no number"),
    "two points": (NIST, "G0 X1.2.3", 1, 4, "X1.2.3", "'1.2.3' is none"),
    "exponent": (NIST, "G0 X1e-5", 1, 4, "X1e-5", "with an exponent"),
    "twice": (NIST, "G0 X1 Y1 X2", 1, 10, "X2", "X stands twice"),
    "command twice": (NIST, "G0 G0 X1", 1, 4, "G0", "stands twice"),
    "contradiction": (NIST, "G0 G1 X1 F5", 1, 4, "G1", "contradicts G0"),
    "contradiction of units": (NIST, "G20 G21", 1, 5, "G21", "contradicts G20"),
    "no letter": (NIST, "G0 X1 2", 1, 7, "2", "no letter"),
    "expression": (NIST, "G0 X[1+2]", 1, 4, "X[1+2]", "write the number instead"),
    "parameter": (NIST, "#1=5", 1, 1, "#1=5", "parameters and expressions"),
    "comment": (NIST, "G0 X1 (to", 1, 7, "(", "no end"),
    "comments": (NIST, "G0 X1 (a (b (c)))", 1, 7, "(", "as many )"),
    "order behind %": (NIST, "G0 X1\n%wait 3", 2, 1, "%wait", "only % alone ends a program"),
    "subroutine": (NIST, "o<a> sub", 1, 1, "o<a> sub", "are not understood: write out the lines"),
    "loop": (NIST, "G0 X1\nO100 while [1]", 2, 1, "O100 while [1]", "loops"),
    "branch": (REPRAP, "if a > 1", 1, 1, "if a > 1", "write out the lines"),
    "map of the bed": (KLIPPER, "BED_MESH_PROFILE LOAD=a", 1, 1, "BED_MESH_PROFILE", "no map"),
    "other program": (NIST, "M98 P7", 1, 1, "M98", "write out what it calls"),
    "rotation": (NIST, "G68 R45", 1, 1, "G68", "turn the places itself"),
    "bytes": (NIST, b"G0 X1 \xff", 1, 7, "\ufffd", "no word"),
    "order to a terminal": (
        NIST,
        "G0 \x1b[2J\x07",
        1,
        4,
        "\x1b[2J\x07",
        r": \x1b[2J\x07: this is no word",
    ),
    "umlaut before": (NIST, "(\u00e4) G0 X1 Q", 1, 11, "Q", "Q has no number"),
    "unknown G": (NIST, "G123 X1", 1, 1, "G123", "not understood"),
    "unknown M": (NIST, "M123", 1, 1, "M123", "under ignored"),
    "cycle": (NIST, "G84 X1 Z1 R2 F5", 1, 1, "G84", "cycles as lines"),
    "hole without R": (NIST, "F5 G81 X1 Z1", 1, 8, "X1", "needs Z, the bottom, and R"),
    "hole upwards": (NIST, "F5 G81 X1 Z3 R2", 1, 8, "X1", "is above R"),
    "hole without steps": (NIST, "F5 G83 X1 Z1 R2", 1, 8, "X1", "needs a Q above 0"),
    "hole of tiny steps": (NIST, "F5 G83 X1 Z1 R2 Q.0001", 1, 8, "X1", "more than 1000 steps"),
    "hole without a rest": (NIST, "F5 G82 X1 Z1 R2", 1, 8, "X1", "needs a P"),
    "hole in another plane": (NIST, "G18 F5 G81 X1 Z1 R2", 1, 12, "X1", "along Z only"),
    "holes without an end": (NIST, "F5 G81 X1 Z1 R2 L1001", 1, 8, "X1", "1000 holes"),
    "numbers of another cycle": (NIST, "F5 G81 X1 Z1 R2\nG73 X1 Q1", 2, 5, "X1", "needs Z"),
    "word of others": (NIST, "M83", 1, 1, "M83", "of marlin, reprap, klipper: name this dialect"),
    "order to grbl": (NIST, "$X", 1, 1, "$X", "it is a word of grbl"),
    "jog of grbl": (GRBL, "$J=G91X1F5", 1, 1, "$J=G91X1F5", "not as jogs"),
    "compensation": (NIST, "G41 D1", 1, 1, "G41", "compensate"),
    "no feed": (NIST, "G1 X1", 1, 4, "X1", "no F says how fast"),
    "no feed on an arc": (NIST, "G2 X1 R1", 1, 4, "X1", "no F says how fast"),
    "no feed of Delta X": (DELTA_X, "G0 X1", 1, 4, "X1", "F600 (mm/s)"),
    "zero feed": (NIST, "G1 X1 F0", 1, 7, "F0", "0 mm/s must be at least 0.01 mm/s"),
    "negative feed": (NIST, "G1 X1 F-60", 1, 7, "F-60", "-1 mm/s must be at least"),
    "no motion": (NIST, "X1", 1, 1, "X1", "no G0 to G3"),
    "after G80": (NIST, "G0 X1\nG80\nX2", 3, 1, "X2", "no G0 to G3"),
    "axis": (NIST, "G0 X1 A5", 1, 7, "A5", "no axis A"),
    "without meaning": (NIST, "G0 X1 Q5", 1, 7, "Q5", "Q has no meaning"),
    "centre of a line": (NIST, "G1 X1 I5 F5", 1, 7, "I5", "I has no meaning"),
    "centre of another plane": (NIST, "G2 X1 I.5 K1 F5", 1, 11, "K1", "in this plane"),
    "large exponent": (NIST, "G0 X1\nx1.E5", 2, 1, "x1.E5", "with an exponent"),
    "farther": (NIST, "G0 X1\nX123456789", 2, 0, "", "farther than 100 m"),
    "far": (NIST, "G0 X1\nX-1000000001", 2, 1, "X-1000000001", "from -1000000000 to 1000000000"),
    "endless": (NIST, "G0 X" + NINES, 1, 4, "X" + NINES, "X999"),
    "endless command": (NIST, "G" + NINES, 1, 1, "G" + NINES, "to 1000000000"),
    "endless tool": (NIST, f"T{NINES} M6", 1, 1, "T" + NINES, "to 1000000000"),
    "endless dwell": (NIST, "G4 P" + NINES, 1, 4, "P" + NINES, "to 1000000000"),
    "endless spindle": (NIST, "M3 S" + NINES, 1, 4, "S" + NINES, "to 1000000000"),
    "endless part": (MARLIN, "M220 S" + NINES, 1, 6, "S" + NINES, "to 1000000000"),
    "endless turns": (NIST, f"F9\nG2 I1 P{NINES}", 2, 7, "P" + NINES, "to 1000000000"),
    "too many turns": (NIST, "F9\nG2 I1 P15917", 2, 7, "P15917", "15915 turns at most"),
    "output of 37 bits": (NIST, "M62 P99999999999", 1, 5, "P99999999999", "to 1000000000"),
    "far tolerance": (NIST, "G64 P100001", 1, 1, "G64", "100.001 m must be at most 100 m"),
    "small part": (MARLIN, "F60\nM220 S0.0001", 2, 1, "M220", "at least 0.01 mm/s"),
    "large part": (MARLIN, "M220 S999999999\nF9999999", 2, 1, "F9999999", "at most 1e+09"),
    "large speed": (DELTA_X, "G20\nF999999999", 2, 1, "F999999999", "at most 1e+09 mm/s"),
    "fan": (MARLIN, "M106 S-5", 1, 6, "S-5", "fan must be at least 0"),
    "wide digit": (NIST, "G0 X\uff11", 1, 4, "X\uff11", "X has no number"),
    "far rise": (NIST, "F9 G0 Z-99000\nG2 I1 Z99000", 2, 0, "", "farther than 100 m"),
    "no arc": (NIST, "G2 X1 F5 Y1 I-5 J5", 1, 17, "J5", "the same within"),
    "no centre": (NIST, "G1 F5\nG2 I0 J0 X1", 2, 7, "J0", "begins at its centre"),
    "radius too small": (NIST, "G2 X20 R9 F5", 1, 8, "R9", "9 mm must be at least half"),
    "circle by radius": (NIST, "G2 X0 R9 F5", 1, 7, "R9", "whole circle"),
    "radius and centre": (NIST, "G2 X10 R9 I5 F5", 1, 11, "I5", "one of them"),
    "half a centre": (NIST, "G90.1 G2 X10 I5 F5", 1, 14, "I5", "needs I and J"),
    "turns": (NIST, "G2 I5 P0 F5", 1, 7, "P0", "so many turns"),
    "turns of a printer": (KLIPPER, "G2 I5 P2", 1, 7, "P2", "so many turns"),
    "dwell": (NIST, "G4", 1, 1, "G4", "needs a time"),
    "negative dwell": (NIST, "G4 P-1", 1, 1, "G4", "at least 0"),
    "tolerance": (NIST, "G64 P-1", 1, 1, "G64", "P = -1 must be at least 0"),
    "unknown tool": (NIST, "G43 H7", 1, 1, "G43", "no offset of tool 7"),
    "half a tool": (NIST, "T1.5 M6", 1, 1, "T1.5", "whole number"),
    "output": (NIST, "M62", 1, 1, "M62", "needs a P"),
    "pin": (NIST, "M42 P1", 1, 1, "M42", "needs P and S"),
    "offset of no axis": (NIST, "G92", 1, 1, "G92", "needs X, Y or Z"),
    "two for the axes": (NIST, "G92 G1 X1 F5", 1, 5, "G1", "takes the axes"),
    "machine arc": (NIST, "G2 F5\nG53 X1 R1", 2, 1, "G53", "G0 and G1 only"),
    "stored place": (MARLIN, "G61", 1, 1, "G61", "stored places"),
    "text of a printer": (NIST, "M117 Hello", 1, 1, "M117", "not understood"),
    "name": (MARLIN, "START_PRINT BED=60", 1, 1, "START_PRINT", "under ignored"),
    "told and more": (MARLIN, "M104 S200 G1 X1", 1, 1, "M104", "line of its own"),
    "told and more, no end": (MARLIN, "M104 S1 G1 X1 (", 1, 15, "(", "the comment has no end"),
    "told and more, no word": (MARLIN, "M104 ö G1 X1", 1, 6, "ö", "this is no word"),
    "told, a text and more": (MARLIN, 'M104 P"G28" G1 X1', 1, 1, "M104", "line of its own"),
    "motion before what is told": (MARLIN, "G0 X1\nX5 M104 S2", 2, 4, "M104", "line of its own"),
    "motion before a text": (MARLIN, "G0 X1\nX5 M117 X7", 2, 4, "M117", "line of its own"),
    "a tool before what is told": (MARLIN, "T1 M104 S2", 1, 4, "M104", "line of its own"),
    "checksum": (MARLIN, "N3 T0*58", 1, 6, "*58", "the checksum of this line is 57"),
    "checksum of nothing": (MARLIN, "*7", 1, 1, "*7", "the checksum of this line is 0"),
    "flag": (MARLIN, "G1 X Y5", 1, 4, "X", "X has no number"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_not_understood_is_named_with_its_place(name):
    dialect, text, line, column, word, reason = WRONG[name]
    text = text + (b"\nG0 X1\n" if isinstance(text, bytes) else "\nG0 X1\n")
    with pytest.raises(ProgramError) as caught:
        read(text, dialect)
    error = caught.value
    assert (error.line, error.column, error.word) == (line, column, word)
    assert reason in str(error)
    assert str(error).startswith(f"program: line {line}")


def test_a_file_of_zero_bytes_is_not_taken_for_utf_16():
    with pytest.raises(ProgramError, match="it begins with zero bytes") as caught:
        read_program(bytes(1000))
    assert "UTF-16" not in str(caught.value)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_a_text_in_utf_16_is_told(encoding):
    with pytest.raises(ProgramError, match="program: is no text in UTF-8 or ASCII"):
        read("G0 X1\n".encode(encoding))


def test_a_home_without_a_place():
    with pytest.raises(ProgramError, match="line 1, column 1: G28: no such place is known"):
        read_program("G28\n")


@pytest.mark.parametrize("text", ["", "\n\n", "(nothing)\n", "%\n", "G21\n", "%\nG21\n%\nG0 X9\n"])
def test_a_program_that_does_nothing(text):
    with pytest.raises(ProgramError, match="it says nothing that can be done"):
        read(text)


def test_a_program_that_is_cut_off():
    with pytest.raises(ProgramError, match=r"line 2: this last line has no end.*cut off"):
        read("G0 X1\nX12.3")
    with pytest.raises(ProgramError, match="line 2: this last line has no end"):
        read("G0 X1\nM3")
    # The last two move nothing and put nothing out, however they would go on.
    lasts = ("X12.3\n", "M2", "(end)", "G80", "\x1a")
    for whole in ("%\nG0 X1\n%", *(f"G0 X1\n{last}" for last in lasts)):
        assert read(whole).steps


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(ProgramError, match=r"none\.gcode: cannot be read"):
        load_program(tmp_path / "none.gcode")
    file = tmp_path / "part.gcode"
    file.write_text("G0 X1\nG0 X1 X2\n")
    with pytest.raises(ProgramError, match=r"part\.gcode: line 2, column 7: X2: X stands twice"):
        load_program(file)


def test_nothing_depends_on_which_lines_are_read_together():
    """Lines that are not ordinary change nothing of the others, in more than a megabyte of them."""
    lines = [f"G1 X{n % 90 - 45}.{n % 7} Y{n % 50 - 25}.123456 F600\n" for n in range(32_000)]
    others = ["/G1 X500\n" if n % 500 == 0 else "" for n in range(32_000)]
    plain, mixed = "".join(lines), "".join(map("".join, zip(others, lines)))
    (one,), (other,) = runs(plain), runs(mixed)
    assert one.segments.numbers.tolist() == other.segments.numbers.tolist()
    assert (other.lines - one.lines).tolist() == [1 + n // 500 for n in range(32_000)]
    with pytest.raises(ProgramError, match="line 32001, column 4"):
        read(plain + "G1 XY\n")
    # One number that is none makes the lines around it be read one by one.
    with pytest.raises(ProgramError, match=r"line 32001, column 4: X1\.2\.3"):
        read(plain + "G1 X1.2.3\n")
