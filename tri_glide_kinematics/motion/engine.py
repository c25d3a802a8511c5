"""The motion engine: targets in, slider setpoints out; no clock and no ROS.

At every instant the engine holds a plan that leads to rest and was verified as a whole. A command
makes a new plan from a setpoint of it; only if that is verified too does it replace the held one.
So whatever is commanded, and in whatever order, all that comes out is part of a verified plan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from tri_glide_kinematics.checks import finite, finite_vector, member
from tri_glide_kinematics.motion.commands import DriveLimits, Follow, Jog, Move, Track, jog_of
from tri_glide_kinematics.motion.held_motion import MotionPhase, PlanRole
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.path_commands import PathCommands
from tri_glide_kinematics.motion.planner import MotionKind
from tri_glide_kinematics.motion.plans import SampledPlan, SliderState
from tri_glide_kinematics.tri_glide.errors import NoPoseError
from tri_glide_kinematics.tri_glide.kinematics import TriGlide
from tri_glide_kinematics.wording import vector_text
from tri_glide_kinematics.workspace.workspace import Workspace

__all__ = [
    "MotionEngine",
    "MotionKind",
    "MotionPhase",
    "SampledPlan",
    "SliderLimits",
    "SliderState",
]


class MotionEngine(PathCommands):
    """Commanded state of the three sliders, stepped by a given time.

    Commands never touch the setpoint itself: they replace the plan of what comes next. Each raises
    a ``KinematicsError`` with the reason if it is refused; the engine goes on with what it did.

    A plan takes some milliseconds in mid-motion. By default it is made within the call of the
    command. With ``in_pieces`` it is made in calls of ``work``, in what time a control cycle has
    left: it begins at a later setpoint, and until then the held plan goes on. Why there is none is
    told by ``take_refusal`` then. A new goal takes the place of one that is still ``preparing``; a
    caller that receives goals faster than they are carried out should hold back the newest until
    then, as the controller of the node does.
    """

    def __init__(
        self,
        workspace: Workspace,
        limits: SliderLimits,
        *,
        kind: MotionKind = MotionKind.SLIDER,
        speed_scale: float = 1.0,
        in_pieces: bool = False,
    ) -> None:
        """Prepare the engine; ``start`` begins.

        Args:
            workspace: where the platform may be, and of which machine.
            limits: of the sliders.
            kind: of moves to a position. A jog is straight in both.
            speed_scale: factor of the velocity limits and of the speed of jogs, in (0, 1].
                Accelerations and jerks are not scaled, so that a stop is never slower.
            in_pieces: whether plans are made by ``work``, and not within a command.

        Raises:
            NotAChoiceError: if ``kind`` is no ``MotionKind``, but its name, for example.
            NotFiniteError: if the scale is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        member("kind", kind, MotionKind)
        super().__init__(workspace, kind, DriveLimits(limits, speed_scale), in_pieces)
        self._machine: TriGlide = workspace.machine
        self._kind = kind

    def __repr__(self) -> str:
        """Return what it does and where the sliders are commanded to be."""
        if self._held is None:
            return f"<MotionEngine, {self._kind.name}, not started>"
        heights = vector_text(self.state.heights)
        return f"<MotionEngine, {self._kind.name}, {self.phase.name}, heights {heights} m>"

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
        self._preparation = None
        self._tracks = False
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
            self.keep_goal()
        else:
            self._workspace.check_position((x, y, z))
            self._prepare_goal(move)

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
        elif (
            isinstance(held.goal, Jog)
            and held.goal.is_renewed_by(jog)
            and self.phase is not MotionPhase.IDLE
        ):
            self.keep_goal()
        elif not self._track_jog(held, jog):
            self._prepare_goal(jog)

    def track(self, position: Sequence[float], velocity: Sequence[float], age: float = 0.0) -> None:
        """Follow a target that moves; it is taken to go on as it does until the next call.

        The machine catches up with it and then follows it, as far as limits and workspace let it:
        at an edge it waits for the target to come back.

        Args:
            position: of the target. Shape (3,) [m].
            velocity: of the target. Shape (3,) [m/s].
            age: how long ago, before the present setpoint, it was so [s].

        Raises:
            NotStartedError: before the start.
            KinematicsError: if the numbers are not finite or no vectors, or if the following begins
                with a target or a platform outside the workspace.
        """
        held = self._holding()
        x, y, z = finite_vector("position", position, 3)
        dx, dy, dz = finite_vector("velocity", velocity, 3)
        target = Track((x, y, z), (dx, dy, dz), finite("age", age))
        self.keep_goal()
        begins = not (self._tracks and isinstance(held.goal, Track))
        if begins:
            self._workspace.check_heights(held.plan.state(self._time).heights)
            self._workspace.check_position(target.position)
        self._pursuit.report(target, begins=begins)
        if begins:
            self._begin_to_track(target)
        else:
            self._replace(replace(held, goal=target))

    def stop(self) -> None:
        """Come to rest as soon as the limits allow, and forget the goal.

        Raises:
            NotStartedError: before the start.
        """
        held = self._holding()
        self.keep_goal()
        if held.goal is None:
            return
        self._tracks = False
        self._preparation = None
        self._replace(replace(held, goal=None, role=PlanRole.EARLIER))
        self._prepare_braking(urgent=True, stays=not isinstance(held.goal, Track))

    def check_position(self, position: Sequence[float]) -> None:
        """Check what can be said of a target without a plan: that it is inside the workspace.

        Args:
            position: Shape (3,) [m].

        Raises:
            KinematicsError: if it is no place in the workspace.
        """
        self._workspace.check_position(position)

    @property
    def tracking_distance(self) -> float:
        """How far the platform, by the setpoint, is from the moving target; NaN without one [m]."""
        if not isinstance(self._held.goal if self._held else None, Track):
            return math.nan
        return self._pursuit.distance(self.state.heights)

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

    def _change(self, limits: DriveLimits) -> None:
        """Put limits in force now, or slow down until that is possible."""
        held = self._held
        if held is None:
            self._first_limits = limits
        elif limits != self._newest_limits:
            goal = self._preparation.goal if self._preparation is not None else None
            if isinstance(goal, Follow):
                # The whole path is looked at first; then it waits for the limits, too.
                self._replace(replace(held, pending=limits))
                return
            if goal is not None:
                # It is planned when the limits are in force.
                self._tracks = False
                held = replace(held, goal=goal, role=PlanRole.EARLIER)
            self._replace(replace(held, pending=limits))
            # The next step of tracking keeps them, if it can.
            if not self._tracks:
                self._prepare(self._replanning.tried_again)
