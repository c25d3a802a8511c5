"""Directions get the name of what they are."""

import numpy as np
import pytest

from testing.wrong_machines import NOMINAL
from tri_glide_kinematics.calibration.fit import in_words, named_directions, positions_of
from tri_glide_kinematics.tri_glide import TriGlide

NAMED = named_directions(NOMINAL.vector)


@pytest.mark.parametrize("name", NAMED)
def test_a_direction_alone_is_called_by_its_name(name):
    unit = NAMED[name] / np.linalg.norm(NAMED[name])
    assert in_words(NOMINAL.vector, np.eye(12), unit[:, None]) == (name,)


def test_several_directions_are_all_named_and_once():
    names = ("shifting along x", "turning about z", "the common scale of anchors and arms")
    some = np.linalg.qr(np.column_stack([NAMED[name] for name in names]))[0]
    turned = some @ np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    assert in_words(NOMINAL.vector, np.eye(12), turned) == names


def test_a_direction_without_a_name_says_what_it_changes():
    arm = np.eye(12)[:, [7]]
    assert in_words(NOMINAL.vector, np.eye(12), arm) == ("a combination of arm length 2",)
    assert in_words(NOMINAL.vector, np.eye(12), np.empty((12, 0))) == ()


@pytest.mark.parametrize(
    "name", ["the common scale of anchors and arms", "the size of the anchors' triangle"]
)
def test_sizes_hold_the_platform_in_the_middle(name):
    heights = np.array([TriGlide(NOMINAL.geometry).inverse((0.0, 0.0, 0.1))])
    change = 1e-6 * NAMED[name] / np.linalg.norm(NAMED[name])
    moved = positions_of(NOMINAL.vector + change, heights) - (0.0, 0.0, 0.1)
    assert np.abs(moved).max() < 1e-10
