"""Moves from rest to rest of any size, with limits of any size."""

from __future__ import annotations

from itertools import islice, product

import pytest
from motion_machine import WORKSPACE

from tri_glide_kinematics.motion import MotionKind, SliderLimits, plan_move

BEGIN = (0.0, 0.0, 0.3)
LENGTHS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1)
VELOCITIES = tuple(10.0**power for power in range(-3, 2))
ACCELERATIONS = tuple(10.0**power for power in range(-2, 4))
JERKS = tuple(10.0**power for power in range(-1, 6))
DIRECTIONS = ((0.0, 0.0, 1.0), (0.6, 0.5, 0.62))


@pytest.mark.parametrize("kind", MotionKind)
def test_no_move_is_refused_for_the_rounding_of_its_times(kind):
    """A phase of 0.1 us, 50 s after the start, is known to 7e-8 of its length."""
    moves = product(LENGTHS, DIRECTIONS, VELOCITIES, ACCELERATIONS, JERKS)
    # A fifth of them, with the two that were refused.
    for length, direction, *limits in islice(moves, 1, None, 5):
        end = [start + length * part for start, part in zip(BEGIN, direction)]
        bounds = SliderLimits.uniform(*limits)
        motion = plan_move(WORKSPACE, bounds, BEGIN, end, kind=kind)
        if kind is MotionKind.SLIDER:
            motion.check_limits(bounds)
        ended = WORKSPACE.machine.forward(motion.at(motion.duration).heights)
        assert ended == pytest.approx(end, abs=1e-9)
