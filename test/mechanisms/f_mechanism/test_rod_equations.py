"""Crank pins: where the cranks carry them, for one crank angle and for many."""

import math

import numpy as np
import pytest
from f_mechanism_samples import random_mechanism

from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import pins_at

ANGLES = np.linspace(-4.0, 9.0, 27)


@pytest.mark.parametrize("seed", range(4))
def test_pins_turn_about_their_pivots(seed):
    linkage = random_mechanism(np.random.default_rng(seed)).linkage
    pins = pins_at(linkage, linkage.crank_angles(ANGLES))
    cranks = zip(pins[:3], linkage.pivots, linkage.cranks, linkage.speeds, linkage.phases)
    for pin, pivot, length, speed, phase in cranks:
        assert abs(pin - pivot) == pytest.approx(np.full(len(ANGLES), length))
        turned = np.angle((pin - pivot) * np.exp(-1j * (speed * ANGLES + phase)))
        assert turned == pytest.approx(np.zeros(len(ANGLES)), abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_rates_are_differences_of_places(seed):
    linkage = random_mechanism(np.random.default_rng(seed)).linkage
    step = 1e-6
    before, at, after = (
        pins_at(linkage, linkage.crank_angles(ANGLES + offset)) for offset in (-step, 0.0, step)
    )
    for low, rate, high in zip(before[:3], at[3:], after[:3]):
        assert np.max(abs((high - low) / (2.0 * step) - rate)) < 1e-8 * linkage.size


@pytest.mark.parametrize("seed", range(4))
def test_one_crank_angle_and_many_agree(seed):
    linkage = random_mechanism(np.random.default_rng(seed)).linkage
    many = pins_at(linkage, linkage.crank_angles(ANGLES))
    for row, angle in enumerate(ANGLES.tolist()):
        one = pins_at(linkage, linkage.crank_angles(angle))
        assert max(abs(p - q[row]) for p, q in zip(one, many)) < 1e-14 * linkage.size
        assert math.isfinite(abs(one.a))
