"""Many crank angles at once: the same positions as one by one."""

import numpy as np
import pytest
from f_mechanism_samples import example_2, random_mechanism
from soak import many


def test_batch_equals_single_solutions():
    rng = np.random.default_rng(18)
    for _ in range(many(8)):
        mechanism = random_mechanism(rng, size=10.0 ** rng.uniform(-3, 3))
        angles = rng.uniform(-10.0, 10.0, 40)
        batch = mechanism.poses_batch(angles)
        joints, pins = batch.platform_joints(), batch.crank_pins()
        for row, crank_angle in enumerate(angles):
            poses = mechanism.poses(crank_angle)
            assert batch.counts[row] == len(poses)
            assert np.all(np.isnan(batch.angle[row, len(poses) :]))
            for slot, pose in enumerate(poses):
                assert joints[row, slot] == pytest.approx(
                    np.array(pose.platform_joints), abs=1e-8 * mechanism.size
                )
                assert pins[row] == pytest.approx(
                    np.array(pose.crank_pins), abs=1e-12 * mechanism.size
                )
                assert batch.angle[row, slot] == pytest.approx(pose.angle, abs=1e-9)
                assert batch.position[row, slot] == pytest.approx(
                    pose.position, abs=1e-8 * mechanism.size
                )
                if abs(pose.singularity) > 1e-2:
                    assert batch.angular_velocity[row, slot] == pytest.approx(
                        pose.angular_velocity, rel=1e-7, abs=1e-9
                    )
                    assert batch.velocity[row, slot] == pytest.approx(
                        pose.velocity, rel=1e-7, abs=1e-7 * mechanism.size
                    )
                assert batch.singularity[row, slot] == pytest.approx(pose.singularity, abs=1e-8)
                assert batch.residual[row, slot] < 1e-9 * mechanism.size


def test_empty_batch():
    batch = example_2().poses_batch([])
    assert batch.angle.shape == (0, 6)
    assert batch.platform_joints().shape == (0, 6, 3, 2)
