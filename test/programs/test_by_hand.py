"""What an operator does by hand: work zeros and buttons that are kept, a line that is typed."""

from dataclasses import replace

import pytest

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.programs import (
    KeptError,
    ProgramError,
    ProgramSettings,
    buttons_file,
    default_zeros_file,
    load_buttons,
    load_zeros,
    read_program,
    read_short,
    touched_off,
    with_kept_zeros,
    write_buttons,
    write_zeros,
)

PLACE = (0.03, -0.02, 0.26)
SETTINGS = ProgramSettings(offsets={"G54": (0.0, 0.0, 0.25), "G55": (0.1, 0.0, 0.0)})


def end_of(program):
    (run,) = (run for step in program.steps for run in step.runs)
    return tuple(run.segments.numbers[-3:])


def test_a_work_zero_is_kept_and_holds_in_place_of_the_settings(tmp_path, monkeypatch):
    file = tmp_path / "new" / "zeros.yaml"
    assert with_kept_zeros(SETTINGS, file) == SETTINGS
    # z is what it was in the settings.
    zero = touched_off(SETTINGS.offsets["G54"], PLACE, (0, 1), 0.005)
    assert zero == pytest.approx((0.025, -0.025, 0.25))
    write_zeros(file, {"G54": zero, "G56": PLACE})
    settings = with_kept_zeros(SETTINGS, file)
    assert settings.offsets == {"G54": zero, "G55": (0.1, 0.0, 0.0), "G56": PLACE}
    # The place that was touched off has this value in a program.
    program = read_program("G21 G90 G54\nG0 X5 Y5 Z10\nM2\n", settings)
    assert end_of(program) == pytest.approx(PLACE)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    name = "tri_glide_kinematics/work_zero_hall_cell_1.yaml"
    assert default_zeros_file("/hall/cell_1") == tmp_path / name


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G54: [0, 0]", "G54: is .0, 0., must be a list of 3 numbers"),
        ("G60: [0, 0, 0]", "G60: is not known here"),
        ("G54: [0, 0, 1000]", "G54 = 1000 m must be within 100 m"),
        ("[1", "is not YAML"),
    ],
)
def test_a_kept_work_zero_without_a_meaning_is_an_error(tmp_path, text, reason):
    file = tmp_path / "zeros.yaml"
    file.write_text(text)
    with pytest.raises(KinematicsError, match=reason):
        with_kept_zeros(SETTINGS, file)


def test_what_has_no_meaning_is_not_kept(tmp_path):
    file = tmp_path / "zeros.yaml"
    write_zeros(file, {"G54": PLACE})
    with pytest.raises(KinematicsError, match="G54 = 1000 m must be within"):
        write_zeros(file, {"G54": (0.0, 0.0, 1000.0)})
    assert load_zeros(file) == {"G54": PLACE}


def test_own_buttons_are_kept_beside_the_work_zeros_of_their_machine(tmp_path):
    file = buttons_file(tmp_path / "new" / "work_zero_cell_1.yaml")
    assert file.name == "work_zero_cell_1.buttons.yaml"
    assert load_buttons(file) == {}
    programs = {"yes": "G28\n", "1": "G0 X1 ; \N{DEGREE SIGN}", "Park: now": "G0 Z5\nM5\n"}
    write_buttons(file, programs)
    assert list(load_buttons(file).items()) == list(programs.items())
    file.write_text("1: G28\n")
    with pytest.raises(KeptError, match="must have a text for each name"):
        load_buttons(file)


def test_a_typed_line_is_a_program_from_where_the_platform_is():
    assert end_of(read_short("G1 X1 F600", SETTINGS, PLACE)) == pytest.approx((0.001, *PLACE[1:]))
    assert end_of(read_short("G91 G0 X1", SETTINGS, PLACE)) == pytest.approx((0.031, *PLACE[1:]))
    # What a line has set holds in no other one.
    assert end_of(read_short("G0 X1", SETTINGS, PLACE)) == pytest.approx((0.001, *PLACE[1:]))
    home = replace(SETTINGS, home=(0.0, 0.0, 0.3))
    assert end_of(read_short("G28", home, PLACE)) == (0.0, 0.0, 0.3)
    (spindle,) = read_short("M3 S900", SETTINGS, PLACE).steps
    assert (spindle.name, spindle.value) == ("spindle", 900.0)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("X1", "no G0 to G3 before it"),
        ("G1 X1", "no F says how fast"),
        ("G0 X1 G7", "this command is not understood"),
        ("", "it says nothing"),
        ("G0 X1" + " " * 1996, "it has 2001 characters, at most 2000: make a file"),
        ("G91 G83 X1 Z-5 R1 Q.05 L9 F500", "segments, at most 1000: make a file"),
    ],
)
def test_a_typed_line_that_is_none_is_refused(line, reason):
    with pytest.raises(ProgramError, match=reason):
        read_short(line, SETTINGS, PLACE)
