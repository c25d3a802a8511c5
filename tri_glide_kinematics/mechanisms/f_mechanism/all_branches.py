"""All branches of an F-mechanism as connected curves over the crank angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.equal_numbers import first_largest
from tri_glide_kinematics.mechanisms.f_mechanism.closure import (
    ROUNDING_ERROR,
    Closure,
    Cubic,
    closure,
    derivatives,
    row_roots,
)
from tri_glide_kinematics.mechanisms.f_mechanism.curve import Curve
from tri_glide_kinematics.mechanisms.f_mechanism.positions import (
    FMechanismPose,
    FMechanismPoses,
    poses_at,
    solve_batch,
)
from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import Linkage, direction, pins_at
from tri_glide_kinematics.mechanisms.f_mechanism.trace import (
    FMechanismTrace,
    TraceOptions,
    starting_point,
    straight_drive,
    trace_branch,
)
from tri_glide_kinematics.vectors import FloatArray

# Islands are closed branches so small that they lie between two sampled crank angles.
#
# Such an island appears and vanishes between two samples. There the closure condition F, as a
# function of the platform angle, has an extremum that comes to zero and leaves it again. So every
# extremum that approaches zero on one side of an interval and leaves it on the other is searched
# for its least distance.

# Step of central differences over the crank angle [rad]: near the cube root of rounding, where
# their error is least.
_DIFFERENCE = 1e-6
# Halvings of an interval between two samples, and steps of Newton's method to an extremum from a
# sample, or from where it was one halving before.
_BISECTIONS = 25
_NEWTON_STEPS = 6
_TRACKING_STEPS = 2


def find_islands(linkage: Linkage, crank_angles: FloatArray) -> list[float]:
    """Crank angles between the equidistant given ones at which an island is widest [rad]."""
    polynomial = _closure(linkage, crank_angles).polynomial
    row, angle = row_roots(_derivative(polynomial))
    spacing = crank_angles[1] - crank_angles[0]
    low = crank_angles[row]
    value, slope, angle = _extremum(linkage, low, angle)
    high_value, high_slope, _ = _extremum(linkage, low + spacing, angle)
    sign = np.where(value >= 0.0, 1.0, -1.0)
    valley = (sign * high_value > 0.0) & (sign * slope < 0.0) & (sign * high_slope > 0.0)
    low, angle, sign = low[valley], angle[valley], sign[valley]
    high = low + spacing
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        value, slope, angle = _extremum(linkage, middle, angle, _TRACKING_STEPS)
        falling = sign * slope < 0.0
        low, high = np.where(falling, middle, low), np.where(falling, high, middle)
    scale = _closure(linkage, low).scale
    island = sign * value < -ROUNDING_ERROR * scale
    return [math.remainder(float(found), 2.0 * math.pi) for found in low[island]]


def _closure(linkage: Linkage, crank_angles: FloatArray) -> Closure:
    return closure(linkage, pins_at(linkage, linkage.crank_angles(crank_angles)))


def _derivative(polynomial: Cubic) -> Cubic:
    """Derivative by the platform angle."""
    zero = np.zeros_like(polynomial.constant)
    return Cubic(zero, 1j * polynomial.first, 2j * polynomial.second, 3j * polynomial.third)


def _extremum(
    linkage: Linkage, crank_angles: FloatArray, angle: FloatArray, steps: int = _NEWTON_STEPS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value at the extremum near ``angle``, its slope over the crank angle, and its place."""
    polynomial = _closure(linkage, crank_angles).polynomial
    for _ in range(steps):
        _, slope, curvature = derivatives(polynomial, direction(angle))
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.nan_to_num(slope / curvature)
        angle = angle - np.clip(step, -0.1, 0.1)
    z = direction(angle)
    value = derivatives(polynomial, z)[0]
    # Along the line of extrema the derivative is the partial one.
    before, after = (
        derivatives(_closure(linkage, crank_angles + offset).polynomial, z)[0]
        for offset in (-_DIFFERENCE, _DIFFERENCE)
    )
    return value, (after - before) / (2.0 * _DIFFERENCE), angle


# A branch that has not closed after so many turns is given as an open one.
_MOST_TURNS = 50
# Positions of a trace and of the survey agree this well, beside a fold too [rad, size].
_SAME = 1e-5
# Longest step along a branch [rad]: the tubes of the arcs make it shorter where the curve bends.
_LARGEST_STEP = 0.5


@dataclass(frozen=True, eq=False)
class FMechanismOverview:
    """All positions of a mechanism over one turn of its cranks.

    Attributes:
        crank_angles: equidistant angles in [0, 2 pi), shape (n,) [rad].
        counts: number of positions at each, shape (n,).
        self_motion: where the platform can move with the cranks at rest, shape (n,).
        branches: each connected curve once, with its events. Its samples lie at the crank angles
            above, counted on over full turns.
        singular_poses: positions through which no branch can be followed: isolated ones, and those
            on branches that are singular everywhere.
    """

    crank_angles: FloatArray
    counts: NDArray[np.int64]
    self_motion: NDArray[np.bool_]
    branches: tuple[FMechanismTrace, ...]
    singular_poses: tuple[FMechanismPose, ...]

    @property
    def fully_turning(self) -> tuple[int, ...]:
        """Indices of the branches on which the cranks turn through without reversing."""
        return tuple(i for i, branch in enumerate(self.branches) if branch.turns_fully)


def survey(linkage: Linkage, samples: int) -> FMechanismOverview:
    """Solve at ``samples`` crank angles, and follow every branch found until it closes."""
    spacing = 2.0 * math.pi / samples
    crank_angles: FloatArray = spacing * np.arange(samples, dtype=np.float64)
    poses = solve_batch(linkage, crank_angles)
    missing = ~np.isnan(poses.angle)
    branches: list[FMechanismTrace] = []
    singular: list[FMechanismPose] = []
    while True:
        # Start far from singular positions, where the branch is well told from others.
        strength = np.where(missing, np.abs(poses.singularity), -1.0)
        row, slot = divmod(first_largest(strength), strength.shape[1])
        if not missing[row, slot]:
            break
        missing[row, slot] = False
        crank_angle = float(crank_angles[row])
        angle, origin = float(poses.angle[row, slot]), complex(*poses.position[row, slot])
        found = _whole_branch(linkage, crank_angle, angle, origin, spacing)
        if not found:
            singular.append(_nearest(linkage, poses_at(linkage, crank_angle), angle, origin))
        for branch in found:
            _mark(poses, branch, missing, linkage.size, spacing)
        branches += found
    for crank_angle in find_islands(linkage, crank_angles):
        for pose in poses_at(linkage, crank_angle):
            origin = complex(*pose.position)
            for branch in _whole_branch(linkage, crank_angle, pose.angle, origin, spacing):
                if len(branch.angle) == 1 and not _known(branches, branch):
                    branches.append(branch)
    return FMechanismOverview(
        crank_angles, poses.counts, poses.self_motion, tuple(branches), tuple(singular)
    )


def _nearest(
    linkage: Linkage, poses: tuple[FMechanismPose, ...], angle: float, origin: complex
) -> FMechanismPose:
    """The pose that is nearest to a platform angle [rad] and origin [m]."""

    def distance(pose: FMechanismPose) -> float:
        turn = math.remainder(pose.angle - angle, 2.0 * math.pi)
        return abs(turn) + abs(complex(*pose.position) - origin) / linkage.size

    return min(poses, key=distance)


def _whole_branch(
    linkage: Linkage, crank_angle: float, angle: float, origin: complex, spacing: float
) -> list[FMechanismTrace]:
    """Follow a branch to its closure; both ways where it ends before, none where it is singular."""
    branches = []
    for sense in (1.0, -1.0):
        drive, _ = straight_drive(linkage, crank_angle, (sense, 0.0, 0.0))
        curve = Curve(linkage, drive)
        offset = math.remainder(-sense * crank_angle, spacing)
        most = round(2.0 * math.pi * _MOST_TURNS / spacing)
        options = TraceOptions(
            stations=offset + spacing * np.arange(-most, most + 1, dtype=np.float64),
            through=True,
            period=2.0 * math.pi,
            largest_step=_LARGEST_STEP,
        )
        branches.append(trace_branch(curve, starting_point(curve, angle, origin), options))
        if branches[-1].closed:
            return branches[-1:]
    return [branch for branch in branches if branch.arcs]


def _mark(
    poses: FMechanismPoses,
    branch: FMechanismTrace,
    missing: NDArray[np.bool_],
    size: float,
    spacing: float,
) -> None:
    """Take the positions that a branch passes off the ``missing`` ones."""
    row = np.rint(branch.crank_angle / spacing).astype(np.int64) % len(missing)
    turn = poses.angle[row] - branch.angle[:, np.newaxis]
    turn = np.abs(turn - 2.0 * math.pi * np.rint(turn / (2.0 * math.pi)))
    shift = np.max(np.abs(poses.position[row] - branch.position[:, np.newaxis]), axis=-1) / size
    at, slot = np.nonzero(turn + shift < _SAME)
    missing[row[at], slot] = False


def _known(branches: list[FMechanismTrace], branch: FMechanismTrace) -> bool:
    """Whether an island was found before: its turning points are those of another branch."""
    angle = branch.turning_points[0].crank_angle if branch.turning_points else math.nan
    return any(
        abs(math.remainder(angle - other.crank_angle, 2.0 * math.pi)) < 1e-9
        for known in branches
        for other in known.turning_points
    )
