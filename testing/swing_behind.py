"""How a platform with one mode on each axis swings behind a motion: an answer of its own.

It knows neither shapers nor the simulated machine.
"""

from __future__ import annotations

import math

import numpy as np

from tri_glide_kinematics.motion import Trajectory
from tri_glide_kinematics.motion.shaping import Mode
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray

SAMPLE = 0.0005  # s


def swing(places: FloatArray, dt: float, mode: Mode) -> FloatArray:
    """Return how far the platform is from the rigid ``places``, ``dt`` seconds apart. (n, 3) [m].

    The offset q is that of q'' + 2 z w q' + w^2 q = -u'', where u changes linearly between two
    places: an impulse at each of them, and a free swing between.
    """
    w, z = math.tau * mode.frequency, mode.damping
    damped = w * math.sqrt(1.0 - z * z)
    fade = math.exp(-z * w * dt)
    c, s = math.cos(damped * dt), math.sin(damped * dt)
    step = fade * np.array(
        ((c + z * w / damped * s, s / damped), (-w * w / damped * s, c - z * w / damped * s))
    )
    rates = np.diff(places, axis=0, prepend=places[:1]) / dt
    kicks = np.diff(rates, axis=0, append=np.zeros((1, 3)))
    state = np.zeros((2, 3))
    offsets = np.empty_like(places)
    for index, kick in enumerate(kicks):
        offsets[index] = state[0]
        state[1] -= kick
        state = step @ state
    return offsets


def _sampled(machine: TriGlide, motion: Trajectory, longer: float) -> tuple[FloatArray, FloatArray]:
    times = np.arange(0.0, motion.duration + longer, SAMPLE)
    return times, machine.forward_batch(motion.sample(times).heights)


def left_after(machine: TriGlide, motion: Trajectory, mode: Mode) -> float:
    """Return how far the platform swings at most after a ``motion`` has come to rest [m]."""
    times, places = _sampled(machine, motion, 3.0 * mode.period)
    offsets = swing(places, SAMPLE, mode)[times > motion.duration + SAMPLE]
    return float(np.linalg.norm(offsets, axis=1).max())


def settled_at(machine: TriGlide, motion: Trajectory, mode: Mode, close: float) -> float:
    """Return from when on the platform stays ``close`` [m] to where it comes to rest [s]."""
    longest = math.log(1e4) / max(mode.decay, 1e-3)
    times, places = _sampled(machine, motion, longest)
    away = np.linalg.norm(places + swing(places, SAMPLE, mode) - places[-1], axis=1)
    return float(times[np.flatnonzero(away > close)[-1]])
