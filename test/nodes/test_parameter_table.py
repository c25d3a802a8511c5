from __future__ import annotations

import math

import pytest

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.nodes.parameter_table import Parameter, ParameterError, markdown_table

RATE = Parameter("rate", 500.0, "setpoints per second", "1/s", 10.0, 2000.0)
LIMITS = Parameter("limits", (1.0, 1.0, 1.0), "limit of each", "m/s", 0.1, 9.0, live=True)
KIND = Parameter("kind", "a", "which one", choices=("a", "b"))
KINDS = Parameter("kinds", ("a",), "which ones", choices=("a", "b"), any_size=True)
FLAG = Parameter("flag", False, "whether or not")


def test_valid_values_come_back_with_arrays_as_tuples():
    assert RATE.checked(10.0) == 10.0
    assert RATE.checked(2000.0) == 2000.0
    assert LIMITS.checked([1.0, 2.0, 3.0]) == (1.0, 2.0, 3.0)
    assert KIND.checked("b") == "b"
    assert KINDS.checked(["b", "a"]) == ("b", "a")
    assert FLAG.checked(True) is True


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
        (KINDS, [], ParameterError, "kinds has 0 elements"),
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
