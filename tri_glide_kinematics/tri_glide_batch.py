"""The closed forms of ``tri_glide.py`` over arrays, for a million poses at a time.

The arithmetic is that of the functions for one pose, operation for operation, so that the results
are the same. The poses are worked through in blocks, whose intermediate results stay in the
processor's cache; nothing is allocated within a block. Whether all poses of a block have a solution
is asked of the whole block first, as picking out single rows costs more than calculating them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Poses per block. Fewer, and the calls of numpy cost more than their work; more, and the
# intermediate results leave the second-level cache.
BLOCK = 2048


def inverse_batch(constants: tuple[float, ...], positions: Floats, *, single_mode: bool) -> Floats:
    """Return slider heights, with rows of NaN where there are none.

    Args:
        constants: anchor x [m], anchor y [m] and squared length [m^2] of each arm, then the
            negative gradients of the barycentric coordinates 2 and 3 (x, y, x, y) [1/m].
        positions: Shape (n, 3) [m].
        single_mode: whether no pose within reach can belong to the other assembly mode.

    Returns:
        Heights. Shape (n, 3) [m].
    """
    arms = np.array(constants[:9]).reshape(3, 3)
    anchor_x, anchor_y, squared_length = (arms[:, k, None] for k in range(3))
    gradient_x, gradient_y = (np.array(constants[9 + k :: 2])[:, None] for k in range(2))
    count = len(positions)
    heights = np.empty((count, 3))
    size = min(BLOCK, count)
    buffers = np.empty((4, 3, size))
    weight_buffers = np.empty((2, 2, size))
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, count, BLOCK):
            stop = min(start + BLOCK, count)
            place, across_x, across_y, rises = buffers[:, :, : stop - start]
            np.copyto(place, positions[start:stop].T)
            x, y, z = place
            np.subtract(anchor_x, x, out=across_x)
            np.subtract(anchor_y, y, out=across_y)
            if not single_mode:
                weights, terms = weight_buffers[:, :, : stop - start]
                np.multiply(gradient_x, across_x[0], out=weights)
                np.multiply(gradient_y, across_y[0], out=terms)
                np.add(weights, terms, out=weights)
            np.multiply(across_x, across_x, out=across_x)
            np.multiply(across_y, across_y, out=across_y)
            np.subtract(squared_length, across_x, out=rises)
            np.subtract(rises, across_y, out=rises)
            np.sqrt(rises, out=rises)
            plane = rises[0]
            if not single_mode:
                np.subtract(rises[1:], rises[0], out=terms)
                np.multiply(weights, terms, out=terms)
                plane = np.add(rises[0], terms[0], out=terms[0])
                np.add(plane, terms[1], out=plane)
            result = heights[start:stop]
            for arm in range(3):
                np.add(rises[arm], z, out=result[:, arm])
            if not (rises.min() > 0.0 and plane.min() > 0.0 and np.isfinite(z.sum())):
                solved = (rises > 0.0).all(axis=0) & (plane > 0.0) & np.isfinite(z)
                result[~solved] = np.nan
    return heights


def forward_batch(constants: tuple[float, ...], heights: Floats) -> Floats:
    """Return platform positions, with rows of NaN where there are none.

    Args:
        constants: anchor x [m], anchor y [m] and squared length [m^2] of arm 1; the two rows of the
            inverse of the matrix of anchor differences [1/m]; the foot of the line on which the
            platform lies when all sliders are level, seen from anchor 1 [m].
        heights: Shape (n, 3) [m].

    Returns:
        Positions. Shape (n, 3) [m].
    """
    anchor = np.array(constants[:2])[:, None]
    squared_length = constants[2]
    from_second, from_third = (np.array(constants[3 + k : 7 : 2])[:, None] for k in range(2))
    level_foot = np.array(constants[7:])[:, None]
    count = len(heights)
    positions = np.empty((count, 3))
    size = min(BLOCK, count)
    height_buffer = np.empty((3, size))
    buffers = np.empty((6, 2, size))
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        for start in range(0, count, BLOCK):
            stop = min(start + BLOCK, count)
            height = height_buffer[:, : stop - start]
            steps, halves, foot, slope, terms, scalars = buffers[:, :, : stop - start]
            np.copyto(height, heights[start:stop].T)
            np.subtract(height[1:], height[0], out=steps)
            np.multiply(steps, 0.5, out=halves)
            np.multiply(halves, steps, out=halves)
            np.multiply(from_second, halves[0], out=foot)
            np.add(level_foot, foot, out=foot)
            np.multiply(from_third, halves[1], out=terms)
            np.add(foot, terms, out=foot)
            np.multiply(from_second, steps[0], out=slope)
            np.multiply(from_third, steps[1], out=terms)
            np.add(slope, terms, out=slope)
            n, discriminant = scalars
            np.multiply(slope, slope, out=terms)
            np.add(terms[0], 1.0, out=n)
            np.add(n, terms[1], out=n)
            np.multiply(n, squared_length, out=discriminant)
            np.multiply(foot, foot, out=terms)
            np.subtract(discriminant, terms[0], out=discriminant)
            np.subtract(discriminant, terms[1], out=discriminant)
            np.multiply(foot, slope[::-1], out=terms)
            cross = np.subtract(terms[0], terms[1], out=terms[0])
            np.multiply(cross, cross, out=cross)
            np.subtract(discriminant, cross, out=discriminant)
            root = np.sqrt(discriminant, out=discriminant)
            np.multiply(foot, slope, out=terms)
            drop = np.add(terms[0], terms[1], out=terms[0])
            np.subtract(drop, root, out=drop)
            np.divide(drop, n, out=drop)
            np.multiply(slope, drop, out=slope)
            np.add(foot, anchor, out=foot)
            result = positions[start:stop]
            np.subtract(foot[0], slope[0], out=result[:, 0])
            np.subtract(foot[1], slope[1], out=result[:, 1])
            np.add(height[0], drop, out=result[:, 2])
            np.subtract(steps, drop, out=halves)
            if not (root.min() > 0.0 and drop.max() < 0.0 and halves.min() > 0.0):
                solved = (root > 0.0) & (drop < 0.0) & (halves > 0.0).all(axis=0)
                result[~solved] = np.nan
    return positions
