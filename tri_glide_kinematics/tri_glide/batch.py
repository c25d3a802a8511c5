"""The closed forms of ``kinematics.py`` for many poses at a time.

A function here takes numbers or arrays. Its steps are those of the function for one pose, so that
the results are the same to the last bit. numpy works through the poses in blocks, whose
intermediate results stay in the processor's cache. On request, where numba is installed, the same
function is compiled into a loop over the poses: one pass over the memory instead of dozens. That
takes seconds when it is first used in a process, which pays for itself after some hundred million
poses.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from typing import Any, TypeAlias

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

# Poses per block. Fewer, and the calls of numpy cost more than their work; many more, and the
# intermediate results leave the cache.
BLOCK = 12_000

# A float, or an array of them.
Number: TypeAlias = Any

# Constants of a machine and three numbers of a pose; returns the three others, and whether they are
# a solution.
Solution: TypeAlias = Callable[..., tuple[Number, Number, Number, Number]]


def inverse(
    constants: tuple[float, ...], x: Number, y: Number, z: Number
) -> tuple[Number, Number, Number, Number]:
    """Return the slider heights of a platform position [m], and whether there are any.

    The ``constants`` are anchor x [m], anchor y [m] and squared length [m^2] of each arm; the
    negative gradients of the barycentric coordinates 2 and 3 (x, y, x, y) [1/m]; and whether no
    pose within reach can belong to the other assembly mode.
    """
    x1, y1, b1, x2, y2, b2, x3, y3, b3, ux, uy, vx, vy, single_mode = constants
    f1x, f1y, f2x, f2y, f3x, f3y = x1 - x, y1 - y, x2 - x, y2 - y, x3 - x, y3 - y
    q1 = b1 - f1x * f1x - f1y * f1y
    q2 = b2 - f2x * f2x - f2y * f2y
    q3 = b3 - f3x * f3x - f3y * f3y
    s1, s2, s3 = np.sqrt(q1), np.sqrt(q2), np.sqrt(q3)
    # Without branches, so that a compiler can deal with several poses at once.
    solved = (q1 > 0.0) & (q2 > 0.0) & (q3 > 0.0) & (z * 0.0 == 0.0)
    if not single_mode:
        depth = s1 + (ux * f1x + uy * f1y) * (s2 - s1) + (vx * f1x + vy * f1y) * (s3 - s1)
        solved = solved & (depth > 0.0)
    return s1 + z, s2 + z, s3 + z, solved


def forward(
    constants: tuple[float, ...], h1: Number, h2: Number, h3: Number
) -> tuple[Number, Number, Number, Number]:
    """Return the platform position of slider heights [m], and whether there is one.

    The ``constants`` are anchor x [m], anchor y [m] and squared length [m^2] of arm 1; the two rows
    of the inverse of the matrix of anchor differences [1/m]; the platform's place relative to
    anchor 1 when all sliders are level [m].
    """
    x1, y1, b1, ux, vx, uy, vy, px0, py0 = constants
    d2, d3 = h2 - h1, h3 - h1
    e2, e3 = 0.5 * d2 * d2, 0.5 * d3 * d3
    px, py = ux * e2 + vx * e3 + px0, uy * e2 + vy * e3 + py0
    mx, my = ux * d2 + vx * d3, uy * d2 + vy * d3
    n = 1.0 + mx * mx + my * my
    c = px * my - py * mx
    discriminant = n * b1 - px * px - py * py - c * c
    w = (px * mx + py * my - np.sqrt(discriminant)) / n
    solved = (discriminant > 0.0) & (w < 0.0) & (w < d2) & (w < d3)
    return x1 + (px - mx * w), y1 + (py - my * w), h1 + w, solved


def by_blocks(solution: Solution, constants: tuple[float, ...], rows: FloatArray) -> FloatArray:
    """Return what a ``solution`` makes of ``rows``, NaN where it is none.

    Both have the shape (n, 3). Fortran order is written and read about twice as fast as C order.
    """
    result = np.empty((3, len(rows)))
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        for start in range(0, len(rows), BLOCK):
            some = slice(start, start + BLOCK)
            *found, solved = solution(constants, *np.ascontiguousarray(rows[some].T))
            for row, numbers in zip(result, found):
                row[some] = numbers
            if not solved.all():
                result[:, some][:, ~solved] = np.nan
    return result.T


def numba_is_installed() -> bool:
    """Tell whether numba is installed; it is not imported for that."""
    return find_spec("numba") is not None


def by_loop(solution: Solution, constants: tuple[float, ...], rows: FloatArray) -> FloatArray:
    """Return the same by a compiled loop; in C order."""
    result = np.empty(rows.shape)
    compiled_loop(solution)(constants, rows, result)
    return result


@cache
def compiled_loop(solution: Solution) -> Callable[..., None]:
    """Compile a loop that follows numpy in what a division by zero gives."""
    import numba

    compiled = numba.njit(error_model="numpy")(solution)

    def loop(constants: tuple[float, ...], rows: FloatArray, result: FloatArray) -> None:
        for i in range(len(rows)):
            a, b, c, solved = compiled(constants, rows[i, 0], rows[i, 1], rows[i, 2])
            result[i, 0] = a if solved else np.nan
            result[i, 1] = b if solved else np.nan
            result[i, 2] = c if solved else np.nan

    return numba.njit(error_model="numpy")(loop)
