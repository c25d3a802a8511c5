"""Keys of YAML files: what they say, and what is wrong with them."""

import math

import pytest

from tri_glide_kinematics.keys import FileError, Keys, load_yaml


class OtherError(FileError):
    """As a room has its own."""


class OtherKeys(Keys):
    """Keys whose mistakes are another error."""

    error_class = OtherError


def test_units_of_lengths():
    assert Keys("file", "", {}).unit() == 1.0
    assert Keys("file", "", {"unit": "mm"}).unit() == 0.001
    with pytest.raises(FileError, match="file: unit: is 'cm', must be one of m, mm"):
        Keys("file", "", {"unit": "cm"}).unit()


def test_choices_switches_and_texts():
    keys = Keys("file", "", {"a": "x", "b": True, "c": ["y", "z"], "d": 1})
    assert keys.choice("a", ("x", "y")) == "x"
    assert keys.choice("none", ("x", "y"), "") == ""
    assert keys.switch("b") is keys.switch("none", True) is True
    assert keys.texts("c", ()) == ["y", "z"]
    assert keys.has("d") and not keys.has("e")
    with pytest.raises(FileError, match="file: a: is 'x', must be one of y, z"):
        keys.choice("a", ("y", "z"))
    with pytest.raises(FileError, match="d: is 1, must be true or false"):
        keys.switch("d")
    with pytest.raises(FileError, match="d: is 1, must be a list of texts"):
        keys.texts("d", ())


@pytest.mark.parametrize("value", [[1, 2, 3], [1], "1, 2", [1, math.nan], [1, True], None])
def test_so_many_finite_numbers(value):
    keys = Keys("file", "touch 1", {})
    assert keys.numbers("tilt", [1, "2e-3"], 2) == (1.0, 0.002)
    with pytest.raises(FileError, match=r"file: touch 1, tilt.*: is .*, must be a"):
        keys.numbers("tilt", value, 2)


def test_mistakes_are_the_error_of_the_room(tmp_path):
    with pytest.raises(OtherError):
        OtherKeys("file", "", 3)
    with pytest.raises(OtherError):
        OtherKeys("file", "", {"a": "b"}).number("a")
    with pytest.raises(OtherError, match="cannot be read"):
        load_yaml(tmp_path / "none.yaml", OtherError)
    file = tmp_path / "file.yaml"
    file.write_text("a: {b: c}\n")
    entry = OtherError.keys_of(file).within("a", {"b": "c"})
    with pytest.raises(OtherError, match=r"file\.yaml: a, b: is 'c', must be a finite number"):
        entry.number("b")


@pytest.mark.parametrize(
    ("text", "lines", "key"),
    [
        ("unit: mm\nunit: m\n", "lines 1 and 2", "unit"),
        ('a: 1\nb:\n  - {c: 1,\n     "c": 2}\n', "lines 3 and 4", "c"),
        ("a: {b: 1, b: 1}\n", "line 1", "b"),
        ("? [{a: 1, a: 2}]\n: 1\n", "line 1", "a"),
    ],
)
def test_a_key_that_stands_twice_is_refused(tmp_path, text, lines, key):
    file = tmp_path / "file.yaml"
    file.write_text(text)
    with pytest.raises(OtherError, match=f": {lines}: the key '{key}' stands twice"):
        load_yaml(file, OtherError)


def test_an_entry_that_holds_itself_has_an_end(tmp_path):
    file = tmp_path / "file.yaml"
    file.write_text("a: &a\n  b: [*a]\n")
    entry = load_yaml(file, OtherError)["a"]
    assert entry["b"][0] is entry


def test_equal_keys_of_different_entries_are_no_mistake(tmp_path):
    file = tmp_path / "file.yaml"
    file.write_text("a: &a {c: 1, d: 2}\nb: {<<: *a, c: 3}\n")
    assert load_yaml(file, OtherError) == {"a": {"c": 1, "d": 2}, "b": {"c": 3, "d": 2}}
