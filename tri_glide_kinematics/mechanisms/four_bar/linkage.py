"""The four-bar linkage: position, velocity, acceleration on both branches (sources 002, 004).

The crank turns about the crank pivot, the rocker about the rocker pivot; the coupler joins the
crank pin to the rocker pin. All angles are measured from the x axis of the plane,
counter-clockwise, in [rad]. The closed form is in :mod:`.sweep`, the properties of a linkage
as such are in :mod:`.analysis`.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import finite, finite_array, finite_vector, member
from tri_glide_kinematics.equal_numbers import wrapped
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms.four_bar import analysis
from tri_glide_kinematics.mechanisms.four_bar.analysis import (
    Branch,
    DeadCentre,
    DeadCentreKind,
    GrashofClass,
    LinkLengths,
    TransmissionExtremes,
)
from tri_glide_kinematics.mechanisms.four_bar.sweep import (
    FourBarPose,
    FourBarSweep,
    GroundFrame,
    LoopConstants,
    close_loop,
)
from tri_glide_kinematics.vectors import FloatArray, Point
from tri_glide_kinematics.wording import number_text


class CrankLimitError(KinematicsError):
    """A crank angle at which the linkage cannot be closed."""

    def __init__(self, crank_angle: float, ranges: tuple[tuple[float, float], ...]) -> None:
        """Store the ``crank_angle`` and the ``ranges`` that the crank can reach, in [rad]."""
        reach = " or ".join(
            f"from {number_text(low)} to {number_text(high)} rad" for low, high in ranges
        )
        super().__init__(
            f"crank_angle = {number_text(crank_angle)} rad is beyond the crank's limits: it "
            f"reaches {reach}"
        )
        self.crank_angle = crank_angle
        self.ranges = ranges


@dataclass(frozen=True)
class FourBar:
    """A four-bar linkage.

    Attributes:
        crank: crank pivot to crank pin, in [m].
        coupler: crank pin to rocker pin, in [m].
        rocker: rocker pivot to rocker pin, in [m].
        ground: crank pivot to rocker pivot, in [m].
        crank_pivot: x and y of the crank pivot, in [m].
        ground_angle: from the x axis to the line from crank pivot to rocker pivot, in [rad].
        tolerance: sums of two lengths that differ by no more than this part of the longest link
            make the linkage a change-point linkage; lengths then give way by as much.
    """

    crank: float
    coupler: float
    rocker: float
    ground: float
    crank_pivot: Point = (0.0, 0.0)
    ground_angle: float = 0.0
    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            WrongShapeError: if the crank pivot has not two coordinates.
            OutOfBoundsError: if a length is not positive, or the tolerance not from 0 to 1e-3.
            NotAssemblableError: if one link is as long as the other three together.
        """
        x, y = finite_vector("crank_pivot", self.crank_pivot, 2)
        object.__setattr__(self, "crank_pivot", (x, y))
        object.__setattr__(self, "ground_angle", finite("ground_angle", self.ground_angle))
        for name in ("crank", "coupler", "rocker", "ground"):
            object.__setattr__(self, name, getattr(self.lengths, name))

    @classmethod
    def from_joints(
        cls,
        crank_pivot: Sequence[float],
        crank_pin: Sequence[float],
        rocker_pin: Sequence[float],
        rocker_pivot: Sequence[float],
        tolerance: float = 1e-12,
    ) -> AssembledFourBar:
        """Take a linkage from the x and y of its four joints in one position (source 002), in [m].

        Raises:
            NotFiniteError: if a coordinate is NaN or infinite.
            WrongShapeError: if a joint has not two coordinates.
            OutOfBoundsError: if two joined joints coincide.
            NotAssemblableError: if all joints lie on one line with one link as long as the others.
        """
        a0 = complex(*finite_vector("crank_pivot", crank_pivot, 2))
        a = complex(*finite_vector("crank_pin", crank_pin, 2))
        b = complex(*finite_vector("rocker_pin", rocker_pin, 2))
        b0 = complex(*finite_vector("rocker_pivot", rocker_pivot, 2))
        ground_angle = wrapped(cmath.phase(b0 - a0))
        crank_angle = wrapped(cmath.phase(a - a0))
        linkage = AssembledFourBar(
            crank=abs(a - a0),
            coupler=abs(b - a),
            rocker=abs(b - b0),
            ground=abs(b0 - a0),
            crank_pivot=(a0.real, a0.imag),
            ground_angle=ground_angle,
            tolerance=tolerance,
            assembled_crank_angle=crank_angle,
        )
        side = ((b0 - a).conjugate() * (b - a)).imag / linkage.lengths.longest**2
        branch = analysis.branch_of(linkage.lengths, crank_angle - ground_angle, side)
        return replace(linkage, assembled_branch=branch)

    @cached_property
    def lengths(self) -> LinkLengths:
        """The four lengths alone."""
        return LinkLengths(self.crank, self.coupler, self.rocker, self.ground, self.tolerance)

    @cached_property
    def frame(self) -> GroundFrame:
        """The position of the ground link."""
        return GroundFrame(self.crank_pivot, self.ground_angle)

    @property
    def rocker_pivot(self) -> Point:
        """Position of the rocker pivot, in [m]."""
        pivot = complex(*self.crank_pivot) + self.ground * self.frame.rotation
        return pivot.real, pivot.imag

    @cached_property
    def grashof_class(self) -> GrashofClass:
        """Which links turn fully."""
        return analysis.grashof_class(self.lengths)

    @property
    def crank_turns_fully(self) -> bool:
        """Whether the linkage can be closed at every crank angle."""
        return self.lengths.stretched_gap >= 0.0 and self.lengths.folded_gap >= 0.0

    @cached_property
    def crank_ranges(self) -> tuple[tuple[float, float], ...]:
        """Intervals of crank angles at which the linkage can be closed, in [rad].

        One interval of a full turn, one shorter interval, or two that mirror each other in the
        ground; their ends are the crank's limits.
        """
        return tuple(
            (low + self.ground_angle, high + self.ground_angle)
            for low, high in analysis.crank_ranges(self.lengths)
        )

    @cached_property
    def transmission_extremes(self) -> TransmissionExtremes:
        """Smallest and largest transmission angle over all crank angles that can be reached."""
        extremes = analysis.transmission_extremes(self.lengths)
        return replace(
            extremes,
            smallest_at=wrapped(extremes.smallest_at + self.ground_angle),
            largest_at=wrapped(extremes.largest_at + self.ground_angle),
        )

    @cached_property
    def dead_centres(self) -> tuple[DeadCentre, ...]:
        """All positions in which two moving links are in line."""
        centres = analysis.dead_centres(self.lengths)
        return tuple(centre.turned(self.ground_angle) for centre in centres)

    def solve(
        self, crank_angle: float, crank_velocity: float = 0.0, crank_acceleration: float = 0.0
    ) -> tuple[FourBarPose, ...]:
        """Return both poses at a crank angle, the open one first; none beyond a limit.

        Args:
            crank_angle: in [rad].
            crank_velocity: in [rad/s].
            crank_acceleration: in [rad/s^2].

        Raises:
            NotFiniteError: if a number is NaN or infinite.
        """
        angle = finite("crank_angle", crank_angle)
        sweep = self.sweep([angle], crank_velocity, crank_acceleration)
        if math.isnan(sweep.motion[0, 0, 0]):
            return ()
        pivot = self.rocker_pivot
        return FourBarPose.of(sweep.open, pivot), FourBarPose.of(sweep.crossed, pivot)

    def pose(
        self,
        crank_angle: float,
        branch: Branch,
        crank_velocity: float = 0.0,
        crank_acceleration: float = 0.0,
    ) -> FourBarPose:
        """Return the pose on one branch at a crank angle; arguments as for :meth:`solve`.

        Raises:
            NotAChoiceError: if ``branch`` is no ``Branch``, but its name, for example.
            NotFiniteError: if a number is NaN or infinite.
            CrankLimitError: if the linkage cannot be closed at the crank angle.
        """
        member("branch", branch, Branch)
        poses = self.solve(crank_angle, crank_velocity, crank_acceleration)
        if not poses:
            raise CrankLimitError(crank_angle, self.crank_ranges)
        return poses[0 if branch is Branch.OPEN else 1]

    def sweep(
        self,
        crank_angles: ArrayLike,
        crank_velocity: ArrayLike = 0.0,
        crank_acceleration: ArrayLike = 0.0,
    ) -> FourBarSweep:
        """Return both branches at many crank angles; rows beyond a limit are NaN.

        If the linkage has just one change point, its branches swap sides there once a turn: angles
        that differ by a full turn lie on different assemblies, and two turns close the motion.

        Args:
            crank_angles: in [rad]. Shape (n,).
            crank_velocity: in [rad/s]. One for all angles, or shape (n,).
            crank_acceleration: in [rad/s^2]. One for all angles, or shape (n,).

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            WrongShapeError: if an array has the wrong shape.
        """
        angles = finite_array("crank_angles", crank_angles, (None,))
        velocity = _scalar_or_array("crank_velocity", crank_velocity, angles.size)
        acceleration = _scalar_or_array("crank_acceleration", crank_acceleration, angles.size)
        motion = close_loop(
            self._loop_constants,
            angles - self.ground_angle if self.ground_angle else angles,
            velocity,
            acceleration if acceleration.ndim or float(acceleration) else None,
        )
        return FourBarSweep(self.lengths, self.frame, angles, velocity, acceleration, motion)

    @cached_property
    def _loop_constants(self) -> LoopConstants:
        return LoopConstants(self.lengths)


@dataclass(frozen=True)
class AssembledFourBar(FourBar):
    """A linkage that was given by its joints in one position.

    Attributes:
        assembled_crank_angle: of that position, in [rad].
        assembled_branch: of that position, None if coupler and rocker were in line in it.
    """

    assembled_crank_angle: float = 0.0
    assembled_branch: Branch | None = None

    def __post_init__(self) -> None:
        """Check the numbers and the branch.

        Raises:
            NotAChoiceError: if the branch is neither a ``Branch`` nor None.
        """
        super().__post_init__()
        if self.assembled_branch is not None:
            member("assembled_branch", self.assembled_branch, Branch)


def _scalar_or_array(name: str, values: ArrayLike, size: int) -> FloatArray:
    """Return a finite number as an array of shape (), or finite numbers in the shape (size,)."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim:
        return finite_array(name, array, (size,))
    finite(name, float(array))
    return array


class SweepEventKind(Enum):
    """The event at which coupler and rocker are in line."""

    LIMIT = "limit"
    """The crank gets no farther."""
    CHANGE_POINT = "change point"
    """Both branches meet, and the linkage can go on along either."""


@dataclass(frozen=True)
class SweepEvent:
    """A limit or a change point that a sweep meets.

    Attributes:
        kind: which of both.
        row: index of the last crank angle of the sweep that does not lie beyond it.
        crank_angle: of the event, counted on over full turns, in [rad].
        rocker_angle: in [rad], in (-pi, pi].
        rocker_pin: in [m].
    """

    kind: SweepEventKind
    row: int
    crank_angle: float
    rocker_angle: float
    rocker_pin: Point


def sweep_events(linkage: FourBar, crank_angles: FloatArray) -> tuple[SweepEvent, ...]:
    """Limits and change points in the order in which a sweep meets them.

    Args:
        linkage: that is swept.
        crank_angles: rising or falling. Shape (n,) [rad].
    """
    lengths = linkage.lengths
    is_change_point = {
        DeadCentreKind.COUPLER_ROCKER_STRETCHED: lengths.stretches,
        DeadCentreKind.COUPLER_ROCKER_FOLDED: lengths.folds,
    }
    sense = -1.0 if crank_angles[-1] < crank_angles[0] else 1.0
    lower, upper = sorted((float(crank_angles[0]), float(crank_angles[-1])))
    pivot_x, pivot_y = linkage.rocker_pivot
    events = []
    for centre in linkage.dead_centres:
        if centre.kind not in is_change_point:
            continue
        kind = SweepEventKind.CHANGE_POINT if is_change_point[centre.kind] else SweepEventKind.LIMIT
        rocker_pin = (
            pivot_x + linkage.rocker * math.cos(centre.rocker_angle),
            pivot_y + linkage.rocker * math.sin(centre.rocker_angle),
        )
        first = math.ceil((lower - centre.crank_angle) / math.tau)
        last = math.floor((upper - centre.crank_angle) / math.tau)
        for turn in range(first, last + 1):
            angle = centre.crank_angle + turn * math.tau
            row = int(np.searchsorted(sense * crank_angles, sense * angle, side="right")) - 1
            events.append(SweepEvent(kind, row, angle, centre.rocker_angle, rocker_pin))
    return tuple(sorted(events, key=lambda event: sense * event.crank_angle))
