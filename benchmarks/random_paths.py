"""Paths at random, as an engine may be asked for them."""

from __future__ import annotations

import math

import numpy as np

from tri_glide_kinematics.motion import PlatformPath
from tri_glide_kinematics.vectors import Vector3

# Part of the paths that are polylines of many points, as from a CAM program.
DENSE = 0.2


def random_path(rng: np.random.Generator, start: Vector3, size: float) -> PlatformPath:
    """Return lines and arcs, or a dense polyline, whose corners are rounded, or stops.

    Args:
        rng: source of chance.
        start: of the path. Shape (3,) [m].
        size: of its segments, about [m].
    """
    tolerance = float(rng.choice((0.0, 0.01, 0.1, 0.3))) * size
    if rng.random() < DENSE:
        return _dense(rng, start, size, tolerance)
    path = PlatformPath.start(start)
    for _ in range(rng.integers(1, 9)):
        speed = 10.0 ** rng.uniform(-2.0, 0.0) if rng.random() < 0.2 else None
        if rng.random() < 0.3:
            centre = np.array(path.end) + size * rng.normal(size=3)
            angle = float(rng.uniform(-7.0, 7.0))
            path = path.arc_about(centre, rng.normal(size=3), angle, tolerance, speed)
        else:
            path = path.line_to(np.array(path.end) + size * rng.normal(size=3), tolerance, speed)
    return path


def _dense(rng: np.random.Generator, start: Vector3, size: float, tolerance: float) -> PlatformPath:
    """Return a polyline along a circle."""
    angles = np.linspace(0.0, rng.uniform(1.0, 4.0 * math.pi), rng.integers(20, 300))
    first, second = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    around = (np.cos(angles) - 1.0)[:, np.newaxis] * first + np.sin(angles)[:, np.newaxis] * second
    return PlatformPath.through(np.array(start) + size * around, tolerance)
