"""The only place that calls ruckig: states and limits in, phases of constant jerk out."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.trajectory.phases import Phases

# The ROS index has ruckig 0.9.2, whose own Python module shows no phases: see tri_glide_ruckig/.
try:
    from ruckig import (
        ControlInterface,
        InputParameter,
        Ruckig,
        RuckigError,
        Synchronization,
        Trajectory,
    )
except ImportError as missing:
    try:
        from tri_glide_ruckig import (
            ControlInterface,
            InputParameter,
            Ruckig,
            RuckigError,
            Synchronization,
            Trajectory,
        )
    except ImportError:
        raise ModuleNotFoundError(
            "there is neither the module ruckig (python3 -m pip install ruckig) nor "
            "tri_glide_ruckig, a package of the same repository that makes it of ruckig's library",
            name="ruckig",
        ) from missing

__all__ = ["RuckigPlanner", "Synchronization"]

# Ruckig fails on round numbers where two kinds of profile meet: 0.05 m from rest to rest at
# 10 m/s^2 and 200 m/s^3 is such a case. A jerk that is smaller by this leads past it.
JERK_FACTORS = (1.0, 1.0 - 1e-9, 1.0 - 1e-6)


class RuckigPlanner:
    """Time-optimal phases of constant jerk; ruckig's objects are made once and used again."""

    def __init__(self, degrees_of_freedom: int) -> None:
        """Prepare for that many degrees of freedom."""
        # The cycle time given here has no effect: trajectories are calculated, never stepped.
        self._ruckig = Ruckig(degrees_of_freedom, 0.001)
        self._trajectory = Trajectory(degrees_of_freedom)
        self._input = InputParameter(degrees_of_freedom)
        self._input.target_velocity = [0.0] * degrees_of_freedom
        self._input.target_acceleration = [0.0] * degrees_of_freedom

    def to_rest_at(
        self,
        target: Sequence[float],
        position: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        limits: tuple[Sequence[float], Sequence[float], Sequence[float]],
        synchronization: Synchronization = Synchronization.Time,
        downwards: Sequence[float] | None = None,
    ) -> list[Phases]:
        """Return the phases that lead from a state to rest at ``target``.

        Args:
            target: where each degree of freedom comes to rest.
            position: of the state.
            velocity: of the state.
            acceleration: of the state.
            limits: of velocity, acceleration and jerk.
            synchronization: ``Time`` if all are to arrive together, or ``No``. Ruckig does not
                keep ``Phase``, for which see :class:`SliderMotion`.
            downwards: limits of negative accelerations, if they are others.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        parameters = self._input
        parameters.control_interface = ControlInterface.Position
        parameters.target_position = target
        parameters.current_position = position
        parameters.max_velocity = limits[0]
        if downwards is None:
            return self._calculate(velocity, acceleration, limits, synchronization)
        parameters.min_acceleration = [-most for most in downwards]
        try:
            return self._calculate(velocity, acceleration, limits, synchronization)
        finally:
            parameters.min_acceleration = None

    def onto_origin(
        self,
        state: Sequence[Sequence[float]],
        velocities: Sequence[tuple[float, float]],
        accelerations: Sequence[tuple[float, float]],
        jerk: Sequence[float],
    ) -> list[Phases]:
        """Return the phases that bring all degrees of freedom to rest at zero as soon as possible.

        All are there at the same time. Seen from a frame that moves, as a target does, limits
        differ by direction.

        Args:
            state: position, velocity and acceleration of each degree of freedom.
            velocities: least, below zero, and largest, above zero, of each.
            accelerations: likewise.
            jerk: limit of each.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        parameters = self._input
        position, velocity, acceleration = zip(*state)
        parameters.min_velocity, highest = zip(*velocities)
        parameters.min_acceleration, most = zip(*accelerations)
        try:
            return self.to_rest_at(
                [0.0] * len(jerk),
                position,
                velocity,
                acceleration,
                (highest, most, jerk),
                Synchronization.Time,
            )
        finally:
            parameters.min_velocity = parameters.min_acceleration = None

    def to_pass(
        self,
        target: Sequence[float],
        passing: Sequence[float],
        state: Sequence[Sequence[float]],
        limits: tuple[Sequence[float], Sequence[float], Sequence[float]],
        bend: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> list[Phases]:
        """Return the phases that bring each degree of freedom to ``target`` as soon as possible.

        Args:
            target: of each degree of freedom.
            passing: velocity that it has there.
            state: position, velocity and acceleration of each degree of freedom.
            limits: of velocity, acceleration and jerk.
            bend: acceleration that it has there.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        position, velocity, acceleration = zip(*state)
        self._input.target_velocity, self._input.target_acceleration = passing, bend
        try:
            return self.to_rest_at(
                target, position, velocity, acceleration, limits, Synchronization.No
            )
        finally:
            self._input.target_velocity = [0.0] * len(target)
            self._input.target_acceleration = [0.0] * len(target)

    def to_rest(
        self,
        velocity: Sequence[float],
        acceleration: Sequence[float],
        limits: tuple[Sequence[float], Sequence[float], Sequence[float]],
    ) -> list[Phases]:
        """Return the phases that bring each degree of freedom to rest as soon as possible.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        return self.to_velocity([0.0] * len(velocity), velocity, acceleration, limits)

    def to_velocity(
        self,
        target: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        limits: tuple[Sequence[float], Sequence[float], Sequence[float]],
    ) -> list[Phases]:
        """Return the phases that lead to steady motion at the velocities ``target``.

        Ruckig ignores the velocity limits here.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        parameters = self._input
        parameters.control_interface = ControlInterface.Velocity
        parameters.target_velocity = target
        try:
            return self._calculate(velocity, acceleration, limits, Synchronization.No)
        finally:
            parameters.target_velocity = [0.0] * len(target)

    def _calculate(
        self,
        velocity: Sequence[float],
        acceleration: Sequence[float],
        limits: tuple[Sequence[float], Sequence[float], Sequence[float]],
        synchronization: Synchronization,
    ) -> list[Phases]:
        parameters = self._input
        parameters.synchronization = synchronization
        parameters.current_velocity = velocity
        parameters.current_acceleration = acceleration
        parameters.max_acceleration = limits[1]
        for factor in JERK_FACTORS:
            parameters.max_jerk = [factor * jerk for jerk in limits[2]]
            try:
                self._ruckig.calculate(parameters, self._trajectory)
            # The binding has no name for some results and raises a ValueError then.
            except (RuckigError, ValueError) as error:
                reason = str(error).strip().splitlines()
            else:
                return [
                    [*zip(profile.brake.t, profile.brake.j), *zip(profile.t, profile.j)]
                    for profile in self._trajectory.profiles[0]
                ]
        raise PlanningError(reason[0] if reason else "ruckig gives no reason")
