"""The edge of a workspace as lines, for whoever draws it.

On some levels it is looked how far the platform can go outwards from the middle. That makes a ring
on each level; some of their places are joined to meridians.
"""

from __future__ import annotations

from itertools import pairwise
from math import atan2, cos, pi, sin

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace.tracing import TOLERANCE
from tri_glide_kinematics.workspace.workspace import Workspace

# Rings of the outline, directions in each, and lines from ring to ring: enough to look smooth.
LEVELS = 9
DIRECTIONS = 48
MERIDIANS = 12

# Number of heights, from bottom to top, at which a place inside is looked for if the middle is not.
PLACES = 65

# No workspace is wider or taller [m].
FARTHEST = 1000.0

UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)


def outline(workspace: Workspace) -> Interruptible[FloatArray]:
    """Return the edge of a ``workspace`` as lines between two points each, interruptibly.

    Seen from the middle, the edge is where the platform leaves the workspace for the first time.

    Returns:
        Both ends of all lines, one after the other. Shape (2 n, 3) [m]; no line if there is no
        place inside.
    """
    rings = yield from edge_rings(workspace)
    if not len(rings):
        return np.empty((0, 3))
    lines = [np.stack((ring, np.roll(ring, -1, axis=0)), axis=1) for ring in rings]
    some = np.linspace(0, rings.shape[1], MERIDIANS, endpoint=False).astype(int)
    lines += [np.stack((lower[some], upper[some]), axis=1) for lower, upper in pairwise(rings)]
    return np.concatenate(lines).reshape(-1, 3)


def edge_rings(workspace: Workspace) -> Interruptible[FloatArray]:
    """Return the edge of a ``workspace`` as rings, the lowest first, interruptibly.

    Returns:
        Shape (levels, n, 3) [m]; no ring if there is no place inside.
    """
    middle = yield from _middle(workspace)
    if middle is None:
        return np.empty((0, 0, 3))
    x, y, z = middle
    bottom = z - workspace.exit_distance(middle, DOWN, FARTHEST)
    top = z + workspace.exit_distance(middle, UP, FARTHEST)
    # The ends themselves are no place to start from, for rounding.
    half = max(0.5 * (top - bottom) - TOLERANCE, 0.0)
    directions = _directions(workspace, x, y)
    rings = []
    # Denser near the ends, where the edge is bent most.
    for level in 0.5 * (bottom + top) - half * np.cos(np.linspace(0.0, pi, LEVELS)):
        start = (x, y, float(level))
        ring = []
        for angle in directions:
            direction = (cos(angle), sin(angle), 0.0)
            distance = workspace.exit_distance(start, direction, FARTHEST)
            ring.append(np.array(start) + distance * np.array(direction))
            yield
        rings.append(np.array(ring))
    return np.array(rings)


def _directions(workspace: Workspace, x: float, y: float) -> list[float]:
    """Return the directions to look in, those of the corners of a box among them [rad]."""
    angles = np.linspace(-pi, pi, DIRECTIONS, endpoint=False).tolist()
    lower, upper = workspace.limits.box_lower, workspace.limits.box_upper
    if lower and upper:
        angles += [atan2(v - y, u - x) for u in (lower[0], upper[0]) for v in (lower[1], upper[1])]
    return sorted(angles)


def _middle(workspace: Workspace) -> Interruptible[Vector3 | None]:
    """Return a place inside, in the middle as far as possible; None if none is found."""
    limits, geometry = workspace.limits, workspace.machine.geometry
    lower, upper, cylinder = limits.box_lower, limits.box_upper, limits.cylinder
    axes = [np.mean(geometry.anchors, axis=0).tolist()]
    lowest = min(limits.lower_heights) - max(geometry.arm_lengths)
    highest = max(limits.upper_heights)
    if lower and upper:
        axes.insert(0, np.mean((lower[:2], upper[:2]), axis=0).tolist())
    if cylinder:
        axes.insert(0, [cylinder.center_x, cylinder.center_y])
        lowest, highest = max(lowest, cylinder.z_min), min(highest, cylinder.z_max)
    if lower:
        lowest = max(lowest, lower[2])
    if upper:
        highest = min(highest, upper[2])
    for x, y in axes:
        inside = []
        for z in np.linspace(lowest, highest, PLACES).tolist():
            yield
            try:
                workspace.check_position((x, y, z))
            except KinematicsError:
                continue
            inside.append(z)
        if inside:
            return x, y, inside[len(inside) // 2]
    return None
