"""Requests about landing gears: the answer is the library's, or says what is wrong."""

import numpy as np
import pytest
from mechanism_requests import ask, nose_gear

from tri_glide_interfaces.msg import LandingGearMotion
from tri_glide_interfaces.srv import SolveLandingGear
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms import landing_gear
from tri_glide_kinematics.nodes import mechanism_node as mechanism_messages


class TestSolveLandingGear:
    MOTION = LandingGearMotion(
        pitch_angle=0.1,
        retraction_angle=0.6,
        yaw_velocity=0.2,
        retraction_velocity=0.8,
        spin_velocity=120.0,
        yaw_acceleration=0.05,
        retraction_acceleration=-0.4,
        spin_acceleration=-15.0,
        forward_velocity=75.0,
        forward_acceleration=-2.0,
    )

    def test_every_number_is_that_of_the_library(self):
        response = ask(
            mechanism_messages.solve_landing_gear,
            SolveLandingGear,
            gear=nose_gear(gear_ixy=0.1, gear_iyz=-0.2, gravity=[0.1, 0.2, -9.8]),
            motion=self.MOTION,
        )
        inertia = [[15.0, 0.1, 1.2], [0.1, 16.0, -0.2], [1.2, -0.2, 2.5]]
        gear = landing_gear.LandingGear(
            0.9, 0.3, 1.4, 0.2, 90.0, 60.0, inertia, 4.0, 2.3, (0.1, 0.2, -9.8)
        )
        state = gear.state(
            landing_gear.LandingGearMotion(0.1, 0.6, 0.2, 0.8, 120.0, 0.05, -0.4, -15.0, 75.0, -2.0)
        )
        for part in ("gear", "wheel", "hinge", "axle"):
            message, expected = getattr(response, part), getattr(state, part)
            names = message.get_fields_and_field_types()
            assert set(names) == set(vars(expected))
            for name in names:
                assert np.array_equal(getattr(message, name), getattr(expected, name))

    def test_gravity_is_that_of_the_earth_unless_it_is_named(self):
        response = ask(mechanism_messages.solve_landing_gear, SolveLandingGear, gear=nose_gear())
        assert response.hinge.force == pytest.approx((0.0, 0.0, 150.0 * 9.80665))

    def test_a_gear_that_is_none_is_refused(self):
        with pytest.raises(KinematicsError, match="smallest principal value of gear_inertia"):
            ask(
                mechanism_messages.solve_landing_gear,
                SolveLandingGear,
                gear=nose_gear(gear_izz=-2.5),
            )
