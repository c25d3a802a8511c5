"""Targets that go a straight way and end, and a plain causal follower to compare with."""

import numpy as np

from tri_glide_kinematics.motion import SliderState
from tri_glide_kinematics.motion.limits import AT_REST
from tri_glide_kinematics.motion.trajectory import CubicPlan, RuckigPlanner
from tri_glide_kinematics.vectors import FloatArray

# A target told to be at a place with a velocity, at a time [s].
Report = tuple[float, FloatArray, FloatArray]

# Of a plain follower, for each axis of the platform [m/s, m/s^2, m/s^3].
PLAIN = (1.0, 10.0, 200.0)


def gentle(part: float) -> tuple[float, float]:
    """Return way and speed of a stroke of 1 in a time of 1 that begins and ends gently."""
    t = min(max(part, 0.0), 1.0)
    return t**3 * (10.0 - 15.0 * t + 6.0 * t * t), 30.0 * (t * (1.0 - t)) ** 2


def dead(part: float) -> tuple[float, float]:
    """Return way and speed of a stroke of 1 in a time of 1 that begins and ends suddenly."""
    return min(max(part, 0.0), 1.0), 1.0 if 0.0 <= part < 1.0 else 0.0


def forth_and_back(part: float) -> tuple[float, float]:
    """Return way and speed of a stroke of 1 forth in a time of 1, and back."""
    way, speed = dead(part if part < 1.0 else 2.0 - part)
    return way, speed if part < 1.0 else -speed


def most_beyond(places: FloatArray, start: FloatArray, way: FloatArray) -> float:
    """Return how far places are beyond the end of a straight way, at most [m]."""
    length = float(np.linalg.norm(way))
    return float(((places - start) @ way).max()) / length - length


def places_of_plain_follower(
    reports: list[Report],
    duration: float,
    period: float,
    bounds: tuple[float, float, float] = PLAIN,
) -> FloatArray:
    """Return where a plain causal follower is after each cycle. Shape (n, 3) [m].

    Each axis of the platform is led by ruckig to where the target was told to be last, led by the
    age of that and with its velocity, within bounds of velocity, acceleration and jerk.
    """
    limits = (bounds[0],) * 3, (bounds[1],) * 3, (bounds[2],) * 3
    planner, waiting = RuckigPlanner(3), list(reports)
    x, y, z = waiting[0][1].tolist()
    state = SliderState((x, y, z), AT_REST, AT_REST)
    places = []
    for cycle in range(round(duration / period)):
        while waiting and waiting[0][0] <= cycle * period + 1e-9:
            time, place, velocity = waiting.pop(0)
        led = place + (cycle * period - time) * velocity
        passing = np.clip(velocity, -bounds[0], bounds[0])
        ways = planner.to_pass(led.tolist(), passing.tolist(), list(zip(*state)), limits)
        # What comes after the arrival is steady.
        state = CubicPlan(state, [[*way, (period, 0.0)] for way in ways]).at(period)
        places.append(state.heights)
    return np.array(places)
