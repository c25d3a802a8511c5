"""A simulated platform swings as second-order modes do."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from soak import many
from strategies import reproducible

from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind, residual
from tri_glide_kinematics.simulation import PlatformMode, SimulatedSwing, SwingModel

HOME = (0.01, -0.02, 0.3)
STEPS = (0.0005, 0.001, 0.002, 0.005, 0.01)

frequencies = st.floats(1.0, 100.0)
dampings = st.floats(0.0, 0.5)


def swing_of(frequency, damping=0.0, axis=0, share=1.0):
    return SimulatedSwing(HOME, SwingModel((PlatformMode(axis, (frequency,), damping, share),)))


def ramp(axis, speed, time):
    """Return where a platform is led that has moved at a speed since time 0."""
    return tuple(value + speed * time * (i == axis) for i, value in enumerate(HOME))


def after_ramp(frequency, damping, speed, time):
    """Return swing and rate after the start of a ramp, in closed form."""
    omega = math.tau * frequency
    damped = omega * math.sqrt(1.0 - damping**2)
    fading = math.exp(-damping * omega * time)
    swing = -speed / damped * fading * math.sin(damped * time)
    rate = -speed * fading * math.cos(damped * time) - damping * omega * swing
    return swing, rate


@pytest.mark.parametrize("dt", STEPS)
@settings(reproducible, max_examples=many(8))
@given(st.integers(0, 2), frequencies, dampings)
def test_a_ramp_is_answered_as_in_closed_form(dt, axis, frequency, damping):
    swing = swing_of(frequency, damping, axis)
    for step in range(1, round(0.2 / dt) + 1):
        time = step * dt
        state = swing.step(ramp(axis, 0.3, time), dt)
        behind, rate = after_ramp(frequency, damping, 0.3, time)
        assert state.position[axis] == pytest.approx(
            ramp(axis, 0.3, time)[axis] + behind, abs=1e-12
        )
        assert state.velocity[axis] == pytest.approx(0.3 + rate, abs=1e-10)
        omega = math.tau * frequency
        felt = -2.0 * damping * omega * rate - omega**2 * behind
        assert state.acceleration[axis] == pytest.approx(felt, abs=1e-8)
        assert all(state.position[i] == HOME[i] for i in range(3) if i != axis)


@pytest.mark.parametrize("damping", [0.0, 0.03, 0.5])
def test_motion_in_pieces_of_lines_is_the_same_with_any_step(damping):
    model = SwingModel(
        (PlatformMode(2, (15.0,), damping, 0.6), PlatformMode(2, (31.0,), 0.02, 0.4))
    )
    knots = [(0.0, 0.0), (0.1, 0.02), (0.16, 0.05), (0.2, 0.03), (0.4, 0.03)]
    ends = []
    for dt in STEPS:
        swing = SimulatedSwing((0.0, 0.0, 0.0), model)
        for step in range(1, round(0.4 / dt) + 1):
            z = float(np.interp(step * dt, *zip(*knots)))
            state = swing.step((0.0, 0.0, z), dt)
        ends.append((*state.position, *state.velocity))
    assert np.ptp(ends, axis=0) == pytest.approx(np.zeros(6), abs=1e-12)
    assert abs(ends[0][2] - 0.03) > 1e-5


def test_modes_along_an_axis_share_the_swing():
    both = SimulatedSwing(
        HOME, SwingModel((PlatformMode(0, (10.0,), 0.05, 0.7), PlatformMode(0, (17.0,), 0.02, 0.3)))
    )
    for step in range(1, 200):
        state = both.step(ramp(0, 0.2, step * 0.002), 0.002)
        swings = [
            after_ramp(frequency, damping, 0.2, step * 0.002)[0]
            for frequency, damping in ((10.0, 0.05), (17.0, 0.02))
        ]
        expected = ramp(0, 0.2, step * 0.002)[0] + 0.7 * swings[0] + 0.3 * swings[1]
        assert state.position[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("kind", ShaperKind)
@pytest.mark.parametrize(("frequency", "damping"), [(12.5, 0.0), (12.5, 0.04), (14.0, 0.02)])
def test_a_shaper_leaves_of_the_swing_what_its_formula_tells(kind, frequency, damping):
    """Each impulse of a shaper becomes a change of the velocity."""
    shaper = Shaper.of(kind, Mode(12.5, 0.04))
    swing, place, speed, before = swing_of(frequency, damping), HOME[0], 0.0, 0.0
    for time, amplitude in zip((*shaper.times[1:], shaper.duration + 1e-9), shaper.amplitudes):
        speed += 0.3 * amplitude
        place += speed * (time - before)
        state = swing.step((place, *HOME[1:]), time - before)
        before = time
    omega = math.tau * frequency
    damped = omega * math.sqrt(1.0 - damping**2)
    behind, rate = state.position[0] - place, state.velocity[0] - speed
    amplitude = math.hypot(behind, (rate + damping * omega * behind) / damped)
    left = float(residual(shaper, [frequency], damping)[0])
    assert amplitude / (0.3 / damped) == pytest.approx(left, abs=1e-6)


def test_without_a_mode_the_platform_is_where_it_is_led():
    swing = SimulatedSwing(HOME)
    first = swing.step(ramp(0, 0.5, 0.002), 0.002)
    assert first.position == ramp(0, 0.5, 0.002)
    assert first.velocity == pytest.approx((0.5, 0.0, 0.0))
    assert first.acceleration == pytest.approx((250.0, 0.0, 0.0))
    assert swing.step(ramp(0, 0.5, 0.004), 0.002).acceleration == pytest.approx((0.0,) * 3)


LOW, HIGH = (0.0, 0.0, 0.2), (0.0, 0.0, 0.4)
BETWEEN = SwingModel((PlatformMode(0, (12.0, 20.0), 0.01),), (LOW, HIGH))


def test_a_frequency_is_given_at_points_and_lies_between_them_elsewhere():
    assert BETWEEN.frequencies(LOW) == [12.0]
    assert BETWEEN.frequencies(HIGH) == [20.0]
    assert BETWEEN.frequencies((0.0, 0.0, 0.3)) == pytest.approx([16.0])
    # At a third of the way, the squares of the distances are as 1 to 4.
    assert BETWEEN.frequencies((0.0, 0.0, 0.2 + 0.2 / 3.0)) == pytest.approx([12.0 + 8.0 / 5.0])
    assert BETWEEN.frequencies((0.0, 0.0, 1e6)) == pytest.approx([16.0])


@reproducible
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(tuple))
def test_no_frequency_is_beyond_those_of_the_points(position):
    assert 12.0 <= BETWEEN.frequencies(position)[0] <= 20.0


@pytest.mark.parametrize(("z", "frequency"), [(0.2, 12.0), (0.3, 16.0), (0.4, 20.0)])
def test_a_platform_swings_with_the_frequency_of_its_place(z, frequency):
    swing = SimulatedSwing((0.0, 0.0, z), BETWEEN)
    swing.step((0.001, 0.0, z), 0.001)
    places = np.array([swing.step((0.001, 0.0, z), 0.001).position[0] for _ in range(2000)])
    turns = np.count_nonzero(np.diff(np.sign(places - 0.001)))
    assert turns / 2.0 / 2.0 == pytest.approx(frequency, abs=0.3)


def test_another_model_goes_on_with_the_swing():
    swing = swing_of(15.0)
    swing.step(ramp(0, 0.3, 0.002), 0.002)
    swing.step(ramp(0, 0.3, 0.004), 0.002)
    swing.model = SwingModel((PlatformMode(0, (14.0,), 0.02),))
    assert swing.step(ramp(0, 0.3, 0.006), 0.002).position[0] < ramp(0, 0.3, 0.006)[0] - 1e-3
    swing.model = SwingModel()
    assert swing.step(ramp(0, 0.3, 0.008), 0.002).position == ramp(0, 0.3, 0.008)


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        ((3, (15.0,), 0.0), OutOfBoundsError, "axis = 3"),
        ((0, (0.0,), 0.0), OutOfBoundsError, "frequency = 0 Hz"),
        ((0, (15.0,), 0.6), OutOfBoundsError, "damping = 0.6"),
        ((0, (15.0,), 0.0, 0.0), OutOfBoundsError, "share = 0 must be above 0"),
        ((0, (math.nan,), 0.0), KinematicsError, "frequency = nan"),
    ],
)
def test_a_mode_that_cannot_be(arguments, error, text):
    with pytest.raises(error, match=text):
        PlatformMode(*arguments)


def test_modes_that_do_not_fit_together():
    mode = PlatformMode(1, (15.0,), 0.0, 0.6)
    with pytest.raises(OutOfBoundsError, match="sum of the shares along y"):
        SwingModel((mode, mode))
    with pytest.raises(WrongShapeError, match="frequencies"):
        SwingModel((mode,), (LOW, HIGH))
    with pytest.raises(KinematicsError, match="2 points must be different"):
        SwingModel((), (LOW, LOW))
    with pytest.raises(KinematicsError, match="at least 1"):
        SwingModel((), ())
