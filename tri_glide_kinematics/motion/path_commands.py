"""What can be asked of an engine about paths: to follow one, to pause on it and to go on."""

from __future__ import annotations

from dataclasses import replace

from tri_glide_kinematics.motion.commands import Command, Follow
from tri_glide_kinematics.motion.errors import NewerGoalError, NoPathError
from tri_glide_kinematics.motion.execution import PlanExecution
from tri_glide_kinematics.motion.held_motion import HeldMotion, MotionPhase, PlanRole
from tri_glide_kinematics.motion.paths.platform_path import PlatformPath


class PathCommands(PlanExecution):
    """An execution of plans that takes goals, and paths among them."""

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
        self._prepare_goal(Follow(path))

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
        if not isinstance(self._holding().goal, Follow):
            raise NoPathError("to extend")
        self._prepare_goal(Follow(path, extends=True))

    def pause(self) -> None:
        """Come to rest on the path, from where ``resume`` goes on.

        Raises:
            NotStartedError: before the start.
            NoPathError: if no path is followed.
            NewerGoalError: if another goal is being planned already.
        """
        held, goal = self._followed("to pause on")
        if goal.is_paused:
            return
        extension = self._extension
        self._preparation = None
        paused = replace(held, goal=replace(goal, place=held.place(self._time), is_paused=True))
        if held.role is PlanRole.LEADS_TO_GOAL and self._time < held.plan.duration:
            paused = replace(paused, role=PlanRole.EARLIER)
        self._replace(paused)
        if paused.waits(self._time):
            self._prepare_braking(urgent=True)
        if extension is not None:
            self._prepare_goal(extension)

    def resume(self) -> None:
        """Go on along the path after a pause; without a pause nothing changes.

        Raises:
            NotStartedError: before the start.
            NoPathError: if no path is followed.
            NewerGoalError: if another goal is being planned already.
        """
        held, goal = self._followed("to go on")
        if not goal.is_paused:
            return
        extension = self._extension
        self._preparation = None
        self._replace(replace(held, goal=replace(goal, is_paused=False)))
        if extension is not None:
            self._prepare_goal(extension)
        elif held.pending is None:
            self._prepare(self._replanning.continued)

    def keep_goal(self) -> None:
        """Give up a new goal that is still being prepared; what is held goes on."""
        if self._preparation is not None and self._preparation.goal is not None:
            self._preparation = None
            self._look_ahead()

    @property
    def is_paused(self) -> bool:
        """Whether the path that is followed is paused, or comes to rest for that."""
        goal = self._held.goal if self._held is not None else None
        return isinstance(goal, Follow) and goal.is_paused

    def _followed(self, purpose: str) -> tuple[HeldMotion, Follow]:
        """Return what is held, and the path that is followed.

        Args:
            purpose: for the text, if there is none.

        Raises:
            NotStartedError: before the start.
            NoPathError: if no path is followed.
            NewerGoalError: if another goal is being planned already.
        """
        held = self._holding()
        newer = self._preparation.goal if self._preparation is not None else None
        if newer is not None and self._extension is None:
            raise NewerGoalError
        if not isinstance(held.goal, Follow) or self.phase is MotionPhase.IDLE:
            raise NoPathError(purpose)
        return held, held.goal

    @property
    def _extension(self) -> Follow | None:
        """An extension of the path that is being prepared."""
        goal = self._preparation.goal if self._preparation is not None else None
        return goal if isinstance(goal, Follow) and goal.extends else None

    def _prepare_goal(self, goal: Command) -> None:
        held = self._holding()
        if held.pending is not None and not isinstance(goal, Follow):
            # It has its turn when the limits are in force; what is prepared for them knows it then.
            self._tracks = False
            self._replace(replace(held, goal=goal))
            if self._preparation is not None:
                self._prepare(self._replanning.tried_again)
        else:
            self._prepare(self._making(goal), goal)
