"""The motion engine: targets in, slider setpoints out; no clock and no ROS.

At every instant the engine holds a plan that leads to rest and was verified as a whole. A command
makes a new plan from the present setpoint; only if that is verified too does it replace the held
one. So whatever is commanded, and in whatever order, all that comes out is part of a verified plan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from tri_glide_kinematics.checks import finite_vector
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.motion.commands import DriveLimits, Jog, Move, jog_of
from tri_glide_kinematics.motion.held_motion import HeldMotion, MotionPhase
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.plan_holder import PlanHolder
from tri_glide_kinematics.motion.planner import MotionKind
from tri_glide_kinematics.motion.plans import SampledPlan, SliderState
from tri_glide_kinematics.motion.replanning import Replanning
from tri_glide_kinematics.tri_glide.errors import NoPoseError
from tri_glide_kinematics.tri_glide.kinematics import TriGlide
from tri_glide_kinematics.workspace.workspace import Workspace

__all__ = [
    "MotionEngine",
    "MotionKind",
    "MotionPhase",
    "SampledPlan",
    "SliderLimits",
    "SliderState",
]

# What could not be done at once is tried again after this time of motion [s].
RETRY_INTERVAL = 0.008


class MotionEngine(PlanHolder):
    """Commanded state of the three sliders, stepped by a given time.

    Commands never touch the setpoint itself: they replace the plan of what comes next, from the
    next step on. Each raises a ``KinematicsError`` with the reason if it is refused; the engine
    then goes on with what it did. Each is planned within its call, which takes some milliseconds in
    mid-motion. A caller that receives commands faster than that should pass on the newest only, as
    the controller of the node does.
    """

    def __init__(
        self,
        workspace: Workspace,
        limits: SliderLimits,
        *,
        kind: MotionKind = MotionKind.SLIDER,
        speed_scale: float = 1.0,
    ) -> None:
        """Prepare the engine; ``start`` begins.

        Args:
            workspace: where the platform may be, and of which machine.
            limits: of the sliders.
            kind: of moves to a position. A jog is straight in both.
            speed_scale: factor of the velocity limits and of the speed of jogs, in (0, 1].
                Accelerations and jerks are not scaled, so that a stop is never slower.

        Raises:
            NotFiniteError: if the scale is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        super().__init__(DriveLimits(limits, speed_scale))
        self._machine: TriGlide = workspace.machine
        self._workspace = workspace
        self._replanning = Replanning(workspace, kind)
        self._kind = kind
        self._retry_at = math.inf
        self._refusal: KinematicsError | None = None

    @property
    def kind(self) -> MotionKind:
        """How moves go to their target."""
        return self._kind

    def start(self, heights: Sequence[float]) -> None:
        """Begin, or begin anew, at rest at measured heights.

        A place outside the workspace is taken as it is: from there, moves are accepted that make
        nothing worse.

        Args:
            heights: of the sliders. Shape (3,) [m].

        Raises:
            WrongShapeError: if there are not three numbers.
            NotFiniteError: if one of them is NaN or infinite.
            NoPoseError: if no pose of the platform belongs to them.
        """
        h1, h2, h3 = finite_vector("heights", heights, 3)
        self._machine.forward((h1, h2, h3))
        self._replace(self._replanning.at_rest((h1, h2, h3), self._newest_limits))

    def move_to(self, position: Sequence[float]) -> None:
        """Move the platform to a position and rest there.

        The position that is being moved to, or was reached, changes nothing. While limits are
        pending the motion is planned when they are in force; ``take_refusal`` says if that fails.

        Args:
            position: Shape (3,) [m].

        Raises:
            NotStartedError: before the start.
            KinematicsError: if the position is no place in the workspace, or there is no way.
        """
        held = self._holding()
        x, y, z = finite_vector("position", position, 3)
        move = Move((x, y, z))
        if move == held.goal:
            return
        self._workspace.check_position((x, y, z))
        self._replace(self._replanning.with_goal(held, self._time, move))

    def jog(self, velocity: Sequence[float]) -> None:
        """Move the platform along a direction, up to the edge of the workspace at most.

        Limits of the sliders reduce the speed, never the direction. The same velocity again changes
        nothing while the platform moves; a velocity below 1e-7 m/s is a stop.

        Args:
            velocity: of the platform. Shape (3,) [m/s].

        Raises:
            NotStartedError: before the start.
            NoRoomError: if the edge is too near in that direction. At the edge it is raised again
                for each twist that leads outwards.
            KinematicsError: if the velocity is no finite vector, or there is no way.
        """
        held = self._holding()
        x, y, z = finite_vector("velocity", velocity, 3)
        jog = jog_of((x, y, z))
        if jog is None:
            self.stop()
        elif not (
            isinstance(held.goal, Jog)
            and held.goal.is_renewed_by(jog)
            and self.phase is not MotionPhase.IDLE
        ):
            self._replace(self._replanning.with_goal(held, self._time, jog))

    def stop(self) -> None:
        """Come to rest as soon as the limits allow, and forget the goal.

        Raises:
            NotStartedError: before the start.
        """
        held = self._holding()
        if held.goal is not None:
            self._replace(self._replanning.stopped(held, self._time))

    def check_position(self, position: Sequence[float]) -> None:
        """Check what can be said of a target without a plan: that it is inside the workspace.

        Args:
            position: Shape (3,) [m].

        Raises:
            KinematicsError: if it is no place in the workspace.
        """
        self._workspace.check_position(position)

    def distance_from_target(self, heights: Sequence[float]) -> float:
        """Return how far the platform at measured ``heights`` is from the target.

        Args:
            heights: of the sliders. Shape (3,) [m].

        Returns:
            Distance [m]; NaN without a target, infinite if no pose belongs to the heights.
        """
        target = self.target
        if target is None:
            return math.nan
        try:
            return math.dist(target, self._machine.forward(heights))
        except NoPoseError:
            return math.inf

    def set_limits(self, limits: SliderLimits, speed_scale: float | None = None) -> None:
        """Change the limits of the sliders, and the scale with them if one is given.

        They are in force at once if a plan inside them can be made. Otherwise the motion slows
        down inside the old ones until that is so; meanwhile ``limits_pending`` is true.

        Args:
            limits: already checked as a set by their class.
            speed_scale: in (0, 1]; None leaves it as it is.

        Raises:
            NotFiniteError: if the scale is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        if speed_scale is None:
            speed_scale = self._newest_limits.speed_scale
        self._change(DriveLimits(limits, speed_scale))

    def set_speed_scale(self, speed_scale: float) -> None:
        """Change the scale of the velocities, as ``set_limits`` changes limits.

        Args:
            speed_scale: in (0, 1].

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        self._change(DriveLimits(self._newest_limits.sliders, speed_scale))

    def step(self, dt: float) -> SliderState:
        """Advance by ``dt`` [s] and return the setpoint.

        Raises:
            NotStartedError: before the start.
            OutOfBoundsError: if ``dt`` is not greater than zero, or NaN.
        """
        held = self._held
        time = self._time + dt
        # Nearly always there is nothing to do but go on. NaN is not greater than zero, either.
        if held is None or not dt > 0.0 or time >= self._retry_at:
            if not 0.0 < dt < math.inf:
                raise OutOfBoundsError("dt", dt, "finite and greater than 0", "s")
            if self._time >= self._retry_at:
                self._replace(*self._replanning.tried_again(self._holding(), self._time))
            held = self._holding()
            time = self._time + dt
        self._time = time
        return held.plan.state(time)

    def take_refusal(self) -> KinematicsError | None:
        """Return, once, why something that had to wait could not be done after all."""
        refusal, self._refusal = self._refusal, None
        return refusal

    def _replace(self, held: HeldMotion, refusal: KinematicsError | None = None) -> None:
        """Hold something else, keep a ``refusal``, and see to it that what waits is tried again."""
        self._hold(held)
        self._refusal = refusal or self._refusal
        waits = held.waits(self._time)
        self._retry_at = min(self._time + RETRY_INTERVAL, held.plan.duration) if waits else math.inf

    def _change(self, limits: DriveLimits) -> None:
        """Put limits in force now, or slow down until that is possible."""
        if self._held is None:
            self._first_limits = limits
        elif limits != self._newest_limits:
            self._replace(*self._replanning.with_limits(self._held, self._time, limits))
