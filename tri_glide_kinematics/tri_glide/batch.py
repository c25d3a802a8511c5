"""The closed forms of ``kinematics.py`` over arrays, for a million poses at a time.

The arithmetic is that of the functions for one pose, operation for operation, so that the results
are the same. The poses are worked through in blocks, whose intermediate results stay in the
processor's cache; nothing is allocated within a block. Results are stored component by component
(Fortran order), which numpy writes and reads about twice as fast as row by row. Whether all poses
of a block have a solution is asked of the whole block first, as picking out single rows costs more
than calculating them.
"""

from __future__ import annotations

from math import isfinite

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
