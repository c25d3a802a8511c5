"""Trajectories of a path's parts: each joins the one before it, as a receiver drives them."""

import math

import numpy as np
import pytest
from motion_machine import LIMITS, MotionKind, MotionPhase, engine, place
from scipy.interpolate import BPoly

from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.ros.outputs import plan_points

PERIOD = 0.002
STEP = 0.01


def begin_with_curve(in_pieces):
    """Return an engine on a curve of several parts, long enough to be planned in windows."""
    moving = engine(kind=MotionKind.LINEAR, in_pieces=in_pieces)
    angles = np.linspace(0.0, 2.0 * math.pi, 201)
    offsets = 0.04 * np.stack((np.sin(angles), 1.0 - np.cos(angles), 0.0 * angles), axis=1)
    moving.follow(PlatformPath.through(place(moving) + offsets, tolerance=1e-4, speed=0.1))
    return moving


def followed(first, plan):
    """Return what a receiver makes of a trajectory: quintics between its points, and the end."""
    rows = [np.vstack((start, values)) for start, values in zip(first, plan[1:])]
    times = np.concatenate(([0.0], plan.times))
    return BPoly.from_derivatives(times, np.stack(rows, axis=1))


@pytest.mark.parametrize("in_pieces", [False, True])
def test_a_receiver_of_all_parts_moves_as_the_setpoints_do(in_pieces):
    moving = begin_with_curve(in_pieces)
    number, time, begin, driven = 0, 0.0, 0.0, None
    parts = 0
    moving.work(lambda: True)
    while moving.phase is not MotionPhase.IDLE:
        moving.work(lambda: True)
        state = moving.step(PERIOD)
        time += PERIOD
        if driven is not None:
            here = min(time - begin, driven.x[-1])
            height, velocity, acceleration = (driven(here, order) for order in range(3))
            # At the joint the receiver still has the plan before, which would have braked by now.
            assert height == pytest.approx(state.heights, abs=1e-6)
            assert velocity == pytest.approx(state.velocities, abs=LIMITS.jerk[0] * PERIOD**2)
            assert acceleration == pytest.approx(
                state.accelerations, abs=2.0 * LIMITS.jerk[0] * PERIOD
            )
        if moving.plan_number != number:
            number, begin, parts = moving.plan_number, time, parts + 1
            driven = followed(state, plan_points(moving, STEP))
    assert parts > 3
