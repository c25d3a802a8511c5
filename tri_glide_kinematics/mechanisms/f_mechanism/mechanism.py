"""F-mechanism: a planar 3-RRR robot whose three cranks are driven synchronously (source 001)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tri_glide_kinematics.checks import finite, finite_array, finite_vector, positive
from tri_glide_kinematics.equal_numbers import SAME_ANGLE, first_largest
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, WrongShapeError
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
    NEARLY_SINGULAR,
    FMechanismTrace,
    TraceOptions,
    starting_point,
    straight_drive,
    trace_branch,
)
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

# All branches of an F-mechanism as connected curves over the crank angle.

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
# Nearly singular arcs of all branches, after which one that has another is given up: beside a
# self-motion branches are so near to each other that a turn may take millions, of 60 us each.
_PATIENCE = 10_000
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
            on branches that are singular everywhere, or nearly so.
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
    patience = iter(range(_PATIENCE))
    while missing.any():
        # Start far from singular positions, where the branch is well told from others.
        strength = np.where(missing, np.abs(poses.singularity), -1.0)
        row, slot = divmod(first_largest(strength), strength.shape[1])
        pose = poses.pose(row, slot)
        found = _whole_branch(linkage, pose, spacing, patience)
        unclosed = not any(one.closed for one in found)
        if unclosed and abs(pose.singularity) < NEARLY_SINGULAR and next(patience, None) is None:
            # Nor will it be from those that are left: they are still nearer to singular ones.
            break
        missing[row, slot] = False
        if not found:
            singular.append(pose)
        for branch in found:
            _mark(poses, branch, missing, linkage.size, spacing)
        branches += found
    singular += [poses.pose(row, slot) for row, slot in np.argwhere(missing)]
    for crank_angle in find_islands(linkage, crank_angles):
        for pose in poses_at(linkage, crank_angle):
            for branch in _whole_branch(linkage, pose, spacing, patience):
                if len(branch.angle) == 1 and not _known(branches, branch):
                    branches.append(branch)
    return FMechanismOverview(
        crank_angles, poses.counts, poses.self_motion, tuple(branches), tuple(singular)
    )


def _whole_branch(
    linkage: Linkage, start: FMechanismPose, spacing: float, patience: Iterator[int]
) -> list[FMechanismTrace]:
    """Follow a branch to its closure; both ways where it ends before, none where it is singular."""
    branches = []
    for sense in (1.0, -1.0):
        drive, _ = straight_drive(linkage, start.crank_angle, (sense, 0.0, 0.0))
        curve = Curve(linkage, drive)
        offset = math.remainder(-sense * start.crank_angle, spacing)
        most = round(2.0 * math.pi * _MOST_TURNS / spacing)
        options = TraceOptions(
            stations=offset + spacing * np.arange(-most, most + 1, dtype=np.float64),
            through=True,
            period=2.0 * math.pi,
            largest_step=_LARGEST_STEP,
            patience=patience,
        )
        place = starting_point(curve, start.angle, complex(*start.position))
        branches.append(trace_branch(curve, place, options))
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


class DegenerateLinkageError(KinematicsError):
    """Points or lengths of a mechanism leave a part of it undetermined at every crank angle."""

    def __init__(self, reason: str) -> None:
        """Store the ``reason`` in words."""
        super().__init__(reason)
        self.reason = reason


# Platform joints closer than this, relative to the size, are one point.
_COINCIDENT = 1e-12
# Products of four lengths of a smaller mechanism are too small for floating-point numbers [m].
_SMALLEST = 1e-70


class FMechanism:
    """Planar 3-RRR mechanism with cranks A, B, C that turn at one speed.

    Crank A stands at the crank angle t, crank B at phase_b + t (or phase_b - t when
    counter-rotating), crank C at phase_c + t. Collinear base and platform points are allowed.
    """

    def __init__(
        self,
        base: ArrayLike,
        crank_lengths: Sequence[float],
        rod_lengths: Sequence[float],
        platform: ArrayLike,
        phase_b: float = 0.0,
        phase_c: float = 0.0,
        counter_rotating: bool = False,
    ) -> None:
        """Check and store the dimensions.

        Args:
            base: crank pivots A0, B0, C0, shape (3, 2) [m].
            crank_lengths: a_1, b_1, c_1, shape (3,) [m].
            rod_lengths: a_2, b_2, c_2, shape (3,) [m].
            platform: joints A2, B2, C2 in the platform frame, shape (3, 2) [m].
            phase_b: angle of crank B when crank A stands at zero, delta_b [rad].
            phase_c: angle of crank C when crank A stands at zero, delta_c [rad].
            counter_rotating: whether crank B turns against the others.

        Raises:
            WrongShapeError: if an array has another shape.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a length is not greater than zero, or all are below 1e-70 m.
            DegenerateLinkageError: if the three platform joints coincide, which leaves the platform
                angle undetermined.
        """
        pivots = _points("base", base)
        joints = _points("platform", platform)
        cranks = _lengths("crank_lengths", crank_lengths)
        rods = _lengths("rod_lengths", rod_lengths)
        centroid = sum(joints) / 3.0
        radius = math.sqrt(sum(abs(joint - centroid) ** 2 for joint in joints) / 3.0)
        sides = [abs(p - q) for points in (pivots, joints) for p in points for q in points]
        size = max(*cranks, *rods, *sides)
        if size < _SMALLEST:
            raise OutOfBoundsError("largest length", size, f"at least {_SMALLEST:g}", "m")
        if radius <= _COINCIDENT * size:
            raise DegenerateLinkageError(
                "platform: A2, B2 and C2 coincide, which leaves the platform angle undetermined"
            )
        self._linkage = Linkage(
            pivots=pivots,
            cranks=cranks,
            rods=rods,
            joints=joints,
            speeds=(1.0, -1.0 if counter_rotating else 1.0, 1.0),
            phases=(0.0, finite("phase_b", phase_b), finite("phase_c", phase_c)),
            size=size,
            platform_radius=radius,
        )

    def __eq__(self, other: object) -> bool:
        """Return whether the other mechanism has the same dimensions."""
        return self._linkage == other._linkage if isinstance(other, FMechanism) else NotImplemented

    def __hash__(self) -> int:
        """Return the hash of the dimensions."""
        return hash(self._linkage)

    def __repr__(self) -> str:
        """Return the call that makes this mechanism."""
        one = self._linkage
        base, platform = ([(p.real, p.imag) for p in points] for points in (one.pivots, one.joints))
        return (
            f"FMechanism(base={base}, crank_lengths={one.cranks}, rod_lengths={one.rods}, "
            f"platform={platform}, phase_b={self.phase_b!r}, phase_c={self.phase_c!r}, "
            f"counter_rotating={self.counter_rotating})"
        )

    @property
    def linkage(self) -> Linkage:
        """The dimensions as complex numbers."""
        return self._linkage

    @property
    def size(self) -> float:
        """The largest length of the mechanism, to which tolerances refer [m]."""
        return self._linkage.size

    @property
    def phase_b(self) -> float:
        """Angle of crank B when crank A stands at zero [rad]."""
        return self._linkage.phases[1]

    @property
    def phase_c(self) -> float:
        """Angle of crank C when crank A stands at zero [rad]."""
        return self._linkage.phases[2]

    @property
    def counter_rotating(self) -> bool:
        """Whether crank B turns against the others."""
        return self._linkage.speeds[1] < 0.0

    def with_phases(self, phase_b: float, phase_c: float) -> FMechanism:
        """The same mechanism with other phase shifts [rad].

        Raises:
            NotFiniteError: if a phase is NaN or infinite.
        """
        other = object.__new__(FMechanism)
        phases = (0.0, finite("phase_b", phase_b), finite("phase_c", phase_c))
        other._linkage = replace(self._linkage, phases=phases)
        return other

    def poses(self, crank_angle: float) -> tuple[FMechanismPose, ...]:
        """All positions of the moving triangle at one crank angle [rad].

        Returns:
            0 to 6 positions, ascending by platform angle. A double root (fold) is one position.

        Raises:
            NotFiniteError: if the angle is NaN or infinite.
            SelfMotionError: if the platform can move while the cranks stand still.
        """
        return poses_at(self._linkage, finite("crank_angle", crank_angle))

    def poses_batch(self, crank_angles: ArrayLike) -> FMechanismPoses:
        """All positions at many crank angles, shape (n,) [rad].

        Rows with a self-motion are marked and hold NaN.

        Raises:
            WrongShapeError: if the angles are not a one-dimensional array.
            NotFiniteError: if one of them is NaN or infinite.
        """
        return solve_batch(self._linkage, finite_array("crank_angles", crank_angles, (None,)))

    def trace(
        self,
        crank_angle: float,
        pose: FMechanismPose,
        end: float | None = None,
        *,
        steps: int = 360,
        crank_angles: ArrayLike | None = None,
        phases: tuple[float, float] | None = None,
        through: bool = False,
        largest_step: float = 0.5,
    ) -> FMechanismTrace:
        """Follow the branch of ``pose`` while the cranks turn and the phases change.

        The crank angle and both phases run along a straight line from ``crank_angle`` and the
        phases of this mechanism to ``end`` and ``phases``. The branch is followed in arcs whose
        length the mechanism decides: the samples do not influence it. From a turning point it is
        the side on which the platform angle rises.

        Args:
            crank_angle: angle of crank A in ``pose`` [rad].
            pose: where to start, one of ``poses(crank_angle)``.
            end: angle of crank A at the end [rad]; one turn ahead by default.
            steps: number of equal steps between the samples.
            crank_angles: places of the samples instead of ``end`` and ``steps``, strictly monotone,
                shape (n,) [rad]. The range is theirs; it must hold ``crank_angle``.
            phases: phase_b and phase_c at the end [rad]; unchanged by default.
            through: go on through turning points and bifurcations along the same curve. The cranks
                then turn back: with unchanged phases as far behind the start as ``end`` lies ahead
                of it, otherwise to the start. Without it, the trace stops at the first one.
            largest_step: longest arc [rad]; the samples do not depend on it.

        Returns:
            The start, then a sample wherever the branch passes one of the requested places.

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if ``steps`` or ``largest_step`` is not positive, or ``crank_angles``
                are not monotone, do not hold the start, or end at it though the phases change.
            WrongShapeError: if ``crank_angles`` or ``phases`` has another shape.
            NotAPoseError: if ``pose`` is not a position of this mechanism at ``crank_angle``.
        """
        start = finite("crank_angle", crank_angle)
        positive("largest_step", largest_step, "rad")
        places = None
        if crank_angles is not None:
            places = _monotone("crank_angles", crank_angles, start)
            end = float(places[-1])
        stop = start + 2.0 * math.pi if end is None else finite("end", end)
        way, changes = stop - start, (0.0, 0.0)
        if phases is not None:
            phase_b, phase_c = finite_vector("phases", phases, 2)
            changes = (phase_b - self.phase_b, phase_c - self.phase_c)
        turning_only = max(map(abs, changes)) <= SAME_ANGLE
        if turning_only:
            changes = (0.0, 0.0)
        if places is not None:
            if turning_only:
                # The sense of the given angles counts, also from the last of them.
                way = float(places[-1] - places[0])
            elif abs(way) <= SAME_ANGLE:
                bound = "other than the last of crank_angles, as the phases change"
                raise OutOfBoundsError("crank_angle", start, bound, "rad")
        drive, length = straight_drive(self._linkage, start, (way, *changes))
        if places is not None:
            stations = (places - start) / drive.rates[0]
        else:
            positive("steps", steps)
            stations = np.linspace(0.0, length, int(steps) + 1)
            if through and turning_only:
                stations = np.concatenate([-stations[:0:-1], stations])
        curve = Curve(self._linkage, drive)
        options = TraceOptions(
            stations=stations,
            through=through,
            period=2.0 * math.pi if turning_only else math.inf,
            largest_step=largest_step,
        )
        return trace_branch(
            curve, starting_point(curve, pose.angle, complex(*pose.position)), options
        )

    def overview(self, samples: int = 360) -> FMechanismOverview:
        """All branches as connected curves, and the number of positions over one turn.

        Args:
            samples: number of equidistant crank angles, from 0 on.

        Raises:
            OutOfBoundsError: if ``samples`` is less than 8.
        """
        if samples < 8:
            raise OutOfBoundsError("samples", samples, "at least 8")
        return survey(self._linkage, samples)


def _monotone(name: str, values: ArrayLike, start: float) -> NDArray[np.float64]:
    """Strictly monotone finite values that hold ``start`` in their range."""
    array = finite_array(name, values, (None,))
    if len(array) < 2:
        raise WrongShapeError(name, array.shape, "(n,) with n of at least 2")
    steps = np.diff(array)
    wrong = np.flatnonzero(steps * np.sign(steps[0]) <= 0.0)
    if wrong.size:
        index = int(wrong[0]) + 1
        before, value = array[index - 1 : index + 1].tolist()
        bound = f"beyond the one before (all rise, or all fall), {number_text(before)}"
        raise OutOfBoundsError(f"{name}[{index}]", value, bound, "rad")
    low, high = sorted((float(array[0]), float(array[-1])))
    if not low - SAME_ANGLE <= start <= high + SAME_ANGLE:
        raise OutOfBoundsError(
            "crank_angle", start, f"within {name}, {number_text(low)} to {number_text(high)}", "rad"
        )
    return array


def _points(name: str, values: ArrayLike) -> tuple[complex, complex, complex]:
    a, b, c = (complex(x, y) for x, y in finite_array(name, values, (3, 2)).tolist())
    return a, b, c


def _lengths(name: str, values: Sequence[float]) -> tuple[float, float, float]:
    a, b, c = (
        positive(f"{name}[{index}]", value, "m")
        for index, value in enumerate(finite_vector(name, values, 3))
    )
    return a, b, c
