"""What a slider does on phases of constant jerk: exact extremes against dense samples."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_plans import PHASES
from strategies import reproducible

from tri_glide_kinematics.motion.tracking.clearance import excursion
from tri_glide_kinematics.motion.tracking.slider_way import way_of
from tri_glide_kinematics.motion.trajectory import evaluate, total_duration


@reproducible
@given(st.floats(-1.0, 1.0), st.floats(-10.0, 10.0), PHASES)
def test_extremes_are_those_of_dense_samples(velocity, acceleration, phases):
    found = excursion(velocity, acceleration, phases)
    times = np.linspace(0.0, total_duration(phases), 4001)
    _, ways, rates, accelerations = evaluate(phases, (0.0, velocity, acceleration), times)
    step = times[1]
    for extreme, sampled, slope in (
        (found.highest, max(0.0, ways.max()), found.speed),
        (-found.lowest, max(0.0, -ways.min()), found.speed),
        (found.speed, np.abs(rates).max(), found.acceleration),
        (found.acceleration, np.abs(accelerations).max(), found.jerk),
    ):
        assert sampled - 1e-12 <= extreme <= sampled + slope * step + 1e-12
    assert found.duration == pytest.approx(times[-1])
    assert found.jerk == max(abs(jerk) for duration, jerk in phases if duration > 0.0)
    assert found.displacement == pytest.approx(ways[-1], abs=1e-12)
    assert found.end_velocity == pytest.approx(rates[-1], abs=1e-12)
    way = way_of(velocity, acceleration, phases)
    assert (way.displacement, way.velocity, way.acceleration) == pytest.approx(
        (found.displacement, found.end_velocity, found.end_acceleration), abs=1e-12
    )


def test_a_turn_inside_a_phase_is_seen():
    # Up and back again within one phase: 1 m/s and -10 m/s^2 turn after 0.1 s at 0.05 m.
    found = excursion(1.0, -10.0, [(0.2, 0.0)])
    assert found.highest == pytest.approx(0.05)
    assert found.displacement == pytest.approx(0.0, abs=1e-15)
    # The velocity has its extreme inside, and passes zero twice.
    found = excursion(0.1, -10.0, [(0.1, 200.0)])
    assert found.speed == pytest.approx(0.15)
    assert found.lowest < found.displacement < found.highest


def test_what_is_no_number_stays_none():
    for phases in ([(math.nan, 1.0)], [(0.1, math.nan), (0.1, 0.0)]):
        found = excursion(0.1, 0.0, phases)
        assert math.isnan(found.speed)
        assert math.isnan(found.highest)


def test_nothing_moves():
    found = excursion(0.0, 0.0, [(0.0, 200.0), (0.1, 0.0)])
    assert found == (0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
