"""Numbers in messages."""

import math

import numpy as np
import pytest
from strategies import DEFAULT_LIMITS

from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.settings import IK_NODE
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, ArmTooShortError, TriGlide
from tri_glide_kinematics.wording import number_text, unit_question, vector_text
from tri_glide_kinematics.workspace import Workspace


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


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (math.nextafter(1.0, 2.0), "1.0000000000000002"),
        (np.float64(math.nextafter(0.001, 0.0)), "0.0009999999999999998"),
        (1_000_000_001, "1000000001"),
        (1.0000000015, "1.0000000015"),
        (1.0, "1"),
        (0.1, "0.1"),
        (-0.0, "0"),
        (math.nan, "nan"),
        (math.inf, "inf"),
        (2.0 / 3.0, "0.666666667"),
        (0.123456789012, "0.123456789"),
    ],
)
def test_an_offending_number_does_not_read_like_its_bound(value, text):
    assert str(OutOfBoundsError("x", value, "y")) == f"x = {text} must be y"


def test_a_length_far_beyond_its_bound_is_asked_for_its_unit():
    assert unit_question(280.0, 0.4) == unit_question(-280.0, 0.4) == "; is it in millimetres?"
    for length, bound in ((0.5, 0.4), (2.9, 0.4), (2.9, 0.0), (11.0, 4.0), (math.nan, 1.0)):
        assert unit_question(length, bound) == ""


def test_millimetres_taken_for_metres_are_asked_for_everywhere():
    machine = TriGlide(DEFAULT_GEOMETRY)
    workspace = Workspace(machine, DEFAULT_LIMITS)
    base_radius = next(one for one in IK_NODE if one.name == "base_radius")
    for wrong in (
        lambda: machine.inverse((50.0, 0.0, 280.0)),
        lambda: machine.forward((600.0, 610.0, 620.0)),
        lambda: workspace.check_position((0.0, 0.0, 280.0)),
        lambda: workspace.check_heights((600.0, 600.0, 600.0)),
        lambda: PlatformPath.start((0.0, 0.0, 280.0)),
        lambda: base_radius.checked(250.0),
    ):
        with pytest.raises(KinematicsError, match=r"; is it in millimetres\?$"):
            wrong()
    for wrong_too in (
        lambda: machine.inverse((0.5, 0.0, 0.28)),
        lambda: machine.forward((0.1, 0.6, 2.0)),
        lambda: workspace.check_position((0.0, 0.0, 2.0)),
        lambda: PlatformPath.start((0.0, math.nan, 0.0)),
    ):
        with pytest.raises(KinematicsError, match=r"^((?!millimetres).)*$"):
            wrong_too()
