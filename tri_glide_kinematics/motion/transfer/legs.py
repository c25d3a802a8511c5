"""Legs of a transfer: from station to station, one after the other, and the plan that they make."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.errors import MotionError
from tri_glide_kinematics.motion.limits import AT_REST, SliderState
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import (
    CubicPlan,
    PathPlan,
    SequencePlan,
    Trajectory,
)
from tri_glide_kinematics.motion.transfer.carried import CarriedPlan
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3, plus

# Of two legs the end of one and the begin of the next differ by less [m, m/s, m/s^2], so shortly
# before the end [s].
SAME_STATE, SHORTLY = 1e-6, 1e-10


class TransferError(MotionError):
    """A transfer that cannot be planned, or go on."""

    refusal = Refusal.NO_PLAN


class Station(NamedTuple):
    """One place of a transfer.

    Attributes:
        position: where the platform is to be, as of the time that the transfer names. Shape (3,)
            [m].
        dwell: how long it stays there, and moves with the place [s].
        velocity: of the place. Shape (3,) [m/s].
        acceleration: of the place. Shape (3,) [m/s^2].
        outputs: what is told there, and how long after the arrival; earlier if negative [s].
    """

    position: Vector3
    dwell: float = 0.0
    velocity: Vector3 = AT_REST
    acceleration: Vector3 = AT_REST
    outputs: tuple[tuple[float, Any], ...] = ()

    @property
    def moves(self) -> bool:
        """Whether it is to be met in motion."""
        return any(self.velocity) or any(self.acceleration)

    @property
    def ride(self) -> float:
        """How long the platform moves with it: the dwell, if it moves [s]."""
        return self.dwell if self.moves else 0.0

    @property
    def rest(self) -> float:
        """How long the platform rests there: the dwell, if it does not move [s]."""
        return 0.0 if self.moves else self.dwell

    def after(self, time: float) -> MovingTarget:
        """Return where it is, and how it moves, some ``time`` later [s]."""
        target = MovingTarget(self.position, self.velocity, self.acceleration)
        return target.after(time)


class Leg(NamedTuple):
    """From one station to the next, and the dwell there; times are those of its base [s].

    Attributes:
        plan: what is driven.
        base: the motion in the frame.
        upright: from when on it is upright above the next one.
        arrival: at the next one.
        begin: of what is left of it.
        slope: how much higher the next station is for its way along x and y; None if not known.
        moves: whether the next station moves.
        ride: with the next station, which moves [s].
        spare: by how much the frame may sink until the platform is too low between the stations
            [m].
    """

    plan: Trajectory
    base: PathPlan
    upright: float
    arrival: float
    begin: float = 0.0
    slope: tuple[float, float] | None = None
    moves: bool = False
    ride: float = 0.0
    spare: float = math.inf

    @property
    def carried(self) -> CarriedPlan | None:
        """What is driven, if the frame moves."""
        return self.plan if isinstance(self.plan, CarriedPlan) else None

    def frame_at(self, time: float) -> MovingTarget:
        """Return how the frame moves at a ``time`` in the base [s]."""
        carried = self.carried
        if carried is None:
            return MovingTarget(AT_REST, AT_REST, AT_REST)
        return carried.carriage.at(time)

    @property
    def in_frame(self) -> Trajectory:
        """The motion in the frame."""
        carried = self.carried
        return self.plan if carried is None else carried.base

    @property
    def goal(self) -> Vector3:
        """Where it ends in the frame. Shape (3,) [m]."""
        return place_on(self.base, self.base.ends_at)

    def is_at(self, time: float) -> Vector3:
        """Return where its goal is at a ``time`` in the base [m]."""
        return plus(self.frame_at(time).position, self.goal)


class TransferPlan(SequencePlan):
    """Legs one after the other.

    Attributes:
        legs: the first is the present one.
        first: index of the station that the first leg leads to.
        wait: rest with which it begins [s].
        gives_up: why it leads to no station, but up from one; None if it leads to all.
        end: where the platform rests at last. Shape (3,) [m].
    """

    def __init__(
        self,
        legs: Sequence[Leg],
        first: int = 0,
        wait: float = 0.0,
        gives_up: KinematicsError | None = None,
    ) -> None:
        """Join the ``legs``, of which each was proved by itself.

        Raises:
            TransferError: if one does not begin as the one before ends.
        """
        super().__init__([leg.plan for leg in legs])
        for before, after in pairwise(legs):
            # At its end itself a leg rests.
            ends, begins = before.plan.at(before.plan.duration - SHORTLY), after.plan.at(0.0)
            apart = float(np.abs(np.subtract(ends, begins)).max())
            if not apart < SAME_STATE:
                text = f"legs do not join: {apart:.3g} m, m/s or m/s^2 apart"
                raise TransferError(f"{text}, at most {SAME_STATE:g}")
        self.legs, self.first = tuple(legs), first
        last = legs[-1].base.heights.geometry
        self.end = TriGlide(last).forward(self.at(self.duration).heights)
        self.wait, self.gives_up = wait, gives_up

    def arrival(self, station: int) -> float:
        """Return when it arrives at a ``station``, by its index [s]; negative if that is past."""
        index = station - self.first
        if index < 0:
            return -math.inf
        if index >= len(self.legs) or self.gives_up is not None:
            return math.inf
        before = sum(leg.plan.duration for leg in self.legs[:index])
        return before + self.legs[index].arrival - self.legs[index].begin

    def present(self, time: float) -> tuple[int, float]:
        """Return which of the legs is driven at a ``time`` [s], and the time in its base."""
        for index, leg in enumerate(self.legs):
            if time < leg.plan.duration or index == len(self.legs) - 1:
                break
            time -= leg.plan.duration
        return index, leg.begin + time


def stay(leg: Leg, dwell: float) -> Leg:
    """Return a rest of ``dwell`` seconds behind a ``leg``."""
    heights = leg.plan.at(leg.plan.duration).heights
    rest = CubicPlan(SliderState(heights, AT_REST, AT_REST), [[(dwell, 0.0)]] * 3)
    return Leg(rest, leg.base, 0.0, math.inf)


def place_on(base: PathPlan, place: float) -> Vector3:
    """Return where the path of a ``base`` is at a ``place`` on it [m]."""
    x, y, z, *_ = base.heights.driven.state(place)
    return x, y, z


def slope_of(station: Station) -> tuple[float, float] | None:
    """Return how much higher a ``station`` is for its way along x and y; None if upright."""
    x, y, z = station.velocity if any(station.velocity) else station.acceleration
    level = x * x + y * y
    if level == 0.0:
        return None if z else (0.0, 0.0)
    return z * x / level, z * y / level


def on_slope(
    place: MovingTarget, there: Vector3, slope: tuple[float, float] | None
) -> MovingTarget:
    """Return a ``place`` at the height that it has on a ``slope`` through another place [m]."""
    if slope is None:
        return place

    def level(x: float, y: float, z: float = 0.0) -> Vector3:
        return x, y, z + slope[0] * x + slope[1] * y

    z = there[2] - level(*there[:2])[2]
    return place._replace(
        position=level(*place.position[:2], z),
        velocity=level(*place.velocity[:2]),
        acceleration=level(*place.acceleration[:2]),
    )
