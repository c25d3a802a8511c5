"""The shortest change of a velocity, in closed form, against ruckig."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import reproducible

from tri_glide_kinematics.motion.tracking import to_zero
from tri_glide_kinematics.motion.tracking.slider_way import (
    mildest_way_onto,
    mildest_way_onto_speed,
    stopping_velocity,
    way_onto,
    within,
)
from tri_glide_kinematics.motion.trajectory import RuckigPlanner, after, cut_to, total_duration

MOST, JERK = 10.0, 200.0

# States at which cases meet, and such that are beside them by rounding.
CORNERS = [
    (0.0, 0.0),
    (1e-300, 0.0),
    (0.0, 1e-300),
    (1e-17, -1e-16),
    (-0.0, 0.0),
    (0.25, -10.0),
    (-0.25, 10.0),
    (0.25 + 1e-16, -10.0),
    (0.3, 10.0),
    (0.3, 10.0 + 1e-14),
    (-0.3, -10.0 - 1e-14),
    (0.3, -10.0),
    (0.5, 0.0),
    (-0.5, 0.0),
    (0.25, 10.0),
]


def end(velocity, acceleration, phases):
    state = 0.0, velocity, acceleration
    for duration, jerk in phases:
        state = after(duration, *state, jerk)
    return state


def checked(velocity, acceleration, lowest=-MOST, highest=MOST, jerk=JERK):
    """Return the phases, after a look at what must hold for each."""
    phases = to_zero(velocity, acceleration, lowest, highest, jerk)
    assert all(duration >= 0.0 and abs(one) in (0.0, jerk) for duration, one in phases)
    _, left, rest = end(velocity, acceleration, phases)
    whole = abs(velocity) + acceleration * acceleration / jerk + 1e-3
    assert abs(left) < 1e-13 * whole
    assert abs(rest) < 1e-13 * (abs(acceleration) + jerk * 1e-3)
    state = 0.0, velocity, acceleration
    for duration, one in phases:
        state = after(duration, *state, one)
        assert min(lowest, acceleration) - 1e-12 <= state[2] <= max(highest, acceleration) + 1e-12
    return phases


def test_as_short_as_ruckig_finds_it():
    rng = np.random.default_rng(1)
    ruckig = RuckigPlanner(1)
    states = np.column_stack((rng.uniform(-1.5, 1.5, 500), rng.uniform(-MOST, MOST, 500)))
    for velocity, acceleration in [*states.tolist(), *CORNERS]:
        phases = checked(velocity, acceleration)
        found = ruckig.to_rest([velocity], [acceleration], ([1.0], [MOST], [JERK]))[0]
        assert total_duration(phases) == pytest.approx(total_duration(found), rel=1e-9, abs=1e-9)
        way, _, _ = end(velocity, acceleration, phases)
        assert way == pytest.approx(end(velocity, acceleration, found)[0], rel=1e-9, abs=1e-12)


@reproducible
@given(
    st.floats(-2.0, 2.0),
    st.floats(-0.999, 0.999),
    st.floats(-12.0, -0.1),
    st.floats(0.1, 12.0),
    st.floats(1.0, 1e4),
)
def test_limits_may_differ_by_direction(velocity, part, lowest, highest, jerk):
    acceleration = part * (highest if part > 0.0 else -lowest)
    checked(velocity, acceleration, lowest, highest, jerk)


@reproducible
@given(st.floats(-2.0, 2.0), st.floats(-MOST, MOST))
def test_no_velocity_beyond_the_own_and_that_which_is_left(velocity, acceleration):
    bound = max(abs(velocity), abs(stopping_velocity(velocity, acceleration, JERK))) + 1e-12
    for part in np.linspace(0.0, 1.0, 50):
        phases = to_zero(velocity, acceleration, -MOST, MOST, JERK)
        cut = cut_to(phases, part * total_duration(phases))
        assert abs(end(velocity, acceleration, cut)[1]) <= bound


@reproducible
@given(st.floats(-2.0, 2.0), st.floats(-MOST, MOST), st.floats(1e-4, 0.5))
def test_a_cut_is_the_first_part_and_takes_the_whole_time(velocity, acceleration, duration):
    phases = to_zero(velocity, acceleration, -MOST, MOST, JERK)
    cut = cut_to(phases, duration)
    assert total_duration(cut) == pytest.approx(duration, rel=1e-12)
    whole = total_duration(phases)
    if duration > whole:
        assert cut[-1] == (pytest.approx(duration - whole, abs=1e-12), 0.0)
    # The rest of the way, done afterwards, comes to the same end.
    _, velocity, acceleration = end(velocity, acceleration, cut)
    left = to_zero(velocity, acceleration, -MOST - 1e-9, MOST + 1e-9, JERK)
    assert total_duration(left) == pytest.approx(max(whole - duration, 0.0), abs=1e-6)


def test_within():
    for value, expected in ((-3.0, -2.0), (-1.0, -1.0), (0.0, 0.0), (2.0, 2.0), (5.0, 2.0)):
        assert within(value, 2.0) == expected


def mean_jerk(ends: np.ndarray, period: float, horizon: float, orders: int) -> float:
    """Return the mean jerk over a first ``period`` of the mildest motion to zero.

    It is a polynomial with the derivatives ``ends`` at the start, and none at the end [s].
    """
    first = 3 - orders
    powers = np.arange(first, first + 2 * orders)
    rows, right = [], []
    for time, values in ((0.0, ends), (horizon, np.zeros(orders))):
        for order in range(first, 3):
            factors = [math.perm(power, order) if power >= order else 0.0 for power in powers]
            rows.append([f * time ** max(power - order, 0) for f, power in zip(factors, powers)])
            right.append(values[order - first])
    polynomial = np.linalg.solve(rows, right)
    accelerations = [
        sum(
            c * math.perm(power, 2) * time ** max(power - 2, 0)
            for c, power in zip(polynomial, powers)
            if power >= 2
        )
        for time in (0.0, period)
    ]
    return (accelerations[1] - accelerations[0]) / period


def test_the_mildest_way_has_the_least_jerk_that_ends_on_what_moves():
    rng = np.random.default_rng(7)
    for _ in range(100):
        period, horizon = rng.uniform(0.0005, 0.004), rng.uniform(0.02, 0.1)
        own = rng.normal(size=3) * (1e-3, 1e-2, 0.1)
        rate, bend, twist = rng.normal(size=3) * (0.1, 1.0, 5.0)
        # What moves is where the slider is zero from, seen from its frame, when the step begins.
        end = [
            rate * period + bend * period**2 / 2 + twist * period**3 / 6,
            rate + bend * period + twist * period**2 / 2,
            bend + twist * period,
        ]
        state = own + np.array((0.0, rate, bend))
        bounds = (1.0, 1e9, 1e5)
        way = mildest_way_onto(tuple(state), tuple(end), bounds, period, horizon, twist)
        ((length, jerk),) = way.phases
        assert length == period
        assert jerk - twist == pytest.approx(mean_jerk(own, period, horizon, 3), rel=1e-6)
        way = mildest_way_onto_speed(
            (state[1], state[2]), (rate + bend * period, bend), bounds, period, horizon
        )
        ((length, jerk),) = way.phases
        assert jerk == pytest.approx(mean_jerk(own[1:], period, horizon, 2), rel=1e-6)


def test_the_mildest_way_is_given_up_where_limits_or_the_horizon_are_too_small():
    far, near = (1e-3, 0.0, 0.0), (1e-13, 0.0, 0.0)
    aim = (0.0, 0.0, 0.0)
    bounds = (1.0, 10.0, 200.0)
    assert mildest_way_onto(far, aim, bounds, 0.001, 0.03) is None
    assert len(mildest_way_onto(far, aim, bounds, 0.001, 0.1).phases) == 1
    assert mildest_way_onto(far, aim, (1.0, 0.01, 200.0), 0.001, 0.1) is None
    # What is hardly any jerk, and a horizon of less than three steps, is one step.
    for own, horizon in ((near, 0.06), (near, 0.0), ((1e-9, 0.0, 0.0), 0.0029)):
        way = mildest_way_onto(own, aim, bounds, 0.001, horizon)
        assert way == way_onto(own, aim, bounds, 0.001)
        assert len(way.phases) == 3
