"""F-mechanisms for the tests, and the closure condition computed a second way."""

import math

import numpy as np

from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism

# Source 001, example 2: phase shift of crank B [rad].
PHASE_B = math.radians(243.0)

UNIT = np.array([1.0, 1.0j])


def example_1(base_side=1.0, platform_side=1.0):
    """Source 001, example 1, with either orientation of both triangles."""
    return FMechanism(
        triangle(300.0, 371.2, 404.0, base_side),
        (84.0, 104.0, 107.0),
        (185.0, 117.0, 185.0),
        triangle(205.0, 250.0, 117.0, platform_side),
        math.radians(103.0 - 177.0),
        math.radians(312.0 - 177.0),
    )


def example_2(phase_b=PHASE_B):
    """Source 001, example 2."""
    return FMechanism(
        [[0.0, 0.0], [52.5, 8.0], [40.0, 99.0]],
        (19.0, 14.0, 16.0),
        (35.0, 34.0, 54.0),
        [[0.0, 0.0], [40.0, 18.0], [-7.0, 28.0]],
        phase_b,
        math.radians(-15.0),
        counter_rotating=True,
    )


def triangle(ab, bc, ac, side):
    x = (ab * ab + ac * ac - bc * bc) / (2.0 * ab)
    return [[0.0, 0.0], [ab, 0.0], [x, side * math.sqrt(ac * ac - x * x)]]


def random_mechanism(rng, size=1.0):
    return FMechanism(
        size * rng.uniform(-1.0, 1.0, (3, 2)),
        size * rng.uniform(0.05, 0.6, 3),
        size * rng.uniform(0.2, 1.2, 3),
        size * rng.uniform(-0.7, 0.7, (3, 2)),
        *rng.uniform(-math.pi, math.pi, 2),
        counter_rotating=bool(rng.integers(2)),
    )


def crank_pins(mechanism, crank_angle):
    linkage = mechanism.linkage
    angles = np.array(linkage.speeds) * crank_angle + np.array(linkage.phases)
    return np.array(linkage.pivots) + np.array(linkage.cranks) * np.exp(1j * angles)


def closure_value(mechanism, crank_angle, angle):
    """Closure condition without any expansion, for platform angles of any shape."""
    pins = crank_pins(mechanism, crank_angle)
    joints, rods = mechanism.linkage.joints, mechanism.linkage.rods
    z = np.exp(1j * np.asarray(angle))
    w_b = z * (joints[1] - joints[0]) - (pins[1] - pins[0])
    w_c = z * (joints[2] - joints[0]) - (pins[2] - pins[0])
    m_b = (rods[1] ** 2 - rods[0] ** 2 - abs(w_b) ** 2) / 2.0
    m_c = (rods[2] ** 2 - rods[0] ** 2 - abs(w_c) ** 2) / 2.0
    determinant = (np.conj(w_b) * w_c).imag
    return abs(m_b * w_c - m_c * w_b) ** 2 - (rods[0] * determinant) ** 2


def rod_gaps(mechanism, crank_angle, angle, position):
    """Deviation of the three rod lengths from the plain definition."""
    joints = complex(*position) + np.exp(1j * angle) * np.array(mechanism.linkage.joints)
    return abs(joints - crank_pins(mechanism, crank_angle)) - np.array(mechanism.linkage.rods)


def mechanism_through(pins, joints, pose, cranks, crank_angles, counter_rotating=False, rods=None):
    """A mechanism whose crank pins stand at ``pins`` at crank angle ``crank_angles[0]``.

    Its rods fit the ``pose`` (angle, position) of a platform with the given ``joints``, all points
    as complex numbers.
    """
    turn = -1.0 if counter_rotating else 1.0
    start = crank_angles[0]
    pivots = np.asarray(pins) - cranks * np.exp(1j * crank_angles)
    if rods is None:
        rods = abs(pose[1] + np.exp(1j * pose[0]) * joints - pins)
    return FMechanism(
        np.stack([pivots.real, pivots.imag], axis=1),
        cranks,
        rods,
        np.stack([np.real(joints), np.imag(joints)], axis=1),
        crank_angles[1] - turn * start,
        crank_angles[2] - start,
        counter_rotating,
    )


def random_points(rng, n):
    return rng.uniform(-1.0, 1.0, (n, 2)) @ UNIT


def concurrent_pins(rng, joints, pose):
    """Crank pins whose rods to the platform at ``pose`` all pass through one point."""
    places = pose[1] + np.exp(1j * pose[0]) * joints
    centre = 2.0 * random_points(rng, 1)[0]
    return places + rng.uniform(0.3, 2.5, 3) * (centre - places)


def bifurcating_mechanism(rng):
    """A mechanism, and the crank angle and pose at which two of its branches meet.

    The rods pass through one point, and the cranks do no work on the forces that then balance in
    them: so the closure conditions are dependent in all directions.
    """
    while True:
        joints, pose = random_points(rng, 3), (rng.uniform(-3.1, 3.1), random_points(rng, 1)[0])
        pins = concurrent_pins(rng, joints, pose)
        rods = pose[1] + np.exp(1j * pose[0]) * joints - pins
        directions = rods / abs(rods)
        forces = np.linalg.svd([directions.real, directions.imag])[2][2]
        turn = rng.choice([-1.0, 1.0])
        arms = rng.uniform(0.1, 0.6, 3) * np.exp(1j * rng.uniform(-math.pi, math.pi, 3))
        work = forces * np.array([1.0, turn, 1.0]) * (np.conj(directions) * 1j * arms).real
        ratio = -(work[0] + work[1]) / work[2]
        if 0.3 < ratio < 3.0:
            arms[2] *= ratio
            mechanism = mechanism_through(pins, joints, pose, abs(arms), np.angle(arms), turn < 0.0)
            return mechanism, float(np.angle(arms[0])), pose


def large_platform(ratio, scale=1.0):
    """Rods of about 1, and base and platform larger by ``ratio``; up to six positions."""
    base = ratio * np.array([[0.0, 0.0], [1.0, 0.0], [0.4, 0.8]])
    platform = base + np.array([[0.0, 0.0], [0.2, 0.1], [0.0, 0.3]])
    return FMechanism(
        scale * base,
        scale * np.array([0.3, 0.4, 0.5]),
        scale * np.array([1.0, 1.2, 1.1]),
        scale * platform,
        0.5,
        -0.7,
    )


def random_large_platform(rng, ratio):
    """Rods of about 1, and base and platform larger by ``ratio`` that nearly fit."""
    base = ratio * rng.uniform(-1.0, 1.0, (3, 2))
    shape = base if ratio > 3.0 else np.zeros((3, 2))
    turn = rng.uniform(-math.pi, math.pi)
    cosine, sine = math.cos(turn), math.sin(turn)
    platform = (shape + rng.uniform(-1.0, 1.0, (3, 2))) @ [[cosine, sine], [-sine, cosine]]
    return FMechanism(
        base,
        rng.uniform(0.1, 0.8, 3),
        rng.uniform(0.5, 2.0, 3),
        platform,
        *rng.uniform(-math.pi, math.pi, 2),
        counter_rotating=bool(rng.integers(2)),
    )
