"""Plans in slider space that tests look at."""

import numpy as np
from hypothesis import strategies as st
from ruckig import InputParameter, Ruckig, Synchronization
from ruckig import Trajectory as RuckigTrajectory

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.limits import AT_REST, SampledPlan, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import SliderMotion
from tri_glide_kinematics.motion.trajectory import CubicPlan, Trajectory
from tri_glide_kinematics.vectors import FloatArray, Vector3

LIMITS = SliderLimits((1.0, 0.7, 0.9), (10.0, 8.0, 12.0), (200.0, 150.0, 400.0))
HOME = SliderState((0.6, 0.55, 0.5), AT_REST, AT_REST)


# (duration [s], jerk) of phases, some of which take no time, or hardly any.
PHASES = st.lists(
    st.tuples(
        st.one_of(st.just(0.0), st.just(1e-9), st.floats(0.01, 0.2)), st.floats(-200.0, 200.0)
    ),
    min_size=1,
    max_size=9,
).filter(lambda phases: max(duration for duration, _ in phases) > 0.0)


def heights() -> st.SearchStrategy[tuple[float, float, float]]:
    """Return a strategy for the heights of three sliders [m]."""
    return st.tuples(*(st.floats(0.3, 0.9) for _ in range(3)))


def moving_plan(first: Vector3, second: Vector3, part: float) -> CubicPlan:
    """Return a move that begins when a ``part`` of another one is over."""
    motion = SliderMotion()
    one = at_once(motion.move(HOME, first, LIMITS))
    return at_once(motion.move(one.at(part * one.duration), second, LIMITS))


def motion_of_ruckig(
    state: SliderState,
    target: Vector3,
    limits: SliderLimits,
    synchronization: Synchronization = Synchronization.Time,
) -> RuckigTrajectory:
    """Return what ruckig itself makes of a move."""
    given, trajectory = InputParameter(3), RuckigTrajectory(3)
    given.current_position, given.current_velocity, given.current_acceleration = state
    given.target_position = target
    given.max_velocity, given.max_acceleration = limits.velocity, limits.acceleration
    given.max_jerk = limits.jerk
    given.synchronization = synchronization
    Ruckig(3, 0.001).calculate(given, trajectory)
    return trajectory


def dense(plan: CubicPlan, count: int = 4001) -> SampledPlan:
    """Return so many samples of a plan, from its start to its end."""
    return plan.sample(np.linspace(0.0, plan.duration, count))


def assert_states_are_samples(
    plan: Trajectory, times: FloatArray, rounding: tuple[float, float, float]
) -> None:
    """Compare setpoints at single instants with those of many, up to some ``rounding`` of each."""
    states = np.array([plan.at(time) for time in times.tolist()])
    for values, expected, near in zip(states.transpose(1, 0, 2), plan.sample(times)[1:], rounding):
        assert np.abs(values - expected).max() <= near


def peaks(plan: CubicPlan) -> FloatArray:
    """Return the largest velocities, accelerations and jerks of dense samples. Shape (3, 3)."""
    sampled = dense(plan)
    return np.array(
        [
            np.abs(sampled.velocities).max(axis=0),
            np.abs(sampled.accelerations).max(axis=0),
            np.abs(plan.pieces[3]).max(axis=0, initial=0.0),
        ]
    )
