"""The closed forms of ``kinematics.py`` as loops over poses, compiled by numba if it is installed.

One pass over the memory instead of the dozens of ``batch.py``, with the same arithmetic
and so the same results. Compiling takes seconds when a loop is first used in a process, which pays
for itself after some hundred million poses: so it is done only on request.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from math import nan

import numpy as np

from tri_glide_kinematics.vectors import FloatArray


def is_available() -> bool:
    """Tell whether numba is installed; it is not imported for that."""
    return find_spec("numba") is not None


def inverse_batch(
    constants: tuple[float, ...], positions: FloatArray, *, single_mode: bool
) -> FloatArray:
    """Return slider heights; arguments as in ``batch``, the result in C order."""
    heights = np.empty(positions.shape)
    compile_loop(inverse_loop)(constants, single_mode, positions, heights)
    return heights


def forward_batch(constants: tuple[float, ...], heights: FloatArray) -> FloatArray:
    """Return platform positions; arguments as in ``batch``, the result in C order."""
    positions = np.empty(heights.shape)
    compile_loop(forward_loop)(constants, heights, positions)
    return positions


def inverse_loop(
    constants: tuple[float, ...], single_mode: bool, positions: FloatArray, heights: FloatArray
) -> None:
    """Fill ``heights``; the loop is plain Python, too, though slow."""
    x1, y1, b1, x2, y2, b2, x3, y3, b3, ux, uy, vx, vy = constants
    for i in range(len(positions)):
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        f1x, f1y, f2x, f2y, f3x, f3y = x1 - x, y1 - y, x2 - x, y2 - y, x3 - x, y3 - y
        q1 = b1 - f1x * f1x - f1y * f1y
        q2 = b2 - f2x * f2x - f2y * f2y
        q3 = b3 - f3x * f3x - f3y * f3y
        s1, s2, s3 = np.sqrt(q1), np.sqrt(q2), np.sqrt(q3)
        plane = s1 + (ux * f1x + uy * f1y) * (s2 - s1) + (vx * f1x + vy * f1y) * (s3 - s1)
        # Without branches, so that the compiler can deal with several poses at once.
        solved = (q1 > 0.0) & (q2 > 0.0) & (q3 > 0.0) & (z * 0.0 == 0.0)
        level = z if solved & (single_mode | (plane > 0.0)) else nan
        heights[i, 0], heights[i, 1], heights[i, 2] = s1 + level, s2 + level, s3 + level


def forward_loop(constants: tuple[float, ...], heights: FloatArray, positions: FloatArray) -> None:
    """Fill ``positions``; the loop is plain Python, too, though slow."""
    x1, y1, b1, ux, vx, uy, vy, px0, py0 = constants
    for i in range(len(heights)):
        h1 = heights[i, 0]
        d2, d3 = heights[i, 1] - h1, heights[i, 2] - h1
        e2, e3 = 0.5 * d2 * d2, 0.5 * d3 * d3
        px, py = ux * e2 + vx * e3 + px0, uy * e2 + vy * e3 + py0
        mx, my = ux * d2 + vx * d3, uy * d2 + vy * d3
        n = 1.0 + mx * mx + my * my
        c = px * my - py * mx
        discriminant = n * b1 - px * px - py * py - c * c
        w = (px * mx + py * my - np.sqrt(discriminant)) / n
        solved = (discriminant > 0.0) & (w < 0.0) & (w < d2) & (w < d3)
        drop = w if solved else nan
        positions[i, 0] = x1 + (px - mx * drop)
        positions[i, 1] = y1 + (py - my * drop)
        positions[i, 2] = h1 + drop


@cache
def compile_loop(loop: Callable[..., None]) -> Callable[..., None]:
    """Compile a loop so that it follows numpy in what a division by zero gives."""
    import numba

    compiled: Callable[..., None] = numba.njit(error_model="numpy")(loop)
    return compiled
