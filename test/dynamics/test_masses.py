import math
import re

import pytest

from tri_glide_kinematics.dynamics import Arm, Masses, PayloadOffCentreError
from tri_glide_kinematics.errors import (
    KinematicsError,
    NotANumberError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)

ARM = Arm(0.2)
GOOD = {"carriages": (1.0, 1.1, 1.2), "arms": (ARM, ARM, ARM), "platform": 0.6}


def test_a_uniform_arm_counts_as_a_third_at_each_end():
    assert Arm(0.6).end_masses(0.4) == pytest.approx((0.2, 0.1, 0.2))
    # Its inertia may be given, too.
    assert Arm(0.6, 0.5, 0.6 * 0.4**2 / 12.0).end_masses(0.4) == pytest.approx((0.2, 0.1, 0.2))


def test_an_arm_with_all_its_mass_at_its_ends_has_none_between_them():
    near, far, length = 0.3, 0.1, 0.5
    mass, centre = near + far, far / (near + far)
    inertia = length**2 * (near * centre**2 + far * (1.0 - centre) ** 2)
    assert Arm(mass, centre, inertia).end_masses(length) == pytest.approx(
        (near, 0.0, far), abs=1e-15
    )


@pytest.mark.parametrize("centre", [-0.01, 1.01])
def test_the_centre_is_on_the_arm(centre):
    with pytest.raises(OutOfBoundsError, match=re.escape(f"arm centre = {centre} must be from")):
        Arm(0.2, centre, 0.001)


def test_an_arm_with_its_centre_elsewhere_needs_an_inertia():
    with pytest.raises(OutOfBoundsError, match=re.escape("arm centre = 0.4 must be 0.5 for a")):
        Arm(0.2, 0.4)


@pytest.mark.parametrize(
    "change, error, text",
    [
        ({"carriages": (1.0, 2.0)}, WrongShapeError, "carriages has shape (2,)"),
        ({"carriages": (1.0, 0.0, 2.0)}, OutOfBoundsError, "carriages[1] = 0 kg must be greater"),
        ({"platform": 0.0}, OutOfBoundsError, "platform = 0 kg must be greater than 0"),
        ({"payload": -0.1}, OutOfBoundsError, "payload = -0.1 kg must be at least 0"),
        ({"counterweights": (0, -2, 0)}, OutOfBoundsError, "counterweights[1] = -2 kg must be"),
        ({"coulomb": (0, 0, math.nan)}, NotFiniteError, "coulomb[2] = nan"),
        ({"viscous": (-1, 0, 0)}, OutOfBoundsError, "viscous[0] = -1 N s/m must be at least 0"),
        ({"gravity": (0, 0, "g")}, NotANumberError, "gravity[2] = 'g'"),
        ({"arms": (ARM, ARM)}, WrongShapeError, "arms has shape (2,)"),
        ({"arms": None}, WrongShapeError, "arms has shape (0,)"),
        ({"arms": (ARM, 0.3, ARM)}, KinematicsError, "arms[1] = 0.3 must be an Arm"),
    ],
)
def test_numbers_that_no_machine_has_are_refused(change, error, text):
    with pytest.raises(error, match=re.escape(text)):
        Masses(**{**GOOD, **change})


def test_a_payload_off_centre_is_refused_and_one_below_is_not():
    with pytest.raises(PayloadOffCentreError, match=re.escape("(0.02, 0, -0.1) m")) as caught:
        Masses(**GOOD, payload=0.5, payload_centre=(0.02, 0.0, -0.1))
    assert caught.value.offset == (0.02, 0.0, -0.1)
    masses = Masses(**GOOD, payload=0.5, payload_centre=(0.0, 0.0, -0.1))
    assert masses.with_payload(0.7).payload == 0.7


def test_equal_arms_and_carriages_are_given_once():
    masses = Masses.uniform(1.0, 0.2, 0.6, payload=0.1, counterweight=0.3, coulomb=2, viscous=4)
    assert masses == Masses(
        (1, 1, 1), (ARM,) * 3, 0.6, 0.1, (0, 0, 0), (0.3,) * 3, (2,) * 3, (4,) * 3
    )
