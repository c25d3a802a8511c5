"""Profiles in phases of constant jerk."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import reproducible

from tri_glide_kinematics.motion.trajectory import (
    RuckigPlanner,
    evaluate,
    rest_to_rest,
    total_duration,
)

WAYS = st.floats(1e-6, 10.0)
BOUNDS = st.tuples(st.floats(0.01, 2.0), st.floats(1.0, 20.0), st.floats(20.0, 500.0))


@reproducible
@given(WAYS, BOUNDS, st.floats(0.3, 1.0))
def test_motion_from_rest_to_rest_arrives_and_keeps_its_limits(way, bounds, part):
    speed, acceleration, jerk = bounds
    phases = rest_to_rest(way, speed, acceleration, (jerk, part * jerk))
    total = total_duration(phases)
    times = np.linspace(0.0, total, 2001)
    profile = evaluate(phases, (0.0, 0.0, 0.0), times)
    assert min(duration for duration, _ in phases) >= 0.0
    assert profile.values[-1] == pytest.approx(way, rel=1e-9)
    assert abs(profile.rates[-1]) < 1e-9 * speed
    assert abs(profile.accelerations[-1]) < 1e-9 * acceleration
    assert profile.rates.max() <= speed * (1.0 + 1e-9)
    assert np.abs(profile.accelerations).max() <= acceleration * (1.0 + 1e-9)
    assert np.allclose(profile.values + profile.values[::-1], way, rtol=1e-9)
    # Nothing is left unused: the speed is reached, or the acceleration, or its jerk all the time.
    (ramp, _), (steady, _), (last, _), (cruise, _), *_ = phases
    assert cruise <= 1e-9 * total or profile.rates.max() == pytest.approx(speed)
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
    durations = [total_duration(found) for found in (phases, fastest)]
    assert durations[0] == pytest.approx(durations[1], rel=1e-6)
