"""The motion engine: targets in, slider setpoints out; no clock and no ROS.

At every instant the engine holds a plan that leads to rest and was verified as a whole. A command
makes a new plan from the present setpoint; only if that is verified too does it replace the held
one. So whatever is commanded, and in whatever order, all that comes out is part of a verified plan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum

import numpy as np

from tri_glide_kinematics.checks import finite_vector
from tri_glide_kinematics.errors import (
    KinematicsError,
    NoRoomError,
    NotStartedError,
    OutOfBoundsError,
)
from tri_glide_kinematics.limits import SliderLimits
from tri_glide_kinematics.planning.commands import Command, DriveLimits, Jog, Move, stays_within
from tri_glide_kinematics.planning.motion_planner import MotionKind, MotionPlanner
from tri_glide_kinematics.planning.plans import (
    AT_REST,
    CubicPlan,
    FloatArray,
    Plan,
    SampledPlan,
    SequencePlan,
    SliderState,
    Vector3,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.workspace import Workspace

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

# Of poses, and of twists, that follow each other faster than this only the newest is planned [s].
COMMAND_INTERVAL = 0.005

# A jog that is slower than this is a stop [m/s].
SLOWEST_JOG = 1e-7


class MotionPhase(Enum):
    """What the engine is doing."""

    IDLE = "idle"
    MOVING = "moving"
    JOGGING = "jogging"
    STOPPING = "stopping"


class MotionEngine:
    """Commanded state of the three sliders, stepped by a given time.

    Commands never touch the setpoint itself: they replace the plan of what comes next, from the
    next step on. Each raises a ``KinematicsError`` with the reason if it is refused; the engine
    then goes on with what it did. Of poses, and of twists, that follow each other faster than
    ``COMMAND_INTERVAL`` only the newest is planned; if it is refused then, ``take_refusal`` tells.
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
        self._pending_limits: DriveLimits | None = None
        self._plan: Plan | None = None
        self._time = 0.0
        # What the held plan carries out, or is to be once what waits is done.
        self._command: Command | None = None
        self._waiting: Command | None = None
        self._stopping = False
        self._stop_waits = False
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
        return self._pending_limits is not None

    @property
    def started(self) -> bool:
        """Whether the engine knows where the sliders are."""
        return self._plan is not None

    @property
    def phase(self) -> MotionPhase:
        """What the engine is doing."""
        if self.remaining == 0.0 and not self.limits_pending:
            return MotionPhase.IDLE
        if self._stopping:
            return MotionPhase.STOPPING
        return MotionPhase.JOGGING if isinstance(self._command, Jog) else MotionPhase.MOVING

    @property
    def remaining(self) -> float:
        """Time until the held plan is at rest [s]."""
        return max(self._plan.duration - self._time, 0.0) if self._plan else 0.0

    @property
    def target(self) -> Vector3 | None:
        """Position of the platform that is being moved to or was reached [m]."""
        newest = self._waiting or self._command
        return newest.position if isinstance(newest, Move) else None

    @property
    def state(self) -> SliderState:
        """Present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        return self._held().state(self._time)

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
        if self._pending_limits is not None:
            self._limits, self._pending_limits = self._pending_limits, None
        resting = SliderState((h1, h2, h3), AT_REST, AT_REST)
        self._hold(CubicPlan(resting, ((), (), ())), None)

    def move_to(self, position: Sequence[float]) -> None:
        """Move the platform to a position and rest there.

        The position that is being moved to, or was reached, changes nothing.

        Args:
            position: Shape (3,) [m].

        Raises:
            NotStartedError: before the start.
            KinematicsError: if the position is no place in the workspace, or there is no way.
        """
        self._held()
        x, y, z = finite_vector("position", position, 3)
        move = Move((x, y, z))
        if move == (self._waiting or self._command):
            return
        self._workspace.check_position((x, y, z))
        self._obey(move)

    def jog(self, velocity: Sequence[float]) -> None:
        """Move the platform along a direction, up to the edge of the workspace at most.

        Limits of the sliders reduce the speed, never the direction. The same velocity again changes
        nothing; zero is a stop.

        Args:
            velocity: of the platform. Shape (3,) [m/s].

        Raises:
            NotStartedError: before the start.
            KinematicsError: if the velocity is no finite vector, or there is no room.
        """
        self._held()
        x, y, z = finite_vector("velocity", velocity, 3)
        speed = math.hypot(x, y, z)
        if speed < SLOWEST_JOG:
            self.stop()
            return
        jog = Jog((x / speed, y / speed, z / speed), speed)
        newest = self._waiting or self._command
        renewed = isinstance(newest, Jog) and newest.is_renewed_by(jog)
        if renewed and self.remaining > 0.0:
            return
        try:
            self._obey(jog)
        except NoRoomError:
            # A jog that is held at the edge has been told before.
            if not renewed:
                raise

    def stop(self) -> None:
        """Come to rest as soon as the limits allow.

        Raises:
            NotStartedError: before the start.
        """
        self._held()
        self._command = self._waiting = None
        if self._stopping or self.remaining == 0.0:
            return
        self._stopping = True
        self._stop_waits = not self._brake()
        self._retry_soon()

    def set_limits(self, limits: SliderLimits) -> None:
        """Change the limits of the sliders.

        They are in force at once if a plan inside them can be made. Otherwise the motion slows
        down inside the old ones until that is so; ``limits_pending`` tells.

        Args:
            limits: already checked as a set by their class.
        """
        newest = self._pending_limits or self._limits
        self._change(DriveLimits(limits, newest.speed_scale))

    def set_speed_scale(self, speed_scale: float) -> None:
        """Change the part of the velocities that is used, as ``set_limits`` changes limits.

        Args:
            speed_scale: in (0, 1].

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        newest = self._pending_limits or self._limits
        self._change(DriveLimits(newest.sliders, speed_scale))

    def step(self, dt: float) -> SliderState:
        """Advance by ``dt`` [s] and return the setpoint.

        Raises:
            NotStartedError: before the start.
            OutOfBoundsError: if ``dt`` is not greater than zero, or NaN.
        """
        plan = self._plan
        time = self._time + dt
        # Nearly always there is nothing to do but go on. NaN is not greater than zero, either.
        if plan is None or not dt > 0.0 or time >= self._retry_at:
            if not 0.0 < dt < math.inf:
                raise OutOfBoundsError("dt", dt, "finite and greater than 0", "s")
            if self._time >= self._retry_at:
                self._catch_up()
            plan = self._held()
            time = self._time + dt
        self._time = time
        return plan.state(time)

    def sample_plan(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints of the held plan at ``times`` from now on.

        Args:
            times: Shape (n,) [s]; after ``remaining`` the sliders rest.

        Raises:
            NotStartedError: before the start.
        """
        sampled = self._held().sample(self._time + np.asarray(times, dtype=np.float64))
        return sampled._replace(times=np.asarray(times, dtype=np.float64))

    def take_refusal(self) -> KinematicsError | None:
        """Return, once, why something that had to wait could not be done after all."""
        refusal, self._refusal = self._refusal, None
        return refusal

    def _held(self) -> Plan:
        if self._plan is None:
            raise NotStartedError
        return self._plan

    def _hold(self, plan: Plan, command: Command | None) -> None:
        """Replace the plan by one that begins with the present setpoint."""
        self._plan = plan
        self._time = 0.0
        self._command = command
        self._waiting = None
        self._stopping = self._stop_waits = False
        self._retry_soon()

    def _retry_soon(self) -> None:
        """Set the time at which what has to wait is tried again."""
        waits = self._stop_waits or self._pending_limits is not None or self._waiting is not None
        self._retry_at = self._time + RETRY_INTERVAL if waits else math.inf

    def _planned(self, command: Command, limits: DriveLimits, *, or_after: bool) -> Plan:
        """Return a plan for ``command`` from the present setpoint.

        Args:
            command: to be carried out.
            limits: for all of the plan.
            or_after: whether the held plan may come first, if there is no better way.

        Raises:
            KinematicsError: if there is none.
        """
        state, moving = self.state, self.remaining > 0.0
        if isinstance(command, Jog):
            speed = command.speed * limits.speed_scale
            return self._planner.jog(state, command.direction, speed, limits.effective, moving)
        held = SequencePlan((self._held(),), self._time) if or_after else None
        return self._planner.move(state, command.position, limits.effective, moving, held)

    def _obey(self, command: Command) -> None:
        """Hold a plan for ``command``, or let it wait if it comes too soon after one of its kind.

        Raises:
            KinematicsError: if there is none.
        """
        if (
            isinstance(self._command, type(command))
            and self._time < COMMAND_INTERVAL
            and self.remaining > 0.0
        ):
            self._waiting = command
            self._retry_at = COMMAND_INTERVAL
            return
        plan = self._planned(command, self._limits, or_after=True)
        if self._pending_limits is None:
            self._hold(plan, command)
        else:
            # The motion is slowing down for new limits, and goes on from there.
            self._command = self._waiting = command
            self._stopping = self._stop_waits = False
            self._retry_soon()

    def _brake(self) -> bool:
        """Hold a plan that stops; return whether there is one now."""
        on_line = self._kind is MotionKind.LINEAR or not isinstance(self._held(), CubicPlan)
        try:
            plan = self._planner.stop(self.state, self._limits.effective, on_line)
        except KinematicsError:
            return False
        if plan.duration < self.remaining:
            self._plan, self._time = plan, 0.0
        return True

    def _change(self, limits: DriveLimits) -> None:
        """Put limits in force now, or slow down until that is possible."""
        self._pending_limits = None
        if limits == self._limits or self._takes_over(limits):
            return
        self._pending_limits = limits
        if self._waiting is None:
            self._waiting = self._command
        self._brake()
        self._retry_soon()

    def _takes_over(self, limits: DriveLimits) -> bool:
        """Put limits in force if the motion can go on inside them; return whether it does."""
        if self._plan is None or self.remaining == 0.0:
            self._limits = limits
            return True
        if stays_within(self.state, limits.effective):
            command = self._waiting or self._command
            try:
                if command is not None:
                    plan = self._planned(command, limits, or_after=False)
                    self._limits = limits
                    self._hold(plan, command)
                    return True
            except KinematicsError:
                pass
        if self._planner.keeps(self._plan, limits.effective, self._time):
            self._limits = limits
            return True
        return False

    def _catch_up(self) -> None:
        """Do what had to wait, or try again soon."""
        if self._pending_limits is not None and self._takes_over(self._pending_limits):
            self._pending_limits = None
        if self._stop_waits:
            self._stop_waits = not self._brake()
        elif self._waiting is not None and self._pending_limits is None:
            command, self._waiting = self._waiting, None
            try:
                self._hold(self._planned(command, self._limits, or_after=True), command)
            except KinematicsError as error:
                self._refusal = error
        self._retry_soon()
