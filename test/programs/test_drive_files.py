"""Files to be driven: what they mean, and what is wrong with others."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.programs import DriveFileError, Dwell, MoveStep, PathStep, load_drive
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

EXAMPLE = Path(__file__).parents[2] / "config" / "drive_example.yaml"
HOME = {"move": {"to": [0.0, 0.0, 250.0]}}


@pytest.fixture
def load(tmp_path):
    """Return a function that writes a file and reads it."""

    def loaded(*steps, **keys):
        file = tmp_path / "drive.yaml"
        file.write_text(yaml.safe_dump({"unit": "mm", "steps": list(steps), **keys}))
        return load_drive(file)

    return loaded


def path_of(*segments):
    return {"path": {"segments": list(segments)}}


def test_the_example_is_a_drive_inside_the_default_machine():
    drive = load_drive(EXAMPLE)
    kinds = [type(step) for step in drive.steps]
    assert kinds == [MoveStep, PathStep, Dwell, PathStep, MoveStep]
    assert drive.steps[0].position == (0.0, 0.0, 0.25)
    limits = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
    workspace = Workspace(TriGlide(DEFAULT_GEOMETRY), limits)
    for step in drive.steps:
        if isinstance(step, PathStep):
            for place in step.path.position(np.linspace(0.0, step.path.length, 200)).tolist():
                workspace.check_position(place)


def test_segments_mean_what_the_path_of_the_same_numbers_means(load):
    drive = load(
        HOME,
        path_of(
            {"line": {"to": [40, 0, 250]}},
            {"arc": {"via": [60, 20, 250], "to": [40, 40, 250], "tolerance": 0.5}},
            {"circle": {"centre": [40, 50, 250], "axis": [0, 0, 2], "angle": -90, "speed": 10}},
        ),
        defaults={"tolerance": 2, "speed": 200},
    )
    expected = (
        PlatformPath.start((0.0, 0.0, 0.25))
        .line_to((0.04, 0.0, 0.25), 0.002, 0.2)
        .arc_to((0.06, 0.02, 0.25), (0.04, 0.04, 0.25), 0.0005, 0.2)
        .arc_about((0.04, 0.05, 0.25), (0.0, 0.0, 1.0), -0.5 * np.pi, 0.002, 0.01)
    ).segments
    found = drive.steps[1].path.segments
    for name in ("points", "lengths", "tangents", "curvatures", "tolerances", "speeds"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), atol=1e-15)


def test_metres_and_no_bounds_where_nothing_is_said(load):
    drive = load(
        {"move": {"to": [0, 0, "25e-2"]}}, path_of({"line": {"to": [0, 0, 0.3]}}), unit="m"
    )
    assert drive.frame == ""
    assert drive.steps[0].position == (0.0, 0.0, 0.25)
    segments = drive.steps[1].path.segments
    assert segments.tolerances.tolist() == [0.0]
    assert segments.speeds.tolist() == [np.inf]


def test_a_move_has_only_the_speed_that_it_names(load):
    slow = {"move": {"to": [0, 0, 300], "speed": 50}}
    drive = load(HOME, slow, defaults={"speed": 200})
    assert [step.speed for step in drive.steps] == [0.0, 0.05]


def test_a_path_that_comes_first_begins_where_the_machine_is(load):
    line = path_of({"line": {"to": [0, 0, 300]}})
    circle = path_of({"circle": {"centre": [0, 10, 300], "axis": [0, 0, 1], "angle": 360}})
    drive = load(circle, line, line_to(0, 0, 250), {"wait": {"seconds": 1}})
    assert [step.path is None for step in drive.steps[:3]] == [True, True, False]


def line_to(*place):
    return path_of({"line": {"to": list(place)}})


WRONG = {
    "no steps": ((), {}, "steps: is [], must be a list of one entry at least"),
    "unknown step": (({"fly": {}},), {}, "step 1: has fly, must have one of move, path, wait"),
    "two in one": (({**HOME, "wait": {}},), {}, "step 1: has move, wait, must have one of"),
    "no keys": ((HOME, {"wait": 3}), {}, "step 2 (wait): is 3, must be keys with values"),
    "no place": (({"move": {}},), {}, "step 1 (move), to: is missing"),
    "two numbers": (({"move": {"to": [1, 2]}},), {}, "to: is [1, 2], must be a list of 3 numbers"),
    "misspelt": (
        (HOME, path_of({"line": {"to": [1, 2, 3], "toleranz": 1}})),
        {},
        "step 2 (path), segment 1 (line), toleranz: is not known here; known are to, tolerance,",
    ),
    "negative tolerance": (
        (path_of({"line": {"to": [1, 2, 3], "tolerance": -1}}),),
        {},
        "segment 1 (line), tolerance: is -1, must be at least 0",
    ),
    "negative wait": (({"wait": {"seconds": -2}},), {}, "seconds: is -2, must be at least 0"),
    "unknown segment": ((path_of({"spline": {}}),), {}, "segment 1: has spline, must have one of"),
    "line without length": ((HOME, line_to(0, 0, 250)), {}, "step 2 (path): segment 1 ends where"),
    "no arc": (
        (HOME, path_of({"arc": {"via": [1, 0, 250], "to": [2, 0, 250]}})),
        {},
        "step 2 (path): segment 1",
    ),
    "huge": ((HOME, line_to(1e9, 0, 0)), {}, "number 1 of segment 1 = 1000000 must be at most 100"),
    "unit": ((HOME,), {"unit": "inch"}, "unit: is 'inch', must be one of m, mm"),
    "default": ((HOME,), {"defaults": {"speed": "fast"}}, "defaults, speed: is 'fast'"),
    "unknown key": ((HOME,), {"stepps": []}, "stepps: is not known here; known are"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_named_with_file_and_place(load, name):
    steps, keys, text = WRONG[name]
    with pytest.raises(DriveFileError) as caught:
        load(*steps, **keys)
    assert text in str(caught.value)
    assert "drive.yaml: " in str(caught.value)


@pytest.mark.parametrize(
    ("content", "text"),
    [(b"\xff\xfe", "cannot be read"), (b"a: [", "is not YAML"), (b"", "is None, must be keys")],
)
def test_what_is_no_such_file_at_all(tmp_path, content, text):
    file = tmp_path / "drive.yaml"
    file.write_bytes(content)
    with pytest.raises(DriveFileError, match=text):
        load_drive(file)
    with pytest.raises(DriveFileError, match="cannot be read"):
        load_drive(tmp_path / "none.yaml")
