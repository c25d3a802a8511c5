"""Settings of programs, in a file and from Python."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.programs import (
    Dialect,
    ProgramSettings,
    SettingsError,
    load_own_settings,
    load_settings,
)

EXAMPLE = Path(__file__).parents[2] / "config" / "program_settings.yaml"

WHOLE = {
    "unit": "mm",
    "dialect": "marlin",
    "start": [0, 0, 300],
    "home": [0, 0, 310],
    "tolerance": 0.2,
    "feed": 20,
    "block_delete": False,
    "optional_stop": False,
    "ignored": ["m104", "START_PRINT"],
    "offsets": {"G54": [1, 2, 3], "G59.3": [0, 0, 5]},
    "tools": {3: [0, 0, 50]},
}


@pytest.fixture
def load(tmp_path):
    """Return a function that writes a file and reads it."""

    def loaded(others=None, **keys):
        file = tmp_path / "settings.yaml"
        file.write_text(yaml.safe_dump(keys))
        return load_settings(file, others)

    return loaded


def test_a_whole_file(load):
    settings = load(**WHOLE)
    assert settings.dialect is Dialect.MARLIN
    assert settings.start == (0.0, 0.0, 0.3)
    assert settings.home == (0.0, 0.0, 0.31)
    assert settings.offsets == {"G54": (0.001, 0.002, 0.003), "G59.3": (0.0, 0.0, 0.005)}
    assert settings.tools == {3: (0.0, 0.0, 0.05)}
    assert (settings.tolerance, settings.feed) == (2e-4, 0.02)
    assert not settings.block_delete
    assert not settings.optional_stop
    assert settings.ignored == {"M104", "START_PRINT"}


def test_the_example_is_read():
    settings = load_settings(EXAMPLE)
    assert settings.home == (0.0, 0.0, 0.3)
    assert settings.offsets["G54"] == (0.0, 0.0, 0.25)


def test_what_is_not_named_is_as_without_a_file(load):
    assert load(unit="mm") == ProgramSettings()


def test_what_is_not_named_is_as_in_other_settings(load):
    others = load(**WHOLE)
    assert load(others) == others
    own = load(others, offsets={"G55": [0.0, 0.0, 0.1]}, tolerance=0.0)
    assert own == replace(others, offsets={**others.offsets, "G55": (0.0, 0.0, 0.1)}, tolerance=0.0)


def test_lengths_are_in_mm_where_a_printer_is_named_and_no_unit(load):
    assert load(dialect="klipper", home=[0, 0, 300]).home == (0.0, 0.0, 0.3)
    assert load(dialect="nist", home=[0, 0, 0.3]).home == (0.0, 0.0, 0.3)


def test_own_settings_change_what_they_name_of_the_packaged_ones(tmp_path):
    own = tmp_path / "own.yaml"
    own.write_text("dialect: marlin\n")
    assert load_own_settings(own) == replace(load_settings(EXAMPLE), dialect=Dialect.MARLIN)


@pytest.mark.parametrize("dialect", ["marlin", "klipper", "reprap", "grbl"])
def test_settings_of_each_kind_come_with_the_package(dialect):
    own = load_own_settings(f"program_settings_{dialect}.yaml")
    assert own == replace(load_settings(EXAMPLE), dialect=Dialect(dialect))


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"dialect": "fanuc"}, "dialect: is 'fanuc', must be one of nist, marlin, reprap, klipper"),
        ({"home": [0, 0, 300]}, "home = 300 m must be within 100 m"),
        ({"home": [1, 2]}, "home: is .1, 2., must be a list of 3 numbers"),
        ({"offsets": {"G60": [0, 0, 0]}}, "offset G60 must be one of G54, G55"),
        ({"offsets": [1]}, "offsets: is .1., must be keys with values"),
        ({"offsets": {"G54": 5}}, "offsets, G54: is 5, must be a list of 3 numbers"),
        ({"tools": {"a": [0, 0, 0]}}, "tool 'a' must be a whole number, at least 1"),
        ({"tools": {0: [0, 0, 0]}}, "tool 0 must be a whole number, at least 1"),
        ({"tolerance": -1}, "tolerance: is -1, must be at least 0"),
        ({"feed": -1}, "feed: is -1, must be at least 0"),
        ({"block_delete": 1}, "block_delete: is 1, must be true or false"),
        ({"ignored": "M104"}, "ignored: is .M104., must be a list of texts"),
        ({"speed": 1}, "speed: is not known here; known are dialect, unit"),
    ],
)
def test_what_is_wrong_is_named(load, keys, text):
    with pytest.raises(SettingsError, match=f"settings.yaml: .*{text}"):
        load(**keys)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"dialect": "nist"}, "dialect = 'nist' must be Dialect.NIST"),
        ({"home": (0.0, 0.0, float("nan"))}, "home.2. = nan"),
        ({"tools": {1: (0.0, 0.0)}}, "tool 1 has shape"),
        ({"tolerance": -1.0}, "tolerance = -1 m must be at least 0"),
        ({"feed": 0.0}, "feed = 0 m/s must be greater than 0"),
        ({"feed": 1e-6}, "feed = 1e-06 m/s must be at least 1e-05"),
        ({"feed": 1e7}, r"feed = .* must be at most 1e\+06"),
        ({"tolerance": 101.0}, "tolerance = 101 m must be at most 100"),
    ],
)
def test_what_is_wrong_is_named_in_python_too(keys, text):
    with pytest.raises(KinematicsError, match=text):
        ProgramSettings(**keys)
