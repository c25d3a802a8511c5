"""All positions of the moving triangle at many crank angles at once.

The same steps as for one crank angle, on flat arrays with one entry for each root. Rows with a
special case in them (a double root, a degenerate linear system, a self-motion) are rare, and are
solved one by one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.errors import SelfMotionError
from tri_glide_kinematics.mechanisms.f_mechanism.results import FMechanismPoses
from tri_glide_kinematics.mechanisms.f_mechanism.solving.batch_roots import row_order, simple_roots
from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import ROUNDING, Closure, closure
from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import (
    CrankPins,
    Linkage,
    direction,
    pins_at,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.polynomial import Linear
from tri_glide_kinematics.mechanisms.f_mechanism.solving.positions import (
    DEGENERATE,
    LONGEST_CORRECTION,
    RESIDUAL,
    poses_at,
    special_pins,
)
from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import (
    motion,
    newton_step,
    rod_jacobian,
    rotation,
    singularity_unit,
)
from tri_glide_kinematics.rounding import directions

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Rows solved together: their samples fit into the processor's cache.
_CHUNK = 1024


def solve_batch(linkage: Linkage, crank_angles: Array) -> FMechanismPoses:
    """All positions at the given crank angles, shape (n,) [rad]."""
    n = len(crank_angles)
    result = FMechanismPoses(
        crank_angles=crank_angles,
        counts=np.zeros(n, dtype=np.int64),
        angle=np.full((n, 6), np.nan),
        position=np.full((n, 6, 2), np.nan),
        angular_velocity=np.full((n, 6), np.nan),
        velocity=np.full((n, 6, 2), np.nan),
        residual=np.full((n, 6), np.nan),
        singularity=np.full((n, 6), np.nan),
        self_motion=np.zeros(n, dtype=np.bool_),
        linkage=linkage,
    )
    for first in range(0, n, _CHUNK):
        rows = slice(first, min(first + _CHUNK, n))
        special = _solve_chunk(linkage, crank_angles[rows], result, first)
        for row in (first + np.flatnonzero(special)).tolist():
            _solve_row(linkage, result, row)
    return result


def _solve_chunk(linkage: Linkage, angles: Array, result: FMechanismPoses, first: int) -> Mask:
    """Write the positions of ordinary rows to ``result``; return which rows are special."""
    pins = pins_at(linkage, linkage.crank_angles(angles))
    condition = closure(linkage, pins)
    tolerance = ROUNDING * condition.scale
    special: Mask = special_pins(linkage, pins, condition) | condition.noisy
    roots = simple_roots(condition.polynomial, tolerance, special)

    row = roots.row
    z = direction(roots.angle)
    pins = CrankPins(*(part[row] for part in pins))
    v, degenerate = _rod_vectors(linkage, pins, condition, row, z)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing, turn = newton_step(rod_jacobian(linkage, pins, z, v))
        z, v = z * rotation(turn), v * rotation(swing)
        jacobian = rod_jacobian(linkage, pins, z, v)
        inverse = 1.0 / jacobian.determinant
        origin, joints, velocity, turn_rate = motion(linkage, pins, z, v, jacobian, inverse)
        gaps = [abs(abs(q - p) - length) for q, p, length in zip(joints, pins, linkage.rods)]
        residual = np.maximum(np.maximum(gaps[0], gaps[1]), gaps[2])
        failed = degenerate | ~(residual <= RESIDUAL * linkage.size)
        failed |= ~(abs(turn) <= LONGEST_CORRECTION * _apart(row, roots.angle))
    special[row[failed]] = True

    angle = directions(z)
    ordinary = np.flatnonzero(~special[row])
    ordinary = ordinary[row_order(row[ordinary], angle[ordinary])]
    row = row[ordinary]
    counts = np.bincount(row, minlength=len(angles))
    slot = np.arange(len(row)) - (np.cumsum(counts) - counts)[row]
    place = (first + row, slot)
    result.counts[first : first + len(angles)] = counts
    result.angle[place] = angle[ordinary]
    result.position[place] = _points(origin[ordinary])
    result.angular_velocity[place] = turn_rate[ordinary]
    result.velocity[place] = _points(velocity[ordinary])
    result.residual[place] = residual[ordinary]
    result.singularity[place] = jacobian.determinant[ordinary] / singularity_unit(linkage)
    return special


def _solve_row(linkage: Linkage, result: FMechanismPoses, row: int) -> None:
    """Solve one row by itself."""
    try:
        poses = poses_at(linkage, float(result.crank_angles[row]))
    except SelfMotionError:
        result.self_motion[row] = True
        return
    result.counts[row] = len(poses)
    for slot, pose in enumerate(poses):
        result.angle[row, slot] = pose.angle
        result.position[row, slot] = pose.position
        result.angular_velocity[row, slot] = pose.angular_velocity
        result.velocity[row, slot] = pose.velocity
        result.residual[row, slot] = pose.residual
        result.singularity[row, slot] = pose.singularity


def _points(numbers: Complex) -> Array:
    return numbers.view(np.float64).reshape(-1, 2)


def _apart(row: Index, angle: Array) -> Array:
    """Distance of each root to the next one in its row, or to the ends of the circle [rad]."""
    steps = np.full(len(row) + 1, np.pi)
    steps[1:-1] = np.where(row[1:] == row[:-1], angle[1:] - angle[:-1], np.pi)
    apart: Array = np.minimum(steps[:-1], steps[1:])
    return apart


def _rod_vectors(
    linkage: Linkage, pins: CrankPins, condition: Closure, row: Index, z: Complex
) -> tuple[Complex, Mask]:
    """Rod vectors v of the roots ``z``, and where the linear system for them is degenerate."""
    determinant, m_b, m_c = (
        Linear(part.constant[row], part.first[row]).at(z)
        for part in (condition.determinant, condition.product_b, condition.product_c)
    )
    w_b = z * linkage.platform_b - (pins.b - pins.a)
    w_c = z * linkage.platform_c - (pins.c - pins.a)
    largest = np.maximum(abs(w_b), abs(w_c))
    least = DEGENERATE * linkage.unit**2 * linkage.reach
    degenerate = ~(abs(determinant) > least * largest)
    # Only the direction is needed: its length is that of rod A, its sense that of D.
    v = (m_b * w_c - m_c * w_b) * (-1j * np.sign(determinant))
    with np.errstate(divide="ignore", invalid="ignore"):
        v *= linkage.rods[0] / abs(v)
    return v, degenerate
