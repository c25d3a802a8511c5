"""How far behind: turning twists and moving targets, by the engine as ``ik_node`` steps it.

Nothing here is timed, so nothing depends on the computer.
"""

import math
from collections.abc import Iterable

import numpy as np

from benchmarks.followed import on_circle, straight_error
from benchmarks.judge import LIMITS, MACHINE
from benchmarks.soak import engine_at
from benchmarks.table import Row, print_rows
from tri_glide_kinematics.motion import MotionEngine, SliderState
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.motion.trajectory import CubicPlan, RuckigPlanner
from tri_glide_kinematics.vectors import Vector3

PERIOD = 0.002  # s
PLACE = (0.0, 0.0, 0.3)
SPEED = 0.1  # m/s of twists
TWIST_PERIOD = 0.01  # s
SETTLED = 0.5  # s after which a lag is measured
ON_CIRCLE = on_circle(0.02, 1.0)
TURNS = (0.25, 0.5, 1.0, 2.0)  # per second
SHAPER = Shaper.of(ShaperKind.EI, Mode(15.0, 0.03))


def run() -> bool:
    """Measure and print the table; it is always complete."""
    return print_rows("tracking", rows(), "reference")


def rows() -> Iterable[Row]:
    """Yield lags behind twists, and errors behind targets."""
    for turns in TURNS:
        ours, theirs = lag(_jogged(turns), turns), lag(unchecked(turns), turns)
        yield Row(
            f"lag behind a twist that turns {turns:g} times a second",
            f"{1000.0 * ours:.2f} ms",
            f"{1000.0 * theirs:.2f} ms (ruckig's velocity interface, no checks)",
            ours <= theirs + PERIOD,
        )
    error = straight_error(_started(), PERIOD)
    yield Row(
        "target in a straight line, 0.3 m/s, told 100 times a second",
        f"{1000.0 * error:.2g} mm",
        "0.05 mm",
        error < 5e-5,
    )
    ours, theirs = _circle(with_velocity=True), _circle(with_velocity=False)
    yield Row(
        "target on a circle of 20 mm once a second, told 30 times with 5 ms of jitter",
        f"{1000.0 * ours:.2g} mm",
        f"{1000.0 * theirs:.2g} mm (poses)",
        ours < min(1e-3, theirs / 3.0),
    )
    error, behind = straight_error(_started(SHAPER), PERIOD), 0.3 * SHAPER.delay
    yield Row(
        "target in that line, with a shaper (EI, 15 Hz)",
        f"{1000.0 * error:.2g} mm",
        f"{1000.0 * behind:.2g} mm (its delay)",
        error < 1e-5,
    )
    error, behind = _circle(with_velocity=True, shaper=SHAPER), 0.02 * math.tau * SHAPER.delay
    yield Row(
        "target on that circle, with a shaper (EI, 15 Hz)",
        f"{1000.0 * error:.2g} mm",
        f"{1000.0 * behind:.2g} mm (its delay)",
        error < behind / 3.0,
    )


def _started(shaper: Shaper | None = None) -> MotionEngine:
    engine = engine_at(PLACE, in_pieces=True)
    engine.set_shaper(shaper)
    return engine


def _cycle(engine: MotionEngine) -> SliderState:
    """Return the next setpoint; plans are ready within their cycle."""
    setpoint = engine.step(PERIOD)
    engine.work(lambda: True)
    return setpoint


def turning(time: float, turns: float) -> Vector3:
    """Return the twist that was sent last at a ``time`` [s]."""
    angle = math.tau * turns * TWIST_PERIOD * math.floor(time / TWIST_PERIOD + 1e-6)
    return SPEED * math.cos(angle), SPEED * math.sin(angle), 0.0


def _jogged(turns: float) -> list[SliderState]:
    engine, states = _started(), []
    for cycle in range(round(2.0 / PERIOD)):
        engine.jog(turning(cycle * PERIOD, turns))
        engine.work(lambda: True)
        states.append(_cycle(engine))
    return states


def unchecked(turns: float, period: float = PERIOD, duration: float = 2.0) -> list[SliderState]:
    """Return setpoints by ruckig's velocity interface, each cycle from inverse kinematics."""
    ruckig, states = RuckigPlanner(3), []
    state = SliderState(MACHINE.inverse(PLACE), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    bounds = (LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk)
    for cycle in range(round(duration / period)):
        place = MACHINE.forward(state.heights)
        _, rates = MACHINE.inverse_velocity(place, turning(cycle * period, turns))
        phases = ruckig.to_velocity(rates, state.velocities, state.accelerations, bounds)
        state = CubicPlan(state, [[*each, (period, 0.0)] for each in phases]).at(period)
        states.append(state)
    return states


def lag(states: list[SliderState], turns: float, period: float = PERIOD) -> float:
    """Return by how much the direction of the platform is behind that of the stick [s]."""
    first = round(SETTLED / period)
    times = period * np.arange(first, len(states))
    velocities = [MACHINE.forward_velocity(*state[:2])[1] for state in states[first:]]
    angles = np.array([math.atan2(y, x) for x, y, _ in velocities])
    behind = np.angle(np.exp(1j * (math.tau * turns * times - angles)))
    return float(behind.mean()) / (math.tau * turns)


def _circle(*, with_velocity: bool, shaper: Shaper | None = None) -> float:
    """Return the largest error behind a target that is reported late and with jitter [m]."""
    chance = np.random.default_rng(4)
    reports = [(n / 30.0, n / 30.0 + float(chance.uniform(0.0, 0.005))) for n in range(120)]
    engine, errors = _started(shaper), []
    for cycle in range(round(3.9 / PERIOD)):
        now = cycle * PERIOD
        while reports and reports[0][1] <= now:
            seen, _ = reports.pop(0)
            position, velocity = ON_CIRCLE(seen)
            if with_velocity:
                engine.track(position, velocity, now - seen)
            else:
                engine.move_to(position)
                engine.work(lambda: True)
        place = MACHINE.forward(_cycle(engine).heights)
        errors.append(math.dist(place, ON_CIRCLE(now + PERIOD)[0]))
    return max(errors[round(1.0 / PERIOD) :])
