"""Knots in phases of constant jerk."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_plans import PHASES
from strategies import nudged, reproducible

from tri_glide_kinematics.motion.limits import AT_REST, SliderState
from tri_glide_kinematics.motion.trajectory import CubicPlan, shortest_piece, total_duration
from tri_glide_kinematics.motion.trajectory.cubic import with_knots_of
from tri_glide_kinematics.motion.trajectory.phases import knots


def test_each_phase_gets_as_many_pieces_whatever_the_last_bits_are():
    rng = np.random.default_rng(1)
    # Half of the 13 pieces end in the middle of the motion.
    durations = [0.1, 0.2, 0.2, 0.1]
    counts = set()
    for _ in range(100):
        nudged_durations = nudged(rng, durations).tolist()
        times = np.array(knots([(time, 1.0) for time in nudged_durations], 13, 1e-6))
        assert len(times) == 14
        ends = np.cumsum([0.0, *durations])
        counts.add(tuple(np.histogram(times + 1e-9, ends)[0].tolist()))
    assert len(counts) == 1


@reproducible
@given(PHASES, st.integers(40, 60))
def test_knots_are_as_many_as_asked_for_and_at_the_changes(phases, pieces):
    phases = [(duration, jerk) for duration, jerk in phases] + [(0.05, 0.0)]
    times = knots(phases, pieces, 1e-5)
    assert len(times) == pieces + 1
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(total_duration(phases))
    assert (np.diff(times) > 0.0).all()
    change = 0.0
    for duration, _ in phases[:-1]:
        change += duration
        if duration > 1e-5:
            assert min(abs(time - change) for time in times) < 1e-7


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
