"""Positions of the F-mechanism: all of them, exact, and nothing else."""

import math

import numpy as np
import pytest
from f_mechanism_samples import (
    closure_value,
    concurrent_pins,
    example_2,
    mechanism_through,
    random_mechanism,
    random_points,
)
from soak import many
from strategies import nudged

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.mechanisms.f_mechanism import (
    DegenerateLinkageError,
    FMechanism,
    SelfMotionError,
)

# Source 001, figure 5.
PRINTED_ANGLES = (-75.688, -55.562, -18.443, -0.982)


def angle_difference(p, q):
    return abs(math.remainder(p - q, 2.0 * math.pi))


def test_example_2_has_the_printed_angles():
    poses = example_2().poses(math.radians(146.0))
    assert [round(math.degrees(pose.angle), 3) for pose in poses] == list(PRINTED_ANGLES)


def test_printed_main_loop_has_other_angles():
    # The listing of source 001 adds phase C to crank B: `ff2[i]:=omegab*ff1[i]+phasc`.
    poses = example_2(phase_b=math.radians(-15.0)).poses(math.radians(146.0))
    found = [math.degrees(pose.angle) for pose in poses]
    for printed in PRINTED_ANGLES:
        assert all(abs(printed - angle) > 1.0 for angle in found)


def with_any_cranks(rng, pins, joints, pose, **more):
    """A mechanism that stands like this, but for its cranks, and its crank angle."""
    angles, cranks = rng.uniform(-math.pi, math.pi, 3), rng.uniform(0.1, 0.6, 3)
    return mechanism_through(pins, joints, pose, cranks, angles, **more), angles[0]


def is_among(poses, angle, origin):
    return any(
        angle_difference(found, angle) < 1e-6 and abs(complex(*position) - origin) < 1e-6
        for found, position in poses
    )


def batch_row(mechanism, crank_angle):
    batch = mechanism.poses_batch([crank_angle])
    count = batch.counts[0]
    return list(zip(batch.angle[0, :count], batch.position[0, :count]))


def single_row(mechanism, crank_angle):
    return [(pose.angle, pose.position) for pose in mechanism.poses(crank_angle)]


def test_exact_folds_are_found_once():
    rng = np.random.default_rng(11)
    for _ in range(many(20)):
        # Three rods through one point: the platform can turn about it for an instant.
        joints, pose = random_points(rng, 3), (rng.uniform(-3.1, 3.1), random_points(rng, 1)[0])
        pins = concurrent_pins(rng, joints, pose)
        mechanism, at = with_any_cranks(rng, pins, joints, pose)
        for poses in (single_row(mechanism, at), batch_row(mechanism, at)):
            near = [angle for angle, _ in poses if angle_difference(angle, pose[0]) < 1e-5]
            assert len(near) == 1
        fold = min(mechanism.poses(at), key=lambda p: angle_difference(p.angle, pose[0]))
        assert fold.double
        assert abs(fold.singularity) < 1e-5
        assert fold.residual < 1e-9 * mechanism.size
        assert np.allclose(fold.position, (pose[1].real, pose[1].imag), atol=1e-5)


def test_degenerate_linear_system_keeps_both_positions():
    rng = np.random.default_rng(12)
    for _ in range(many(20)):
        joints, pose = random_points(rng, 3), (rng.uniform(-3.1, 3.1), random_points(rng, 1)[0])
        z = np.exp(1j * pose[0])
        places = pose[1] + z * joints
        pin_a, pin_b = random_points(rng, 2)
        # w_c parallel to w_b: at this angle a mirror image of rod A solves all equations too.
        rod = places[0] - pin_a
        w_b = z * (joints[1] - joints[0]) - (pin_b - pin_a)
        pin_c = pin_a + z * (joints[2] - joints[0]) - rng.uniform(-2.0, 2.0) * w_b
        mirrored = w_b / w_b.conjugate() * rod.conjugate()
        mechanism, at = with_any_cranks(rng, np.array([pin_a, pin_b, pin_c]), joints, pose)
        for poses in (single_row(mechanism, at), batch_row(mechanism, at)):
            assert is_among(poses, *pose)
            assert is_among(poses, pose[0], pose[1] + mirrored - rod)
            different = {(round(a, 7), round(p[0], 7), round(p[1], 7)) for a, p in poses}
            assert len(different) == len(poses)


def test_degenerate_linear_system_invents_nothing():
    rng = np.random.default_rng(13)
    for _ in range(many(20)):
        joints = random_points(rng, 3)
        angle = rng.uniform(-3.1, 3.1)
        pin_a, pin_b = random_points(rng, 2)
        ratio = rng.uniform(-2.0, 2.0)
        w_b = np.exp(1j * angle) * (joints[1] - joints[0]) - (pin_b - pin_a)
        pin_c = pin_a + np.exp(1j * angle) * (joints[2] - joints[0]) - ratio * w_b
        # F has a double root at this angle, but rod A does not reach the line that is left for it.
        rod_a = rng.uniform(0.1, 0.5)
        product = 1.1 * rod_a * abs(w_b)
        rods = [
            rod_a,
            math.sqrt(rod_a**2 + abs(w_b) ** 2 + 2.0 * product),
            math.sqrt(max(rod_a**2 + abs(ratio * w_b) ** 2 + 2.0 * ratio * product, 1e-3)),
        ]
        pins = np.array([pin_a, pin_b, pin_c])
        mechanism, at = with_any_cranks(rng, pins, joints, None, rods=rods)
        value = closure_value(mechanism, at, angle)
        if abs(rods[2] ** 2 - rods[0] ** 2 - abs(ratio * w_b) ** 2 - 2 * ratio * product) < 1e-12:
            assert abs(value) < 1e-12
        for pose in mechanism.poses(at):
            assert pose.residual < 1e-9 * mechanism.size
            assert angle_difference(pose.angle, angle) > 1e-6


def test_degenerate_linear_system_where_rounding_keeps_f_off_zero():
    mechanism = FMechanism(
        [[-3.0, 0.0], [2.0, -2.0], [-3.0, 1.0]],
        (1.0, 2.0, 1.0),
        (2.0, 1.0, 2.0),
        [[0.0, 2.0], [2.0, -2.0], [2.0, 1.0]],
        math.pi,
        0.5 * math.pi,
    )
    poses = mechanism.poses(-0.5 * math.pi)
    assert len(poses) == 4
    assert max(pose.residual for pose in poses) < 1e-12 * mechanism.size


def test_identically_vanishing_determinant():
    # Pins and platform both collinear in the same ratio: the two linear equations are parallel at
    # every platform angle, and every root of F is double.
    rng = np.random.default_rng(14)
    for _ in range(many(30)):
        ratio = rng.uniform(-2.0, 2.0)
        d_b, pin_a, e_b = random_points(rng, 3)
        joints = np.array([0.0, d_b, ratio * d_b])
        pins = pin_a + np.array([0.0, e_b, ratio * e_b])
        pose = (rng.uniform(-3.1, 3.1), random_points(rng, 1)[0])
        mechanism, at = with_any_cranks(rng, pins, joints, pose)
        assert all(found.residual < 1e-9 * mechanism.size for found in mechanism.poses(at))
        poses = single_row(mechanism, at)
        assert len(poses) in (2, 4)
        rod = pose[1] - pin_a
        w_b = np.exp(1j * pose[0]) * d_b - e_b
        mirrored = w_b / w_b.conjugate() * rod.conjugate()
        assert is_among(poses, *pose)
        assert is_among(poses, pose[0], pin_a + mirrored)


def parallelogram():
    triangle = [[0.0, 0.0], [2.0, 0.5], [0.7, 1.8]]
    return FMechanism(triangle, (0.5, 0.5, 0.5), (1.3, 1.3, 1.3), triangle)


def redundant_rod():
    # Crank C and rod C repeat crank B and rod B: a four-bar coupler that swings freely.
    base = [[0.0, 0.0], [3.0, 0.0], [3.0, 0.0]]
    platform = [[0.0, 0.0], [2.5, 0.0], [2.5, 0.0]]
    return FMechanism(base, (0.5, 0.4, 0.4), (2.0, 2.2, 2.2), platform)


@pytest.mark.parametrize("mechanism", [parallelogram(), redundant_rod()])
def test_self_motion_is_said(mechanism):
    with pytest.raises(SelfMotionError, match="self-motion") as caught:
        mechanism.poses(0.3)
    assert caught.value.crank_angle == 0.3
    batch = mechanism.poses_batch([0.3, 1.0])
    with pytest.raises(IndexError, match="slot 0 has no position: row 1 has 0"):
        batch.pose(1, 0)
    assert batch.self_motion.tolist() == [True, True]
    assert batch.counts.tolist() == [0, 0]


def test_self_motion_at_one_crank_angle():
    # A2 and C2 coincide, and at crank angle zero A1 and C1 do too.
    mechanism = FMechanism(
        [[-1.0, -1.0], [-3.0, 1.0], [2.0, -1.0]],
        (2.0, 1.0, 1.0),
        (4.0, 3.0, 4.0),
        [[-1.0, -1.0], [2.0, 0.0], [-1.0, -1.0]],
        0.0,
        math.pi,
    )
    with pytest.raises(SelfMotionError):
        mechanism.poses(0.0)
    batch = mechanism.poses_batch([0.0, 0.1])
    assert batch.self_motion.tolist() == [True, False]
    assert batch.counts[1] == len(mechanism.poses(0.1)) > 0


def test_double_root_at_half_a_turn():
    mechanism = FMechanism(
        [[-3.0, -3.0], [3.0, -2.0], [3.0, -3.0]],
        (2.0, 2.0, 2.0),
        (4.0, 4.0, 4.0),
        [[-2.0, -1.0], [-2.0, 0.0], [0.0, -1.0]],
        0.5 * math.pi,
        0.0,
        counter_rotating=True,
    )
    (pose,) = mechanism.poses(0.0)
    assert pose.double
    assert pose.angle == pytest.approx(math.pi, abs=1e-9)
    batch = mechanism.poses_batch([0.0])
    assert batch.counts.tolist() == [1]
    assert batch.angle[0, 0] == pytest.approx(math.pi, abs=1e-9)


def test_redundant_rod_that_never_closes_is_no_self_motion():
    base = [[0.0, 0.0], [30.0, 0.0], [30.0, 0.0]]
    platform = [[0.0, 0.0], [2.5, 0.0], [2.5, 0.0]]
    mechanism = FMechanism(base, (0.5, 0.4, 0.4), (2.0, 2.2, 2.2), platform)
    assert mechanism.poses(0.3) == ()
    assert not mechanism.poses_batch([0.3]).self_motion[0]


def test_two_coincident_platform_joints_are_allowed():
    rng = np.random.default_rng(15)
    for _ in range(100):
        joints = random_points(rng, 3)
        joints[2] = joints[1]
        pose = (rng.uniform(-3.1, 3.1), random_points(rng, 1)[0])
        mechanism, at = with_any_cranks(rng, random_points(rng, 3), joints, pose)
        poses = mechanism.poses(at)
        assert min(angle_difference(p.angle, pose[0]) for p in poses) < 1e-6
        assert len(poses) <= 4


def test_velocities_against_central_differences():
    rng = np.random.default_rng(16)
    step = 1e-6
    checked = 0
    for _ in range(100):
        mechanism = random_mechanism(rng)
        crank_angle = rng.uniform(-math.pi, math.pi)
        corner = tuple(rng.uniform(-1.0, 1.0, 2))
        for pose in mechanism.poses(crank_angle):
            if abs(pose.singularity) < 0.1:
                continue
            before, after = (
                min(
                    mechanism.poses(crank_angle + sign * step),
                    key=lambda p: (
                        angle_difference(p.angle, pose.angle) + math.dist(p.position, pose.position)
                    ),
                )
                for sign in (-1.0, 1.0)
            )
            turn = math.remainder(after.angle - before.angle, 2.0 * math.pi) / (2.0 * step)
            assert turn == pytest.approx(pose.angular_velocity, abs=1e-6)
            slope = (np.array(after.position) - before.position) / (2.0 * step)
            assert slope == pytest.approx(pose.velocity, abs=1e-5)
            slope = (np.array(after.point(corner)) - before.point(corner)) / (2.0 * step)
            assert slope == pytest.approx(pose.point_velocity(corner), abs=1e-5)
            checked += 1
    assert checked > 100


def test_singularity_is_the_determinant_of_the_rod_lines():
    rng = np.random.default_rng(17)
    checked = 0
    for _ in range(200):
        mechanism = random_mechanism(rng)
        platform = np.array([(j.real, j.imag) for j in mechanism.linkage.joints])
        radius = math.sqrt(np.mean(np.sum((platform - platform.mean(axis=0)) ** 2, axis=1)))
        for pose in mechanism.poses(0.7):
            joints, pins = np.array(pose.platform_joints), np.array(pose.crank_pins)
            direction = joints - pins
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
            arm = joints - rng.uniform(-1.0, 1.0, 2)
            moment = arm[:, 0] * direction[:, 1] - arm[:, 1] * direction[:, 0]
            lines = np.column_stack([direction, moment / radius])
            assert pose.singularity == pytest.approx(np.linalg.det(lines), abs=1e-9)
            checked += 1
    assert checked > 200


GOOD = {
    "base": [[0.0, 0.0], [3.0, 0.0], [1.0, 2.0]],
    "crank_lengths": (0.5, 0.5, 0.5),
    "rod_lengths": (1.0, 1.0, 1.0),
    "platform": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
}


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"base": [[0.0, 0.0], [1.0, 0.0]]}, WrongShapeError, "base"),
        ({"platform": [[0.0, 0.0, 0.0]] * 3}, WrongShapeError, "platform"),
        ({"base": [[0.0, 0.0], [math.nan, 0.0], [1.0, 2.0]]}, NotFiniteError, r"base\[1\]\[0\]"),
        ({"platform": [[0.0, 0.0], [1.0, 0.0], [0.0, math.inf]]}, NotFiniteError, "platform"),
        ({"crank_lengths": (0.5, 0.0, 0.5)}, OutOfBoundsError, r"crank_lengths\[1\]"),
        ({"crank_lengths": (0.5, 0.5)}, WrongShapeError, "crank_lengths"),
        ({"rod_lengths": (1.0, 1.0, -1.0)}, OutOfBoundsError, r"rod_lengths\[2\]"),
        ({"rod_lengths": (math.nan, 1.0, 1.0)}, NotFiniteError, r"rod_lengths\[0\]"),
        ({"platform": [[1.0, 2.0]] * 3}, DegenerateLinkageError, "coincide"),
        (
            {"platform": [[0, 0], [1, 0], [1e99, 1]]},
            OutOfBoundsError,
            r"platform\[2\]\[0\] = 1e.99",
        ),
        ({"phase_b": math.inf}, NotFiniteError, "phase_b"),
        ({"phase_c": math.nan}, NotFiniteError, "phase_c"),
    ],
)
def test_bad_dimensions(change, error, text):
    with pytest.raises(error, match=text):
        FMechanism(**{**GOOD, **change})


@pytest.mark.parametrize(
    ("ask", "error", "text"),
    [
        (lambda of: of.poses(math.nan), NotFiniteError, "crank_angle"),
        (lambda of: of.poses_batch([0.0, math.inf]), NotFiniteError, r"crank_angles\[1\]"),
        (lambda of: of.poses_batch([0.0, 1e300]), OutOfBoundsError, r"crank_angles\[1\]"),
        (lambda of: of.poses_batch([[0.0]]), WrongShapeError, "crank_angles"),
        (lambda of: of.with_phases(0.0, math.nan), NotFiniteError, "phase_c"),
    ],
)
def test_bad_crank_angles(ask, error, text):
    with pytest.raises(error, match=text):
        ask(example_2())


def test_positions_that_share_a_platform_angle_are_in_order_of_their_place():
    # Pins and platform collinear, the first in the middle: at each root of F the
    # platform can be in two places.
    rng = np.random.default_rng(20)
    lengths = [
        [[0.0, 0.0], [1.4, 0.5], [-1.4, -0.5]],
        [0.5, 0.5, 0.5],
        [1.4, 1.2, 1.7],
        [[0.0, 0.0], [1.5, 0.0], [-1.5, 0.0]],
    ]
    orders = set()
    for _ in range(many(20)):
        mechanism = FMechanism(*(nudged(rng, part) for part in lengths))
        poses = mechanism.poses(0.3)
        orders.add(tuple((round(p.angle, 5), *np.round(p.position, 5).tolist()) for p in poses))
    assert len(orders) == 1
    angles = [angle for angle, *_ in orders.pop()]
    assert len(angles) > len(set(angles))


def test_half_a_turn_of_the_platform_is_the_last_position():
    rng = np.random.default_rng(21)
    # Some have another position beside it.
    for _ in range(many(360)):
        joints, pins, place = random_points(rng, 3), random_points(rng, 3), random_points(rng, 1)[0]
        against = bool(rng.integers(2))
        turned = (math.pi, place)
        mechanism, at = with_any_cranks(rng, pins, joints, turned, counter_rotating=against)
        for poses in (single_row(mechanism, at), batch_row(mechanism, at)):
            assert poses[-1][0] == pytest.approx(math.pi, abs=1e-11)


def test_is_a_value():
    assert example_2() == example_2()
    assert hash(example_2()) == hash(example_2())
    assert example_2() != example_2(1.0)
    assert example_2().with_phases(1.0, 2.0) == example_2(0.0).with_phases(1.0, 2.0)
    poses = example_2().poses_batch([0.0, 1.0])
    assert poses == poses
    assert poses != example_2().poses_batch([0.0, 1.0])
