"""Numbers in messages."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.tri_glide.errors import ArmTooShortError
from tri_glide_kinematics.wording import number_text, vector_text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (8.32667268e-17, "0"),
        (-8.32667268e-17, "0"),
        (1e-9, "1e-09"),
        (-0.25, "-0.25"),
        (0.1 + 0.2, "0.3"),
        (np.float64(-0.0), "0"),
        (math.nan, "nan"),
        (-math.inf, "-inf"),
        (500, "500"),
    ],
)
def test_numbers_are_written_as_a_person_would(value, text):
    assert number_text(value) == text


def test_digits_are_significant_ones():
    assert number_text(0.123456789, digits=3) == "0.123"


def test_what_counts_as_zero_depends_on_the_scale():
    assert number_text(1e-9, scale=1e4) == "0"
    assert number_text(-1e-300, scale=0.0) == "-1e-300"
    assert number_text(-0.0, scale=0.0) == "0"


def test_vectors_are_numbers_in_brackets():
    assert vector_text((-0.0, 8.32667268e-17, 0.28)) == "(0, 0, 0.28)"
    assert vector_text((0.1234567, 0.0), digits=3) == "(0.123, 0)"


def test_errors_write_positions_so():
    error = ArmTooShortError((-0.0, 8.32667268e-17, 0.3), 0, 0.5, 0.4)
    assert "position (0, 0, 0.3) m" in str(error)


def test_an_offending_number_is_written_however_small():
    """Its smallness may be what is wrong with it."""
    assert "x = -1e-30 m must be" in str(OutOfBoundsError("x", -1e-30, "at least 0", "m"))
