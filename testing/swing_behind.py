"""How a platform with one mode on each axis swings behind a motion: an answer of its own.

It knows neither shapers nor the simulated machine.
"""

import math

import numpy as np

from tri_glide_kinematics.motion import Trajectory
from tri_glide_kinematics.motion.shaping import Mode
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray

SAMPLE = 0.0005  # s
# So long a swing is looked at after the end of its motion, in periods.
AFTER = 3.0


def swing(places: FloatArray, dt: float, mode: Mode) -> FloatArray:
    """Return how far the platform is from the rigid ``places``, ``dt`` seconds apart. (n, 3) [m].

    The offset q is that of q'' + 2 z w q' + w^2 q = -u'', where u changes linearly between two
    places: it is the sum of the free swings that the impulses at these have started.
    """
    w, z = math.tau * mode.frequency, mode.damping
    damped = w * math.sqrt(1.0 - z * z)
    times = dt * np.arange(len(places))
    free = np.exp(-z * w * times) * np.sin(damped * times) / damped
    rates = np.diff(places, axis=0, prepend=places[:1]) / dt
    kicks = np.diff(rates, axis=0, append=np.zeros((1, 3)))
    # Twice as long, so that the end of the sum does not come in at its begin.
    long = 2 * len(places)
    spectrum = np.fft.rfft(free, long)[:, np.newaxis] * np.fft.rfft(kicks, long, axis=0)
    return -np.fft.irfft(spectrum, long, axis=0)[: len(places)]


def left_behind(places: FloatArray, dt: float, mode: Mode) -> float:
    """Return how far the platform swings at most after it was led to the last of ``places`` [m].

    Args:
        places: from rest to rest, ``dt`` seconds apart. Shape (n, 3) [m].
        dt: between two places [s].
        mode: of each axis.
    """
    rest = np.repeat(places[-1:], math.ceil(AFTER * mode.period / dt), axis=0)
    offsets = swing(np.concatenate((places, rest)), dt, mode)[len(places) :]
    return float(np.linalg.norm(offsets, axis=1).max())


def left_after(machine: TriGlide, motion: Trajectory, mode: Mode) -> float:
    """Return how far the platform swings at most after a ``motion`` has come to rest [m]."""
    return left_behind(_places(machine, motion), SAMPLE, mode)


def settled_at(machine: TriGlide, motion: Trajectory, mode: Mode, close: float) -> float:
    """Return from when on the platform stays ``close`` [m] to where it comes to rest [s]."""
    longest = math.log(1e4) / max(mode.decay, 1e-3)
    places = _places(machine, motion, longest)
    away = np.linalg.norm(places + swing(places, SAMPLE, mode) - places[-1], axis=1)
    return SAMPLE * float(np.flatnonzero(away > close)[-1])


def _places(machine: TriGlide, motion: Trajectory, longer: float = 0.0) -> FloatArray:
    """Return where the platform is led, to rest and for some time ``longer`` [s]. (n, 3) [m]."""
    times = np.arange(0.0, motion.duration + longer + SAMPLE, SAMPLE)
    return machine.forward_batch(motion.sample(times).heights)
