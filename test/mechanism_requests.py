"""Requests about mechanisms, as tests ask them."""

from __future__ import annotations

import math

import numpy as np

from tri_glide_interfaces.msg import CrankSweep, FMechanism, FourBar, LandingGear, Point2
from tri_glide_kinematics.ros.mechanisms import check_numbers


def turn():
    return CrankSweep(start_angle=0.0, end_angle=math.tau, steps=360)


def textbook():
    return FourBar(crank=2.0, coupler=7.0, rocker=9.0, ground=6.0)


def example_2(**changes):
    """Source 001, example 2."""
    message = FMechanism(
        base=[Point2(x=x, y=y) for x, y in ((0.0, 0.0), (52.5, 8.0), (40.0, 99.0))],
        crank_lengths=[19.0, 14.0, 16.0],
        rod_lengths=[35.0, 34.0, 54.0],
        platform=[Point2(x=x, y=y) for x, y in ((0.0, 0.0), (40.0, 18.0), (-7.0, 28.0))],
        phase_b=math.radians(243.0),
        phase_c=math.radians(-15.0),
        counter_rotating=True,
    )
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def nose_gear(**changes):
    message = LandingGear(
        l1=0.9,
        l2=0.3,
        l3=1.4,
        l4=0.2,
        gear_mass=90.0,
        wheel_mass=60.0,
        gear_ixx=15.0,
        gear_ixz=1.2,
        gear_iyy=16.0,
        gear_izz=2.5,
        wheel_axial_inertia=4.0,
        wheel_transverse_inertia=2.3,
    )
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def ask(fill, kind, **fields):
    request, response = kind.Request(**fields), kind.Response()
    check_numbers(request)
    fill(request, response)
    return response


def columns(response):
    """All columns of a trace by name."""
    kinds = response.get_fields_and_field_types()
    return {
        name: np.array(getattr(response, name))
        for name, kind in kinds.items()
        if kind == "sequence<double>"
    }
