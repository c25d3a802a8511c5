"""The closed forms of ``kinematics.py`` over arrays, for a million poses at a time.

The arithmetic is that of the functions for one pose, operation for operation, so that the results
are the same. The poses are worked through in blocks, whose intermediate results stay in the
processor's cache; nothing is allocated within a block. Results are stored component by component
(Fortran order), which numpy writes and reads about twice as fast as row by row. Whether all poses
of a block have a solution is asked of the whole block first, as picking out single rows costs more
than calculating them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from math import isfinite, nan

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

# Poses per block. Fewer, and the calls of numpy cost more than their work; many more, and the
# intermediate results, 2 MB, leave the cache. Not a power of two: rows a multiple of 4096 bytes
# apart would share few places of the first-level cache.
BLOCK = 24_000


def inverse_batch(
    constants: tuple[float, ...], positions: FloatArray, *, single_mode: bool
) -> FloatArray:
    """Return slider heights, with rows of NaN where there are none.

    Args:
        constants: anchor x [m], anchor y [m] and squared length [m^2] of each arm, then the
            negative gradients of the barycentric coordinates 2 and 3 (x, y, x, y) [1/m].
        positions: Shape (n, 3) [m].
        single_mode: whether no pose within reach can belong to the other assembly mode.

    Returns:
        Heights. Shape (n, 3) [m], in Fortran order.
    """
    arms = (constants[0:3], constants[3:6], constants[6:9])
    ux, uy, vx, vy = constants[9:]
    count = len(positions)
    heights = np.empty((3, count))
    buffers = np.empty((10, min(BLOCK, count)))
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, count, BLOCK):
            stop = min(start + BLOCK, count)
            block = buffers[:, : stop - start]
            place, rises, (across_x, across_y, plane, term) = block[:3], block[3:6], block[6:]
            np.copyto(place, positions[start:stop].T)
            x, y, z = place
            for (anchor_x, anchor_y, squared_length), rise in zip(arms, rises):
                np.subtract(anchor_x, x, out=across_x)
                np.multiply(across_x, across_x, out=across_x)
                np.subtract(anchor_y, y, out=across_y)
                np.multiply(across_y, across_y, out=across_y)
                np.subtract(squared_length, across_x, out=rise)
                np.subtract(rise, across_y, out=rise)
            np.sqrt(rises, out=rises)
            result = heights[:, start:stop]
            np.add(rises, z, out=result)
            solvable = rises.min() > 0.0 and isfinite(z.sum())
            if not single_mode:
                np.subtract(arms[0][0], x, out=across_x)
                np.subtract(arms[0][1], y, out=across_y)
                np.copyto(plane, rises[0])
                for gradient_x, gradient_y, rise in ((ux, uy, rises[1]), (vx, vy, rises[2])):
                    weight = _combine(gradient_x, across_x, gradient_y, across_y, term, out=x)
                    np.subtract(rise, rises[0], out=term)
                    np.multiply(weight, term, out=weight)
                    np.add(plane, weight, out=plane)
                solvable = solvable and plane.min() > 0.0
            if not solvable:
                solved = (rises > 0.0).all(axis=0) & np.isfinite(z)
                if not single_mode:
                    solved &= plane > 0.0
                result[:, ~solved] = np.nan
    return heights.T


def forward_batch(constants: tuple[float, ...], heights: FloatArray) -> FloatArray:
    """Return platform positions, with rows of NaN where there are none.

    Args:
        constants: anchor x [m], anchor y [m] and squared length [m^2] of arm 1; the two rows of the
            inverse of the matrix of anchor differences [1/m]; the platform's place relative to
            anchor 1 when all sliders are level [m].
        heights: Shape (n, 3) [m].

    Returns:
        Positions. Shape (n, 3) [m], in Fortran order.
    """
    x1, y1, squared_length, ux, vx, uy, vy, level_x, level_y = constants
    count = len(heights)
    positions = np.empty((3, count))
    buffers = np.empty((11, min(BLOCK, count)))
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        for start in range(0, count, BLOCK):
            stop = min(start + BLOCK, count)
            block = buffers[:, : stop - start]
            height, steps, foot, slope, squares = (
                *(block[0], block[1:3], block[3:5]),
                *(block[5:7], block[7:9]),
            )
            (px, py), (mx, my), (root, term), n, drop = foot, slope, squares, block[9], block[10]
            np.copyto(block[:3], heights[start:stop].T)
            np.subtract(steps, height, out=steps)
            np.multiply(steps, steps, out=squares)
            # Halving the constants is exact, so this is the one-pose formula to the last bit.
            _combine(0.5 * ux, squares[0], 0.5 * vx, squares[1], n, out=px)
            _combine(0.5 * uy, squares[0], 0.5 * vy, squares[1], n, out=py)
            np.add(px, level_x, out=px)
            np.add(py, level_y, out=py)
            _combine(ux, steps[0], vx, steps[1], n, out=mx)
            _combine(uy, steps[0], vy, steps[1], n, out=my)
            np.multiply(slope, slope, out=squares)
            np.add(squares[0], 1.0, out=n)
            np.add(n, squares[1], out=n)
            np.multiply(px, my, out=drop)
            np.multiply(py, mx, out=term)
            np.subtract(drop, term, out=drop)
            np.multiply(drop, drop, out=drop)
            np.multiply(n, squared_length, out=root)
            np.multiply(px, px, out=term)
            np.subtract(root, term, out=root)
            np.multiply(py, py, out=term)
            np.subtract(root, term, out=root)
            np.subtract(root, drop, out=root)
            np.sqrt(root, out=root)
            np.multiply(px, mx, out=drop)
            np.multiply(py, my, out=term)
            np.add(drop, term, out=drop)
            np.subtract(drop, root, out=drop)
            np.divide(drop, n, out=drop)
            np.multiply(slope, drop, out=slope)
            np.subtract(foot, slope, out=foot)
            result = positions[:, start:stop]
            np.add(px, x1, out=result[0])
            np.add(py, y1, out=result[1])
            np.add(height, drop, out=result[2])
            np.subtract(steps, drop, out=steps)
            if not (root.min() > 0.0 and drop.max() < 0.0 and steps.min() > 0.0):
                solved = (root > 0.0) & (drop < 0.0) & (steps > 0.0).all(axis=0)
                result[:, ~solved] = np.nan
    return positions.T


def _combine(
    a: float, x: FloatArray, b: float, y: FloatArray, term: FloatArray, *, out: FloatArray
) -> FloatArray:
    """Write a x + b y to ``out`` by way of ``term`` and return it."""
    np.multiply(a, x, out=out)
    np.multiply(b, y, out=term)
    return np.add(out, term, out=out)


# The same as loops over poses, compiled by numba if it is installed: one pass over the memory
# instead of dozens, with the same arithmetic and so the same results. Compiling takes seconds when
# a loop is first used in a process, which pays for itself after some hundred million poses: so it
# is done only on request.


def numba_is_installed() -> bool:
    """Tell whether numba is installed; it is not imported for that."""
    return find_spec("numba") is not None


def filled(loop: Callable[..., None], rows: FloatArray, *constants: object) -> FloatArray:
    """Return what a ``loop``, compiled, makes of ``rows`` with its ``constants``; in C order."""
    result = np.empty(rows.shape)
    compile_loop(loop)(*constants, rows, result)
    return result


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
