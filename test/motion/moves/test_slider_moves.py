"""Moves from rest to rest of any size, with limits of any size."""

import random
from itertools import product

import pytest
from motion_machine import WORKSPACE
from soak import many, seed

from tri_glide_kinematics.motion import MotionKind, SliderLimits, plan_move

BEGIN = (0.0, 0.0, 0.3)
LENGTHS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1)
VELOCITIES = tuple(10.0**power for power in range(-3, 2))
ACCELERATIONS = tuple(10.0**power for power in range(-2, 4))
JERKS = tuple(10.0**power for power in range(-1, 6))
DIRECTIONS = ((0.0, 0.0, 1.0), (0.6, 0.5, 0.62))
MOVES = tuple(product(LENGTHS, DIRECTIONS, VELOCITIES, ACCELERATIONS, JERKS))
REFUSED = tuple((0.05, direction, 0.001, 0.01, 1e5) for direction in DIRECTIONS)
# All cells of a line of 50 s are looked at: one of them is enough.
BY_KIND = [(MotionKind.LINEAR, REFUSED[1]), *((MotionKind.SLIDER, each) for each in REFUSED)]


def assert_planned(kind: MotionKind, length: float, direction, *limits: float) -> None:
    end = [start + length * part for start, part in zip(BEGIN, direction)]
    bounds = SliderLimits.uniform(*limits)
    motion = plan_move(WORKSPACE, bounds, BEGIN, end, kind=kind)
    if kind is MotionKind.SLIDER:
        motion.check_limits(bounds)
    ended = WORKSPACE.machine.forward(motion.at(motion.duration).heights)
    assert ended == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize(("kind", "move"), BY_KIND)
def test_no_move_is_refused_for_the_rounding_of_its_times(kind, move):
    """A phase of 0.1 us, 50 s after the start, is known to 7e-8 of its length."""
    assert_planned(kind, *move)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [(MotionKind.SLIDER, 200), (MotionKind.LINEAR, 30)])
def test_moves_of_any_size_are_planned(kind, count):
    count = min(many(count), len(MOVES))
    for move in random.Random(seed(1)).sample(MOVES, count):
        assert_planned(kind, *move)
