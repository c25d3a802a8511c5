import math
from array import array

import pytest

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.settings import Parameter, ParameterError, change_text, start_text
from tri_glide_kinematics.settings.tables import markdown_table, plain_list

RATE = Parameter("rate", 500.0, "setpoints per second", "1/s", 10.0, 2000.0)
LIMITS = Parameter("limits", (1.0, 1.0, 1.0), "limit of each", "m/s", 0.1, 9.0, live=True)
KIND = Parameter("kind", "a", "which one", choices=("a", "b"))
KINDS = Parameter("kinds", ("a",), "which ones", choices=("a", "b"), any_size=True)
FLAG = Parameter("flag", False, "whether or not")
NAME = Parameter("name", "a", "its name", told=True)


def test_valid_values_come_back_with_arrays_as_tuples():
    assert RATE.checked(10.0) == 10.0
    assert RATE.checked(2000.0) == 2000.0
    assert LIMITS.checked([1.0, 2.0, 3.0]) == (1.0, 2.0, 3.0)
    assert KIND.checked("b") == "b"
    assert KINDS.checked(["b", "a"]) == ("b", "a")
    assert FLAG.checked(True) is True


def test_integers_become_doubles_where_these_are_wanted():
    rate = RATE.checked(500)
    assert (rate, type(rate)) == (500.0, float)
    limits = LIMITS.checked(array("q", [1, 2, 3]))
    assert limits == (1.0, 2.0, 3.0)
    assert {type(limit) for limit in limits} == {float}


@pytest.mark.parametrize(
    ("parameter", "value", "error", "text"),
    [
        (RATE, 9.9, OutOfBoundsError, "rate = 9.9 1/s must be at least 10 1/s"),
        (RATE, 2001.0, OutOfBoundsError, "rate = 2001 1/s must be at most 2000 1/s"),
        (RATE, math.nan, NotFiniteError, "rate = nan"),
        (RATE, math.inf, NotFiniteError, "rate = inf"),
        (LIMITS, [1.0, 2.0], ParameterError, "limits has 2 elements, expected 3"),
        (LIMITS, [], ParameterError, "limits has 0 elements"),
        (LIMITS, [1.0, 0.0, 1.0], OutOfBoundsError, "limits[1] = 0 m/s must be at least 0.1"),
        (LIMITS, [1.0, 1.0, math.nan], NotFiniteError, "limits[2] = nan"),
        (KIND, "c", ParameterError, "kind = 'c' must be one of a, b"),
        (KINDS, ["a", "x"], ParameterError, "kinds[1] = 'x' must be one of a, b"),
        (KINDS, [], ParameterError, "kinds has 0 elements, expected at least one"),
        (KINDS, None, ParameterError, "kinds has 0 elements, expected at least one"),
        (RATE, 3, OutOfBoundsError, "rate = 3 1/s must be at least 10 1/s"),
        (RATE, "fast", ParameterError, "rate = 'fast' must be a double"),
        (RATE, True, ParameterError, "rate = True must be a double"),
        (RATE, None, ParameterError, "rate = [] must be a double"),
        (RATE, array("q", [1, 2]), ParameterError, "rate = [1, 2] must be a double"),
        (LIMITS, 1.0, ParameterError, "limits = 1.0 must be an array, double[3]"),
        (LIMITS, ["a", "b", "c"], ParameterError, "limits[0] = 'a' must be a double"),
        (KIND, 1, ParameterError, "kind = 1 must be a string"),
        (KINDS, "a", ParameterError, "kinds = 'a' must be an array, string[]"),
        (FLAG, 1, ParameterError, "flag = 1 must be a bool"),
    ],
)
def test_invalid_values_are_named(parameter, value, error, text):
    with pytest.raises(error) as raised:
        parameter.checked(value)
    assert text in str(raised.value)


def test_table_says_all_about_each_parameter():
    lines = markdown_table([RATE, LIMITS, KIND, KINDS, FLAG]).splitlines()
    assert lines[2:] == [
        "| `rate` | double | `500.0` | 1/s | 10 to 2000 | no | setpoints per second |",
        "| `limits` | double[3] | `[1.0, 1.0, 1.0]` | m/s | 0.1 to 9 | yes | limit of each |",
        "| `kind` | string | `a` |  | `a`, `b` | no | which one |",
        "| `kinds` | string[] | `[a]` |  | `a`, `b` | no | which ones |",
        "| `flag` | bool | `false` |  |  | no | whether or not |",
    ]
    assert RATE.description == "setpoints per second [1/s]"
    assert FLAG.description == "whether or not"


def test_list_for_a_terminal_says_all_too():
    assert plain_list([RATE, LIMITS, KIND]).splitlines() == [
        "  rate (double 1/s; default 500.0; 10 to 2000)",
        "      setpoints per second",
        "  limits (double[3] m/s; default [1.0, 1.0, 1.0]; 0.1 to 9; live)",
        "      limit of each",
        "  kind (string; default a; a, b)",
        "      which one",
    ]


def test_a_node_tells_its_main_and_its_changed_parameters():
    table = (RATE, LIMITS, NAME)
    default = {"rate": 500.0, "limits": (1.0, 1.0, 1.0), "name": "a"}
    assert start_text(table, default) == "name a, all else as by default"
    assert start_text(table, {**default, "limits": (1.0, 0.5, 1.0), "name": "b"}) == (
        "limits [1, 0.5, 1] m/s (default [1, 1, 1] m/s), name b (default a), all else as by default"
    )
    assert start_text((), {}) == "no parameters"


def test_changes_are_told_with_both_values():
    table = (RATE, LIMITS, FLAG)
    before = {"rate": 500.0, "limits": (1.0, 1.0, 1.0), "flag": False}
    after = {"rate": 250.0, "limits": (1.0, 1.0, 1.0), "flag": True}
    assert change_text(table, before, after) == "rate: 500 1/s -> 250 1/s, flag: false -> true"
    assert change_text(table, before, before) == ""
