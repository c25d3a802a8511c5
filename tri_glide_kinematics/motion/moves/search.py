"""Search for a plan: candidates are made one after the other until one passes verification.

A candidate that fails is dropped. If all fail, the error of the last one says why: it takes the
most time, so it is refused for nothing that more time would help.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from enum import Enum
from functools import partial

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import SliderLimitError
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves.line_entry import LineToEdge, LineToPosition
from tri_glide_kinematics.motion.moves.line_moves import LinearMotion, LineJoining
from tri_glide_kinematics.motion.moves.stopping import Candidate, Stopping, first_found, inside
from tri_glide_kinematics.motion.trajectory import (
    CubicPlan,
    LinePlan,
    RuckigPlanner,
    SequencePlan,
    StraightLine,
    StraightPlan,
    Trajectory,
    UsableParts,
    checked,
    gentler,
    kept,
    total_duration,
)
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import OutsideWorkspaceError, Workspace

# Fraction of acceleration and jerk that blends use at most; the line has what is left.
JOG_BLEND_FRACTIONS = (0.3, 0.6)
JOG_BLEND_FRACTION_FROM_REST = 0.1

# Targets closer than this are reached [m].
REACHED = 1e-9

# Makes a motion from rest in a state, inside a region.
Onward = Callable[[SliderState, Workspace], Interruptible[Trajectory]]


class MotionKind(Enum):
    """How the platform goes to a target."""

    SLIDER = "slider"
    LINEAR = "linear"


class SliderMotion:
    """Makes plans in slider space: sliders arrive together, and the path of the platform bends.

    Ruckig gives the jerks. They are integrated, and every plan is compared with the limits.
    """

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(3)
        self._leader = RuckigPlanner(1)

    def move(
        self, state: SliderState, heights: Vector3, limits: SliderLimits
    ) -> Interruptible[CubicPlan]:
        """Return the plan from ``state`` to rest at ``heights`` [m].

        From rest the sliders keep the ratio of their ways, so that the path is a straight line
        in slider space, whatever the limits; otherwise they only arrive at the same time.

        Raises:
            PlanningError: if there is none.
            SliderLimitError: if it breaks a limit, because the state already leads to that.
            AddedBoundError: if it breaks an added bound.
        """
        if state.velocities == AT_REST and state.accelerations == AT_REST:
            plan = yield from self._from_rest(state, heights, limits)
            try:
                plan.check_sliders(limits)
            except SliderLimitError as error:
                # By ruckig's rounding.
                plan = yield from self._from_rest(state, heights, limits, error.slowdown)
                plan.check_sliders(limits)
            return plan
        bounds = (limits.velocity, limits.acceleration, limits.jerk)
        plan = CubicPlan(state, self._ruckig.to_rest_at(heights, *state, bounds))
        return (yield from checked(plan, limits))

    def _from_rest(
        self, state: SliderState, heights: Vector3, limits: SliderLimits, slowdown: float = 1.0
    ) -> Interruptible[CubicPlan]:
        """Return the fastest plan along the straight line in slider space to ``heights`` [m].

        It takes ``slowdown`` times as long.

        It keeps the added bounds; whether the sliders keep theirs is for the caller to check.

        The slider with the longest way leads, under limits with which all keep theirs. (Ruckig can
        be asked to synchronize the phases itself. If the limits of the sliders differ it often does
        not, without an error, and the path bends.)

        Raises:
            PlanningError: if there is none.
        """
        w1, w2, w3 = (end - start for start, end in zip(state.heights, heights))
        longest = max(w1, w2, w3, key=abs)
        if longest == 0.0:
            return CubicPlan(state, ((), (), ()))
        ratios = (w1 / longest, w2 / longest, w3 / longest)
        velocity, acceleration, jerk = (
            min(bound / abs(ratio) for bound, ratio in zip(bounds, ratios) if ratio)
            for bounds in (limits.velocity, limits.acceleration, limits.jerk)
        )

        def plan(usable: UsableParts) -> tuple[StraightPlan, float]:
            """Return the plan with parts of the limits, and when it is fastest [s]."""
            upwards, downwards = usable.rising * acceleration, usable.braking * acceleration
            if longest < 0.0:
                upwards, downwards = downwards, upwards
            others = [downwards] if limits.added else None
            bounds = [usable.velocity * velocity], [upwards], [jerk]
            (phases,) = self._leader.to_rest_at(
                [longest], [0.0], [0.0], [0.0], bounds, downwards=others
            )
            slower = slowdown * usable.slower
            phases = [(slower * duration, each / slower**3) for duration, each in phases]
            # Four phases of seven come after that.
            fastest = total_duration(phases[:-4])
            return StraightPlan(state.heights, ratios, phases), fastest

        return (yield from kept(plan, limits))


class MotionPlanner:
    """Finds verified plans for one machine.

    Attributes:
        stopping: finds stops.
    """

    def __init__(self, workspace: Workspace, kind: MotionKind) -> None:
        """Prepare for moves of a ``kind`` inside ``workspace``."""
        self._machine = workspace.machine
        self._geometry = workspace.machine.geometry
        self._workspace = workspace
        self._kind = kind
        self._sliders = SliderMotion()
        self._lines = LinearMotion(workspace.machine)
        self._joining = LineJoining(workspace.machine)
        self.stopping = Stopping(self._lines)

    def move(
        self,
        state: SliderState,
        position: Vector3,
        limits: SliderLimits,
        region: Workspace,
        moving: bool,
        held: SequencePlan | None = None,
    ) -> Interruptible[Trajectory]:
        """Return a plan to rest at a platform ``position`` [m].

        Args:
            state: of the sliders.
            position: inside the workspace.
            limits: of the sliders.
            region: where the platform may be on its way.
            moving: whether the sliders are in motion.
            held: plan that leads from ``state`` to rest, after which the move may begin.

        Raises:
            KinematicsError: if there is no way, with the reason.
        """
        if not moving:
            return (yield from self._move_from_rest(state, position, limits, region))
        onto = self._onto_line if self._kind is MotionKind.LINEAR else self._slider_move

        def ways(used: SliderLimits) -> Iterator[Candidate]:
            yield partial(onto, state, position, used, region)

        def onward(stopped: SliderState, region: Workspace) -> Interruptible[Trajectory]:
            return self._move_from_rest(stopped, position, limits, region)

        return (yield from self._in_motion(state, ways, onward, limits, region, held))

    def jog(
        self,
        state: SliderState,
        direction: Vector3,
        speed: float,
        limits: SliderLimits,
        region: Workspace,
        moving: bool,
    ) -> Interruptible[Trajectory]:
        """Return a plan along ``direction`` up to the edge of the workspace.

        Args:
            state: of the sliders.
            direction: of the platform, a unit vector.
            speed: of the platform at most [m/s].
            limits: of the sliders.
            region: where the platform may be on its way.
            moving: whether the sliders are in motion.

        Raises:
            KinematicsError: if there is no way, with the reason.
        """
        builder = LineToEdge(region, direction, speed)

        def onward(stopped: SliderState, region: Workspace) -> Interruptible[Trajectory]:
            return self.jog(stopped, direction, speed, limits, region, moving=False)

        def ways(used: SliderLimits) -> Iterator[Candidate]:
            for fraction in JOG_BLEND_FRACTIONS:
                jog = partial(self._lines.jog, state, builder, used, fraction, speed)
                yield partial(self._blended, jog, used, region)

        if moving:
            return (yield from self._in_motion(state, ways, onward, limits, region))
        from_rest = (
            partial(self._lines.jog, state, builder, used, JOG_BLEND_FRACTION_FROM_REST, speed)
            for used in gentler(limits, state)
        )
        return (yield from first_found(from_rest))

    def _in_motion(
        self,
        state: SliderState,
        ways: Callable[[SliderLimits], Iterator[Candidate]],
        onward: Onward,
        limits: SliderLimits,
        region: Workspace,
        held: SequencePlan | None = None,
    ) -> Interruptible[Trajectory]:
        """Return a plan that goes over to a motion without a stop, or that begins it after one.

        Args:
            state: of the sliders.
            ways: yields the makings without a stop, within some limits.
            onward: makes the motion from rest.
            limits: of the sliders.
            region: where the platform may be on its way.
            held: plan that leads from ``state`` to rest, after which the motion may begin.
        """
        gentle = list(gentler(limits, state))

        def candidates() -> Iterator[Candidate]:
            for used in gentle:
                yield from ways(used)
            for used in gentle:
                for braking in self.stopping.candidates(state, used, region):
                    yield partial(self._then, braking, onward)
            if held is not None:
                yield partial(self._after, held, onward)

        return (yield from first_found(candidates()))

    def region(self, state: SliderState, region_of_motion: Workspace | None = None) -> Workspace:
        """Return where the platform may be on a way that begins at ``state``.

        That is the workspace. If the sliders are outside it, the way back must not be worse than
        the place where it began: the region of the present motion stays, and a new motion gets a
        workspace that is widened to its start.

        Args:
            state: of the sliders.
            region_of_motion: region of the plan that is carried out, None at rest.
        """
        try:
            self._workspace.check_heights(state.heights)
        except OutsideWorkspaceError:
            return region_of_motion or self._workspace.widened_to(state.heights)
        return self._workspace

    def _move_from_rest(
        self, state: SliderState, position: Vector3, limits: SliderLimits, region: Workspace
    ) -> Interruptible[Trajectory]:
        """Return the plan of the kind of motion, which has no alternatives from rest."""
        if self._kind is MotionKind.SLIDER:
            return (yield from self._slider_move(state, position, limits, region))
        return (yield from self.line(state, position, limits, region))

    def line(
        self, state: SliderState, position: Vector3, limits: SliderLimits, region: Workspace
    ) -> Interruptible[Trajectory]:
        """Return a plan along a straight line, from rest to rest at a ``position`` [m].

        The arguments are those of ``move``.

        Raises:
            KinematicsError: if the line leaves the ``region``.
        """
        start = self._machine.forward(state.heights)
        if math.dist(start, position) < REACHED:
            return CubicPlan(state, ((), (), ()))
        yield from region.way_check(start, position)
        yield
        line = StraightLine.between(self._geometry, start, position)
        if limits.added:
            return (yield from self._lines.kept_from_rest(line, limits))
        return self._lines.from_rest(line, limits)

    def _then(self, braking: Candidate, onward: Onward) -> Interruptible[Trajectory]:
        """Return a braking and then the motion from where it rests."""
        return (yield from self._after((yield from braking()), onward))

    def _after(self, first: Trajectory, onward: Onward) -> Interruptible[Trajectory]:
        """Return the plan ``first`` and then the motion from where it rests."""
        stopped = first.at(first.duration)
        second = yield from onward(stopped, self.region(stopped))
        return SequencePlan((first, second))

    def _slider_move(
        self, state: SliderState, position: Vector3, limits: SliderLimits, region: Workspace
    ) -> Interruptible[Trajectory]:
        plan = yield from self._sliders.move(state, self._machine.inverse(position), limits)
        yield
        return (yield from inside(plan, region, limits))

    def _onto_line(
        self, state: SliderState, position: Vector3, limits: SliderLimits, region: Workspace
    ) -> Interruptible[Trajectory]:
        """Return the soonest plan that goes over to a line without a stop, and stays inside."""
        ways = yield from self._joining.ways(state, LineToPosition(region, position), limits)
        while True:
            soonest = partial(self._joining.soonest, ways)
            try:
                return (yield from self._blended(soonest, limits, region))
            except KinematicsError:
                if not ways:
                    raise
            yield

    def _blended(
        self,
        candidate: Callable[[], Interruptible[LinePlan]],
        limits: SliderLimits,
        region: Workspace,
    ) -> Interruptible[Trajectory]:
        """Return the plan of ``candidate`` if it stays inside the ``region``."""
        plan = yield from candidate()
        yield
        return (yield from inside(plan, region, limits))
