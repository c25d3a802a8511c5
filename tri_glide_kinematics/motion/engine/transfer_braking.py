"""Brakings of a transfer, which lead no deeper than it does: below its stations is no way."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion
from tri_glide_kinematics.motion.trajectory import Trajectory
from tri_glide_kinematics.motion.transfer import TransferError, TransferPlan, Ways, given_up
from tri_glide_kinematics.workspace import Workspace

# So often it is looked how deep a braking leads [s].
DEPTH_STEP = 0.0005


class TransferBraking:
    """Makes brakings of transfers."""

    def __init__(
        self,
        workspace: Workspace,
        anywhere: Callable[[HeldMotion, float, bool], Interruptible[HeldMotion]],
        slowed: Callable[[HeldMotion, float], Interruptible[Trajectory | None]],
    ) -> None:
        """Prepare for transfers inside a ``workspace``.

        Args:
            workspace: where the platform may be, and of which machine.
            anywhere: brakes from what is held and a time in it, on a line or not.
            slowed: slows down what is held on its own way, if that is proved.
        """
        self._workspace = workspace
        self._anywhere = anywhere
        self._slowed = slowed

    def braked(
        self, held: HeldMotion, plan: TransferPlan, time: float
    ) -> Interruptible[HeldMotion]:
        """Return ``held`` with a braking of its ``plan``.

        The sliders' own stops may lead below the station that it is at, or comes to. A transfer
        that is still the goal has to be given up, and goes up.

        Args:
            held: what is held, in motion.
            plan: of the transfer.
            time: when that begins [s].
        """
        is_stop = held.goal is None
        for stays in (True, False) if is_stop else ():
            braked = yield from self._anywhere(held, time, stays)
            if braked.brakes and self._goes_no_deeper(braked.plan, plan, time):
                return braked
            yield
        held = held.left_to_brake()
        slowed = (yield from self._slowed(held, time)) if is_stop else None
        if slowed is not None:
            return replace(held, plan=slowed)
        height = held.transfer.goal.height if held.transfer is not None else -math.inf
        reason = TransferError("new limits do not allow the transfer to go on")
        try:
            ways, limits = Ways(self._workspace, height, 0.0), held.limits.effective
            return replace(held, plan=(yield from given_up(ways, plan, time, limits, reason)))
        except KinematicsError:
            return held.waiting_to_brake()

    def _goes_no_deeper(self, braking: Trajectory, plan: TransferPlan, time: float) -> bool:
        """Return whether a ``braking`` stays above the stations, or what is left of a ``plan``."""
        if braking is plan:
            return True
        machine = self._workspace.machine
        times = np.arange(0.0, braking.duration + DEPTH_STEP, DEPTH_STEP)
        leg = plan.legs[plan.present(time)[0]].plan
        ends = (leg.platform_at(machine, each)[2] for each in (0.0, leg.duration))
        driven = machine.forward_batch(plan.sample(time + times).heights)[:, 2]
        places = machine.forward_batch(braking.sample(times).heights)[:, 2]
        return bool(places.min() >= min(driven.min(), max(ends)))
