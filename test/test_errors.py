"""What all errors of this package share."""

import copy
import pickle

import pytest

from tri_glide_kinematics.errors import (
    KinematicsError,
    NotAChoiceError,
    OutOfBoundsError,
    WrongShapeError,
)
from tri_glide_kinematics.motion import NoRoomError
from tri_glide_kinematics.motion.errors import RepeatedPointError

ERRORS = (
    KinematicsError("no such thing"),
    OutOfBoundsError("arm_lengths[1]", -0.4, "greater than 0", "m"),
    NoRoomError((0.1, 0.0, 0.3), (1.0, 0.0, 0.0), "the arm ends there"),
    RepeatedPointError(2, 3, (0.1, 0.0, 0.3), 0.0, 1e-9),
)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
def test_an_error_is_copied_with_its_text_and_its_numbers(error, copied):
    """An engine that holds one can be copied, which failed once."""
    again = copied(error)
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


@pytest.mark.parametrize(
    ("error", "carried"),
    [
        (ERRORS[1], ("arm_lengths[1]", -0.4, "greater than 0", "m")),
        (WrongShapeError("heights", (2,), "(3,)"), ("heights", (2,), "(3,)")),
        (NotAChoiceError("kind", "bent", ("linear",)), ("kind", "bent", ("linear",))),
    ],
)
def test_an_error_carries_what_is_wrong(error, carried):
    assert tuple(vars(error).values()) == carried
