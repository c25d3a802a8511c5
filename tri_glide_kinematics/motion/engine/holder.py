"""Holds one plan after the other, with the time that has passed in it, and what the shaper makes.

Plans are made, held and replaced as without a shaper; it is the mean of their platform positions
that is driven. So the past belongs to the motion as long as the shaper lasts, and a plan may only
replace the held one if what is driven then keeps all limits, from the first setpoint to rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PathProgress, progress
from tri_glide_kinematics.motion.errors import NotStartedError
from tri_glide_kinematics.motion.limits import SampledPlan, SliderState
from tri_glide_kinematics.motion.path import DrivenPath
from tri_glide_kinematics.motion.shaped import DrivenPart, ShapedTrajectory
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.trajectory import Trajectory
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3


class ShapedMotion:
    """The shaped motion of the plans that are held one after the other.

    Attributes:
        time: since the newest of them is held [s].
    """

    def __init__(self, machine: TriGlide, shaper: Shaper, driven: Sequence[DrivenPart]) -> None:
        """Begin with what is ``driven``, seen from now."""
        self._machine = machine
        self._trajectory = ShapedTrajectory(machine, shaper, driven)
        self.time = 0.0

    @classmethod
    def from_rest(
        cls, machine: TriGlide, shaper: Shaper, plan: Trajectory, time: float
    ) -> ShapedMotion:
        """Return the motion of a ``plan`` that begins at rest, ``time`` seconds after its start."""
        return cls(machine, shaper, [DrivenPart(-time, plan, 0.0)])

    @property
    def shaper(self) -> Shaper:
        """Its impulses."""
        return self._trajectory.shaper

    def followed_by(self, plan: Trajectory, elapsed: float) -> ShapedMotion:
        """Return the motion that goes on with another ``plan``, of which some time is past [s]."""
        parts = self._with(plan, -elapsed)
        return ShapedMotion(self._machine, self.shaper, parts)

    def going_on(self, plan: Trajectory, lead: float) -> ShapedTrajectory:
        """Return the motion, from now on, if a ``plan`` takes over in ``lead`` seconds.

        If it is the plan that is held, that goes on as it is.
        """
        parts = self._driven
        if plan is not parts[-1].plan:
            parts = self._with(plan, lead)
        return ShapedTrajectory(self._machine, self.shaper, parts)

    @property
    def _driven(self) -> list[DrivenPart]:
        """All parts, seen from now."""
        return [part._replace(begin=part.begin - self.time) for part in self._trajectory.driven]

    def _with(self, plan: Trajectory, lead: float) -> list[DrivenPart]:
        """Return the parts that still count, seen from now, and another plan behind them."""
        parts = [part for part in self._driven if part.begin < lead]
        ends = [part.begin for part in parts[1:]]
        forgotten = sum(end < -self.shaper.duration for end in ends)
        return [*parts[forgotten:], DrivenPart(lead, plan, 0.0)]

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds from now."""
        return self._trajectory.at(self.time + time)

    @property
    def place(self) -> float:
        """How far along the path of the newest plan the platform is, as the mean of places [m]."""
        return self._trajectory.place(self.time)

    @property
    def time_to_rest(self) -> float:
        """Time until the platform rests [s]."""
        return max(self._trajectory.duration - self.time, 0.0)

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at ``times`` from now on. Shape (n,) [s]."""
        return self._trajectory.sample(self.time + times)._replace(times=times)


class PlanHolder:
    """Holds one plan after the other, with the time that has passed in it.

    Attributes:
        motion: what is held; None before the start.
        shaped: what the shaper makes of it; None without a shaper.
        time: that has passed in its plan [s].
        plan_number: counts the plans held so far: a new number is a new plan.
        first_limits: for the start.
    """

    def __init__(self, machine: TriGlide, limits: DriveLimits) -> None:
        """Hold nothing yet of a ``machine``; ``limits`` are for the start."""
        self._machine = machine
        self.motion: HeldMotion | None = None
        self.shaped: ShapedMotion | None = None
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

    def check_started(self) -> None:
        """Check that something is held.

        Raises:
            NotStartedError: before the start.
        """
        if self.motion is None:
            raise NotStartedError

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
        if self.shaped is not None:
            return self.shaped.time_to_rest
        return max(self.motion.plan.duration - self.time, 0.0) if self.motion else 0.0

    @property
    def target(self) -> Vector3 | None:
        """Position of the platform that is being moved to or was reached [m]."""
        return self.motion.destination if self.motion else None

    @property
    def driven_path(self) -> DrivenPath | None:
        """The path that is followed, or was followed last; None without one."""
        path = self.motion.path if self.motion else None
        return path.heights.driven if path is not None else None

    @property
    def path_progress(self) -> PathProgress | None:
        """How far the path is driven that is followed, or was followed last; None without one."""
        held = self.motion
        if held is None or held.path is None:
            return None
        return progress(held.path.heights, held.place(self.time), held.plan, self.time)

    @property
    def path_place(self) -> float:
        """How far along the path as driven the setpoint is; NaN where it is on no path [m]."""
        plan = self.motion.path_plan if self.motion else None
        if plan is None:
            return math.nan
        return plan.place(self.time) if self.shaped is None else self.shaped.place

    @property
    def state(self) -> SliderState:
        """Present setpoint.

        Raises:
            NotStartedError: before the start.
        """
        held = self.held
        return held.plan.at(self.time) if self.shaped is None else self.shaped.at(0.0)

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints of the held plan at ``times`` from now on. Shape (n,) [s].

        Raises:
            NotStartedError: before the start.
        """
        times = np.asarray(times, dtype=np.float64)
        if self.shaped is not None:
            return self.shaped.sample(times)
        return self.held.plan.sample(self.time + times)._replace(times=times)

    def hold(self, held: HeldMotion, elapsed: float = 0.0) -> None:
        """Hold something else; of a new plan ``elapsed`` seconds are past already."""
        last, time, number, shaped = self.motion, self.time, self.plan_number, self.shaped
        if last is None or held.plan is not last.plan:
            time = elapsed
            # The steps of tracking are one motion.
            if last is None or last.tracked_step is None or held.tracked_step is None:
                number += 1
            if shaped is not None:
                shaped = shaped.followed_by(held.plan, elapsed)
        shaper = held.limits.shaper
        if shaper is None:
            shaped = None
        elif shaped is None or shaped.shaper is not shaper:
            # A shaper is put in force at rest, and so it is empty.
            if time >= held.plan.duration:
                time = max(time, held.rests_at)
            shaped = ShapedMotion.from_rest(self._machine, shaper, held.plan, time)
        # All of it, or nothing, whatever fails before.
        self.motion, self.time, self.plan_number, self.shaped = held, time, number, shaped
