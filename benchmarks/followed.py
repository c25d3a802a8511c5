"""How calm what is followed is: targets on circles, with noise, and twists that turn; and how near.

Whole turns, from a second after the start. The ideal is the motion that is asked for, driven by
inverse kinematics. "Fast" is what is above 100 Hz, and above 90 Hz where messages come at 100 Hz.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.judge import LIMITS, MACHINE
from benchmarks.soak import engine_at
from testing.jerk_on_paths import COUNTS, FAST, PERIOD
from tri_glide_kinematics.motion import MotionEngine
from tri_glide_kinematics.motion.tracking import FOLLOW_HORIZON, ToldPlaces
from tri_glide_kinematics.vectors import FloatArray, Vector3

HEIGHT, START, SEED = 0.3, (0.0, -0.05, 0.3), 3
CAUGHT_UP = 1.0  # s until what follows is looked at
SPEED = 0.1  # m/s of twists
LOST = 0.05  # part of reports
NEAR = 2.5e-5  # m from a target that is caught
CALMEST = 90.0 / FAST
MODES, DAMPING = (15.0, 30.0, 100.0), 0.03  # Hz

HEAD = (
    "followed at 1 kHz",
    "jerk over ideal",
    "acceleration above 100 Hz, mm/s^2",
    "sign changes a second",
    "error or lag",
)
Motion = Callable[[float], tuple[Vector3, Vector3]]


class Calm(NamedTuple):
    """What is told of one motion that follows another.

    Attributes:
        jerk: RMS of all sliders over that of the ideal motion.
        fast: RMS of their accelerations above 100 Hz [m/s^2].
        turns: sign changes of the jerk a second, of the slider that has the most.
        behind: largest error behind a target [m], or mean lag behind a twist [s].
    """

    jerk: float
    fast: float
    turns: float
    behind: float


def on_circle(radius: float, turns: float) -> Motion:
    """Return place and velocity on a level circle of a ``radius`` [m] at so many turns a second."""

    def motion(time: float) -> tuple[Vector3, Vector3]:
        rate = math.tau * turns
        x, y = radius * math.cos(rate * time), radius * math.sin(rate * time)
        return (x, y, HEIGHT), (-rate * y, rate * x, 0.0)

    return motion


def calm_of(heights: FloatArray, ideal: FloatArray, told: float, behind: float) -> Calm:
    """Return what is told of ``heights`` that follow ``ideal`` ones. Shapes (n, 3) [m]."""
    jerks, wanted = (np.diff(each, 3, axis=0) / PERIOD**3 for each in (heights, ideal))
    accelerations = np.diff(heights, 2, axis=0) / PERIOD**2
    # A window, as what is cut out of a motion does not begin as it ends.
    window = np.hanning(len(accelerations))[:, np.newaxis]
    spectrum = np.abs(np.fft.rfft((accelerations - accelerations.mean(axis=0)) * window, axis=0))
    slowest = FAST * (CALMEST if abs(told - 0.01) < 1e-6 else 1.0)
    power = 2.0 * np.square(spectrum[np.fft.rfftfreq(len(window), PERIOD) > slowest]).sum()
    fast = math.sqrt(power / len(window) / np.square(window).sum() / 3.0)
    turns = max(
        np.count_nonzero(np.diff(np.sign(jerk[np.abs(jerk) > COUNTS * limit])))
        for jerk, limit in zip(jerks.T, LIMITS.jerk)
    )
    ratio = math.sqrt(np.square(jerks).mean() / np.square(wanted).mean())
    return Calm(ratio, fast, turns / (PERIOD * len(jerks)), behind)


def followed(
    motion: Motion,
    duration: float,
    told: float,
    noise: float = 0.0,
    of_speed: float = 0.0,
    *,
    as_poses: bool = False,
    lost: float = 0.0,
) -> Calm:
    """Return how a target is followed that is ``told`` each so many seconds.

    Its positions have a ``noise`` [m], its velocities one ``of_speed`` [m/s]. Of ``as_poses`` no
    velocities are told. Of all reports a part is ``lost``.
    """
    poses = ToldPlaces()
    engine, rng = engine_at(START), np.random.default_rng(SEED)
    heights, ideal, errors, tellings = [], [], [], 0
    for cycle in range(round((CAUGHT_UP + duration) / PERIOD)):
        if cycle * PERIOD >= tellings * told - 1e-9:
            tellings += 1
            if not lost or rng.random() >= lost:
                position, velocity = motion(cycle * PERIOD)
                wrong = of_speed * rng.normal(size=3) if of_speed else np.zeros(3)
                seen, speed = (position + noise * rng.normal(size=3)).tolist(), velocity + wrong
                known = poses.report(seen, cycle * PERIOD) if as_poses else speed.tolist()
                engine.move_to(seen) if known is None else engine.track(seen, known)
        heights.append(engine.step(PERIOD).heights)
        place, _ = motion((cycle + 1) * PERIOD)
        ideal.append(MACHINE.inverse(place))
        errors.append(math.dist(MACHINE.forward(heights[-1]), place))
    first = round(CAUGHT_UP / PERIOD)
    return calm_of(np.array(heights[first:]), np.array(ideal[first:]), told, max(errors[first:]))


def jogged(turns: float, told: float = 0.01, steps: int = 0) -> Calm:
    """Return how a twist is followed that turns, in so many ``steps`` of a stick or without."""
    engine, radius = engine_at(START), SPEED / (math.tau * turns)
    motion = on_circle(radius, turns)
    heights, ideal, lags, tellings = [], [], [], 0
    for cycle in range(round((CAUGHT_UP + 1.0 / turns) / PERIOD)):
        if cycle * PERIOD >= tellings * told - 1e-9:
            twist = np.array(motion(cycle * PERIOD)[1])
            if steps:
                twist = SPEED / steps * np.round(twist * steps / SPEED)
            engine.jog(twist.tolist())
            tellings += 1
        state = engine.step(PERIOD)
        heights.append(state.heights)
        place, (wx, wy, _) = motion((cycle + 1) * PERIOD)
        ideal.append(MACHINE.inverse(place))
        _, (vx, vy, _) = MACHINE.forward_velocity(state.heights, state.velocities)
        lags.append(math.atan2(vx * wy - vy * wx, vx * wx + vy * wy) / (math.tau * turns))
    first = round(CAUGHT_UP / PERIOD)
    lag = float(np.mean(lags[first:]))
    return calm_of(np.array(heights[first:]), np.array(ideal[first:]), told, lag)


def straight_error(engine: MotionEngine | None = None, period: float = PERIOD) -> float:
    """Return the largest error behind a target on a line once it is caught [m].

    Args:
        engine: at rest; one that plans at once by default.
        period: of its steps [s].
    """
    engine, speed, errors = engine or engine_at((0.0, 0.0, HEIGHT)), 0.3, []
    for cycle in range(round(0.95 / period)):
        if cycle % round(0.01 / period) == 0:
            engine.track((-0.15 + speed * cycle * period, 0.02, 0.3), (speed, 0.0, 0.0))
        place = MACHINE.forward(engine.step(period).heights)
        engine.work(lambda: True)
        errors.append(math.dist(place, (-0.15 + speed * (cycle + 1) * period, 0.02, 0.3)))
    return max(errors[round(0.5 / period) :])


def time_to_catch(speed: float, horizon: float = FOLLOW_HORIZON) -> float:
    """Return how long a platform at rest needs to a target 0.1 m away that goes aside [s]."""
    engine, last = engine_at(START), 0.0
    engine.set_follow_horizon(horizon)
    for cycle in range(round(1.5 / PERIOD)):
        x = -0.06 + speed * cycle * PERIOD
        if cycle % 10 == 0:
            engine.track((x, 0.03, 0.3), (speed, 0.0, 0.0))
        place = MACHINE.forward(engine.step(PERIOD).heights)
        if math.dist(place, (x + speed * PERIOD, 0.03, 0.3)) > NEAR:
            last = (cycle + 1) * PERIOD
    return last


def swing(
    motion: Motion, turns: float, told: float, noise: float, horizon: float = FOLLOW_HORIZON
) -> list[float]:
    """Return the RMS swing of machines with a mode each while a target is followed [m].

    It is what lies within a fifth of the mode's frequency, of four turns once the target is caught.
    """
    engine, rng, places = engine_at(START), np.random.default_rng(SEED), []
    engine.set_follow_horizon(horizon)
    tellings = 0
    for cycle in range(round((4.0 * CAUGHT_UP + 4.0 / turns) / PERIOD)):
        if cycle * PERIOD >= tellings * told - 1e-9:
            position, velocity = motion(cycle * PERIOD)
            engine.track((position + noise * rng.normal(size=3)).tolist(), velocity)
            tellings += 1
        places.append(MACHINE.forward(engine.step(PERIOD).heights))
    pushes = np.diff(places[round(4.0 * CAUGHT_UP / PERIOD) :], 2, axis=0) / PERIOD**2
    window = np.hanning(len(pushes))[:, np.newaxis]
    spectrum = np.fft.rfft((pushes - pushes.mean(axis=0)) * window, axis=0)
    frequencies, found = np.fft.rfftfreq(len(pushes), PERIOD), []
    for mode in MODES:
        ratio = frequencies / mode
        answer = 1.0 / ((math.tau * mode) ** 2 * (1.0 - ratio**2 + 2j * DAMPING * ratio))
        near = np.abs(ratio - 1.0) < 0.2
        power = 2.0 * np.square(np.abs(spectrum[near] * answer[near, np.newaxis])).sum()
        found.append(math.sqrt(power / len(pushes) / np.square(window).sum()))
    return found


def rows() -> Iterator[tuple[str, ...]]:
    """Yield the table."""
    for radius, turns, told, noise, of_speed in (
        (0.02, 1.0, 0.01, 0.0, 0.0),
        (0.03, 0.5, 0.01, 0.0, 0.0),
        (0.02, 1.0, 1.0 / 30.0, 0.0, 0.0),
        (0.03, 0.5, 1.0 / 30.0, 0.0, 0.0),
        (0.02, 1.0, 0.01, 1e-5, 0.0),
        (0.02, 1.0, 0.01, 1e-4, 0.0),
        (0.02, 1.0, 0.01, 0.0, 8e-3),
        (0.02, 1.0, 1.0 / 30.0, 0.0, 8e-3),
    ):
        found = followed(on_circle(radius, turns), 2.0 / turns, told, noise, of_speed)
        name = f"circle of {1e3 * radius:g} mm, {turns:g}/s, told at {1.0 / told:.0f} Hz"
        if noise:
            name += f", {1e3 * noise:g} mm of noise"
        if of_speed:
            name += f", {1e3 * of_speed:g} mm/s of noise"
        yield _row(name, found, f"{1e6 * found.behind:.1f} um")
    for told, as_poses in ((0.01, False), (1.0 / 30.0, False), (1.0 / 30.0, True)):
        found = followed(on_circle(0.03, 0.5), 4.0, told, as_poses=as_poses, lost=LOST)
        name = f"{'poses' if as_poses else 'target'} on a circle of 30 mm, 0.5/s"
        name += f", at {1.0 / told:.0f} Hz, {100.0 * LOST:g} % lost"
        yield _row(name, found, f"{1e6 * found.behind:.1f} um")
    for radius, turns, told, noise in (
        (0.02, 1.0, 0.01, 0.0),
        (0.03, 0.5, 1.0 / 30.0, 0.0),
        (0.03, 0.5, 1.0 / 30.0, 1e-4),
    ):
        motion = on_circle(radius, turns)
        found = followed(motion, 2.0 / turns, told, noise, as_poses=True)
        name = f"poses on a circle of {1e3 * radius:g} mm, {turns:g}/s, at {1.0 / told:.0f} Hz"
        if noise:
            name += f", {1e3 * noise:g} mm of noise"
        yield _row(name, found, f"{1e6 * found.behind:.1f} um")
    for turns, told, steps in (
        (0.25, 0.01, 0),
        (0.5, 0.01, 0),
        (1.0, 0.01, 0),
        (1.0, 1.0 / 30.0, 0),
        (0.25, 0.01, 127),
    ):
        found = jogged(turns, told, steps)
        name = f"twist that turns {turns:g}/s, told at {1.0 / told:.0f} Hz"
        yield _row(
            name + f", steps of 1/{steps}" * bool(steps), found, f"{1e3 * found.behind:.2f} ms"
        )
    for told, noise in ((0.01, 0.0), (1.0 / 30.0, 0.0), (0.01, 1e-5), (0.01, 1e-4)):
        motion = on_circle(0.02, 1.0)
        now, before = (swing(motion, 1.0, told, noise, each) for each in (FOLLOW_HORIZON, 0.0))
        swings = ", ".join(f"{1e6 * a:.1f} ({1e6 * b:.1f})" for a, b in zip(now, before))
        name = f"swing of modes of {', '.join(f'{mode:g}' for mode in MODES)} Hz (no horizon)"
        told_at = f"circle told at {1.0 / told:.0f} Hz, {1e3 * noise:g} mm of noise"
        yield f"{name}, {told_at}", "", "", "", f"{swings} um"
    yield "line, 0.3 m/s", "", "", "", f"{1e6 * straight_error():.2f} um"
    for speed in (0.0, 0.05, 0.1):
        caught = time_to_catch(speed)
        yield f"caught from rest 0.1 m away, at {speed:g} m/s", "", "", "", f"{1e3 * caught:.0f} ms"


def _row(name: str, found: Calm, behind: str) -> tuple[str, ...]:
    figures = f"{found.jerk:.2f}", f"{1e3 * found.fast:.2f}", f"{found.turns:.0f}"
    return (name, *figures, behind)
