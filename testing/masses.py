"""Masses at random, for tests and benchmarks."""

import numpy as np

from tri_glide_kinematics.dynamics import Arm, Masses
from tri_glide_kinematics.vectors import Vector3


def random_masses(
    rng: np.random.Generator, *, heavy_arms: bool = False, friction: bool = True
) -> Masses:
    """Three unequal arms and carriages, counterweights, and gravity in any direction."""
    heaviest = 3.0 if heavy_arms else 0.4
    arms = []
    for uniform in rng.permutation([True, False, False]):
        mass = rng.uniform(0.05, heaviest)
        arms.append(Arm(mass) if uniform else Arm(mass, rng.uniform(), mass * rng.uniform(0, 0.05)))
    return Masses(
        _three(rng, 0.2, 3.0),
        (arms[0], arms[1], arms[2]),
        rng.uniform(0.2, 2.0),
        rng.uniform(0.0, 2.0),
        counterweights=_three(rng, 0.0, 2.0),
        coulomb=_three(rng, 0.0, 10.0 * friction),
        viscous=_three(rng, 0.0, 30.0 * friction),
        gravity=_three(rng, -15.0, 15.0),
    )


def _three(rng: np.random.Generator, lowest: float, highest: float) -> Vector3:
    x, y, z = rng.uniform(lowest, highest, 3).tolist()
    return x, y, z
