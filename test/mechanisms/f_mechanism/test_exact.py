"""Platforms large against the rods, and folds: all positions by another count, all of them closed.

The other count is by Sturm's theorem in fractions, without rounding.
"""

import math

import numpy as np
import pytest
from f_mechanism_samples import (
    example_2,
    large_platform,
    random_large_platform,
    random_mechanism,
    rod_gaps,
)
from soak import many, seed

from benchmarks.references.f_mechanism_count import count_positions
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism

RATIOS = (1.0, 5.0, 12.0, 20.0, 40.0, 100.0, 300.0, 1000.0)
CLOSED = 1e-12  # largest residual, relative to the size


def assert_all_positions(mechanism, crank_angles):
    """All positions are there, close, and are the same in a batch, as are their rates."""
    batch = mechanism.poses_batch(crank_angles)
    joints, pins = (
        values() / mechanism.size for values in (batch.platform_joints, batch.crank_pins)
    )
    for row, crank_angle in enumerate(crank_angles):
        poses = mechanism.poses(crank_angle)
        assert len(poses) == count_positions(mechanism.linkage, crank_angle) == batch.counts[row]
        assert np.isnan(batch.angle[row, len(poses) :]).all()
        for slot, pose in enumerate(poses):
            assert pose.residual <= CLOSED * mechanism.size
            gaps = rod_gaps(mechanism, crank_angle, pose.angle, pose.position)
            assert np.max(abs(gaps)) < 1e-9 * mechanism.size
            assert batch.residual[row, slot] <= CLOSED * mechanism.size
            assert batch.angle[row, slot] == pytest.approx(pose.angle, abs=1e-9)
            place = np.array(pose.position) / mechanism.size
            assert batch.position[row, slot] / mechanism.size == pytest.approx(place, abs=1e-9)
            corners = np.array(pose.platform_joints) / mechanism.size
            assert joints[row, slot] == pytest.approx(corners, abs=1e-9)
            assert pins[row] == pytest.approx(np.array(pose.crank_pins) / mechanism.size, abs=1e-12)
            assert batch.singularity[row, slot] == pytest.approx(pose.singularity, abs=1e-8)
            if abs(pose.singularity) > 1e-2:
                rates = batch.angular_velocity[row, slot], *batch.velocity[row, slot]
                expected = pose.angular_velocity, *pose.velocity
                assert rates == pytest.approx(expected, rel=1e-7, abs=1e-7 * mechanism.size)


def fold_of(mechanism, angles):
    """The last crank angle before the first fold between ``angles``, if there is one."""
    counts = [count_positions(mechanism.linkage, angle) for angle in angles]
    for low, high, before, after in zip(angles, angles[1:], counts, counts[1:]):
        if before != after:
            while low < (middle := 0.5 * (low + high)) < high:
                if count_positions(mechanism.linkage, middle) == before:
                    low = middle
                else:
                    high = middle
            return low
    return None


def test_a_platform_seventy_times_the_rods():
    mechanism = FMechanism(
        [[0.0, 0.0], [70.0, 0.0], [28.0, 56.0]],
        (0.3, 0.4, 0.5),
        (1.0, 1.2, 1.1),
        [[0.0, 0.0], [70.2, 0.1], [28.0, 56.3]],
        0.5,
        -0.7,
    )
    assert len(mechanism.poses(2.0)) == 4
    assert_all_positions(mechanism, [2.0, *np.linspace(0.0, math.tau, 20)])


@pytest.mark.slow
@pytest.mark.parametrize("ratio", RATIOS)
def test_no_position_is_lost_or_wrong_at_any_ratio(ratio):
    rng = np.random.default_rng(seed(int(ratio)))
    assert_all_positions(large_platform(ratio), rng.uniform(0.0, math.tau, many(10)))
    for _ in range(many(3)):
        assert_all_positions(random_large_platform(rng, ratio), rng.uniform(0.0, math.tau, 4))


@pytest.mark.slow
def test_small_platforms_have_none_two_four_or_six_positions():
    rng = np.random.default_rng(seed(20_000))
    counts = set()
    for _ in range(many(100)):
        mechanism, crank_angle = random_mechanism(rng), rng.uniform(-math.pi, math.pi)
        assert_all_positions(mechanism, [crank_angle])
        counts.add(len(mechanism.poses(crank_angle)))
    assert counts == {0, 2, 4, 6}


def nearly_parallelograms(noise, number, height=1.0):
    """Equal cranks and rods, and a platform that is the base but for ``noise`` [m]."""
    rng = np.random.default_rng(number)
    base = rng.uniform(-1.0, 1.0, (3, 2)) * (1.0, height)
    crank, rod = rng.uniform(0.2, 0.8), rng.uniform(0.5, 2.0)
    platform = base + noise * rng.normal(size=(3, 2))
    return FMechanism(base, [crank] * 3, [rod] * 3, platform)


@pytest.mark.parametrize("noise", [1e-11, 1e-10])
def test_no_position_is_found_twice_beside_a_self_motion(noise):
    # Along the way of the self-motion, places 1e-5 m apart close to rounding.
    mechanisms = [nearly_parallelograms(noise, number) for number in range(many(10))]
    for mechanism in mechanisms:
        assert_all_positions(mechanism, [0.3])
    assert max(len(mechanism.poses(0.3)) for mechanism in mechanisms) == 6
    assert mechanisms[0].overview(8).counts.max() <= 6


@pytest.mark.parametrize("noise", [1e-9, 1e-6])
def test_no_position_is_lost_where_all_platform_angles_nearly_coincide(noise):
    # Rounding leaves none of the six roots near the unit circle.
    for number in range(many(10)):
        assert_all_positions(nearly_parallelograms(noise, number, height=0.0), [0.3])


def test_collinear_triangles():
    mechanism = FMechanism(
        [[0.0, 0.0], [1.0, 0.0], [2.5, 0.0]],
        (0.3, 0.2, 0.25),
        (0.9, 0.8, 1.0),
        [[0.0, 0.0], [0.8, 0.0], [1.7, 0.0]],
        0.3,
        0.9,
    )
    assert_all_positions(mechanism, np.linspace(0.0, 6.0, 25))


def test_crank_pins_in_one_place():
    # B1 and C1 coincide, and no rods reach from there to B2 and C2.
    mechanism = FMechanism(
        [[3.0, -2.0], [3.0, 3.0], [3.0, -3.0]],
        (2.0, 2.0, 2.0),
        (1.0, 1.0, 1.0),
        [[-2.0, 1.0], [-1.0, -1.0], [-1.0, -1.0]],
        math.pi,
        1.5 * math.pi,
        counter_rotating=True,
    )
    assert mechanism.poses(-0.5 * math.pi) == ()


@pytest.mark.parametrize("scale", [1e-60, 1e-12, 1e25])
@pytest.mark.parametrize("ratio", [1.0, 40.0, 1000.0])
def test_the_scale_changes_nothing(scale, ratio):
    crank_angles = np.linspace(0.0, 6.0, 8)
    plain, scaled = (
        large_platform(ratio, factor).poses_batch(crank_angles) for factor in (1.0, scale)
    )
    assert plain.counts.tolist() == scaled.counts.tolist()
    assert scaled.angle == pytest.approx(plain.angle, abs=1e-10, nan_ok=True)
    mechanism = large_platform(ratio, scale)
    assert [len(mechanism.poses(angle)) for angle in crank_angles] == plain.counts.tolist()
    assert np.nanmax(scaled.residual) <= CLOSED * mechanism.size


def test_what_is_too_small_for_floating_point_numbers_is_refused():
    with pytest.raises(OutOfBoundsError, match=r"largest length = .*e-75 m must be at least 1e-70"):
        large_platform(1.0, 1e-75)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1.0, 40.0, 1000.0])
def test_a_fold_is_one_double_position_and_beside_it_are_two_or_none(ratio):
    rng = np.random.default_rng(int(ratio))
    found = 0
    while found < many(1):
        mechanism = random_large_platform(rng, ratio)
        fold = fold_of(mechanism, np.linspace(0.0, math.tau, 6).tolist())
        if fold is None:
            continue
        found += 1
        beside = fold + np.array([-1e-6, -1e-7, -1e-9, 1e-9, 1e-7, 1e-6])
        assert_all_positions(mechanism, beside)
        assert not any(pose.double for angle in beside for pose in mechanism.poses(angle))
        poses = mechanism.poses(fold)
        assert sum(pose.double for pose in poses) == 1
        assert max(pose.residual for pose in poses) <= CLOSED * mechanism.size


@pytest.mark.parametrize("ratio", [1.0, 12.0, 40.0, 100.0])
def test_a_followed_branch_passes_positions(ratio):
    mechanism = large_platform(ratio)
    trace = mechanism.trace(2.0, mechanism.poses(2.0)[0], steps=30)
    batch = mechanism.poses_batch(trace.crank_angle)
    assert len(trace.angle) == 31
    assert np.max(trace.residual) <= CLOSED * mechanism.size
    turn = np.remainder(batch.angle - trace.angle[:, np.newaxis] + math.pi, math.tau) - math.pi
    shift = np.max(abs(batch.position - trace.position[:, np.newaxis]), axis=-1) / mechanism.size
    assert np.max(np.nanmin(abs(turn) + shift, axis=1)) < 1e-11


def test_no_crank_angles():
    batch = example_2().poses_batch([])
    assert batch.angle.shape == (0, 6)
    assert batch.platform_joints().shape == (0, 6, 3, 2)
