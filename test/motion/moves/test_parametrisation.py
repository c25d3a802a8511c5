import math

import numpy as np
import pytest

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.moves import parametrise
from tri_glide_kinematics.motion.moves.line_timing import SpeedNorm
from tri_glide_kinematics.motion.trajectory import CoordinateProfile, StraightLine
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

LIMITS = SliderLimits((1.0, 0.8, 0.9), (10.0, 9.0, 8.0), (200.0, 250.0, 180.0))
ACROSS = StraightLine.between(DEFAULT_GEOMETRY, (-0.12, -0.08, 0.3), (0.1, 0.12, 0.45))
UPRIGHT = StraightLine.between(DEFAULT_GEOMETRY, (0.03, 0.02, 0.2), (0.03, 0.02, 0.4))
NORMS = (SpeedNorm(6, 0.0), SpeedNorm(6, 1.1), SpeedNorm(12, 0.0), SpeedNorm(12, 1.4))


@pytest.mark.parametrize("line", [ACROSS, UPRIGHT])
@pytest.mark.parametrize("norm", NORMS)
@pytest.mark.parametrize("speed", [math.inf, 0.2])
def test_weight_is_the_p_norm_and_the_coordinate_its_integral(line, norm, speed):
    parametrisation = parametrise(line, LIMITS, norm, speed)
    ways = np.linspace(0.0, line.length, 20_001)
    _, first, second, third = line.derivatives(ways).heights
    p = norm.exponent
    terms = np.concatenate(
        (
            np.abs(first.T) / LIMITS.velocity,
            norm.bend_weight * np.sqrt(np.abs(second.T) / LIMITS.acceleration),
            norm.bend_weight * np.cbrt(np.abs(third.T) / LIMITS.jerk),
            np.full((len(ways), 1), 1.0 / speed),
        ),
        axis=1,
    )
    sums = (terms**p).sum(axis=1)
    weights = sums ** (1.0 / p)
    assert np.allclose(
        np.interp(parametrisation.ways, ways, weights), parametrisation.weights, rtol=1e-6
    )
    assert parametrisation.bend_fraction == pytest.approx(
        ((terms[:, 3:9] ** p).sum(axis=1) / sums).max(), abs=0.01
    )
    slopes = np.gradient(weights, ways)
    scale = np.abs(slopes).max() + 1.0
    inner = np.interp(parametrisation.ways[1:-1], ways, slopes)
    assert np.abs(inner - parametrisation.weight_slopes[1:-1]).max() < 5e-3 * scale
    areas = 0.5 * (weights[1:] + weights[:-1]) * np.diff(ways)
    integral = np.interp(parametrisation.ways, ways, np.concatenate(([0.0], np.cumsum(areas))))
    assert np.allclose(parametrisation.coordinates, integral, rtol=1e-4)


@pytest.mark.parametrize("norm", NORMS)
def test_largest_rate_acceleration_and_jerk_bring_one_slider_to_its_limit(norm):
    parametrisation = parametrise(ACROSS, LIMITS, norm)
    _, first, _, _ = ACROSS.derivatives(parametrisation.ways).heights
    steps = (np.abs(first) / parametrisation.weights).T
    assert (steps * parametrisation.rates.min() / LIMITS.velocity).max() == pytest.approx(1.0)
    assert (
        steps * parametrisation.accelerations.min() / LIMITS.acceleration
    ).max() == pytest.approx(1.0)
    assert (steps * parametrisation.jerks.min() / LIMITS.jerk).max() == pytest.approx(1.0)


def test_ramps_look_at_their_own_part_of_the_line_alone():
    steep_end = StraightLine.between(DEFAULT_GEOMETRY, (0.0, 0.0, 0.3), (0.0, -0.19, 0.3))
    parametrisation = parametrise(steep_end, LIMITS, SpeedNorm(12, 3.0), 0.05)
    begin, end = (parametrisation.ramp_limits(1.0, at_end=at_end) for at_end in (False, True))
    assert begin[0] > 3.0 * end[0]
    assert begin[1] > 3.0 * end[1]
    assert begin[0] <= parametrisation.accelerations[0]
    assert end[0] <= parametrisation.accelerations[-1]
    assert min(begin[0], end[0]) >= parametrisation.accelerations.min()


def test_platform_keeps_its_speed_where_the_sliders_allow_it():
    parametrisation = parametrise(ACROSS, LIMITS, SpeedNorm(12, 1.6), 0.05)
    assert np.allclose(1.0 / parametrisation.weights, 0.05, rtol=1e-4)


@pytest.mark.parametrize("norm", NORMS)
def test_time_scaling_is_smooth_and_inverts_the_coordinate(norm):
    parametrisation = parametrise(ACROSS, LIMITS, norm)
    total = parametrisation.coordinates[-1]
    times = np.linspace(0.0, 1.0, 4001)
    values = total * (3.0 * times**2 - 2.0 * times**3)
    rates = total * (6.0 * times - 6.0 * times**2)
    scaling = parametrisation.time_scaling(
        CoordinateProfile(times, values, rates, total * (6.0 - 12.0 * times))
    )
    assert scaling.ways[0] == 0.0
    assert scaling.ways[-1] == pytest.approx(ACROSS.length)
    assert (np.diff(scaling.ways) > 0.0).all()
    assert np.allclose(
        np.interp(scaling.ways, parametrisation.ways, parametrisation.coordinates),
        values,
        atol=2e-3 * total,
    )
    step = times[1]
    speeds = (scaling.ways[2:] - scaling.ways[:-2]) / (2.0 * step)
    assert np.abs(speeds - scaling.speeds[1:-1]).max() < 1e-4
    accelerations = (scaling.speeds[2:] - scaling.speeds[:-2]) / (2.0 * step)
    assert np.abs(accelerations - scaling.accelerations[1:-1]).max() < 1e-2


def test_upright_line_has_no_bends():
    assert parametrise(UPRIGHT, LIMITS, SpeedNorm(6, 1.1)).bend_fraction == 0.0
    assert parametrise(ACROSS, LIMITS, SpeedNorm(6, 1.1)).bend_fraction > 0.1
