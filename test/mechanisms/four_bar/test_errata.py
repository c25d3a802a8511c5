"""The equations of source 004 as printed, which fail, beside what is right.

Letters of the source: crank a, coupler b, rocker c, ground d, crank angle phi, coupler angle theta,
rocker angle psi, diagonal g at the angle eta, angle between coupler and diagonal phi-slashed (here
``lean``), angle between rocker and diagonal xi.
"""

import math

import numpy as np
import pytest

from tri_glide_kinematics.mechanisms.four_bar import FourBar

A, B, C, D = 2.0, 7.0, 9.0, 6.0
PHI = math.radians(30.0)


@pytest.fixture
def pose():
    """The open branch, the one of the positive roots."""
    return FourBar(A, B, C, D).solve(PHI)[0]


@pytest.fixture
def g2():
    return A**2 + D**2 - 2.0 * A * D * math.cos(PHI)


def test_6_3_lacks_the_coupler_length(pose, g2):
    diagonal = D - A * np.exp(1j * PHI)
    rocker = C * np.exp(1j * pose.rocker_angle)
    direction = np.exp(1j * pose.coupler_angle)
    assert abs(diagonal + rocker - direction) > 5.0  # as printed
    assert abs(diagonal + rocker - B * direction) < 1e-14 * 10.0


def test_6_4_is_the_law_of_cosines(g2):
    diagonal = abs(D - A * np.exp(1j * PHI))
    for angle in np.linspace(0.0, math.tau, 100):
        printed = abs(A**2 + D**2 - B * np.exp(1j * angle))  # a vector: no sense can be made of it
        assert abs(printed - diagonal**2) > 5.0
    assert g2 == pytest.approx(diagonal**2)


def test_the_angle_of_6_5_is_not_the_crank_angle(pose, g2):
    eta = math.atan2(-A * math.sin(PHI), D - A * math.cos(PHI))
    cosine = (B**2 + g2 - C**2) / (2.0 * B * math.sqrt(g2))
    assert cosine == pytest.approx(math.cos(pose.coupler_angle - eta), abs=1e-14)
    assert abs(cosine - math.cos(PHI)) > 0.5  # "= cos phi" as printed above (6.5)


def coupler_6_8(sign, g2):
    root = math.sqrt(4.0 * B**2 * g2 - (B**2 + g2 - C**2) ** 2)
    along, across = D - A * math.cos(PHI), A * math.sin(PHI)
    projection = B**2 + g2 - C**2
    sine = (along * root - across * projection) / (2.0 * B * g2)
    cosine = (across * root + sign * along * projection) / (2.0 * B * g2)
    return cosine, sine


def test_6_8_has_the_wrong_sign_in_the_cosine(pose, g2):
    printed = coupler_6_8(-1.0, g2)
    assert abs(printed[0] - math.cos(pose.coupler_angle)) > 0.1
    assert abs(math.hypot(*printed) - 1.0) > 0.05
    right = coupler_6_8(1.0, g2)
    assert right == pytest.approx((math.cos(pose.coupler_angle), math.sin(pose.coupler_angle)))


def test_the_negative_root_is_no_mirror_image_in_the_ground(pose):
    """The source calls it one; the mirror image in the x axis has another crank angle."""
    other = FourBar(A, B, C, D).solve(PHI)[1]
    assert abs(other.rocker_angle + pose.rocker_angle) > 0.4
    eta = math.atan2(-A * math.sin(PHI), D - A * math.cos(PHI))
    mirrored = 2.0 * eta - pose.coupler_angle
    assert math.remainder(other.coupler_angle - mirrored, math.tau) == pytest.approx(0.0, abs=1e-14)
