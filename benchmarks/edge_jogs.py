"""Jogs into the edge of the workspace: straight, inside, and to the edge."""

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.judge import LIMITS, MACHINE
from benchmarks.linear_moves import WORKSPACE, along_and_beside
from benchmarks.soak import random_place, random_velocity
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, NoRoomError
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import overruns

SAMPLES = 200
LARGEST_ANGLE = math.radians(1.0)
ROUNDING = 1e-9

# Beyond the end of a jog by so much there has to be the outside [m].
BEYOND = 2e-4

# Ways shorter than this have no direction but that of their rounding [m].
SHORTEST_WAY = 1e-9


@dataclass
class Jogs:
    """What many jogs from rest have shown.

    Attributes:
        done: how many were not refused.
        angle: largest angle between the way of the platform and the twist [rad].
        overrun: largest overrun of slider travel or reach, at any time [m].
        at_edge: how many ended at the edge.
    """

    done: int = 0
    angle: float = 0.0
    overrun: float = -math.inf
    at_edge: int = 0


def overrun(heights: FloatArray) -> float:
    """Return by how much slider travel or reach is passed, negative if it is not [m]."""
    found = overruns(MACHINE, WORKSPACE.limits, heights)
    return float(np.maximum(found.travel, found.reach).max())


def random_heights(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return slider heights of a place inside the workspace."""
    place = random_place(rng, WORKSPACE, (-0.25, -0.25, -0.1), (0.25, 0.25, 0.6))
    return WORKSPACE.check_position(place)


def random_twist(rng: np.random.Generator, slowest: float = 0.02) -> list[float]:
    """Return a velocity in any direction, of up to 2 m/s."""
    return random_velocity(rng, slowest, 2.0)


def measure(count: int, seed: int) -> Jogs:
    """Jog from random places in random directions up to the edge."""
    rng = np.random.default_rng(seed)
    engine = MotionEngine(WORKSPACE, LIMITS)
    found = Jogs()
    for _ in range(count):
        engine.start(random_heights(rng))
        begin = np.array(MACHINE.forward(engine.state.heights))
        twist = random_twist(rng)
        unit = np.array(twist) / math.hypot(*twist)
        try:
            engine.jog(twist)
        except NoRoomError:
            continue
        found.done += 1
        heights = engine.sample_plan(np.linspace(0.0, engine.time_to_rest, SAMPLES)).heights
        found.overrun = max(found.overrun, overrun(heights))
        places = MACHINE.forward_batch(heights)
        along, beside = along_and_beside(places, begin, unit)
        far = along > SHORTEST_WAY
        found.angle = max(found.angle, float(np.arctan2(beside[far], along[far]).max()))
        try:
            WORKSPACE.check_position(
                (MACHINE.forward_batch(heights[-1:])[0] + BEYOND * unit).tolist()
            )
        except KinematicsError:
            found.at_edge += 1
    return found


def is_met(found: Jogs) -> bool:
    """Return whether all jogs were as they have to be."""
    return found.angle < LARGEST_ANGLE and found.overrun <= ROUNDING and found.at_edge == found.done
