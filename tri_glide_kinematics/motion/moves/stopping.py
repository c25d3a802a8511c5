"""How a motion comes to rest: of the stops that can be verified, the soonest.

The sliders' own stop, each slider as soon as it can, is the shortest of all, but on it the platform
leaves its line. So a motion along a line or a path brakes on it, unless that takes much longer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from math import inf
from typing import NamedTuple

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import SliderLimits, SliderState
from tri_glide_kinematics.motion.moves.line_moves import LinearMotion
from tri_glide_kinematics.motion.tracking import (
    SliderWay,
    braking_alone,
    braking_together,
    first_certified,
    to_zero,
)
from tri_glide_kinematics.motion.trajectory import CubicPlan, Phases, Trajectory, total_duration
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import SAMPLES_IN_PIECE, Workspace

# On a line or a path a stop may take this many times the sliders' own stop.
LONGEST_ON_LINE = 1.5

# The braking of a tracked step keeps its direction only nearly; so it may take this many times.
LONGEST_TRACKED = 1.4

# A held plan that ends within this many times the soonest stop is the stop.
NEARLY = 1.05

# Braking along a line: the part of acceleration and jerk that is used, and what of it leads onto
# the line where the platform is beside it. The last is for what no other braking is found for.
LINE_BRAKINGS = ((1.0, 0.1), (0.9, 0.3))
GENTLE_LINE_BRAKING = (0.9, 0.5)

# A braking along a line that is not found in so many pieces is not waited for, or in as many more
# for each added bound: the sliders' own stop is at hand.
ALONG_PIECES = 5

# A stop may be traced at this many places; more would take too long for a control cycle.
STOP_SAMPLES = 140

# Parts of what added bounds leave, for where that is little, as beside a weight: a gentle stop uses
# the first that is proved when it begins. On its way to rest it may use a little more.
GENTLE_PARTS = (0.9, 0.6, 0.3)

# A gentle stop divides accelerations among the sliders as their velocities are; each has this part
# of the largest at least.
LEAST_SHARE = 1e-3

# Makes a trajectory, or raises a KinematicsError.
Candidate = Callable[[], Interruptible[Trajectory]]

# Makes a braking along a line or a path that takes a time at most [s].
Along = Callable[[float], Interruptible[Trajectory]]


class OwnStop(NamedTuple):
    """The stop of each slider by itself, not verified.

    Attributes:
        ways: phases of each slider.
        duration: until the last of them rests [s].
    """

    ways: list[Phases]
    duration: float


def own_stop(state: SliderState, limits: SliderLimits) -> OwnStop:
    """Return the shortest stop of each slider by itself, from a ``state`` within ``limits``."""
    return _timed(braking_alone(_under_way(state), limits))


class Stopping:
    """Finds stops for one machine."""

    def __init__(self, lines: LinearMotion) -> None:
        """Brake along straight lines as ``lines`` does."""
        self._lines = lines

    def soonest(
        self,
        state: SliderState,
        own: OwnStop,
        limits: SliderLimits,
        region: Workspace,
        left: float,
        along: Along | None,
    ) -> Interruptible[Trajectory | None]:
        """Return the soonest stop that can be verified.

        Args:
            state: of the sliders, in motion.
            own: stop of the sliders from this state.
            limits: of the sliders.
            region: where the platform may be.
            left: time until the held plan rests, on its own line if it has one [s].
            along: brakes along the line or the path of the motion, None if it has none.

        Returns:
            The stop; None if the held plan is to be kept, as it rests as soon.

        Raises:
            KinematicsError: if none is found now that is sooner than the held plan.
        """
        longest = LONGEST_ON_LINE * own.duration
        pieces = ALONG_PIECES * (1 + len(limits.added))
        if along is not None and left <= longest:
            try:
                return (yield from _at_hand(along(left), pieces))
            except KinematicsError:
                yield
            return None

        def candidates() -> Iterator[Candidate]:
            if along is not None:
                yield lambda: _at_hand(along(longest), pieces)
            yield partial(self._certified, state, own, limits, region)
            if along is not None:
                yield partial(along, left)
            together = _timed(braking_together(_under_way(state), limits))
            if together.duration < left:
                yield partial(self._certified, state, together, limits, region)
            if along is None:
                yield partial(self.along_line, state, limits, region, left)

        return (yield from first_found(candidates()))

    def gently(
        self, state: SliderState, limits: SliderLimits, region: Workspace, longest: float
    ) -> Interruptible[Trajectory]:
        """Return a stop of all sliders together, as hard as added bounds let it be.

        Accelerations with which the sliders get faster are taken back at once. The others are no
        larger than the bounds allow in this direction, which may be much less.

        Args:
            state: of the sliders, in motion.
            limits: of the sliders.
            region: where the platform may be.
            longest: time that it may take [s].

        Raises:
            PlanningError: if none is found that keeps all limits.
        """
        for part in GENTLE_PARTS:
            stop = _gentle_stop(state, limits, part)
            if stop is None or stop.duration >= longest:
                break
            try:
                return (yield from self._certified(state, stop, limits, region))
            except PlanningError:
                yield
        raise PlanningError("no gentle stop keeps all limits")

    def candidates(
        self, state: SliderState, limits: SliderLimits, region: Workspace
    ) -> Iterator[Candidate]:
        """Yield the makings of stops from which another motion may begin, the best first."""
        for braking in LINE_BRAKINGS:
            yield partial(self._on_line, state, limits, region, braking)
        yield lambda: self._certified(state, own_stop(state, limits), limits, region)
        yield partial(self._on_line, state, limits, region, GENTLE_LINE_BRAKING)

    def along_line(
        self, state: SliderState, limits: SliderLimits, region: Workspace, longest: float
    ) -> Interruptible[Trajectory]:
        """Return a stop along the direction in which the platform moves.

        Args:
            state: of the sliders, in motion.
            limits: of the sliders.
            region: where the platform may be.
            longest: time that it may take [s].

        Raises:
            KinematicsError: if none is found that keeps all limits.
        """
        return (
            yield from first_found(
                partial(self._on_line, state, limits, region, braking, longest)
                for braking in LINE_BRAKINGS
            )
        )

    def _on_line(
        self,
        state: SliderState,
        limits: SliderLimits,
        region: Workspace,
        braking: tuple[float, float],
        longest: float = inf,
    ) -> Interruptible[Trajectory]:
        plan = yield from self._lines.brake(state, limits, *braking, longest)
        return (yield from inside(plan, region, limits))

    def _certified(
        self, state: SliderState, stop: OwnStop, limits: SliderLimits, region: Workspace
    ) -> Interruptible[Trajectory]:
        """Return a ``stop`` of the sliders as a plan.

        Raises:
            PlanningError: if it cannot be shown to keep all limits.
        """
        certified = yield from first_certified(
            region, state, (stop.ways,), limits, STOP_SAMPLES, SAMPLES_IN_PIECE
        )
        if certified is None:
            raise PlanningError("the sliders' stop leads out of the limits")
        return CubicPlan(state, certified.ways)


def inside(plan: Trajectory, region: Workspace, limits: SliderLimits) -> Interruptible[Trajectory]:
    """Return a ``plan`` that stays inside the ``region``; see ``Trajectory.check_inside``."""
    yield from plan.checking_inside(region, limits)
    return plan


def first_found(candidates: Iterable[Candidate]) -> Interruptible[Trajectory]:
    """Return the first of some ``candidates`` that can be made.

    Raises:
        KinematicsError: that of the last candidate.
    """
    refusal: KinematicsError | None = None
    for candidate in candidates:
        try:
            return (yield from candidate())
        except KinematicsError as error:
            refusal = error
        yield
    assert refusal is not None
    raise refusal


def _at_hand(making: Interruptible[Trajectory], pieces: int) -> Interruptible[Trajectory]:
    """Return what a ``making`` comes to, unless that takes more ``pieces``.

    Raises:
        PlanningError: if it does.
        KinematicsError: if there is none.
    """
    for _ in range(pieces):
        try:
            next(making)
        except StopIteration as end:
            plan: Trajectory = end.value
            return plan
        yield
    raise PlanningError("the braking along the line takes too long to find")


def _gentle_stop(state: SliderState, limits: SliderLimits, part: float) -> OwnStop | None:
    """Return a stop that uses a ``part`` of what added bounds leave now; None if that is nothing.

    What a bound uses grows with the accelerations no faster than on a straight line, from what the
    velocities use: so a part of it is not exceeded.
    """
    shares, present = _shares(state.velocities), _shares(state.accelerations)
    hardest = min(most / share for most, share in zip(limits.acceleration, shares))
    # The present accelerations are taken back together, too.
    parts = [max(pair) for pair in zip(shares, present)]
    sharpest = min(jerk / share for jerk, share in zip(limits.jerk, parts))
    left = 1.0
    for bound in limits.added:
        if bound.order == 1:
            # It leaves accelerations alone.
            continue
        steady, braking = (
            bound.part_at(state._replace(accelerations=_against(state, level * hardest, shares)))
            for level in (0.0, 1.0)
        )
        if not (steady < part and braking < inf):
            return None
        if braking > part:
            left = min(left, (part - steady) / (braking - steady))
    ways: list[Phases] = []
    for velocity, acceleration, share, jerk_share in zip(*state[1:], shares, parts):
        most, jerk = left * hardest * share, sharpest * jerk_share
        ways.append(to_zero(velocity, acceleration, -most, most, jerk))
    return _timed(ways)


def _shares(values: Vector3) -> list[float]:
    """Return the sizes of ``values`` as parts of the largest; all of it where they are zero."""
    largest = max(map(abs, values))
    if largest == 0.0:
        return [1.0, 1.0, 1.0]
    return [max(abs(value) / largest, LEAST_SHARE) for value in values]


def _against(state: SliderState, level: float, shares: list[float]) -> Vector3:
    """Return accelerations of a ``level`` against the velocities, each slider with its share."""
    one, two, three = (
        -level * share if velocity > 0.0 else level * share
        for velocity, share in zip(state.velocities, shares)
    )
    return one, two, three


def _under_way(state: SliderState) -> list[SliderWay]:
    return [SliderWay((), 0.0, *each) for each in zip(state.velocities, state.accelerations)]


def _timed(ways: list[Phases]) -> OwnStop:
    return OwnStop(ways, max(total_duration(phases) for phases in ways))
