"""The jerk of the sliders: how much of it is fast, and how often it turns.

Along a path as planned it is taken each millisecond from the plan itself, not from differences. Two
figures tell whether it chatters:

- the part of its energy above 100 Hz: of the squared magnitudes of its Fourier transform, over the
  whole motion from rest to rest and without a window, all sliders together;
- the sign changes of the slider that has the most of them, of what is more than 1 % of its limit.
"""

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.trajectory import PathHeights, TimeScaling
from tri_glide_kinematics.vectors import FloatArray

PERIOD = 1e-3  # s
FAST = 100.0  # Hz
COUNTS = 0.01  # part of the limit


class Chatter(NamedTuple):
    """What tells whether the jerk of a motion chatters.

    Attributes:
        fast: part of the energy above 100 Hz.
        turns: sign changes of the slider that has the most of them.
    """

    fast: float
    turns: int


def slider_jerks(curve: PathHeights, motion: TimeScaling) -> FloatArray:
    """Return the jerks of the sliders, each millisecond of a ``motion``. Shape (3, n) [m/s^3]."""
    times = np.arange(0.5 * PERIOD, float(motion.times[-1]), PERIOD)
    piece = np.searchsorted(motion.times, times, "right") - 1
    t = times - motion.times[piece]
    _, _, _, c3, c4, c5 = motion.coefficients()[:, piece]
    jerk = 6.0 * c3 + t * (24.0 * c4 + t * 60.0 * c5)
    ways, speeds, accelerations = motion.evaluate(times)
    _, first, second, third = curve.derivatives(ways).heights
    return np.asarray(first * jerk + 3.0 * second * speeds * accelerations + third * speeds**3)


def chatter(curve: PathHeights, motion: TimeScaling, limits: SliderLimits) -> Chatter:
    """Return what tells whether the jerk of a ``motion`` from rest to rest chatters."""
    return chatter_of(slider_jerks(curve, motion), limits)


def chatter_of(jerks: FloatArray, limits: SliderLimits) -> Chatter:
    """Return what tells whether jerks chatter.

    Args:
        jerks: of the sliders, each millisecond from rest to rest. Shape (3, n) [m/s^3].
        limits: of the sliders.
    """
    power = np.square(np.abs(np.fft.rfft(jerks, axis=1))).sum(axis=0)
    is_fast = np.fft.rfftfreq(jerks.shape[1], PERIOD) > FAST
    turns = 0
    for jerk, limit in zip(jerks, limits.jerk):
        signs = np.sign(jerk[np.abs(jerk) > COUNTS * limit])
        turns = max(turns, int(np.count_nonzero(np.diff(signs))))
    return Chatter(float(power[is_fast].sum() / power.sum()), turns)


def circle(radius: float, speed: float | None = None) -> PlatformPath:
    """Return a level circle about the middle of the workspace."""
    path = PlatformPath.start((radius, 0.0, 0.3))
    path = path.arc_to((0.0, radius, 0.3), (-radius, 0.0, 0.3), speed=speed)
    return path.arc_to((0.0, -radius, 0.3), (radius, 0.0, 0.3), speed=speed)


def square(side: float, speed: float | None = None, tolerance: float = 1e-3) -> PlatformPath:
    """Return a level square about the middle of the workspace, with rounded corners."""
    a = 0.5 * side
    corners = [(-a, -a, 0.3), (a, -a, 0.3), (a, a, 0.3), (-a, a, 0.3), (-a, -a, 0.3)]
    return PlatformPath.through(np.array(corners), tolerance=tolerance, speed=speed)


def polyline(seed: int, speed: float | None = None, points: int = 8) -> PlatformPath:
    """Return lines between random points of a cube of 120 by 120 by 60 mm, corners rounded."""
    chance = np.random.default_rng(seed)
    places = chance.uniform((-0.06, -0.06, 0.27), (0.06, 0.06, 0.33), (points, 3))
    tolerance = float(np.exp(chance.uniform(np.log(3e-4), np.log(3e-3))))
    return PlatformPath.through(places, tolerance=tolerance, speed=speed)
