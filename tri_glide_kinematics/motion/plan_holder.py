"""The plan that an engine holds: how far it is carried out, and what can be told of it."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.commands import DriveLimits, Follow, Move
from tri_glide_kinematics.motion.errors import NotStartedError
from tri_glide_kinematics.motion.held_motion import HeldMotion, MotionPhase
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.paths.driven_path import DrivenPath
from tri_glide_kinematics.motion.paths.path_progress import PathProgress, progress
from tri_glide_kinematics.motion.plans import SampledPlan, SliderState
from tri_glide_kinematics.motion.tracking.tracked_step import TrackedStep
from tri_glide_kinematics.vectors import FloatArray, Vector3


class PlanHolder:
    """Holds one plan after the other, with the time that has passed in it."""

    def __init__(self, limits: DriveLimits, in_pieces: bool) -> None:
        """Hold nothing yet.

        Args:
            limits: for the start.
            in_pieces: whether what takes long is done by ``work``, and not when it is asked for.
        """
        self._first_limits = limits
        self._in_pieces = in_pieces
        self._held: HeldMotion | None = None
        self._plan_number = 0
        self._time = 0.0

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
    def time_to_rest(self) -> float:
        """Time until the held plan is at rest, at its goal or before [s].

        The held plan of a path leads to rest somewhere on it, and the next one takes its place
        before. ``remaining`` is the time to the end of what was asked for.
        """
        return max(self._held.plan.duration - self._time, 0.0) if self._held else 0.0

    @property
    def plan_number(self) -> int:
        """Counts the plans held so far: a new number is a new plan."""
        return self._plan_number

    @property
    def target(self) -> Vector3 | None:
        """Position of the platform that is being moved to or was reached [m]."""
        goal = self._held.goal if self._held else None
        if isinstance(goal, Follow) and goal.heights is not None:
            x, y, z = goal.heights.driven.segments.points[-1].tolist()
            return x, y, z
        return goal.position if isinstance(goal, Move) else None

    @property
    def driven_path(self) -> DrivenPath | None:
        """The path that is followed, or was followed last; None without one."""
        goal = self._held.goal if self._held else None
        heights = goal.heights if isinstance(goal, Follow) else None
        return heights.driven if heights is not None else None

    @property
    def path_progress(self) -> PathProgress | None:
        """How far the path is driven that is followed, or was followed last; None without one.

        It is None, too, as long as the length of a path is still worked out in pieces.
        """
        held, driven = self._held, self.driven_path
        if held is None or driven is None or (self._in_pieces and not driven.is_measured):
            return None
        assert isinstance(held.goal, Follow)
        assert held.goal.heights is not None
        return progress(held.goal.heights, held.place(self._time), held.plan, self._time)

    @property
    def state(self) -> SliderState:
        """Present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        return self._holding().plan.state(self._time)

    def sample_plan(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints of the held plan at ``times`` from now on.

        Args:
            times: Shape (n,) [s]; after ``time_to_rest`` the sliders rest.

        Raises:
            NotStartedError: before the start.
        """
        plan = self._holding().plan
        sampled = plan.sample(self._time + np.asarray(times, dtype=np.float64))
        return sampled._replace(times=np.asarray(times, dtype=np.float64))

    @property
    def _limits(self) -> DriveLimits:
        """Limits in force."""
        return self._held.limits if self._held else self._first_limits

    @property
    def _newest_limits(self) -> DriveLimits:
        pending = self._held.pending if self._held else None
        return pending or self._limits

    def _holding(self) -> HeldMotion:
        if self._held is None:
            raise NotStartedError
        return self._held

    def _hold(self, held: HeldMotion, elapsed: float = 0.0) -> None:
        """Hold something else; of a new plan ``elapsed`` seconds are past already."""
        last = self._held.plan if self._held else None
        if held.plan is not last:
            self._time = elapsed
            # The steps of tracking are one motion.
            if not (isinstance(last, TrackedStep) and isinstance(held.plan, TrackedStep)):
                self._plan_number += 1
        self._held = held
