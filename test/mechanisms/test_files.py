"""Mechanism files: those in config/ hold the sources' mechanisms, and mistakes are named."""

import math
from pathlib import Path

import numpy as np
import pytest
from f_mechanism_samples import example_1, example_2

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms import MechanismFileError
from tri_glide_kinematics.mechanisms.files import load_mechanism
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.mechanisms.landing_gear import LandingGearMotion

CONFIG = Path(__file__).parents[2] / "config"
MM = 1e-3


@pytest.mark.parametrize(
    ("name", "expected", "point"),
    [
        ("four_bar_textbook", FourBar(0.02, 0.07, 0.09, 0.06), (0.035, 0.02)),
        (
            "four_bar_sheet",
            # Source 002.
            FourBar.from_joints(
                (0.0, 0.0), (0.065183, 0.045552), (0.028332, 0.046047), (-0.074783, 0.004195)
            ),
            (0.018427, 0.0),
        ),
    ],
)
def test_four_bars_of_the_sources(name, expected, point):
    read = load_mechanism(CONFIG / f"{name}.yaml")
    assert read.mechanism == expected
    assert read.coupler_point == point


@pytest.mark.parametrize(("number", "in_mm"), [(1, example_1()), (2, example_2())])
def test_f_mechanisms_of_the_source(number, in_mm):
    read = load_mechanism(CONFIG / f"f_mechanism_example_{number}.yaml").mechanism
    for field in ("pivots", "cranks", "rods", "joints"):
        expected = np.array(getattr(in_mm.linkage, field)) * MM
        assert np.allclose(getattr(read.linkage, field), expected, rtol=0.0, atol=1e-15)
    assert read.linkage.speeds == in_mm.linkage.speeds
    assert read.linkage.phases == pytest.approx(in_mm.linkage.phases, abs=1e-15)


def test_landing_gear():
    gear = load_mechanism(CONFIG / "landing_gear.yaml").mechanism
    state = gear.state(LandingGearMotion(pitch_angle=0.0, retraction_angle=0.0))
    # At rest the hinge carries the weight.
    assert np.allclose(state.hinge.force, (0.0, 0.0, 150.0 * 9.80665))


FOUR_BAR = "{crank: 2, coupler: 7, rocker: 9, ground: 6"
BASE = "base: [[0, 0], [1, 0], [1, 1]]"
WHOLE = f"f_mechanism: {{{BASE}, platform: [[0, 0], [1, 0], [1, 1]]"
WHOLE += ", crank_lengths: [1, 1, 1], rod_lengths: [1, 1, 1]"
GEAR = "landing_gear: {l1: 1, l2: 1, l3: 1, l4: 1, gear_mass: 1, wheel_mass: 1"
GEAR += ", wheel_axial_inertia: 1, wheel_transverse_inertia: 1, gear_inertia"


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ("", FourBar(2.0, 7.0, 9.0, 6.0)),
        (", tolerance: 1e-9", FourBar(2.0, 7.0, 9.0, 6.0, tolerance=1e-9)),
        (", ground_angle_degrees: 90", FourBar(2.0, 7.0, 9.0, 6.0, ground_angle=math.pi / 2.0)),
        (", crank_pivot: [1, -1.5]", FourBar(2.0, 7.0, 9.0, 6.0, crank_pivot=(1.0, -1.5))),
    ],
)
def test_optional_keys_of_a_four_bar(tmp_path, keys, expected):
    path = tmp_path / "linkage.yaml"
    path.write_text(f"four_bar: {FOUR_BAR}{keys}}}\n")
    read = load_mechanism(path)
    assert read.mechanism == expected
    assert read.coupler_point == (0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "key", "reason"),
    [
        ("four_bar: {", "line 1, column 12", "is not YAML: "),
        ("four_bar:\n  crank: 2\n  crank: 3", "lines 2 and 3", "the key 'crank' stands twice"),
        ("four_bar: !!python/object:os.system {}", "line 1, column 11", "is not YAML: "),
        ("", "", "must hold one section, named one of four_bar, f_mechanism, landing_gear"),
        ("- 1", "", "must hold one section"),
        ("four_bar: {}\nlanding_gear: {}", "", "must hold one section"),
        ("five_bar: {}", "five_bar", "is no kind of mechanism: must be one of four_bar, "),
        ("four_bar: 3", "four_bar", "is 3, must be keys with values"),
        ("four_bar: {crank: 2, coupler: 7, rocker: 9}", "four_bar.ground", "is missing"),
        (f"four_bar: {FOUR_BAR}, gruond: 6}}", "four_bar.gruond", "is not known here"),
        ("four_bar: {crank: long}", "four_bar.crank", "is 'long', must be a finite number"),
        ("four_bar: {crank: true}", "four_bar.crank", "is True, must be a finite number"),
        ("four_bar: {crank: [1]}", "four_bar.crank", "is [1], must be a finite number"),
        (f"four_bar: {{crank: 1{'0' * 400}}}", "four_bar.crank", "must be a finite number"),
        ("four_bar: {crank:}", "four_bar.crank", "is missing"),
        (f"four_bar: {FOUR_BAR}, crank_pivot: 0}}", "four_bar.crank_pivot", "must be a list of 2"),
        (f"four_bar: {FOUR_BAR}, coupler_point: [0, x]}}", "four_bar.coupler_point[1]", "is 'x', "),
        ("four_bar: {crank_pin: [0, 1]}", "four_bar.crank_pivot", "is missing"),
        ("four_bar: {crank: 0, coupler: 7, rocker: 9, ground: 6}", "four_bar", "crank = 0 m must"),
        ("four_bar: {crank: .nan}", "four_bar.crank", "is nan, must be a finite number"),
        (
            "four_bar: {crank: 20, coupler: 7, rocker: 5, ground: 6}",
            "four_bar",
            "crank = 20 m must",
        ),
        ("f_mechanism: {base: [[0, 0], [1, 0]]}", "f_mechanism.base", "must be a list of 3 points"),
        (
            "f_mechanism: {base: [[0, 0], [1, 0], [1]]}",
            "f_mechanism.base[2]",
            "a list of 2 numbers",
        ),
        (f"f_mechanism: {{{BASE}, crank_lengths: [1]}}", "f_mechanism.crank_lengths", "list of 3"),
        (f"{WHOLE}, counter_rotating: 1}}", "f_mechanism.counter_rotating", "be true or false"),
        (f"{GEAR}: [[1, 0], [0, 1]]}}", "landing_gear.gear_inertia", "3 rows of 3 numbers"),
        (f"{GEAR}: [1, 2, 3]}}", "landing_gear.gear_inertia[0]", "must be a list of 3 numbers"),
    ],
)
def test_a_mistake_is_named_with_its_file_and_key(tmp_path, text, key, reason):
    path = tmp_path / "wrong.yaml"
    path.write_text(text)
    with pytest.raises(MechanismFileError) as caught:
        load_mechanism(path)
    error = caught.value
    assert isinstance(error, KinematicsError)
    assert (error.path, error.key) == (str(path), key)
    assert reason in error.reason
    assert str(error).startswith(f"{path}: {key}: " if key else f"{path}: ")
    assert "\n" not in str(error)


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00"])
def test_an_unreadable_file_is_said(tmp_path, content):
    path = tmp_path / "no.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(MechanismFileError, match=r"no\.yaml: cannot be read: "):
        load_mechanism(path)
