"""The references of the benchmarks compute the same numbers as this project: no times here."""

import importlib.util
import math

import numpy as np
import pytest

from benchmarks.bench_mechanisms import CRANK_VELOCITY, LENGTHS, crank_angles, example_2
from benchmarks.bench_tri_glide import GEOMETRY, positions
from benchmarks.references import (
    f_mechanism_sextic,
    four_bar_numpy,
    four_bar_pylinkage,
    square_optimum,
    tri_glide_c,
    tri_glide_floats,
)
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry

UNEVEN = TriGlideGeometry(((0.0, 0.21), (0.18, -0.1), (-0.2, -0.12)), (0.4, 0.42, 0.38))
TIGHT = {"rtol": 0.0, "atol": 1e-14}


@pytest.mark.parametrize("geometry", [GEOMETRY, UNEVEN])
def test_float_functions_are_the_closed_form(geometry):
    machine = TriGlide(geometry)
    inverse = tri_glide_floats.inverse_velocity_of(geometry)
    forward = tri_glide_floats.forward_velocity_of(geometry)
    velocities = np.random.default_rng(6).uniform(-1.0, 1.0, (200, 3))
    for position, velocity in zip(positions(200).tolist(), velocities.tolist()):
        heights, rates = machine.inverse_velocity(position, velocity)
        np.testing.assert_allclose(inverse(position, velocity), (heights, rates), **TIGHT)
        ours = machine.forward_velocity(heights, rates)
        np.testing.assert_allclose(forward(heights, rates), ours, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("geometry", [GEOMETRY, UNEVEN])
def test_c_loops_are_the_closed_form(geometry):
    machine = TriGlide(geometry)
    places = positions(5000)
    heights = tri_glide_c.inverse_batch_of(geometry)(places)
    np.testing.assert_allclose(heights, machine.inverse_batch(places), **TIGHT)
    again = tri_glide_c.forward_batch_of(geometry)(heights)
    np.testing.assert_allclose(again, machine.forward_batch(heights), rtol=0.0, atol=1e-12)


def test_numpy_sweep_is_the_same_motion():
    angles = crank_angles(720)
    sweep = FourBar(*LENGTHS).sweep(angles, CRANK_VELOCITY)
    branches = four_bar_numpy.sweep(LENGTHS, angles, CRANK_VELOCITY)
    for ours, theirs in zip((sweep.open, sweep.crossed), branches):
        np.testing.assert_allclose(
            np.transpose([theirs.pin_x, theirs.pin_y]), ours.rocker_pins, rtol=0.0, atol=1e-12
        )
        for name in ("coupler", "rocker"):
            for kind, plural in (("velocity", "velocities"), ("acceleration", "accelerations")):
                np.testing.assert_allclose(
                    getattr(theirs, f"{name}_{kind}"),
                    getattr(ours, f"{name}_{plural}"),
                    rtol=1e-11,
                    atol=1e-10,
                )


def test_sextics_have_the_platform_angles_as_real_roots():
    mechanism = example_2()
    angles = crank_angles(90)
    sextics = f_mechanism_sextic.sextics(mechanism.linkage, angles)
    for angle, roots in zip(angles, f_mechanism_sextic.roots_in_a_loop(sextics)):
        ours = [pose.angle for pose in mechanism.poses(angle)]
        np.testing.assert_allclose(f_mechanism_sextic.real_angles(roots), ours, rtol=0.0, atol=1e-7)


def test_example_is_the_one_with_the_printed_angles():
    printed = (-75.688, -55.562, -18.443, -0.982)
    angles = [math.degrees(pose.angle) for pose in example_2().poses(math.radians(146.0))]
    np.testing.assert_allclose(angles, printed, rtol=0.0, atol=5e-4)


def test_pylinkage_follows_the_open_branch():
    if importlib.util.find_spec("pylinkage") is None or importlib.util.find_spec("numba") is None:
        # Only the benchmark needs them; then it has to say so instead of failing.
        with pytest.raises(ModuleNotFoundError):
            four_bar_pylinkage.sweep_of(LENGTHS, 360)
        return
    simulate, arguments = four_bar_pylinkage.sweep_of(LENGTHS, 360)
    joints = simulate(*arguments)
    # It starts at the crank angle zero and returns the position after each step.
    ours = FourBar(*LENGTHS).sweep(np.roll(crank_angles(360), -1)).open.rocker_pins
    np.testing.assert_allclose(joints[:, 3], ours, rtol=0.0, atol=1e-9)


def test_the_least_time_about_a_square_follows_freedom_and_jerk(monkeypatch):
    monkeypatch.setattr(square_optimum, "FIRST_CORNERS", (0.28,))
    corners = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.04), (0.0, 0.04), (0.0, 0.0)]
    points = np.array([(x - 0.02, y - 0.02, 0.3) for x, y in corners])

    def least(jerk, tolerance, outside):
        limits = SliderLimits.uniform(10.0, 1000.0, jerk)
        machine = TriGlide(GEOMETRY)
        return square_optimum.least_time(machine, points, limits, tolerance, outside, steps=60)

    inside = least(200.0, 1e-3, 0.0)
    # Where only jerks are limited, time goes with the cubic root of their limit.
    assert least(100.0, 1e-3, 0.0) == pytest.approx(inside * 2.0 ** (1.0 / 3.0), rel=1e-3)
    assert least(200.0, 0.5e-3, 0.0) > 1.02 * inside
    assert least(200.0, 1e-3, 1e-3) < 0.98 * inside
