"""Verified plans: candidates are made one after the other until one is inside all limits.

What a plan has to pass: velocity, acceleration and jerk of each slider, slider travel, and the
workspace, on the whole way to rest. A candidate that fails is dropped; if all fail, the error of
the last one, which is the most patient, says why.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from enum import Enum
from functools import partial

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.aims import Aim, JogAim, TargetAim
from tri_glide_kinematics.motion.errors import SliderLimitError, SliderTravelError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.lines.line_plan import LinePlan
from tri_glide_kinematics.motion.lines.linear_motion import LinearMotion, check_line
from tri_glide_kinematics.motion.lines.straight_line import StraightLine
from tri_glide_kinematics.motion.plans import CubicPlan, Plan, SequencePlan, SliderState
from tri_glide_kinematics.motion.sliders.slider_motion import (
    SliderMotion,
    check_limits,
    height_extremes,
)
from tri_glide_kinematics.motion.sliders.straight_plan import StraightPlan
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace.errors import OutsideWorkspaceError
from tri_glide_kinematics.workspace.workspace import Workspace

# Part of acceleration and jerk that blends use at most; the motion along the line has the rest.
BLEND_SHARES = (0.3, 0.6)
FROM_REST_SHARE = 0.1

# Part of acceleration and jerk for braking along a line.
BRAKE_PARTS = (0.95, 0.75)
LEAST_BRAKE_PART = 0.5

# Targets closer than this are reached [m].
SAME_PLACE = 1e-9


# A slider may pass an end of its travel by this: rounding [m].
TRAVEL_ROUNDING = 1e-9

Candidate = Callable[[], Plan]


class MotionKind(Enum):
    """How the platform goes to a target."""

    SLIDER = "slider"
    LINEAR = "linear"


class MotionPlanner:
    """Finds verified plans for one machine."""

    def __init__(self, workspace: Workspace, kind: MotionKind) -> None:
        """Prepare for moves of a ``kind`` inside ``workspace``."""
        self._machine = workspace.machine
        self._geometry = workspace.machine.geometry
        self._workspace = workspace
        self._kind = kind
        self._sliders = SliderMotion()
        self._lines = LinearMotion(workspace.machine)

    def move(
        self,
        state: SliderState,
        position: Vector3,
        limits: SliderLimits,
        room: Workspace,
        moving: bool,
        held: SequencePlan | None = None,
    ) -> Plan:
        """Return a plan to rest at a platform ``position`` [m].

        Args:
            state: of the sliders.
            position: inside the workspace.
            limits: of the sliders.
            room: where the platform may be on its way.
            moving: whether the sliders are in motion.
            held: plan that leads from ``state`` to rest, after which the move may begin.

        Raises:
            KinematicsError: if there is no way, with the reason.
        """
        if not moving:
            return self._move_from_rest(state, position, limits, room)

        def candidates() -> Iterator[Candidate]:
            if self._kind is MotionKind.SLIDER:
                yield partial(self._slider_move, state, position, limits, room)
            else:
                aim = TargetAim(room, position)
                yield from self._line_moves(state, aim, limits, room)
            for braking in self._brakings(state, limits, room):
                yield partial(self._then_move, braking, position, limits)
            if held is not None:
                yield partial(self._then_move, lambda: held, position, limits)

        return _first(candidates())

    def jog(
        self,
        state: SliderState,
        direction: Vector3,
        speed: float,
        limits: SliderLimits,
        room: Workspace,
        moving: bool,
    ) -> Plan:
        """Return a plan along ``direction`` up to the edge of the workspace.

        Args:
            state: of the sliders.
            direction: of the platform, a unit vector.
            speed: of the platform at most [m/s].
            limits: of the sliders.
            room: where the platform may be on its way.
            moving: whether the sliders are in motion.

        Raises:
            KinematicsError: if there is no way, with the reason.
        """
        aim = JogAim(room, direction, speed)
        if not moving:
            return self._lines.jog(state, aim, limits, FROM_REST_SHARE, speed)

        def candidates() -> Iterator[Candidate]:
            for share in BLEND_SHARES:
                jog = partial(self._lines.jog, state, aim, limits, share, speed)
                yield partial(self._blended, jog, limits, room)
            for braking in self._brakings(state, limits, room):
                yield partial(self._then_jog, braking, direction, limits, speed)

        return _first(candidates())

    def stop(
        self, state: SliderState, limits: SliderLimits, room: Workspace, on_line: bool
    ) -> Plan:
        """Return a plan that comes to rest soon.

        Args:
            state: of the sliders, in motion.
            limits: of the sliders.
            room: where the platform may be on its way.
            on_line: whether the platform moves along a line, which then is not left.

        Raises:
            KinematicsError: if no braking keeps all limits now.
        """
        return _first(self._brakings(state, limits, room, on_line))

    def keeps(self, plan: Plan, limits: SliderLimits, since: float) -> bool:
        """Return whether what is left of ``plan`` at a time [s] is inside ``limits``."""
        try:
            if isinstance(plan, SequencePlan):
                return all(self.keeps(part, limits, past) for part, past in plan.parts(since))
            if isinstance(plan, LinePlan):
                check_line(plan, limits, since)
            elif isinstance(plan, CubicPlan):
                check_limits(plan, limits, since)
        except SliderLimitError:
            return False
        return True

    def room(self, state: SliderState, room_of_motion: Workspace | None = None) -> Workspace:
        """Return where the platform may be on a way that begins at ``state``.

        That is the workspace. If the sliders are outside it, the way back must not be worse than
        the place where it began: the room of the present motion stays, and a new motion gets a
        workspace that is widened to its start.

        Args:
            state: of the sliders.
            room_of_motion: room of the plan that is carried out, None at rest.
        """
        try:
            self._workspace.check_heights(state.heights)
        except OutsideWorkspaceError:
            return room_of_motion or self._workspace.widened_to(state.heights)
        return self._workspace

    def _move_from_rest(
        self, state: SliderState, position: Vector3, limits: SliderLimits, room: Workspace
    ) -> Plan:
        """Return the plan of the kind of motion, which has no alternatives from rest."""
        if self._kind is MotionKind.SLIDER:
            return self._slider_move(state, position, limits, room)
        start = self._machine.forward(state.heights)
        if math.dist(start, position) < SAME_PLACE:
            return CubicPlan(state, ((), (), ()))
        room.check_way(start, position)
        return self._lines.from_rest(StraightLine.between(self._geometry, start, position), limits)

    def _then_move(self, braking: Candidate, position: Vector3, limits: SliderLimits) -> Plan:
        """Return a braking and then the move from where it rests."""
        first = braking()
        rest = first.state(first.duration)
        second = self._move_from_rest(rest, position, limits, self.room(rest))
        return SequencePlan((first, second))

    def _then_jog(
        self, braking: Candidate, direction: Vector3, limits: SliderLimits, speed: float
    ) -> Plan:
        """Return a braking and then the jog from where it rests."""
        first = braking()
        rest = first.state(first.duration)
        return SequencePlan(
            (first, self.jog(rest, direction, speed, limits, self.room(rest), moving=False))
        )

    def _slider_move(
        self, state: SliderState, position: Vector3, limits: SliderLimits, room: Workspace
    ) -> Plan:
        plan = self._sliders.move(state, self._machine.inverse(position), limits)
        self._check_sliders(plan, room)
        return plan

    def _line_moves(
        self, state: SliderState, aim: Aim, limits: SliderLimits, room: Workspace
    ) -> Iterator[Candidate]:
        """Yield plans that go over to a line without a stop, the smoothest first."""
        small, large = (
            partial(self._lines.in_motion, state, aim, limits, share) for share in BLEND_SHARES
        )
        overlapping = partial(self._lines.delayed, state, aim, limits)
        for candidate in (small, overlapping, large):
            yield partial(self._blended, candidate, limits, room)

    def _blended(
        self, candidate: Callable[[], LinePlan], limits: SliderLimits, room: Workspace
    ) -> Plan:
        """Return the plan of ``candidate`` if its blend is inside the workspace."""
        plan = candidate()
        self._check_blend(plan, limits, room)
        return plan

    def _brakings(
        self, state: SliderState, limits: SliderLimits, room: Workspace, on_line: bool = True
    ) -> Iterator[Candidate]:
        """Yield plans that come to rest, along the line or with each slider by itself."""

        def along(part: float) -> Plan:
            plan = self._lines.brake(state, limits, part)
            room.check_segment(plan.line.start, plan.line.point(float(plan.law.ways[-1])))
            self._check_blend(plan, limits, room)
            return plan

        def apart() -> Plan:
            plan = self._sliders.brake(state, limits)
            self._check_sliders(plan, room)
            return plan

        if not on_line:
            yield apart
        for part in BRAKE_PARTS:
            yield partial(along, part)
        if on_line:
            yield apart
        yield partial(along, LEAST_BRAKE_PART)

    def _check_sliders(self, plan: CubicPlan, room: Workspace) -> None:
        """Check travel, by the exact extremes of the heights, and the platform's path."""
        lowest, highest = height_extremes(plan)
        self._check_travel(lowest, highest, plan)
        if isinstance(plan, StraightPlan):
            # Over the way there is no acceleration, whatever there is over time.
            room.check_path(plan.at, plan.length, 0.0)
        else:
            # Accelerations are largest where pieces begin.
            peaks = np.abs(plan.pieces[2]).max(axis=0, initial=0.0)
            room.check_path(plan.state, plan.duration, math.hypot(*peaks.tolist()))

    def _check_blend(self, plan: LinePlan, limits: SliderLimits, room: Workspace) -> None:
        """Check travel and path as long as the platform is beside the line of the plan."""
        if plan.blend is None:
            return
        duration = plan.blend.duration
        times = plan.law.times[: np.searchsorted(plan.law.times, duration) + 1]
        heights = plan.sample(times).heights
        # What a slider can move beyond both ends of a piece under its largest acceleration.
        bow = np.square(np.diff(times)).max() / 8.0 * np.array(limits.acceleration)
        self._check_travel(heights.min(axis=0) - bow, heights.max(axis=0) + bow, plan)
        room.check_path(plan.state, duration, math.hypot(*limits.acceleration))

    def _check_travel(self, lowest: FloatArray, highest: FloatArray, plan: Plan) -> None:
        """Raise an error if a slider leaves its travel, or goes on where it is outside already."""
        bounds = self._workspace.limits
        heights = plan.state(0.0).heights
        for i in range(3):
            lower = min(bounds.lower_heights[i], heights[i]) - TRAVEL_ROUNDING
            upper = max(bounds.upper_heights[i], heights[i]) + TRAVEL_ROUNDING
            if not lower <= lowest[i]:
                raise SliderTravelError(i, float(lowest[i]), bounds.lower_heights[i])
            if not highest[i] <= upper:
                raise SliderTravelError(i, float(highest[i]), bounds.upper_heights[i])


def _first(candidates: Iterable[Candidate]) -> Plan:
    """Return the first plan that can be made.

    Raises:
        KinematicsError: that of the last candidate.
    """
    refusal: KinematicsError | None = None
    for candidate in candidates:
        try:
            return candidate()
        except KinematicsError as error:
            refusal = error
    assert refusal is not None
    raise refusal
