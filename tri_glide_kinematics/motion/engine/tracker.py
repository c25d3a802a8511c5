"""Tracks a velocity or a moving target, by one certified step after the other.

Each step is held with the braking behind it, so at every instant there is a verified way to rest.
Where no step can be certified the held braking goes on, and the next step is tried in the next
cycle. Nothing is planned ahead, so a new velocity or position of the target costs no more than any
other cycle. With a shaper the steps are longer, and each is made while the one before goes on.
"""

from __future__ import annotations

import math
from dataclasses import replace

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.drive_limits import DriveLimits
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanRole
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.tracking import Follower, MovingTarget, TargetMotion, Wanted
from tri_glide_kinematics.motion.trajectory import TrackedStep
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# A platform that is nearer to a target when it begins to follow it is there [m].
NEAR = 1e-3


class Tracker:
    """Makes the next step towards a jog or a target; keeps how the target has moved."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for the machine of ``workspace``."""
        self._follower = Follower(workspace)
        self._workspace = workspace
        self._machine = workspace.machine
        self._target: TargetMotion | None = None
        self._time = 0.0

    def report(self, target: MovingTarget, age: float, start: Vector3 | None) -> None:
        """Take in how the ``target`` moves.

        Args:
            target: as it is told.
            age: how long before now it was so [s].
            start: heights of the sliders, if no other one was tracked before [m].
        """
        if start is None:
            assert self._target is not None
            self._target.report(target, self._time - age)
            return
        # A target that is elsewhere at the start is caught up with as soon as possible.
        missing = math.dist(target.after(age).position, self._machine.forward(start))
        self._time = 0.0
        self._target = TargetMotion(
            target._replace(lead=missing if missing < NEAR else math.inf), -age
        )

    def next(self, held: HeldMotion, time: float, dt: float) -> HeldMotion | None:
        """Return what is held for a step of ``dt`` [s], from ``time`` [s] in the held plan on.

        Limits that are pending are in force with it. None if no such step is certified.
        """
        limits, wanted = self._wanted(held, dt)
        step = self._follower.step(held.plan.at(time), wanted, limits.effective, dt)
        return self._with_step(held, step, limits)

    def prepared(
        self, held: HeldMotion, time: float, dt: float, ahead: float
    ) -> Interruptible[HeldMotion | None]:
        """Return what is held for a step, as ``next`` does, that begins ``ahead`` of now [s]."""
        limits, wanted = self._wanted(held, ahead + dt)
        step = yield from self._follower.step_in_pieces(
            held.plan.at(time), wanted, limits.effective, dt
        )
        return self._with_step(held, step, limits)

    def _wanted(self, held: HeldMotion, dt: float) -> tuple[DriveLimits, Wanted]:
        limits = held.pending or held.limits
        assert held.goal is not None
        return limits, held.goal.wanted(self, limits, dt)

    def target_after(self, dt: float, shaper: Shaper | None = None) -> MovingTarget:
        r"""Return where the target will be in ``dt`` seconds, and how it will move.

        What a ``shaper`` makes of a motion $p$ with a steady acceleration $a$ is
        $p(t - d) + \tfrac12 a s^2$, where $d$ and $s^2$ are mean and variance of the times of its
        impulses. So the target is led by $d$, and placed $\tfrac12 a s^2$ before.
        """
        assert self._target is not None
        if shaper is None:
            return self._target.at(self._time + dt)
        foreseen = dt + shaper.delay
        target = self._target.at(self._time + foreseen, foreseen)
        (x, y, z), _, (ax, ay, az), _ = target
        half = 0.5 * shaper.variance
        return target._replace(position=(x - half * ax, y - half * ay, z - half * az))

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""
        self._time += dt

    def distance(self, heights: Vector3) -> float:
        """Return how far the platform at slider ``heights`` [m] is from the target now [m]."""
        if self._target is None:
            return math.nan
        return math.dist(self._target.at(self._time).position, self._machine.forward(heights))

    def _with_step(
        self, held: HeldMotion, step: TrackedStep | None, limits: DriveLimits
    ) -> HeldMotion | None:
        if step is not None:
            return replace(
                held, plan=step, role=PlanRole.LEADS_TO_GOAL, limits=limits, pending=None
            )
        if self._target is not None:
            try:
                self._workspace.check_position(self._target.at(self._time).position)
            except KinematicsError:
                # When it comes back, it is caught up with as soon as possible.
                self._target.lose()
        return None
