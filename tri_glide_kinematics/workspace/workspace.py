"""The workspace of a tri-glide: what is inside, and whether a whole path is.

A place is inside if a set of limits holds (``WorkspaceLimits``). Along a straight line of the
platform, travel, reach, box and cylinder are solved for, and the condition number is traced; along
any other path all limits are traced (``tracing.py`` states the tolerance that this leaves).
Each limit may be exceeded by a nanometre, for rounding.

A machine that is found outside must be able to come back: ``Workspace.widened_to`` returns the
workspace with each broken limit moved to where the machine is. In it, each path is valid that
makes none of them worse.

Whoever draws a workspace gets its edge as lines (``outline``). On some levels it is looked how far
the platform can go outwards from the middle. That makes a ring on each level; some of their places
are joined to meridians.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from math import atan2, cos, dist, hypot, inf, pi, sin

import numpy as np

from tri_glide_kinematics.checks import finite_vector, non_negative, positive
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text
from tri_glide_kinematics.workspace.limits import (
    ROUNDING,
    OutsideWorkspaceError,
    UndecidedWayError,
    WorkspaceBounds,
    WorkspaceLimit,
    WorkspaceLimits,
)
from tri_glide_kinematics.workspace.tracing import (
    SAMPLES_IN_PIECE,
    TOLERANCE,
    ConditionField,
    MovingSliders,
    Sample,
    Surroundings,
    path_probe,
    traced,
)


class Workspace:
    """Checks of places and paths against the limits of one machine.

    Every check raises an ``OutsideWorkspaceError`` that names the limit, the arm and the place, an
    ``UnreachableError`` or ``NoPoseError`` where the machine has no pose at all, or a
    ``NotFiniteError`` or ``WrongShapeError`` for what is not a place. All are a
    ``KinematicsError``.

    Attributes:
        machine: whose workspace it is.
        limits: from which it was made.
        bounds: what is checked, which may be wider than the limits.
    """

    __slots__ = ("_field", "bounds", "limits", "machine")

    def __init__(self, machine: TriGlide, limits: WorkspaceLimits) -> None:
        """Prepare the checks of ``machine`` against ``limits``.

        Raises:
            OutOfBoundsError: if the reach margin is as long as an arm, so that no place is left.
        """
        shortest = min(machine.geometry.arm_lengths)
        if not limits.reach_margin < shortest:
            bound = f"less than the shortest arm, {number_text(shortest)}"
            raise OutOfBoundsError("reach_margin", limits.reach_margin, bound, "m")
        self.machine = machine
        self.limits = limits
        self._use(WorkspaceBounds.from_limits(machine.geometry, limits))

    def __eq__(self, other: object) -> bool:
        """Return whether the other workspace has the same machine and the same places inside."""
        if not isinstance(other, Workspace):
            return NotImplemented
        return (self.machine, self.bounds) == (other.machine, other.bounds)

    def __hash__(self) -> int:
        """Return the hash of machine and bounds."""
        return hash((self.machine, self.bounds))

    def __repr__(self) -> str:
        """Return the call that makes this workspace, and whether its bounds were widened."""
        as_made = WorkspaceBounds.from_limits(self.machine.geometry, self.limits)
        widened = "" if self.bounds == as_made else ".widened_to(...)"
        return f"Workspace({self.machine!r}, {self.limits!r}){widened}"

    def _use(self, bounds: WorkspaceBounds) -> None:
        self.bounds = bounds
        self._field = ConditionField(self.machine.geometry, bounds.condition)

    def widened_to(self, heights: Iterable[float]) -> Workspace:
        """Return a workspace that holds the place of the sliders, wherever it is.

        Limits that are broken there are moved to where they are just kept; all others stay. So
        from a place outside, a path is valid if it does not make matters worse. The widened
        workspace is meant for paths from this place: ask anew for the next one.

        Args:
            heights: of the carriages. Shape (3,) [m].

        Raises:
            NoPoseError: if no pose belongs to the heights.
        """
        place = _vector("heights", heights)
        position = self.machine.forward(place)
        condition = self.machine.condition_number(position)
        widened = Workspace(self.machine, self.limits)
        widened._use(self.bounds.widened_to(position, condition))
        return widened

    def check_position(self, position: Iterable[float]) -> Vector3:
        """Return the slider heights of a platform position, if it is inside.

        Args:
            position: x, y, z. Shape (3,) [m].

        Raises:
            KinematicsError: see the class.
        """
        place = _vector("position", position)
        for shape in self.bounds.shapes:
            shape.check(place)
        heights = self.machine.inverse(place)
        for end in self.bounds.travel:
            end.check(place)
        self._check_condition(place)
        return heights

    def check_heights(self, heights: Iterable[float]) -> Vector3:
        """Return the platform position of slider heights, if it is inside.

        Args:
            heights: of the carriages. Shape (3,) [m].

        Raises:
            KinematicsError: see the class.
        """
        position = self.machine.forward(_vector("heights", heights))
        for bound in (*self.bounds.travel, *self.bounds.shapes):
            bound.check(position)
        self._check_condition(position)
        return position

    def check_segment(self, start: Iterable[float], end: Iterable[float]) -> None:
        """Check the straight line of the platform between two positions.

        Args:
            start: Shape (3,) [m].
            end: Shape (3,) [m].

        Raises:
            KinematicsError: see the class; about the first place of the line that is outside.
        """
        at_once(self.segment_check(start, end))

    def exit_distance(
        self, start: Iterable[float], direction: Iterable[float], maximum: float
    ) -> float:
        """Return how far a straight line of the platform stays inside.

        Args:
            start: where it begins. Shape (3,) [m].
            direction: any vector but zero; its length does not matter. Shape (3,).
            maximum: distance that is of interest [m].

        Returns:
            At most ``maximum`` and at most the distance to the edge, short of it by no more than
            about ``TOLERANCE``; 0 if ``start`` is outside [m].

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            WrongShapeError: if a vector has not three numbers.
            OutOfBoundsError: if ``direction`` is zero or ``maximum`` negative.
        """
        return at_once(self.exit_search(start, direction, maximum))

    def check_path(
        self,
        state: Callable[[float], MovingSliders],
        duration: float,
        acceleration_bound: float,
    ) -> None:
        """Check a motion of the sliders as a whole.

        Args:
            state: returns heights and velocities of the sliders at an instant from 0 to
                ``duration`` [s]: a ``SliderMotionState``, or a setpoint of the engine.
            duration: of the motion [s].
            acceleration_bound: largest Euclidean norm of the three slider accelerations [m/s^2].

        Raises:
            KinematicsError: see the class; about the first place of the path that is outside.
        """
        at_once(self.path_check(state, duration, acceleration_bound))

    def segment_check(self, start: Iterable[float], end: Iterable[float]) -> Interruptible[None]:
        """Do what ``check_segment`` does, interruptibly."""
        first, last = _vector("start", start), _vector("end", end)
        self.check_position(first)
        yield from self.way_check(first, last)

    def way_check(self, first: Vector3, last: Vector3) -> Interruptible[None]:
        """Do the same for a line from a place that is known to be inside.

        Args:
            first: inside. Shape (3,) [m].
            last: Shape (3,) [m].
        """
        length = dist(first, last)
        if length == 0.0:
            return
        direction = (
            (last[0] - first[0]) / length,
            (last[1] - first[1]) / length,
            (last[2] - first[2]) / length,
        )
        bound, leaves = self.bounds.first_exit(first, direction)
        outside = yield from self._line_traced(first, direction, min(length, leaves.distance))
        if outside:
            self._refuse(_along(first, direction, outside[1]))
        if leaves.distance < length:
            worst = bound.value(_along(first, direction, min(length, leaves.worst)))
            raise bound.error(_along(first, direction, leaves.distance), worst)

    def exit_search(
        self, start: Iterable[float], direction: Iterable[float], maximum: float
    ) -> Interruptible[float]:
        """Return what ``exit_distance`` does, interruptibly."""
        first = _vector("start", start)
        way = _vector("direction", direction)
        length = non_negative("maximum", maximum, "m")
        size = positive("length of direction", hypot(*way))
        unit = (way[0] / size, way[1] / size, way[2] / size)
        try:
            self.check_position(first)
        except KinematicsError:
            return 0.0
        length = min(length, self.bounds.first_exit(first, unit)[1].distance)
        outside = yield from self._line_traced(first, unit, length)
        if outside is None:
            return length
        inside, edge = outside
        # The tracing is as fine as its tolerance across, for which a steep line goes far. Where
        # it gave up, more is left, of which nothing is known.
        if (edge - inside) * hypot(unit[0], unit[1]) <= TOLERANCE:
            while edge - inside > TOLERANCE:
                middle = 0.5 * (inside + edge)
                x, y, _ = _along(first, unit, middle)
                if self._field.around(x, y) is None:
                    edge = middle
                else:
                    inside = middle
        return inside

    def path_check(
        self,
        state: Callable[[float], MovingSliders],
        duration: float,
        acceleration_bound: float,
    ) -> Interruptible[None]:
        """Do what ``check_path`` does, interruptibly."""
        probe = path_probe(self.machine.forward, self.bounds, self._field, state)
        outside = yield from traced(probe, duration, acceleration_bound)
        if outside:
            self._refuse(self.check_heights(state(outside[1]).heights))

    def path_proof(
        self,
        state: Callable[[float], MovingSliders],
        duration: float,
        acceleration_bound: float,
        samples: int,
        in_piece: int = SAMPLES_IN_PIECE,
    ) -> Interruptible[bool]:
        """Return whether ``check_path`` accepts a motion with so few ``samples``, interruptibly.

        Between two breaks ``in_piece`` of them are looked at.
        """
        probe = path_probe(self.machine.forward, self.bounds, self._field, state)
        return (yield from traced(probe, duration, acceleration_bound, samples, in_piece)) is None

    def free_way(self, heights: Vector3) -> float:
        """Return how far the sliders may go from some heights, on any path, and stay inside.

        Seen are all limits but the ends of slider travel. Along a straight line of the sliders
        the platform moves at most their way divided by the least singular value around, and so
        leaves neither the ball in which the condition number is kept nor the convex shapes.

        Returns:
            Largest Euclidean distance from the heights; less than 0 if the place is outside [m].
        """
        try:
            position = self.machine.forward(heights)
        except KinematicsError:
            return -inf
        around = self._field.around(position[0], position[1])
        slack = self.bounds.slack(position)
        if around is None or not slack >= -ROUNDING:
            return -inf
        return max(min(around.radius, slack), 0.0) * around.singular_value

    def _line_traced(
        self, start: Vector3, direction: Vector3, length: float
    ) -> Interruptible[tuple[float, float] | None]:
        """Return where a line of the platform breaks the condition number, as ``traced`` does."""
        speed = hypot(direction[0], direction[1])

        def probe(distance: float) -> Sample:
            x, y, _ = _along(start, direction, distance)
            around = self._field.around(x, y)
            if around is None:
                return Sample(distance, False)
            # The platform itself moves along the line, so no gain lies between.
            return Sample(distance, True, Surroundings(around.radius, 1.0, around.slope), speed)

        return traced(probe, length, 0.0)

    def _check_condition(self, position: Vector3) -> None:
        """Raise an error if the condition number is too large."""
        condition = self.machine.condition_number(position)
        if not condition <= self.bounds.condition * (1.0 + 2.0 * ROUNDING):
            limit, bound = WorkspaceLimit.CONDITION, self.bounds.condition
            raise OutsideWorkspaceError(limit, None, position, condition, bound)

    def _refuse(self, position: Vector3) -> None:
        """Raise the error for a place where tracing found the outside, or gave up."""
        self.check_position(position)
        raise UndecidedWayError(position)


def _vector(name: str, values: Iterable[float]) -> Vector3:
    x, y, z = finite_vector(name, values, 3)
    return x, y, z


def _along(start: Vector3, direction: Vector3, distance: float) -> Vector3:
    return (
        start[0] + distance * direction[0],
        start[1] + distance * direction[1],
        start[2] + distance * direction[2],
    )


# Rings of the outline, directions in each, and lines from ring to ring: enough to look smooth.
LEVELS = 9
DIRECTIONS = 48
MERIDIANS = 12

# Number of heights, from bottom to top, at which a place inside is looked for if the middle is not.
PLACES = 65

# No workspace is wider or taller [m].
FARTHEST = 1000.0

UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)


def outline(workspace: Workspace) -> Interruptible[FloatArray]:
    """Return the edge of a ``workspace`` as lines between two points each, interruptibly.

    Seen from the middle, the edge is where the platform leaves the workspace for the first time.

    Returns:
        Both ends of all lines, one after the other. Shape (2 n, 3) [m]; no line if there is no
        place inside.
    """
    rings = yield from edge_rings(workspace)
    if not len(rings):
        return np.empty((0, 3))
    lines = [np.stack((ring, np.roll(ring, -1, axis=0)), axis=1) for ring in rings]
    some = np.linspace(0, rings.shape[1], MERIDIANS, endpoint=False).astype(int)
    lines += [np.stack((lower[some], upper[some]), axis=1) for lower, upper in pairwise(rings)]
    return np.concatenate(lines).reshape(-1, 3)


def edge_rings(workspace: Workspace) -> Interruptible[FloatArray]:
    """Return the edge of a ``workspace`` as rings, the lowest first, interruptibly.

    Returns:
        Shape (levels, n, 3) [m]; no ring if there is no place inside.
    """
    middle = yield from _middle(workspace)
    if middle is None:
        return np.empty((0, 0, 3))
    x, y, z = middle
    bottom = z - workspace.exit_distance(middle, DOWN, FARTHEST)
    top = z + workspace.exit_distance(middle, UP, FARTHEST)
    # The ends themselves are no place to start from, for rounding.
    half = max(0.5 * (top - bottom) - TOLERANCE, 0.0)
    directions = _directions(workspace, x, y)
    rings = []
    # Denser near the ends, where the edge is bent most.
    for level in 0.5 * (bottom + top) - half * np.cos(np.linspace(0.0, pi, LEVELS)):
        start = (x, y, float(level))
        ring = []
        for angle in directions:
            direction = (cos(angle), sin(angle), 0.0)
            distance = workspace.exit_distance(start, direction, FARTHEST)
            ring.append(np.array(start) + distance * np.array(direction))
            yield
        rings.append(np.array(ring))
    return np.array(rings)


def _directions(workspace: Workspace, x: float, y: float) -> list[float]:
    """Return the directions to look in, those of the corners of a box among them [rad]."""
    angles = np.linspace(-pi, pi, DIRECTIONS, endpoint=False).tolist()
    lower, upper = workspace.limits.box_lower, workspace.limits.box_upper
    if lower and upper:
        angles += [atan2(v - y, u - x) for u in (lower[0], upper[0]) for v in (lower[1], upper[1])]
    return sorted(angles)


def _middle(workspace: Workspace) -> Interruptible[Vector3 | None]:
    """Return a place inside, in the middle as far as possible; None if none is found."""
    limits, geometry = workspace.limits, workspace.machine.geometry
    lower, upper, cylinder = limits.box_lower, limits.box_upper, limits.cylinder
    axes = [np.mean(geometry.anchors, axis=0).tolist()]
    bottom, top = workspace.bounds.level_ends
    lowest = max(min(limits.lower_heights) - max(geometry.arm_lengths), bottom)
    highest = min(max(limits.upper_heights), top)
    if lower and upper:
        axes.insert(0, np.mean((lower[:2], upper[:2]), axis=0).tolist())
    if cylinder:
        axes.insert(0, [cylinder.center_x, cylinder.center_y])
    for x, y in axes:
        inside = []
        for z in np.linspace(lowest, highest, PLACES).tolist():
            yield
            try:
                workspace.check_position((x, y, z))
            except KinematicsError:
                continue
            inside.append(z)
        if inside:
            return x, y, inside[len(inside) // 2]
    return None
