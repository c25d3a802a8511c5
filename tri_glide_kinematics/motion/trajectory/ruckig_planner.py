"""The only place that calls ruckig: states and limits in, phases of constant jerk out."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.trajectory.phases import Phases

# The ROS index has ruckig 0.9.2, whose own Python module shows no phases and has no RuckigError:
# see tri_glide_ruckig/.
try:
    import ruckig
    from ruckig import RuckigError
except ImportError as missing:
    try:
        import tri_glide_ruckig as ruckig
        from tri_glide_ruckig import RuckigError
    except ImportError:
        raise ModuleNotFoundError(
            "there is neither the module ruckig (python3 -m pip install ruckig) nor "
            "tri_glide_ruckig, a package of the same repository that makes it of ruckig's library",
            name="ruckig",
        ) from missing

# Ruckig fails on round numbers where two kinds of profile meet: 0.05 m from rest to rest at
# 10 m/s^2 and 200 m/s^3 is such a case. A jerk that is smaller by this leads past it.
JERK_FACTORS = (1.0, 1.0 - 1e-9, 1.0 - 1e-6)

# One number for each degree of freedom.
Numbers = Sequence[float]

# Limits of velocity, acceleration and jerk.
Limits = tuple[Numbers, Numbers, Numbers]


class RuckigPlanner:
    """Time-optimal phases of constant jerk; ruckig's objects are made once and used again."""

    def __init__(self, degrees_of_freedom: int) -> None:
        """Prepare for that many degrees of freedom."""
        # The cycle time given here has no effect: trajectories are calculated, never stepped.
        self._ruckig = ruckig.Ruckig(degrees_of_freedom, 0.001)
        self._trajectory = ruckig.Trajectory(degrees_of_freedom)
        self._input = ruckig.InputParameter(degrees_of_freedom)
        self._zeros = [0.0] * degrees_of_freedom

    def to_rest_at(
        self,
        target: Numbers,
        position: Numbers,
        velocity: Numbers,
        acceleration: Numbers,
        limits: Limits,
        downwards: Numbers | None = None,
        *,
        together: bool = True,
    ) -> list[Phases]:
        """Return the phases that lead from a state to rest at ``target``.

        Args:
            target: where each degree of freedom comes to rest.
            position: of the state.
            velocity: of the state.
            acceleration: of the state.
            limits: of velocity, acceleration and jerk.
            downwards: limits of negative accelerations, if they are others.
            together: whether all are to arrive at the same time. On the way ruckig does not keep
                their ratio, for which see :class:`SliderMotion`.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        least = None if downwards is None else [-most for most in downwards]
        start, end = (position, velocity, acceleration), (target, self._zeros, self._zeros)
        return self._between(start, end, limits, (None, least), together=together)

    def onto_origin(
        self,
        state: Sequence[Numbers],
        velocities: Sequence[tuple[float, float]],
        accelerations: Sequence[tuple[float, float]],
        jerk: Numbers,
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
        slowest, fastest = zip(*velocities)
        least, most = zip(*accelerations)
        end, limits = (self._zeros,) * 3, (fastest, most, jerk)
        return self._between(tuple(zip(*state)), end, limits, (slowest, least), together=True)

    def to_pass(
        self,
        target: Numbers,
        passing: Numbers,
        state: Sequence[Numbers],
        limits: Limits,
        bend: Numbers = (0.0, 0.0, 0.0),
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
        return self._between(tuple(zip(*state)), (target, passing, bend), limits, together=False)

    def to_rest(self, velocity: Numbers, acceleration: Numbers, limits: Limits) -> list[Phases]:
        """Return the phases that bring each degree of freedom to rest as soon as possible.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        return self.to_velocity(self._zeros, velocity, acceleration, limits)

    def to_velocity(
        self, target: Numbers, velocity: Numbers, acceleration: Numbers, limits: Limits
    ) -> list[Phases]:
        """Return the phases that lead to steady motion at the velocities ``target``.

        Ruckig ignores the velocity limits here.

        Raises:
            PlanningError: if ruckig finds no solution.
        """
        parameters = self._input
        parameters.control_interface = ruckig.ControlInterface.Velocity
        parameters.current_velocity, parameters.current_acceleration = velocity, acceleration
        parameters.target_velocity, parameters.target_acceleration = target, self._zeros
        parameters.min_acceleration = None
        return self._calculate(limits, together=False)

    def _between(
        self,
        start: Sequence[Numbers],
        end: Sequence[Numbers],
        limits: Limits,
        lowest: tuple[Numbers | None, Numbers | None] = (None, None),
        *,
        together: bool,
    ) -> list[Phases]:
        """Return the phases from one state to another: positions, velocities and accelerations.

        Velocities and accelerations may have ``lowest`` limits that are not the highest ones.
        """
        parameters = self._input
        parameters.control_interface = ruckig.ControlInterface.Position
        parameters.current_position, parameters.current_velocity = start[:2]
        parameters.target_position, parameters.target_velocity = end[:2]
        parameters.current_acceleration, parameters.target_acceleration = start[2], end[2]
        parameters.min_velocity, parameters.min_acceleration = lowest
        parameters.max_velocity = limits[0]
        return self._calculate(limits, together=together)

    def _calculate(self, limits: Limits, *, together: bool) -> list[Phases]:
        """Return the phases between the states that are given, which arrive ``together`` or not."""
        parameters, kinds = self._input, ruckig.Synchronization
        parameters.synchronization = kinds.Time if together else kinds.No
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
