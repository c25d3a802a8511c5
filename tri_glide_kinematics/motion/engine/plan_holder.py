"""The plan that an engine holds: how far it is carried out, and what can be told of it."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.engine.commands import DriveLimits
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion
from tri_glide_kinematics.motion.engine.progress import PathProgress, progress
from tri_glide_kinematics.motion.path import DrivenPath
from tri_glide_kinematics.motion.trajectory import (
    NotStartedError,
    SampledPlan,
    SliderState,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3


class PlanHolder:
    """Holds one plan after the other, with the time that has passed in it.

    Attributes:
        motion: what is held; None before the start.
        time: that has passed in its plan [s].
        plan_number: counts the plans held so far: a new number is a new plan.
        first_limits: for the start.
    """

    def __init__(self, limits: DriveLimits) -> None:
        """Hold nothing yet; ``limits`` are for the start."""
        self.motion: HeldMotion | None = None
        self.time = 0.0
        self.plan_number = 0
        self.first_limits = limits

    @property
    def held(self) -> HeldMotion:
        """What is held.

        Raises:
            NotStartedError: before the start.
        """
        if self.motion is None:
            raise NotStartedError
        return self.motion

    @property
    def limits(self) -> DriveLimits:
        """Limits in force."""
        return self.motion.limits if self.motion else self.first_limits

    @property
    def newest_limits(self) -> DriveLimits:
        """Limits that are asked for; they may still be pending."""
        pending = self.motion.pending if self.motion else None
        return pending or self.limits

    @property
    def time_to_rest(self) -> float:
        """Time until the held plan is at rest, at its goal or before [s]."""
        return max(self.motion.plan.duration - self.time, 0.0) if self.motion else 0.0

    @property
    def target(self) -> Vector3 | None:
        """Position of the platform that is being moved to or was reached [m]."""
        goal = self.motion.goal if self.motion else None
        return goal.destination if goal is not None else None

    @property
    def driven_path(self) -> DrivenPath | None:
        """The path that is followed, or was followed last; None without one."""
        goal = self.motion.followed if self.motion else None
        return goal.heights.driven if goal is not None and goal.heights is not None else None

    @property
    def path_progress(self) -> PathProgress | None:
        """How far the path is driven that is followed, or was followed last; None without one."""
        held = self.motion
        goal = held.followed if held is not None else None
        if held is None or goal is None or goal.heights is None:
            return None
        return progress(goal.heights, held.place(self.time), held.plan, self.time)

    @property
    def state(self) -> SliderState:
        """Present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        return self.held.plan.at(self.time)

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints of the held plan at ``times`` from now on. Shape (n,) [s].

        Raises:
            NotStartedError: before the start.
        """
        times = np.asarray(times, dtype=np.float64)
        return self.held.plan.sample(self.time + times)._replace(times=times)

    def hold(self, held: HeldMotion, elapsed: float = 0.0) -> None:
        """Hold something else; of a new plan ``elapsed`` seconds are past already."""
        last = self.motion
        if last is None or held.plan is not last.plan:
            self.time = elapsed
            # The steps of tracking are one motion.
            if last is None or last.tracked_step is None or held.tracked_step is None:
                self.plan_number += 1
        self.motion = held
