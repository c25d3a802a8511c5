"""Plans transfers from where the present motion comes to rest, and what is left of them again."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine.commands import Transfer
from tri_glide_kinematics.motion.engine.held_motion import HeldMotion, HeldTransfer, PlanRole
from tri_glide_kinematics.motion.engine.replacing import LeadTime, PlanReplacing
from tri_glide_kinematics.motion.engine.replanning import Making, Replanned
from tri_glide_kinematics.motion.transfer import (
    Renewal,
    Station,
    TransferError,
    TransferPlanner,
    Ways,
    given_up,
)
from tri_glide_kinematics.workspace import Workspace

# At first it is expected that a plan, and that of what is left of it, take so long [s].
PLANNED_IN, RENEWED_IN = 0.15, 0.01

# Before the first step, it may be so long [s].
LONGEST_STEP = 0.004


class TransferProgress(NamedTuple):
    """How far a transfer is.

    Attributes:
        arrivals: when the platform is at each of the stations, from now on; negative if that is
            past, infinite if it does not get there [s].
        gives_up: why it does not get to all of them; None if it does.
    """

    arrivals: tuple[float, ...]
    gives_up: KinematicsError | None


class Transferring:
    """Plans transfers."""

    def __init__(self, plans: PlanReplacing, workspace: Workspace) -> None:
        """Plan what is asked for.

        Args:
            plans: lets the next plan take the place of the held one.
            workspace: where the platform may be, and of which machine.
        """
        self._plans = plans
        self._holder = plans.holder
        self._workspace = workspace
        self._lead_time, self._renewal_lead_time = LeadTime(), LeadTime()
        self._lead_time.note(PLANNED_IN)
        self._renewal_lead_time.note(RENEWED_IN)

    @property
    def progress(self) -> TransferProgress | None:
        """How far the transfer is that is carried out; None without one."""
        held = self._holder.motion
        transfer = held.transfer if held is not None else None
        if held is None or transfer is None:
            return None
        goal, plan = transfer
        past = self._holder.time - held.limits.held_back
        arrivals = (plan.arrival(station) - past for station in range(len(goal.stations)))
        return TransferProgress(tuple(arrivals), plan.gives_up)

    def prepare(self, goal: Transfer) -> None:
        """Make the plan of a ``goal`` that begins where the present motion comes to rest.

        Raises:
            NotStartedError: before the start.
            TransferError: if it does not come to rest by itself, or limits wait.
            KinematicsError: if there is no plan.
        """
        held, time = self._holder.held, self._holder.time
        if held.pending is not None:
            raise TransferError("new limits are not in force yet: ask again")
        goes_on = held.goal is not None and not held.goal.has_end
        if time < held.rests_at and (goes_on or math.isfinite(held.goes_on_at)):
            raise TransferError("a transfer begins at rest: stop the present motion first")
        making = partial(self._planned, goal, self._holder.elapsed)
        start = max(time, held.rests_at)
        proved = self._plans.shaped_plans.proved(making, goal)
        self._plans.tracks = False
        self._plans.begin(proved, goal, start, self._lead_time)

    def renew(self, station: int, motion: Station, age: float) -> bool:
        """Plan again what is left of a transfer, as a station moves otherwise.

        Args:
            station: its index.
            motion: how it moves.
            age: time from that of its position to the present setpoint [s].

        Returns:
            Whether that is begun: not while another plan is made, or the station is not the
            next, or did not move when the transfer was planned.
        """
        held, transfer = self._holder.held, self._holder.held.transfer
        if transfer is None or self._plans.preparation is not None or held.brakes:
            return False
        plan = transfer.plan
        index, _ = plan.present(self._holder.time)
        if plan.gives_up is not None or plan.first + index != station or not plan.legs[index].moves:
            return False
        seen = self._holder.elapsed - age
        return self._begin(partial(self._renewed, transfer, station, motion, seen))

    def give_up(self, reason: KinematicsError) -> bool:
        """Go up from where a transfer is, and rest; return whether that is begun.

        Args:
            reason: why.
        """
        held, transfer, time = self._holder.held, self._holder.held.transfer, self._holder.time
        if transfer is None or held.brakes or time >= held.rests_at:
            return False
        plan = transfer.plan
        index, _ = plan.present(time)
        if plan.gives_up is not None or plan.legs[index].carried is None:
            return False
        return self._begin(partial(self._given_up, transfer, reason))

    def _begin(self, making: Making) -> bool:
        """Begin ``making`` what is left of a transfer; return that."""
        start = self._holder.time + self._plans.lead(self._renewal_lead_time)
        proved = self._plans.shaped_plans.proved(making)
        self._plans.begin(proved, None, start, self._renewal_lead_time)
        return True

    def _given_up(
        self, transfer: HeldTransfer, reason: KinematicsError, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        ways, limits = self._ways(transfer.goal), held.limits.effective
        going_up = yield from given_up(ways, transfer.plan, start, limits, reason)
        return Replanned(replace(held, plan=going_up))

    def _begins(self, start: float) -> float:
        """Return when a plan begins for ``start`` in the held plan, by the time of the engine.

        One that is made anew, as it was late, begins before its first piece.
        """
        return self._holder.elapsed + (start - self._holder.time)

    def _planned(
        self, goal: Transfer, asked: float, held: HeldMotion, start: float
    ) -> Interruptible[Replanned]:
        """Make a plan for the stations of a ``goal``, ``asked`` for at a time of the engine [s]."""
        limits, begins = held.limits, self._begins(start)
        shaper, step = limits.shaper, self._plans.last_step or LONGEST_STEP
        wait = goal.stays - (begins - asked)
        ahead = start - self._holder.time
        if self._plans.in_pieces:
            wait = max(wait, self._lead_time.after(step) - ahead)
        if self._plans.in_pieces or ahead > 0.0:
            # The step in which it begins is known only then.
            wait = max(wait, 2.0 * step)
        stations = [
            station._replace(dwell=station.dwell + limits.held_back) for station in goal.stations
        ]
        delay = goal.lead + (shaper.delay if shaper is not None else 0.0)
        age = goal.age + begins - asked + delay
        here = self._workspace.machine.forward(held.plan.at(start).heights)
        planner = TransferPlanner(self._workspace, goal.height, goal.tolerance)
        plan = yield from planner.planned(
            here, stations, age, limits.effective, wait=max(wait, 0.0), lifts=goal.lifts
        )
        leads = PlanRole.LEADS_TO_GOAL
        return Replanned(HeldMotion(plan, goal, leads, self._workspace, limits))

    def _renewed(
        self,
        transfer: HeldTransfer,
        station: int,
        motion: Station,
        seen: float,
        held: HeldMotion,
        start: float,
    ) -> Interruptible[Replanned]:
        """Make what is left of a plan again; ``seen`` is by the time of the engine [s]."""
        (goal, plan), limits = transfer, held.limits
        if plan.first + plan.present(start)[0] != station:
            # It leads to the next one by then.
            return Replanned(held)
        delay = goal.lead + (limits.shaper.delay if limits.shaper is not None else 0.0)
        age = self._begins(start) - seen + delay
        renewal = Renewal(self._ways(goal), plan, start, limits.effective)
        motion = motion._replace(outputs=goal.stations[station].outputs)
        renewed = yield from renewal.to(motion, age, goal.allowed)
        return Replanned(held if renewed is None else replace(held, plan=renewed))

    def _ways(self, goal: Transfer) -> Ways:
        return Ways(self._workspace, goal.height, goal.tolerance)
