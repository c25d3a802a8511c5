"""The curve of positions: its gradients and second derivatives are those of the rod equations."""

import numpy as np
import pytest
from f_mechanism_samples import random_mechanism

from tri_glide_kinematics.mechanisms.f_mechanism.curve import Curve, Drive


def test_derivatives_of_the_rod_equations():
    rng = np.random.default_rng(35)
    step = 1e-6
    for _ in range(30):
        mechanism = random_mechanism(rng)
        drive = Drive(tuple(rng.uniform(-3, 3, 3)), tuple(rng.uniform(-1, 1, 3)))
        curve = Curve(mechanism.linkage, drive)
        x = rng.uniform(-3.0, 3.0, 3)
        at = curve.gradients(tuple(x))
        hessians = curve.hessians(tuple(x))
        for axis in range(3):
            offset = step * np.eye(3)[axis]
            before, after = curve.gradients(tuple(x - offset)), curve.gradients(tuple(x + offset))
            assert (after.gap_b - before.gap_b) / (2 * step) == pytest.approx(at.b[axis], abs=1e-8)
            assert (after.gap_c - before.gap_c) / (2 * step) == pytest.approx(at.c[axis], abs=1e-8)
            for hessian, low, high in zip(hessians, (before.b, before.c), (after.b, after.c)):
                slope = (np.array(high) - low) / (2 * step)
                assert slope == pytest.approx(hessian[axis], abs=1e-7)
