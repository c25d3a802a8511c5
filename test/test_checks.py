import math

import numpy as np
import pytest

from tri_glide_kinematics import checks
from tri_glide_kinematics.errors import (
    KinematicsError,
    NotANumberError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.non_negative])
def test_not_finite_is_refused_by_name(check, value):
    with pytest.raises(NotFiniteError, match=f"speed = {value} is not a finite number") as caught:
        check("speed", value)
    assert caught.value.name == "speed"


@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.non_negative])
def test_numbers_become_plain_floats(check):
    for value in (3, np.float32(3.0), np.int64(3), np.array(3.0)):
        assert type(check("count", value)) is float
        assert check("count", value) == 3.0


def test_bounds():
    assert checks.non_negative("gap", 0.0) == 0.0
    assert checks.positive("gap", 5e-324) == 5e-324
    with pytest.raises(OutOfBoundsError, match=r"gap = 0 m must be greater than 0 m") as caught:
        checks.positive("gap", 0.0, "m")
    assert (caught.value.value, caught.value.bound, caught.value.unit) == (
        0.0,
        "greater than 0",
        "m",
    )
    with pytest.raises(OutOfBoundsError, match=r"^gap = -0.25 must be at least 0$"):
        checks.non_negative("gap", -0.25)


def test_vector():
    assert checks.finite_vector("v", np.arange(3), 3) == (0.0, 1.0, 2.0)
    with pytest.raises(WrongShapeError, match=r"v has shape \(2,\), expected \(3,\)") as caught:
        checks.finite_vector("v", (1.0, 2.0), 3)
    assert caught.value.shape == (2,)
    with pytest.raises(NotFiniteError, match=r"v\[1\] = nan"):
        checks.finite_vector("v", (1.0, math.nan, math.inf), 3)


def test_array():
    array = checks.array_of_shape("points", [[1, 2, 3]], (None, 3))
    assert array.dtype == np.float64
    assert array.shape == (1, 3)
    assert checks.array_of_shape("points", np.empty((0, 3)), (None, 3)).shape == (0, 3)
    for wrong in (1.0, [1, 2, 3], [[1, 2]], np.zeros((2, 3, 1))):
        with pytest.raises(WrongShapeError, match=r"expected \(n, 3\)") as caught:
            checks.array_of_shape("points", wrong, (None, 3))
        assert caught.value.shape == np.shape(wrong)


def test_all_errors_have_one_base_that_is_a_value_error():
    assert issubclass(KinematicsError, ValueError)
    for error in (NotFiniteError, OutOfBoundsError, WrongShapeError):
        assert issubclass(error, KinematicsError)


@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.non_negative])
def test_huge_numbers_are_refused(check):
    assert check("length", 1e30) == 1e30
    with pytest.raises(OutOfBoundsError, match=r"length = 1e\+300 must be at most 1e\+30"):
        check("length", 1e300)


def test_huge_numbers_in_vectors_are_refused_by_name():
    assert checks.finite_vector("v", (1e30, -1e30), 2) == (1e30, -1e30)
    with pytest.raises(OutOfBoundsError, match=r"v\[1\] = -1e\+31 must be at most 1e\+30"):
        checks.finite_vector("v", (0.0, -1e31), 2)


def test_an_empty_list_has_no_rows():
    assert checks.array_of_shape("points", [], (None, 3)).shape == (0, 3)
    assert checks.array_of_shape("angles", [], (None,)).shape == (0,)
    with pytest.raises(WrongShapeError):
        checks.array_of_shape("point", [], (3,))


def test_finite_array():
    assert checks.finite_array("angle", 1.0, ()).shape == ()
    for value in (math.nan, -math.inf, 1e31):
        error = OutOfBoundsError if math.isfinite(value) else NotFiniteError
        with pytest.raises(error, match=r"points\[1\]\[0\]"):
            checks.finite_array("points", [[1.0, 2.0], [value, value]], (None, 2))


@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.non_negative])
@pytest.mark.parametrize("value", ["abc", "1.5", b"1", None, [1.0, 2.0], 1j])
def test_what_is_no_number_is_refused_by_name(check, value):
    with pytest.raises(NotANumberError, match=r"^speed = .* is not a number$") as caught:
        check("speed", value)
    assert (caught.value.name, caught.value.value) == ("speed", value)


def test_what_is_no_vector_is_refused_by_name():
    for value in (0.3, None, "ab"):
        with pytest.raises(WrongShapeError, match=r"v has shape .*, expected \(3,\)"):
            checks.finite_vector("v", value, 3)
    with pytest.raises(NotANumberError, match=r"v\[2\] = 'c' is not a number"):
        checks.finite_vector("v", [1, 2, "c"], 3)
    with pytest.raises(NotANumberError, match=r"points = .* is not a number"):
        checks.array_of_shape("points", [["a", "b", "c"]], (None, 3))


def test_a_whole_number_too_large_for_a_float_is_not_finite():
    with pytest.raises(NotFiniteError, match="count = -inf"):
        checks.finite("count", -(10**400))
