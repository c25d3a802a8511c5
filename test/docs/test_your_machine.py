"""The numbers that docs/your_machine.md and its sketch give."""

import math

import pytest

from tri_glide_kinematics import TriGlide, TriGlideGeometry

R, P, L = 0.25, 0.05, 0.40


def test_zero_of_the_heights_is_the_plane_of_z_zero():
    machine = TriGlide(TriGlideGeometry.symmetric(R, P, L))
    for height in (0.0, 0.6):
        z = height - math.sqrt(L**2 - (R - P) ** 2)
        assert machine.forward((height,) * 3) == pytest.approx((0.0, 0.0, z))


def test_a_wrong_height_moves_the_platform_as_the_table_says():
    machine = TriGlide(TriGlideGeometry.symmetric(R, P, L))
    before = machine.forward((0.6, 0.6, 0.6))
    after = machine.forward((0.601, 0.6, 0.6))
    moved = [1000.0 * (b - a) for a, b in zip(before, after)]
    assert moved == pytest.approx([0.0, 1.15, 0.33], abs=0.01)
