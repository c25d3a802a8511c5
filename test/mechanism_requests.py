"""Requests about mechanisms, as tests ask them."""

import math

import f_mechanism_samples
import numpy as np

from tri_glide_interfaces.msg import CrankSweep, FMechanism, FourBar, LandingGear, Point2
from tri_glide_kinematics.nodes.mechanism_node import check_numbers


def turn():
    return CrankSweep(start_angle=0.0, end_angle=math.tau, steps=360)


def textbook():
    return FourBar(crank=2.0, coupler=7.0, rocker=9.0, ground=6.0)


def message_of(mechanism):
    """Return the message that describes an F-mechanism of the library."""
    linkage = mechanism.linkage
    return FMechanism(
        base=[Point2(x=p.real, y=p.imag) for p in linkage.pivots],
        crank_lengths=linkage.cranks,
        rod_lengths=linkage.rods,
        platform=[Point2(x=p.real, y=p.imag) for p in linkage.joints],
        phase_b=mechanism.phase_b,
        phase_c=mechanism.phase_c,
        counter_rotating=mechanism.counter_rotating,
    )


def example_2(**changes):
    """Source 001, example 2."""
    message = message_of(f_mechanism_samples.example_2())
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


def assert_columns(response, scalars, places):
    """Check that a trace has these columns and no others; places have one for x and one for y."""
    expected = dict(scalars)
    for name, place in places.items():
        expected[f"{name}_x"], expected[f"{name}_y"] = place.T
    kinds = response.get_fields_and_field_types()
    assert set(expected) == {name for name, kind in kinds.items() if kind == "sequence<double>"}
    for name, column in expected.items():
        np.testing.assert_array_equal(getattr(response, name), column, err_msg=name)


def assert_message(message, expected):
    """Check all fields of a message."""
    assert set(message.get_fields_and_field_types()) == set(expected)
    for name, value in expected.items():
        np.testing.assert_array_equal(plain(getattr(message, name)), value, err_msg=name)


def plain(value):
    """Points as pairs of numbers, all else as it is."""
    if isinstance(value, Point2):
        return value.x, value.y
    return [plain(each) for each in value] if isinstance(value, list) else value
