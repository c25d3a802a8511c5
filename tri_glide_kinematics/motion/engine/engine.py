"""The motion engine: targets in, slider setpoints out; no clock and no ROS.

At every instant the engine holds a plan that leads to rest and was verified as a whole. A command
makes a new plan from a setpoint of it; only if that is verified too does it replace the held one.
So whatever is commanded, and in whatever order, all that comes out is part of a verified plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tri_glide_kinematics.checks import finite_vector, member, non_negative
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.motion.engine.commands import (
    Command,
    Follow,
    Jog,
    MotionPhase,
    Move,
    NewLimits,
    Track,
    Transfer,
)
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.engine.execution import PlanExecution
from tri_glide_kinematics.motion.engine.held_motion import (
    FollowedPath,
    HeldMotion,
    PathProgress,
    PlanHolder,
    PlanRole,
)
from tri_glide_kinematics.motion.engine.transferring import TransferProgress
from tri_glide_kinematics.motion.errors import NewerGoalError, NoPathError
from tri_glide_kinematics.motion.limits import SampledPlan, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.motion.path import DrivenPath, PlatformPath
from tri_glide_kinematics.motion.shaping import Shaper, Shaping
from tri_glide_kinematics.motion.tracking import LONGEST_HORIZON
from tri_glide_kinematics.motion.transfer import Station
from tri_glide_kinematics.tri_glide import NoPoseError, TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import vector_text
from tri_glide_kinematics.workspace import Workspace


class MotionEngine:
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
        path_speed_scale: float = 1.0,
        rapid_scale: float = 1.0,
        in_pieces: bool = False,
    ) -> None:
        """Prepare the engine; ``start`` begins.

        Args:
            workspace: where the platform may be, and of which machine.
            limits: of the sliders.
            kind: of moves to a position. A jog is straight in both.
            speed_scale: factor of the velocity limits and of the speed of jogs, in (0, 1].
                Accelerations and jerks are not scaled, so that a stop is never slower.
            path_speed_scale: factor of the platform speeds that paths ask for, in (0, 2]; limits do
                not change.
            rapid_scale: in (0, 1]; where paths ask for no speed, the platform has no more than this
                part of the largest velocity limit; 1 is for no such bound.
            in_pieces: whether plans are made by ``work``, and not within a command.

        Raises:
            NotAChoiceError: if ``kind`` is no ``MotionKind``, but its name, for example.
            NotFiniteError: if a scale is NaN or infinite.
            OutOfBoundsError: if it is not in its interval.
        """
        member("kind", kind, MotionKind)
        drive_limits = DriveLimits(limits, speed_scale, path_speed_scale, rapid_scale)
        self._holder = PlanHolder(workspace.machine, drive_limits)
        self._execution = PlanExecution(self._holder, workspace, kind, in_pieces)
        self._workspace = workspace
        self._in_pieces = in_pieces
        self._machine: TriGlide = workspace.machine
        self._kind = kind

    def __repr__(self) -> str:
        """Return what it does and where the sliders are commanded to be."""
        if self._holder.motion is None:
            return f"<MotionEngine, {self._kind.name}, not started>"
        heights = vector_text(self.state.heights)
        return f"<MotionEngine, {self._kind.name}, {self.phase.name}, heights {heights} m>"

    @property
    def machine(self) -> TriGlide:
        """Whose sliders it moves."""
        return self._machine

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
            CannotHoldError: if force limits are too low to hold the weight there.
        """
        h1, h2, h3 = finite_vector("heights", heights, 3)
        position = self._machine.forward((h1, h2, h3))
        self._holder.newest_limits.sliders.check_holding(np.array((position,)))
        self._execution.plans.preparation = None
        self._execution.plans.tracks = False
        self._holder.shaped = None
        self._execution.plans.replace(
            self._execution.replanning.at_rest((h1, h2, h3), self._holder.newest_limits)
        )

    def carry_out(self, command: Command) -> None:
        """Do what a ``command`` asks for; each of the methods that follow gives one of its own.

        Raises:
            NotStartedError: before the start.
            KinematicsError: if it is refused; what is held goes on.
        """
        self._execution.carry_out(command)

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
        self._holder.check_started()
        self.carry_out(Move(position))

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
        self._holder.check_started()
        self.carry_out(Jog(velocity))

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
        self._holder.check_started()
        self.carry_out(Track(position, velocity, age=age))

    def stop(self) -> None:
        """Come to rest as soon as the limits allow, and forget the goal.

        Raises:
            NotStartedError: before the start.
        """
        self._execution.stop()

    def follow(self, path: PlatformPath) -> None:
        """Move the platform along a path, without a stop where it is smooth, and rest at its end.

        The whole path is looked at before the first setpoint. From rest elsewhere the platform goes
        to its start on a straight line; from a motion it comes to rest before.

        Args:
            path: of one segment at least.

        Raises:
            NotStartedError: before the start.
            KinematicsError: if a place of it cannot be driven to, with the segment and the place.
        """
        self.carry_out(Follow(path))

    def extend(self, path: PlatformPath) -> None:
        """Go on along another path behind the one that is followed, or was followed last.

        The joint is rounded like any other, as far as the platform is not too close to it already.

        Args:
            path: begins where the present one ends.

        Raises:
            NotStartedError: before the start.
            NoPathError: if no path is followed.
            KinematicsError: if a place of it cannot be driven to, with the segment and the place.
        """
        self.carry_out(Follow(path, extends=True))

    def pause(self) -> None:
        """Come to rest on the path, from where ``resume`` goes on.

        Raises:
            NotStartedError: before the start.
            NoPathError: if no path is followed.
            NewerGoalError: if another goal is being planned already.
        """
        held, path = self._followed("to pause on")
        if path.is_paused:
            return
        extension = self._extension
        self._execution.plans.preparation = None
        paused = held.on(replace(path, place=held.place(self._holder.time), is_paused=True))
        if held.role is PlanRole.LEADS_TO_GOAL and self._holder.time < held.plan.duration:
            paused = paused.waiting_to_brake()
        self._execution.plans.replace(paused)
        if paused.waits(self._holder.time):
            self._execution.plans.prepare_braking(urgent=True)
        if extension is not None:
            self._execution.prepare_goal(extension)

    def resume(self) -> None:
        """Go on along the path after a pause; without a pause nothing changes.

        Raises:
            NotStartedError: before the start.
            NoPathError: if no path is followed.
            NewerGoalError: if another goal is being planned already.
        """
        held, path = self._followed("to go on")
        if not path.is_paused:
            return
        extension = self._extension
        self._execution.plans.preparation = None
        self._execution.plans.replace(held.on(replace(path, is_paused=False)))
        if extension is not None:
            self._execution.prepare_goal(extension)
        elif held.pending is None:
            self._execution.plans.prepare(self._execution.replanning.continued)

    def transfer(self, stations: Sequence[Station], height: float, **how: Any) -> None:
        """Bring the platform from station to station, where stations may move; see ``Transfer``.

        It begins where the present motion comes to rest.

        Args:
            stations: in their order, of the present setpoint.
            height: of the platform between stations, by z [m].
            how: further arguments of ``Transfer``.

        Raises:
            NotStartedError: before the start.
            KinematicsError: if a number makes no sense, or there is no plan.
        """
        self._holder.check_started()
        self.carry_out(Transfer(stations, height, **how))

    def renew(self, station: int, motion: Station, age: float = 0.0) -> bool:
        """Plan again what is left of a transfer, as its next ``station`` moves otherwise.

        Where that station is not met any more, the platform goes up and rests.

        Args:
            station: its index.
            motion: how it moves.
            age: time from that of its position to the present setpoint [s].

        Returns:
            Whether that is begun: not while another plan is made, or the station is not the
            next, or did not move when the transfer was planned.

        Raises:
            NotStartedError: before the start.
        """
        return self._execution.transferring.renew(station, motion, age)

    def give_up(self, reason: KinematicsError) -> bool:
        """Go up from the station that a transfer leads to, or is at, and rest.

        Args:
            reason: why.

        Returns:
            Whether that is begun: not where both stations rest, nor if it is given up already.

        Raises:
            NotStartedError: before the start.
        """
        return self._execution.transferring.give_up(reason)

    @property
    def transfer_progress(self) -> TransferProgress | None:
        """How far the transfer is that is carried out; None without one."""
        return self._execution.transferring.progress

    @property
    def elapsed(self) -> float:
        """Time by which it was stepped [s]."""
        return self._holder.elapsed

    def keep_goal(self) -> None:
        """Give up a new goal that is still being prepared; what is held goes on."""
        self._execution.keep_goal()

    def set_limits(
        self,
        limits: SliderLimits,
        speed_scale: float | None = None,
        path_speed_scale: float | None = None,
        rapid_scale: float | None = None,
    ) -> None:
        """Change the limits of the sliders, and the scales with them that are given.

        They are in force at once if a plan inside them can be made. Otherwise the motion slows
        down inside the old ones until that is so; meanwhile ``limits_pending`` is true.

        Args:
            limits: already checked as a set by their class.
            speed_scale: in (0, 1]; None leaves it as it is.
            path_speed_scale: in (0, 2]; None leaves it as it is.
            rapid_scale: in (0, 1]; None leaves it as it is.

        Raises:
            NotFiniteError: if a scale is NaN or infinite.
            OutOfBoundsError: if it is not in its interval.
            CannotHoldError: if the platform rests where new force limits cannot hold the weight.
        """
        newest = self._holder.newest_limits
        given = zip((speed_scale, path_speed_scale, rapid_scale), newest.scales)
        scales = tuple(last if scale is None else scale for scale, last in given)
        if self.started and self.phase is MotionPhase.IDLE:
            limits.check_holding(np.array((self.platform[0],)))
        self.carry_out(NewLimits(DriveLimits(limits, *scales)))

    def set_speed_scale(self, speed_scale: float) -> None:
        """Change the scale of the velocities, as ``set_limits`` changes limits.

        Args:
            speed_scale: in (0, 1].

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 1].
        """
        self.set_limits(self._holder.newest_limits.sliders, speed_scale)

    def set_path_speed_scale(self, path_speed_scale: float) -> None:
        """Change by what the platform speeds that paths ask for are multiplied; no limit changes.

        On a path the platform goes over to the new speed without a stop.

        Args:
            path_speed_scale: in (0, 2].

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is not in (0, 2].
        """
        self.set_limits(self._holder.newest_limits.sliders, path_speed_scale=path_speed_scale)

    def set_shaper(self, shaper: Shaping | None) -> None:
        """Change the shaper of all motion; None is for none.

        It is in force from the next rest on; ``shaper_pending`` tells if that is not yet so.

        Args:
            shaper: always the same one, or what chooses one for the places that a motion passes: a
                move and a path for all of their way, jogs and moving targets for wherever they may
                lead. Where the present one does not do for a command in mid-motion, the platform
                comes to rest first, and goes on with another one.
        """
        self._execution.set_shaper(shaper)

    @property
    def shaper(self) -> Shaper | None:
        """The shaper that is in force."""
        return self._holder.limits.shaper

    @property
    def shaper_pending(self) -> bool:
        """Whether another shaper waits for rest; at rest, what begins next has it."""
        return self._execution.shaped_plans.shaper_pending and self.phase is not MotionPhase.IDLE

    @property
    def limits(self) -> SliderLimits:
        """Limits of the sliders in force, before the scale; new ones may still be pending."""
        return self._holder.limits.sliders

    @property
    def speed_scale(self) -> float:
        """Scale in force."""
        return self._holder.limits.speed_scale

    def set_follow_horizon(self, horizon: float) -> None:
        """Change how long steps of following take to be on what is followed; the next one knows it.

        Args:
            horizon: of targets, and of jogs that change in motion; 0 for the end of each step,
                which answers noise with the whole jerk [s].

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is less than 0 or more than ``LONGEST_HORIZON``.
        """
        horizon = non_negative("follow_horizon", horizon, "s")
        if horizon > LONGEST_HORIZON:
            raise OutOfBoundsError("follow_horizon", horizon, f"at most {LONGEST_HORIZON:g}", "s")
        self._execution.tracking.tracker.follower.horizon = horizon

    @property
    def path_speed_scale(self) -> float:
        """Factor in force of the platform speeds that paths ask for."""
        return self._holder.limits.path_speed_scale

    @property
    def scales(self) -> tuple[float, float, float]:
        """Scales in force of speed, of path speed, and of rapids."""
        return self._holder.limits.scales

    @property
    def limits_pending(self) -> bool:
        """Whether new limits wait for the motion to become slow enough."""
        return self._holder.motion is not None and self._holder.motion.pending is not None

    @property
    def started(self) -> bool:
        """Whether the engine knows where the sliders are."""
        return self._holder.motion is not None

    @property
    def phase(self) -> MotionPhase:
        """What the engine is doing. Idle is at rest with nothing that waits."""
        # It is asked several times in each cycle.
        held = self._holder.motion
        return held.phase(self._holder.time) if held else MotionPhase.IDLE

    @property
    def remaining(self) -> float:
        """Time to the end of what was asked for; inf where it is not known [s].

        It is 0 if, and only if, nothing is left to do: what was asked for has ended at rest, was
        refused, or was stopped. It is not known while a new goal is planned or waits for limits; of
        a path, until its end is planned, and while it is paused; of a moving target, and of a jog
        in motion, which have no end. A stop may be over sooner.
        """
        return self._execution.plans.remaining

    @property
    def time_to_rest(self) -> float:
        """Time until the held plan is at rest, at its goal or before [s].

        The held plan of a path leads to rest somewhere on it, and the next one takes its place
        before. ``remaining`` is the time to the end of what was asked for.
        """
        return self._holder.time_to_rest

    @property
    def plan_number(self) -> int:
        """Counts the plans held so far: a new number is a new plan."""
        return self._holder.plan_number

    @property
    def target(self) -> Vector3 | None:
        """Position of the platform that is being moved to or was reached [m]."""
        return self._holder.target

    @property
    def driven_path(self) -> DrivenPath | None:
        """The path that is followed, or was followed last; None without one."""
        return self._holder.driven_path

    @property
    def path_place(self) -> float:
        """How far along the path as driven the setpoint is; NaN where it is on no path [m].

        It is a way along the path as programmed, as the ``joints`` of the path as driven are. With
        a shaper the setpoint is a mean of places, and so is this.
        """
        return self._holder.path_place

    @property
    def path_progress(self) -> PathProgress | None:
        """How far the path is driven that is followed, or was followed last; None without one.

        It is None, too, as long as the length of a path is still worked out in pieces.
        """
        driven = self._holder.driven_path
        if driven is None or (self._in_pieces and not driven.is_measured):
            return None
        return self._holder.path_progress

    @property
    def state(self) -> SliderState:
        """Present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        return self._holder.state

    @property
    def platform(self) -> tuple[Vector3, Vector3]:
        """Position [m] and velocity [m/s] of the platform, by the present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        state = self._holder.state
        return self._machine.forward_velocity(state.heights, state.velocities)

    def sample_plan(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints of the held plan at ``times`` from now on.

        Args:
            times: Shape (n,) [s]; after ``time_to_rest`` the sliders rest.

        Raises:
            NotStartedError: before the start.
        """
        return self._holder.sample(times)

    @property
    def preparing(self) -> bool:
        """Whether a plan is being made, or waits for the setpoint at which it begins."""
        return self._execution.plans.preparation is not None

    @property
    def preparing_goal(self) -> bool:
        """Whether that is the plan of a new goal, and not what comes next for the present one."""
        return self._execution.plans.goal_in_preparation is not None

    @property
    def tracks(self) -> bool:
        """Whether something is tracked, so that a new velocity or target needs no plan."""
        return self._execution.plans.tracks

    def step(self, dt: float) -> SliderState:
        """Advance by ``dt`` [s] and return the setpoint.

        Raises:
            NotStartedError: before the start.
            OutOfBoundsError: if ``dt`` is not greater than zero, or NaN.
        """
        return self._execution.step(dt)

    def work(self, may_go_on: Callable[[], bool]) -> None:
        """Go on with what is being prepared, by one piece at least; else with what can wait.

        Args:
            may_go_on: asked after each piece, which takes some tenths of a millisecond.
        """
        self._execution.work(may_go_on)

    def take_refusal(self) -> KinematicsError | None:
        """Return, once, why something that had to wait could not be done after all."""
        return self._execution.plans.take_refusal()

    def keep_to_plan(self) -> None:
        """Forget all but the held plan, and drive that to its end.

        Nothing is planned for this: so it can be done, whatever has failed.
        """
        self._execution.plans.keep_to_plan()

    @property
    def is_paused(self) -> bool:
        """Whether the path that is followed is paused, or comes to rest for that."""
        path = self._holder.motion.path if self._holder.motion is not None else None
        return path is not None and path.is_paused

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
        held = self._holder.motion
        if held is None or held.goal is None or held.goal.has_end:
            return math.nan
        return self._execution.tracking.tracker.distance(self.state.heights)

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

    def _followed(self, purpose: str) -> tuple[HeldMotion, FollowedPath]:
        """Return what is held, and the path that is followed.

        Args:
            purpose: for the text, if there is none.

        Raises:
            NotStartedError: before the start.
            NoPathError: if no path is followed.
            NewerGoalError: if another goal is being planned already.
        """
        held = self._holder.held
        newer = self._execution.plans.goal_in_preparation
        if newer is not None and self._extension is None:
            raise NewerGoalError
        if held.path is None or self.phase is MotionPhase.IDLE:
            raise NoPathError(purpose)
        return held, held.path

    @property
    def _extension(self) -> Command | None:
        """An extension of the path that is being prepared."""
        goal = self._execution.plans.goal_in_preparation
        return goal if goal is not None and goal.extends else None
