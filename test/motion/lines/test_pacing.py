from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import reproducible

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.lines.pacing import Shape, line_pace
from tri_glide_kinematics.motion.lines.straight_line import StraightLine
from tri_glide_kinematics.motion.phases import (
    CoordinateLaw,
    evaluate,
    knots,
    rest_to_rest,
    shortest_piece,
    with_knots_of,
)
from tri_glide_kinematics.motion.plans import AT_REST, CubicPlan, SliderState
from tri_glide_kinematics.motion.ruckig_planner import RuckigPlanner
from tri_glide_kinematics.tri_glide.geometry import DEFAULT_GEOMETRY

LIMITS = SliderLimits((1.0, 0.8, 0.9), (10.0, 9.0, 8.0), (200.0, 250.0, 180.0))
ACROSS = StraightLine.between(DEFAULT_GEOMETRY, (-0.12, -0.08, 0.3), (0.1, 0.12, 0.45))
UPRIGHT = StraightLine.between(DEFAULT_GEOMETRY, (0.03, 0.02, 0.2), (0.03, 0.02, 0.4))
SHAPES = (Shape(6, 0.0), Shape(6, 1.1), Shape(12, 0.0), Shape(12, 1.4))


@pytest.mark.parametrize("line", [ACROSS, UPRIGHT])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("speed", [math.inf, 0.2])
def test_weight_is_the_p_norm_and_the_coordinate_its_integral(line, shape, speed):
    paced = line_pace(line, LIMITS, shape, speed)
    ways = np.linspace(0.0, line.length, 20_001)
    _, first, second, third = line.derivatives(ways)
    p = shape.exponent
    terms = np.concatenate(
        (
            np.abs(first.T) / LIMITS.velocity,
            shape.bend * np.sqrt(np.abs(second.T) / LIMITS.acceleration),
            shape.bend * np.cbrt(np.abs(third.T) / LIMITS.jerk),
            np.full((len(ways), 1), 1.0 / speed),
        ),
        axis=1,
    )
    sums = (terms**p).sum(axis=1)
    weights = sums ** (1.0 / p)
    assert np.allclose(np.interp(paced.ways, ways, weights), paced.weights, rtol=1e-6)
    assert paced.bent == pytest.approx(((terms[:, 3:9] ** p).sum(axis=1) / sums).max(), abs=0.01)
    slopes = np.gradient(weights, ways)
    scale = np.abs(slopes).max() + 1.0
    inner = np.interp(paced.ways[1:-1], ways, slopes)
    assert np.abs(inner - paced.weight_slopes[1:-1]).max() < 5e-3 * scale
    areas = 0.5 * (weights[1:] + weights[:-1]) * np.diff(ways)
    integral = np.interp(paced.ways, ways, np.concatenate(([0.0], np.cumsum(areas))))
    assert np.allclose(paced.coordinates, integral, rtol=1e-4)


@pytest.mark.parametrize("shape", SHAPES)
def test_largest_rate_acceleration_and_jerk_bring_one_slider_to_its_limit(shape):
    paced = line_pace(ACROSS, LIMITS, shape)
    _, first, _, _ = ACROSS.derivatives(paced.ways)
    steps = (np.abs(first) / paced.weights).T
    assert (steps * paced.rates.min() / LIMITS.velocity).max() == pytest.approx(1.0)
    assert (steps * paced.accelerations.min() / LIMITS.acceleration).max() == pytest.approx(1.0)
    assert (steps * paced.jerks.min() / LIMITS.jerk).max() == pytest.approx(1.0)


def test_ramps_look_at_their_own_part_of_the_line_alone():
    steep_end = StraightLine.between(DEFAULT_GEOMETRY, (0.0, 0.0, 0.3), (0.0, -0.19, 0.3))
    paced = line_pace(steep_end, LIMITS, Shape(12, 3.0), 0.05)
    begin, end = (paced.ramp_limits(1.0, at_end=at_end) for at_end in (False, True))
    assert begin[0] > 3.0 * end[0]
    assert begin[1] > 3.0 * end[1]
    assert begin[0] <= paced.accelerations[0]
    assert end[0] <= paced.accelerations[-1]
    assert min(begin[0], end[0]) >= paced.accelerations.min()


def test_platform_keeps_its_speed_where_the_sliders_allow_it():
    paced = line_pace(ACROSS, LIMITS, Shape(12, 1.6), 0.05)
    assert np.allclose(1.0 / paced.weights, 0.05, rtol=1e-4)


@pytest.mark.parametrize("shape", SHAPES)
def test_law_is_smooth_and_inverts_the_coordinate(shape):
    paced = line_pace(ACROSS, LIMITS, shape)
    total = paced.coordinates[-1]
    times = np.linspace(0.0, 1.0, 4001)
    values = total * (3.0 * times**2 - 2.0 * times**3)
    rates = total * (6.0 * times - 6.0 * times**2)
    law = paced.law(CoordinateLaw(times, values, rates, total * (6.0 - 12.0 * times)))
    assert law.ways[0] == 0.0
    assert law.ways[-1] == pytest.approx(ACROSS.length)
    assert (np.diff(law.ways) > 0.0).all()
    assert np.allclose(
        np.interp(law.ways, paced.ways, paced.coordinates), values, atol=2e-3 * total
    )
    step = times[1]
    speeds = (law.ways[2:] - law.ways[:-2]) / (2.0 * step)
    assert np.abs(speeds - law.speeds[1:-1]).max() < 1e-4
    gains = (law.speeds[2:] - law.speeds[:-2]) / (2.0 * step)
    assert np.abs(gains - law.accelerations[1:-1]).max() < 1e-2


def test_upright_line_has_no_bends():
    assert line_pace(UPRIGHT, LIMITS, Shape(6, 1.1)).bent == 0.0
    assert line_pace(ACROSS, LIMITS, Shape(6, 1.1)).bent > 0.1


PHASES = st.lists(
    st.tuples(
        st.one_of(st.just(0.0), st.just(1e-9), st.floats(0.01, 0.2)), st.floats(-200.0, 200.0)
    ),
    min_size=1,
    max_size=9,
).filter(lambda phases: max(duration for duration, _ in phases) > 0.0)


@reproducible
@given(PHASES, st.integers(40, 60))
def test_knots_are_as_many_as_asked_for_and_at_the_changes(phases, pieces):
    phases = [(duration, jerk) for duration, jerk in phases] + [(0.05, 0.0)]
    times = knots(phases, pieces, 1e-5)
    assert len(times) == pieces + 1
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(sum(duration for duration, _ in phases))
    assert (np.diff(times) > 0.0).all()
    change = 0.0
    for duration, _ in phases[:-1]:
        change += duration
        if duration > 1e-5:
            assert min(abs(time - change) for time in times) < 1e-7


@reproducible
@given(PHASES, st.floats(-1.0, 1.0), st.floats(-5.0, 5.0))
def test_coordinate_is_the_integral_of_its_jerks(phases, rate, acceleration):
    phases = [*phases, (0.05, 0.0)]
    times = np.linspace(0.0, sum(duration for duration, _ in phases), 501)
    law = evaluate(phases, (0.3, rate, acceleration), times)
    assert (law.values[0], law.rates[0], law.accelerations[0]) == (0.3, rate, acceleration)
    step = times[1]
    for lower, higher, bound in ((0, 1, 100.0), (1, 2, 400.0)):
        values, rates = law[1 + lower], law[1 + higher]
        mean = 0.5 * (rates[1:] + rates[:-1])
        assert np.abs(np.diff(values) / step - mean).max() < bound * step + 1e-9


def test_knots_of_a_blend_are_inserted_and_not_crowded():
    state = SliderState(AT_REST, (0.1, 0.0, 0.0), AT_REST)
    jerks = [[(0.031, -10.0), (0.02, 5.0)], [(0.031 + 3e-6, 1.0), (0.04, -1.0)], []]
    blend = CubicPlan(state, jerks)
    times = np.linspace(0.0, 0.2, 41).tolist()
    merged = with_knots_of(times, blend, 1e-5)
    assert (np.diff(merged) > 1e-5).all()
    assert merged[0] == 0.0 and merged[-1] == 0.2
    for change in (0.031, 0.051, blend.duration):
        assert min(abs(time - change) for time in merged) < 1e-15
    for time in times:
        assert min(abs(time - kept) for kept in merged) <= 1e-5


def test_shortest_piece_keeps_rounding_below_what_limits_notice():
    shortest = shortest_piece(0.4, 10.0)
    # Rounding of a way of 0.4 m in the second derivative of a quintic of this length.
    assert 12.0 * np.spacing(0.4) / shortest**2 < 1e-5


WAYS = st.floats(1e-6, 10.0)
BOUNDS = st.tuples(st.floats(0.01, 2.0), st.floats(1.0, 20.0), st.floats(20.0, 500.0))


@reproducible
@given(WAYS, BOUNDS, st.floats(0.3, 1.0))
def test_motion_from_rest_to_rest_arrives_and_keeps_its_limits(way, bounds, part):
    speed, acceleration, jerk = bounds
    phases = rest_to_rest(way, speed, acceleration, (jerk, part * jerk))
    total = sum(duration for duration, _ in phases)
    times = np.linspace(0.0, total, 2001)
    law = evaluate(phases, (0.0, 0.0, 0.0), times)
    assert min(duration for duration, _ in phases) >= 0.0
    assert law.values[-1] == pytest.approx(way, rel=1e-9)
    assert abs(law.rates[-1]) < 1e-9 * speed
    assert abs(law.accelerations[-1]) < 1e-9 * acceleration
    assert law.rates.max() <= speed * (1.0 + 1e-9)
    assert np.abs(law.accelerations).max() <= acceleration * (1.0 + 1e-9)
    assert np.allclose(law.values + law.values[::-1], way, rtol=1e-9)
    # Nothing is left unused: the speed is reached, or the acceleration, or its jerk all the time.
    (ramp, _), (steady, _), (last, _), (cruise, _), *_ = phases
    assert cruise <= 1e-9 * total or law.rates.max() == pytest.approx(speed)
    assert steady <= 1e-9 * total or ramp * jerk == pytest.approx(acceleration)
    assert ramp * jerk == pytest.approx(last * part * jerk)


@reproducible
@given(WAYS, BOUNDS)
def test_motion_from_rest_to_rest_is_the_fastest_if_both_jerks_are_one(way, bounds):
    speed, acceleration, jerk = bounds
    phases = rest_to_rest(way, speed, acceleration, (jerk, jerk))
    (fastest,) = RuckigPlanner(1).to_rest_at(
        [way], [0.0], [0.0], [0.0], ([speed], [acceleration], [jerk])
    )
    durations = [sum(duration for duration, _ in found) for found in (phases, fastest)]
    assert durations[0] == pytest.approx(durations[1], rel=1e-6)
