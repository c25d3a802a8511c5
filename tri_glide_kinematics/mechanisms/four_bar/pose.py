"""One position of a four-bar linkage with its rates."""

from __future__ import annotations

from dataclasses import dataclass, field

from tri_glide_kinematics.mechanisms.four_bar.analysis import Branch
from tri_glide_kinematics.mechanisms.four_bar.sweep import BranchSweep, PointMotion
from tri_glide_kinematics.vectors import Point


@dataclass(frozen=True)
class FourBarPose:
    """One position of a linkage with its rates.

    Attributes:
        branch: the branch it lies on.
        crank_angle: as asked for, in [rad].
        coupler_angle: from the x axis to the line from crank pin to rocker pin, in (-pi, pi].
        rocker_angle: from the x axis to the line from rocker pivot to rocker pin, in (-pi, pi].
        coupler_velocity: in [rad/s].
        rocker_velocity: in [rad/s].
        coupler_acceleration: in [rad/s^2].
        rocker_acceleration: in [rad/s^2].
        crank_pivot: in [m].
        crank_pin: in [m].
        rocker_pin: in [m].
        rocker_pivot: in [m].
        transmission_angle: between coupler and rocker at the rocker pin, from 0 to pi, in [rad].
        is_singular: whether coupler and rocker are in line. On a limit of the crank the four rates
            are NaN then, at a change point they are those of the smooth motion of the branch.
    """

    branch: Branch
    crank_angle: float
    coupler_angle: float
    rocker_angle: float
    coupler_velocity: float
    rocker_velocity: float
    coupler_acceleration: float
    rocker_acceleration: float
    crank_pivot: Point
    crank_pin: Point
    rocker_pin: Point
    rocker_pivot: Point
    transmission_angle: float
    is_singular: bool
    _sweep: BranchSweep = field(repr=False, compare=False)

    def point_of_coupler_plane(self, x: float, y: float) -> PointMotion:
        """Motion of a point that is fixed to the coupler; its arrays have shape (2,).

        Args:
            x: from the crank pin along the line to the rocker pin, in [m].
            y: to the left of it, in [m].

        Raises:
            NotFiniteError: if a coordinate is NaN or infinite.
        """
        motion = self._sweep.point_of_coupler_plane(x, y)
        return PointMotion(motion.position[0], motion.velocity[0], motion.acceleration[0])

    @classmethod
    def of(cls, sweep: BranchSweep, rocker_pivot: Point) -> FourBarPose:
        """Take the pose from the only row of a sweep; ``rocker_pivot`` is its place in [m]."""
        x, y = sweep.crank_pins[0].tolist()
        pin_x, pin_y = sweep.rocker_pins[0].tolist()
        return cls(
            branch=sweep.branch,
            crank_angle=float(sweep.crank_angles[0]),
            coupler_angle=float(sweep.coupler_angles[0]),
            rocker_angle=float(sweep.rocker_angles[0]),
            coupler_velocity=float(sweep.coupler_velocities[0]),
            rocker_velocity=float(sweep.rocker_velocities[0]),
            coupler_acceleration=float(sweep.coupler_accelerations[0]),
            rocker_acceleration=float(sweep.rocker_accelerations[0]),
            crank_pivot=sweep.frame.crank_pivot,
            crank_pin=(x, y),
            rocker_pin=(pin_x, pin_y),
            rocker_pivot=rocker_pivot,
            transmission_angle=float(sweep.transmission_angles[0]),
            is_singular=bool(sweep.is_singular[0]),
            _sweep=sweep,
        )
