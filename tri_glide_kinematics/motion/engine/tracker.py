"""Tracks a velocity or a moving target, by one certified step after the other.

Each step is held with the braking behind it, so at every instant there is a verified way to rest.
Where no step can be certified the held braking goes on, and the next step is tried in the next
cycle. Nothing is planned ahead, so a new velocity or position of the target costs no more than any
other cycle.
"""

from __future__ import annotations

import math
from dataclasses import replace

from tri_glide_kinematics.motion.engine.commands import Track
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, PlanRole
from tri_glide_kinematics.motion.tracking import (
    Follower,
    MovingTarget,
    TargetMotion,
)
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace


class Tracker:
    """Makes the next step towards a jog or a target; keeps how the target has moved."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for the machine of ``workspace``."""
        self._follower = Follower(workspace)
        self._machine = workspace.machine
        self._target: TargetMotion | None = None
        self._time = 0.0

    def report(self, target: Track, *, begins: bool) -> None:
        """Take in how the ``target`` moves; ``begins`` if no other one was tracked before."""
        moving = MovingTarget(target.position, target.velocity)
        if begins or self._target is None:
            self._time = 0.0
            self._target = TargetMotion(moving, -target.age)
        else:
            self._target.report(moving, self._time - target.age)

    def next(self, held: HeldMotion, time: float, dt: float) -> HeldMotion | None:
        """Return what is held for a step of ``dt`` [s], from ``time`` [s] in the held plan on.

        Limits that are pending are in force with it. None if no such step is certified.
        """
        limits = held.pending or held.limits
        assert held.goal is not None
        if limits.shaper is not held.limits.shaper and time < held.rests_at:
            # A shaper has to be empty when another one takes its place.
            return None
        wanted = held.goal.wanted(self, limits, dt)
        step = self._follower.step(held.plan.at(time), wanted, limits.effective, dt)
        if step is None:
            return None
        return replace(held, plan=step, role=PlanRole.LEADS_TO_GOAL, limits=limits, pending=None)

    def target_after(self, dt: float) -> MovingTarget:
        """Return where the target will be in ``dt`` seconds, and how it will move."""
        assert self._target is not None
        return self._target.at(self._time + dt)

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""
        self._time += dt

    def distance(self, heights: Vector3) -> float:
        """Return how far the platform at slider ``heights`` [m] is from the target now [m]."""
        if self._target is None:
            return math.nan
        return math.dist(self._target.at(self._time).position, self._machine.forward(heights))
