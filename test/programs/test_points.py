"""Tables of points as programs."""

import math

import numpy as np
import pytest

from tri_glide_kinematics.programs import (
    PathRun,
    ProgramError,
    ProgramSettings,
    ProgramStop,
    load_points,
    load_program,
)


@pytest.fixture
def points(tmp_path):
    def load(text, settings=None, unit=None):
        file = tmp_path / "points.csv"
        file.write_text(text)
        # By the end of its name it is the same.
        return load_program(file, settings, unit)

    return load


def run_of(program) -> PathRun:
    run, end = program.steps
    assert isinstance(end, ProgramStop)
    return run


def test_points_are_a_path_with_tolerances_and_speeds(points):
    text = "x [mm],y [mm],z [mm],tolerance [mm],speed [mm/min]\n0,0,250,,\n10,0,250,0.5,600\n"
    run = run_of(points(text + "10,20,250,,\n10,20,250,,\n# end\n0,0,260,1,1200\n"))
    assert run.start == pytest.approx((0.0, 0.0, 0.25))
    np.testing.assert_allclose(
        run.segments.numbers.reshape(-1, 3), [[0.01, 0, 0.25], [0.01, 0.02, 0.25], [0, 0, 0.26]]
    )
    np.testing.assert_allclose(run.segments.tolerances, [5e-4, 5e-5, 1e-3])
    np.testing.assert_allclose(run.segments.speeds, [0.01, math.inf, 0.02])
    # The point that stands twice makes no line.
    assert run.lines.tolist() == [3, 4, 7]


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("0,0,250\n10,0,250\n", "mm"),
        ("0,0,0.25\n0.01,0,0.25\n", "m"),
        ("z,y,x\n250,0,0\n250,0,10\n", "mm"),
        ("x [m],y,z\n0,0,0.25\n0.01,0,0.25\n", None),
        ("speed [m/s],x,y,z [mm]\n,0,0,250\n,10,0,250\n", None),
        ("0,0,250,0.05,0\n10,0,250,0.05,0\n", "mm"),
    ],
)
def test_units_come_from_a_head_or_an_option(points, text, unit):
    run = run_of(points(text, unit=unit))
    np.testing.assert_allclose(run.segments.numbers, [0.01, 0.0, 0.25])
    np.testing.assert_allclose(run.segments.tolerances, [5e-5])
    assert run.segments.speeds.tolist() == [math.inf]


def test_settings_give_what_the_points_do_not(points):
    settings = ProgramSettings(tolerance=2e-3, feed=0.1)
    run = run_of(points("0,0,250\n10,0,250\n20,1,250\n", settings, "mm"))
    assert run.segments.tolerances.tolist() == [2e-3] * 2
    assert run.segments.speeds.tolist() == [0.1] * 2


HEAD = "x [mm],y,z,tolerance,speed\n"


@pytest.mark.parametrize(
    ("text", "line", "column", "reason"),
    [
        ("0,0,250\n1,0,250\n", 0, 1, "x has no unit: name it in a head.*--unit"),
        ("x,y,w\n1,2,3\n", 1, 3, "w is no column of points; known are x, y, z, tolerance, speed"),
        ("x [mm],y\n1,2\n", 1, 0, "has no column z"),
        ("x [cm],y,z\n1,2,3\n", 1, 1, "cm is no unit of x; known are m, mm"),
        ("x [mm],y,z,speed [mm]\n1,2,3,4\n", 1, 4, "mm is no unit of speed; known are m/s"),
        ("1,2\n3,4\n", 1, 0, "has 2 columns"),
        (HEAD + "0,0,250,0,0\n1,,250,0,0\n", 3, 2, "y is empty"),
        (HEAD + "0,0,250,0,0\n1,0,250,-1,0\n", 3, 4, "tolerance must be at least 0"),
        (HEAD + "0,0,250,0,0\n1,0,250,0,-5\n", 3, 5, "speed must be at least 0"),
        (HEAD + "0,0,250,0,0\n0,0,250.0001,0,0\n", 0, 0, "has one place only"),
        (HEAD + "0,0,250,0,0\n9e9,0,250,0,0\n", 3, 1, "x must be at most 100 m"),
        (HEAD + "0,0,250,0,0\n1,0,250,0,1e-9\n", 3, 5, "speed must be 0, or at least 1e-05"),
        (HEAD + "0,0,250,0,0\n1,0,250,0,1e10\n", 3, 5, "speed must be at most 1e\\+06 m/s"),
        (HEAD + "0,0,250,0,0\n1,0,250,1e9,0\n", 3, 4, "tolerance must be at most 100 m"),
    ],
)
def test_a_mistake_is_told_with_line_and_column(points, text, line, column, reason):
    with pytest.raises(ProgramError, match=reason) as told:
        points(text)
    assert (told.value.line, told.value.column) == (line, column)


def test_a_missing_file_is_a_mistake_of_a_program(tmp_path):
    with pytest.raises(ProgramError, match="cannot be read"):
        load_points(tmp_path / "none.csv")
