"""Drives that control positions with forces: what the feed-forward of the setpoints is good for."""

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE

from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.motion import MotionKind, plan_move
from tri_glide_kinematics.simulation import PositionControl, Setpoint, SimulatedDrives
from tri_glide_kinematics.vectors import FloatArray

PERIOD = 0.002  # s
CONTROL = PositionControl((6000.0,) * 3, (130.0,) * 3)
MASSES = Masses.uniform(1.0, 0.2, 1.0, coulomb=1.0, viscous=2.0)
WRONG = Masses.uniform(1.2, 0.24, 1.2, coulomb=1.2, viscous=2.4)
STILL = (0.0, 0.0, 0.0)
TRUE = SliderForces(MACHINE, MASSES)


def errors(known: SliderForces | None) -> FloatArray:
    """Return the tracking errors over some moves; without known masses, the weight alone is fed."""
    rng = np.random.default_rng(2)
    found = []
    for kind in MotionKind:
        start, end = rng.uniform((-0.1, -0.1, 0.22), (0.1, 0.1, 0.36), (2, 3)).tolist()
        motion = plan_move(WORKSPACE, LIMITS, start, end, kind=kind)
        moved = motion.at(0.0)[:2]
        drives = SimulatedDrives(TRUE, CONTROL, moved[0])
        for time in np.arange(1, int(motion.duration / PERIOD) + 20) * PERIOD:
            heights, velocities, accelerations = motion.at(float(time))
            if known is None:
                forces = TRUE.forces(heights, STILL, STILL)
            else:
                # Of wrong masses the weight is compensated all the same, as in the comparison.
                weight = TRUE.forces(heights, STILL, STILL)
                own = known.forces(heights, STILL, STILL)
                driven = known.forces(heights, velocities, accelerations)
                forces = tuple(w + f - o for w, f, o in zip(weight, driven, own))
            moved = drives.step(*moved, Setpoint(heights, velocities, forces), PERIOD)
            found.append(np.subtract(moved[0], heights))
    return np.array(found)


def size(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_feed_forward_takes_the_error_off():
    without = size(errors(None))
    assert 5e-4 < without < 5e-3
    assert size(errors(TRUE)) < 0.1 * without
    assert size(errors(SliderForces(MACHINE, WRONG))) < 0.25 * without


def test_a_machine_at_rest_stays_where_it_is_held():
    drives = SimulatedDrives(TRUE, CONTROL, (0.6, 0.55, 0.6))
    weight = TRUE.forces((0.6, 0.55, 0.6), STILL, STILL)
    moved = (0.6, 0.55, 0.6), STILL
    for _ in range(50):
        moved = drives.step(*moved, Setpoint((0.6, 0.55, 0.6), STILL, weight), PERIOD)
    assert moved[0] == pytest.approx((0.6, 0.55, 0.6), abs=1e-12)
    assert drives.exerted == pytest.approx(weight, abs=1e-9)


def test_without_its_weight_it_sinks_until_the_spring_holds_it():
    smooth = SliderForces(MACHINE, Masses.uniform(1.0, 0.2, 1.0))
    drives = SimulatedDrives(smooth, CONTROL, (0.6, 0.6, 0.6))
    heights, velocities = (0.6, 0.6, 0.6), STILL
    for _ in range(1000):
        heights, velocities = drives.step(heights, velocities, Setpoint((0.6, 0.6, 0.6)), PERIOD)
    sunk = 0.6 - heights[0]
    assert sunk == pytest.approx(drives.exerted[0] / 6000.0, rel=1e-6)
    assert drives.exerted == pytest.approx(smooth.forces(heights, STILL, STILL), rel=1e-6)


def test_a_control_without_stiffness_is_none():
    with pytest.raises(OutOfBoundsError, match=r"stiffness\[1\]"):
        PositionControl((1.0, 0.0, 1.0), (1.0, 1.0, 1.0))
