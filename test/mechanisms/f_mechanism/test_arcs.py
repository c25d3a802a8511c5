"""Tubes about the curve of positions: no other branch is in them."""

import math

import numpy as np
from f_mechanism_samples import random_mechanism
from soak import many

from tri_glide_kinematics.mechanisms.f_mechanism.curve import Curve, Drive, tube
from tri_glide_kinematics.mechanisms.f_mechanism.trace import starting_point


def test_no_other_branch_enters_the_tube():
    # All positions at many places of the drive inside proven tubes: only the arc itself is there.
    rng = np.random.default_rng(36)
    inside = 0
    for _ in range(many(20)):
        mechanism = random_mechanism(rng)
        speeds, phases = mechanism.linkage.speeds, mechanism.linkage.phases
        curve = Curve(mechanism.linkage, Drive(phases, speeds))
        for pose in mechanism.poses(0.0):
            frame = curve.frame(starting_point(curve, pose.angle, complex(*pose.position)))
            length, radius, _ = tube(frame, 0.5)
            centre, tangent = np.array(frame.x), np.array(frame.tangent)
            found = []
            for s in np.linspace(-length, length, 21):
                for other in mechanism.poses(s):
                    rod = complex(*np.subtract(other.platform_joints[0], other.crank_pins[0]))
                    offset = np.array([np.angle(rod), other.angle, s]) - centre
                    offset[:2] = np.remainder(offset[:2] + math.pi, 2.0 * math.pi) - math.pi
                    h = float(offset @ tangent)
                    y = offset - h * tangent
                    if 0.0 <= h <= length and np.linalg.norm(y) <= radius:
                        found.append(h)
                        corrected, _ = curve.correct(frame, h)
                        assert np.linalg.norm(centre + offset - corrected) < 1e-7
                        inside += 1
    assert inside > 100
