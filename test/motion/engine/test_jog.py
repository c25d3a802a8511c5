"""Many jogs into the edge of the workspace: straight, inside, and never stuck."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import DT, MACHINE, each_kind, engine, place, run, run_to_rest
from soak import many

from benchmarks.edge_jogs import ROUNDING, is_met, measure, overrun, random_heights, random_twist
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionPhase, NoRoomError

JOGS = many(200)

# The slowest change of direction near an edge is over after this time for these limits [s].
RAMP = 1.2


def assert_inside(heights) -> None:
    """Check travel and reach; the limit of the condition number lies beyond both."""
    assert overrun(heights) <= ROUNDING


@pytest.mark.slow
def test_jogs_from_rest_are_straight_and_stop_inside_at_the_edge():
    found = measure(JOGS, seed=7)
    assert is_met(found)
    assert found.done > 0.98 * JOGS
    # From rest the ramp, too, goes along the line.
    assert found.angle < math.radians(0.01)


@pytest.mark.slow
@each_kind
def test_jogs_in_mid_motion_turn_into_their_direction_and_stop_inside(kind):
    rng = np.random.default_rng(8)
    moving = engine(kind)
    turned = 0
    for _ in range(many(100)):
        moving.start(random_heights(rng))
        try:
            if rng.random() < 0.5:
                moving.jog(random_twist(rng))
            else:
                moving.move_to(MACHINE.forward(random_heights(rng)))
            for _ in range(int(rng.integers(10, 60))):
                moving.step(2.0 * DT)
            twist = random_twist(rng)
            moving.jog(twist)
        except KinematicsError:
            continue
        if moving.phase is not MotionPhase.JOGGING:
            continue
        sampled = moving.sample_plan(np.linspace(0.0, moving.time_to_rest, 100))
        assert_inside(sampled.heights)
        ramp = moving.time_to_rest if moving.time_to_rest < RAMP else RAMP
        late = moving.sample_plan(np.linspace(ramp, moving.time_to_rest, 20)[:-1])
        for heights, rates in zip(late.heights, late.velocities):
            _, velocity = MACHINE.forward_velocity(heights.tolist(), rates.tolist())
            if (speed := np.linalg.norm(velocity)) > 1e-6:
                turned += 1
                cosine = np.dot(velocity, twist) / (speed * np.linalg.norm(twist))
                assert cosine > math.cos(math.radians(1.0))
    assert turned


@each_kind
def test_every_jog_that_has_ended_can_be_driven_back(kind):
    rng = np.random.default_rng(9)
    moving = engine(kind)
    for _ in range(60):
        moving.start(random_heights(rng))
        twist = random_twist(rng, slowest=0.2)
        try:
            moving.jog(twist)
        except NoRoomError:
            continue
        while moving.phase is not MotionPhase.IDLE:
            moving.step(10.0 * DT)
        edge = place(moving)
        moving.jog([-speed for speed in twist])
        for _ in range(30):
            moving.step(10.0 * DT)
        assert_inside(moving.heights_since())
        assert np.dot(place(moving) - edge, twist) < 0.0


@pytest.mark.slow
def test_jogs_at_the_edge_in_every_direction_move_or_are_refused_with_a_reason():
    """A stick held outwards and turned round at the edge."""
    moving = engine()
    moving.jog((0.3, 0.0, 0.0))
    run_to_rest(moving)
    moved = refused = 0
    for angle in np.linspace(0.0, 4.0 * math.pi, 60):
        before = place(moving)
        try:
            moving.jog((0.1 * math.cos(angle), 0.1 * math.sin(angle), 0.0))
        except KinematicsError as error:
            refused += 1
            assert str(error)
        run(moving, 0.02)
        moved += int(np.linalg.norm(place(moving) - before) > 1e-5)
    assert_inside(moving.heights_since())
    assert moving.kept_limits
    assert moved
    assert refused
