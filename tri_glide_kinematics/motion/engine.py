"""The motion engine: targets in, slider setpoints out; no clock and no ROS.

At every instant the engine holds a plan that leads to rest and was verified as a whole. A command
makes a new plan from the present setpoint; only if that is verified too does it replace the held
one. So whatever is commanded, and in whatever order, all that comes out is part of a verified plan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tri_glide_kinematics.checks import finite_vector
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.motion.commands import (
    Command,
    DriveLimits,
    Jog,
    Move,
    jog_of,
    stays_within,
)
from tri_glide_kinematics.motion.errors import NotStartedError
from tri_glide_kinematics.motion.held_motion import HeldMotion, MotionPhase, PlanRole
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.planner import MotionKind, MotionPlanner
from tri_glide_kinematics.motion.plans import (
    AT_REST,
    CubicPlan,
    Plan,
    SampledPlan,
    SequencePlan,
    SliderState,
)
from tri_glide_kinematics.tri_glide.errors import NoPoseError
from tri_glide_kinematics.tri_glide.kinematics import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
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


class MotionEngine:
    """Commanded state of the three sliders, stepped by a given time.

    Commands never touch the setpoint itself: they replace the plan of what comes next, from the
    next step on. Each raises a ``KinematicsError`` with the reason if it is refused; the engine
    then goes on with what it did. Each is planned at once, which takes some milliseconds in
    mid-motion: who is flooded with commands picks the newest, as the controller of the node does.
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
            speed_scale: part of the velocity limits, and of the speed of jogs, that is used; in
                (0, 1]. Accelerations and jerks are not scaled, so that a stop is never slower.

        Raises:
            NotFiniteError: if the scale is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        self._machine: TriGlide = workspace.machine
        self._workspace = workspace
        self._planner = MotionPlanner(workspace, kind)
        self._kind = kind
        self._limits = DriveLimits(limits, speed_scale)
        self._held: HeldMotion | None = None
        self._plan_number = 0
        self._time = 0.0
        self._retry_at = math.inf
        self._refusal: KinematicsError | None = None

    @property
    def kind(self) -> MotionKind:
        """How moves go to their target."""
        return self._kind

    @property
    def limits(self) -> SliderLimits:
        """Limits of the sliders in force, before the scale; new ones may still be pending."""
        return self._limits.sliders

    @property
    def speed_scale(self) -> float:
        """Scale in force."""
        return self._limits.speed_scale

    @property
    def limits_pending(self) -> bool:
        """Whether new limits wait for the motion to become slow enough."""
        return self._held is not None and self._held.pending is not None

    @property
    def started(self) -> bool:
        """Whether the engine knows where the sliders are."""
        return self._held is not None

    @property
    def phase(self) -> MotionPhase:
        """What the engine is doing. Idle is at rest with nothing that waits."""
        return self._held.phase(self._time) if self._held else MotionPhase.IDLE

    @property
    def remaining(self) -> float:
        """Time until the held plan is at rest [s]."""
        return max(self._held.plan.duration - self._time, 0.0) if self._held else 0.0

    @property
    def plan_number(self) -> int:
        """Counts the plans held so far: a new number is a new plan."""
        return self._plan_number

    @property
    def target(self) -> Vector3 | None:
        """Position of the platform that is being moved to or was reached [m]."""
        goal = self._held.goal if self._held else None
        return goal.position if isinstance(goal, Move) else None

    @property
    def state(self) -> SliderState:
        """Present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        return self._holding().plan.state(self._time)

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
        if self._held is not None and self._held.pending is not None:
            self._limits = self._held.pending
        resting = CubicPlan(SliderState((h1, h2, h3), AT_REST, AT_REST), ((), (), ()))
        self._hold(HeldMotion(resting, None, PlanRole.LEADS_TO_GOAL, self._workspace))

    def move_to(self, position: Sequence[float]) -> None:
        """Move the platform to a position and rest there.

        The position that is being moved to, or was reached, changes nothing. While limits are
        pending the motion is planned when they are in force; if that fails, ``take_refusal`` tells.

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
        self._obey(move)

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
            self._obey(jog)

    def stop(self) -> None:
        """Come to rest as soon as the limits allow, and forget the goal.

        Raises:
            NotStartedError: before the start.
        """
        held = self._holding()
        if held.goal is not None:
            self._hold(self._braked(replace(held, goal=None)))

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
        down inside the old ones until that is so; ``limits_pending`` tells.

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
        """Change the part of the velocities that is used, as ``set_limits`` changes limits.

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
                self._try_again()
            held = self._holding()
            time = self._time + dt
        self._time = time
        return held.plan.state(time)

    def sample_plan(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints of the held plan at ``times`` from now on.

        Args:
            times: Shape (n,) [s]; after ``remaining`` the sliders rest.

        Raises:
            NotStartedError: before the start.
        """
        plan = self._holding().plan
        sampled = plan.sample(self._time + np.asarray(times, dtype=np.float64))
        return sampled._replace(times=np.asarray(times, dtype=np.float64))

    def take_refusal(self) -> KinematicsError | None:
        """Return, once, why something that had to wait could not be done after all."""
        refusal, self._refusal = self._refusal, None
        return refusal

    @property
    def _newest_limits(self) -> DriveLimits:
        pending = self._held.pending if self._held else None
        return pending or self._limits

    def _holding(self) -> HeldMotion:
        if self._held is None:
            raise NotStartedError
        return self._held

    def _hold(self, held: HeldMotion) -> None:
        """Hold something else; a new plan begins with the present setpoint."""
        if self._held is None or held.plan is not self._held.plan:
            self._time = 0.0
            self._plan_number += 1
        self._held = held
        waits = held.waits(self._time)
        self._retry_at = min(self._time + RETRY_INTERVAL, held.plan.duration) if waits else math.inf

    def _planned(self, goal: Command, limits: DriveLimits, *, or_after: bool) -> HeldMotion:
        """Return a plan that leads from the present setpoint to ``goal``.

        Args:
            goal: to be reached.
            limits: for all of the plan.
            or_after: whether the held plan may come first, if there is no better way.

        Raises:
            KinematicsError: if there is none.
        """
        state, moving, room = self.state, self.remaining > 0.0, self._room()
        plan: Plan
        if isinstance(goal, Jog):
            speed = goal.speed * limits.speed_scale
            plan = self._planner.jog(state, goal.direction, speed, limits.effective, room, moving)
        else:
            after = SequencePlan((self._holding().plan,), self._time) if or_after else None
            plan = self._planner.move(state, goal.position, limits.effective, room, moving, after)
        return HeldMotion(plan, goal, PlanRole.LEADS_TO_GOAL, room)

    def _room(self) -> Workspace:
        """Return where the platform may be on a way that begins now."""
        return self._planner.room(
            self.state, self._holding().room if self.remaining > 0.0 else None
        )

    def _obey(self, goal: Command) -> None:
        """Hold a plan for ``goal``, or note it if limits are pending.

        Raises:
            KinematicsError: if there is none.
        """
        held = self._holding()
        if held.pending is None:
            self._hold(self._planned(goal, self._limits, or_after=True))
        else:
            self._hold(replace(held, goal=goal))

    def _braked(self, held: HeldMotion) -> HeldMotion:
        """Return ``held`` with a plan that comes to rest as soon as possible, if there is one."""
        if held.role is PlanRole.BRAKES or self.remaining == 0.0:
            return replace(held, role=PlanRole.BRAKES)
        on_line = self._kind is MotionKind.LINEAR or not isinstance(held.plan, CubicPlan)
        try:
            plan = self._planner.stop(self.state, self._limits.effective, self._room(), on_line)
        except KinematicsError:
            return replace(held, role=PlanRole.EARLIER)
        sooner = plan if plan.duration < self.remaining else held.plan
        return replace(held, plan=sooner, role=PlanRole.BRAKES)

    def _change(self, limits: DriveLimits) -> None:
        """Put limits in force now, or slow down until that is possible."""
        if self._held is None:
            self._limits = limits
            return
        if limits == self._newest_limits:
            return
        self._hold(replace(self._held, pending=limits))
        self._try_again()

    def _try_again(self) -> None:
        """Put pending limits in force if that is possible now, and brake if not."""
        if self._holding().pending is not None:
            self._put_in_force(self._holding())
        held = self._holding()
        self._hold(self._braked(held) if held.waits(self._time) else held)

    def _put_in_force(self, held: HeldMotion) -> None:
        """Put pending limits in force if the motion can go on inside them."""
        limits, goal = held.pending, held.goal
        assert limits is not None
        resting = self.remaining == 0.0
        if not resting and goal is not None and stays_within(self.state, limits.effective):
            try:
                planned = self._planned(goal, limits, or_after=False)
            except KinematicsError:
                pass
            else:
                self._limits = limits
                self._hold(planned)
                return
        if (
            resting
            or limits == self._limits
            or self._planner.keeps(held.plan, limits.effective, self._time)
        ):
            self._limits = limits
            self._hold(replace(held, pending=None))
            if goal is not None and held.role is not PlanRole.LEADS_TO_GOAL:
                self._resume(goal)

    def _resume(self, goal: Command) -> None:
        """Go on to a goal that had to wait; if there is no way, tell so and come to rest."""
        try:
            self._hold(self._planned(goal, self._limits, or_after=True))
        except KinematicsError as error:
            self._refusal = error
            self._hold(replace(self._holding(), goal=None))
