"""Mechanisms of files, with numbers that a person may change: their positions and branches.

A four-bar linkage and an F-mechanism are shown in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tri_glide_kinematics.equal_numbers import first_largest, first_smallest
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms import CrankLimitError, MechanismFile, four_bar
from tri_glide_kinematics.mechanisms.f_mechanism import (
    EventKind,
    FMechanism,
    FMechanismTrace,
    as_points,
)
from tri_glide_kinematics.mechanisms.four_bar import DeadCentreKind, FourBar
from tri_glide_kinematics.mechanisms.pictures import (
    F_MECHANISM,
    FOUR_BAR,
    BranchCurve,
    bounds,
    default_branch,
    default_crank_angle,
    f_mechanism_points,
    four_bar_points,
)
from tri_glide_kinematics.vectors import FloatArray, Point
from tri_glide_kinematics.wording import number_text

# The picture of a mechanism, in its own plane and in metres, whatever draws it.


@dataclass(frozen=True, eq=False)
class Track:
    """Rows along a branch. A place on it is a number of rows from its start, parts included.

    Attributes:
        crank_angles: Shape (n,), n at least 2 [rad].
        keys: what tells positions at one crank angle from each other. Shape (n,).
        closed: whether the last row is the first one again.
    """

    crank_angles: FloatArray
    keys: FloatArray
    closed: bool

    @property
    def end(self) -> float:
        """The last place."""
        return float(self.crank_angles.size - 1)

    def crank_angle(self, place: float) -> float:
        """Return the crank angle at a place [rad]."""
        return self._between(self.crank_angles, place)

    def key(self, place: float) -> float:
        """Return the key at a place."""
        return self._between(self.keys, place)

    def place_of(self, crank_angle: float) -> float:
        """Return the first place at a crank angle [rad], whatever its full turns.

        If the branch never comes there, it is the nearest row.
        """
        offsets = np.remainder(self.crank_angles - crank_angle + math.pi, math.tau) - math.pi
        before, after = offsets[:-1], offsets[1:]
        # Opposite signs half a turn away from the angle are no passage.
        passes = (before * after <= 0.0) & (np.abs(before) + np.abs(after) < math.pi)
        rows = np.flatnonzero(passes)
        if not rows.size:
            return float(first_smallest(np.abs(offsets)))
        row = int(rows[0])
        way = abs(before[row]) + abs(after[row])
        return row + float(abs(before[row]) / way if way > 0.0 else 0.0)

    def turned(self, place: float, by: float) -> float | None:
        """Return the place where the crank is turned ``by`` an angle further, either way [rad].

        It is not past a point where the crank turns back: None if the crank does not come there.
        """
        for forward in (True, False):
            places, ways = self._until_turning(place, forward)
            if by * ways[-1] >= 0.0 and abs(by) <= abs(ways[-1]):
                found = float(np.interp(abs(by), np.abs(ways), places))
                return found % self.end if self.closed else found
        return None

    def advanced(self, place: float, way: float, forward: bool) -> tuple[float, bool]:
        """Go on along the track by a ``way`` of the crank, at least 0 [rad].

        It goes round and round, or back where it ends. Returns the new place, and whether it goes
        on forward, which is along the rows.
        """
        step = float(np.abs(np.diff(self.crank_angles)).max())
        rows = way / step if step > 0.0 else 0.0
        if self.closed:
            return (place + (rows if forward else -rows)) % self.end, forward
        # As if the way back lay behind the end.
        unfolded = ((place if forward else 2.0 * self.end - place) + rows) % (2.0 * self.end)
        return min(unfolded, 2.0 * self.end - unfolded), unfolded < self.end

    def _until_turning(self, place: float, forward: bool) -> tuple[FloatArray, FloatArray]:
        """Return the places up to where the crank turns back, and how far it has turned there.

        On a closed branch that is at most one round, and places go on beyond the ends. Both begin
        with the place itself. Shapes (n,), (n,) [rad].
        """
        period = self.crank_angles.size - 1
        first = math.floor(place) + 1 if forward else math.ceil(place) - 1
        if self.closed:
            rows = first + np.arange(period) if forward else first - np.arange(period)
            gain = self.crank_angles[-1] - self.crank_angles[0]
            angles = self.crank_angles[rows % period] + gain * (rows // period)
        else:
            rows = np.arange(first, period + 1) if forward else np.arange(first, -1, -1)
            angles = self.crank_angles[rows]
        places = np.concatenate([[place], rows])
        ways = np.concatenate([[0.0], angles - self.crank_angle(place)])
        steps = np.diff(ways)
        moves = np.flatnonzero(steps)
        if not moves.size:
            return places[:1], ways[:1]
        back = np.flatnonzero(steps * steps[moves[0]] < 0.0)
        end = int(back[0]) + 1 if back.size else ways.size
        return places[:end], ways[:end]

    def _between(self, column: FloatArray, place: float) -> float:
        return float(np.interp(place, np.arange(column.size), column))


@dataclass(frozen=True)
class Mark:
    """A place on a path where something happens.

    Attributes:
        place: [m].
        kind: what happens there, in words.
        crank_angle: at which it does [rad].
    """

    place: Point
    kind: str
    crank_angle: float

    @property
    def label(self) -> str:
        """The crank angle as it stands beside the mark."""
        return degrees_text(self.within_a_turn)

    @property
    def within_a_turn(self) -> float:
        """The crank angle without full turns [rad]."""
        return math.remainder(self.crank_angle, math.tau)


@dataclass(frozen=True, eq=False)
class Position:
    """One of the positions at a crank angle.

    Attributes:
        key: tells it from the others.
        points: of the skeleton. Shape (k, 2) [m].
        text: what it is, in words.
    """

    key: float
    points: FloatArray
    text: str


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch that is followed.

    Attributes:
        track: the way along it.
        points: of the skeleton along it. Shape (n, k, 2) [m].
        marks: limits, turning points and dead centres.
        text: what it is, in words.
    """

    track: Track
    points: FloatArray
    marks: tuple[Mark, ...]
    text: str

    @cached_property
    def extent(self) -> FloatArray:
        """Corners of a box around all points, which each drawing needs. (2, 2) [m]."""
        return bounds(self.points, margin=0.0)

    @property
    def events(self) -> str:
        """The events with their crank angles, in words."""
        marks = sorted(self.marks, key=lambda mark: mark.within_a_turn)
        kinds = dict.fromkeys(mark.kind for mark in self.marks)
        angles = {
            kind: dict.fromkeys(mark.label for mark in marks if mark.kind == kind) for kind in kinds
        }
        return " ".join(f"{kind} at {', '.join(angles[kind])}." for kind in kinds)


def degrees_text(angle: float) -> str:
    """Return an angle [rad] as a person reads it."""
    return f"{number_text(math.degrees(angle), 4, scale=1e3)}°"


SHORTEST, LONGEST = 0.2, 2.5  # part of a length in the file


@dataclass(frozen=True)
class Dimension:
    """One number.

    Attributes:
        label: of its slider, without the unit.
        value: in the file [m] or [rad].
        lowest: [m] or [rad].
        highest: [m] or [rad].
        is_angle: whether it is an angle.
    """

    label: str
    value: float
    lowest: float
    highest: float
    is_angle: bool = False

    @property
    def unit(self) -> str:
        """In which a person sees it."""
        return "deg" if self.is_angle else "mm"

    def shown(self, value: float) -> float:
        """Return what a person sees [deg] or [mm]."""
        return math.degrees(value) if self.is_angle else 1000.0 * value

    def read(self, shown: float) -> float:
        """Return what a person has chosen [rad] or [m]."""
        return math.radians(shown) if self.is_angle else shown / 1000.0


def length(label: str, value: float) -> Dimension:
    """Return a length that may shrink and grow [m]."""
    return Dimension(label, value, SHORTEST * value, LONGEST * value)


def coordinate(label: str, value: float, size: float) -> Dimension:
    """Return a coordinate in [m] that may change by ``size`` either way."""
    return Dimension(label, value, value - size, value + size)


def phase(label: str, value: float) -> Dimension:
    """Return a phase shift that may change by half a turn either way [rad]."""
    return Dimension(label, value, value - math.pi, value + math.pi, is_angle=True)


STEP = math.radians(0.5)  # of the crank, between two rows of a branch
BRANCHES = (four_bar.Branch.OPEN, four_bar.Branch.CROSSED)
LIMIT = "The crank gets no farther"
ROCKER_END = "The rocker turns back"
ROCKER_ENDS = (DeadCentreKind.CRANK_COUPLER_STRETCHED, DeadCentreKind.CRANK_COUPLER_FOLDED)


class ShownFourBar:
    """A four-bar linkage; the key of a position is the index of its branch.

    Attributes:
        skeleton: of the mechanism.
        paths: indices of the points whose paths are drawn.
        dimensions: what a person may change; ``values`` below are theirs, in [m] and [rad].
        crank_angle: to start from [rad].
        key: of the position to start from.
    """

    skeleton = FOUR_BAR
    paths: tuple[int, ...] = (4, 2)  # the coupler curve, and the way of the rocker pin

    def __init__(self, file: MechanismFile, linkage: FourBar) -> None:
        """Show the ``linkage`` that a ``file`` holds."""
        self._given = linkage
        size = linkage.coupler
        x, y = file.coupler_point
        self.dimensions: tuple[Dimension, ...] = (
            length("crank", linkage.crank),
            length("coupler", linkage.coupler),
            length("rocker", linkage.rocker),
            length("ground", linkage.ground),
            coordinate("point along the coupler", x, size),
            coordinate("point beside the coupler", y, size),
        )
        self.crank_angle = default_crank_angle(linkage)
        self.key = float(BRANCHES.index(default_branch(linkage)))

    def pivots(self, values: Sequence[float]) -> FloatArray:
        """Return the joints that do not move. Shape (2, 2) [m]."""
        x, y = self._given.crank_pivot
        angle, ground = self._given.ground_angle, values[3]
        return np.array([(x, y), (x + ground * math.cos(angle), y + ground * math.sin(angle))])

    def linkage(self, values: Sequence[float]) -> FourBar:
        """Return the linkage with these dimensions.

        Raises:
            KinematicsError: if there is none.
        """
        given, (crank, coupler, rocker, ground) = self._given, values[:4]
        return FourBar(
            *(crank, coupler, rocker, ground),
            crank_pivot=given.crank_pivot,
            ground_angle=given.ground_angle,
            tolerance=given.tolerance,
        )

    def positions(self, values: Sequence[float], crank_angle: float) -> tuple[Position, ...]:
        """Return all positions at a crank angle [rad].

        Raises:
            KinematicsError: if there are none.
        """
        linkage = self.linkage(values)
        sweep = linkage.sweep([crank_angle])
        if not sweep.open.is_reachable.all():
            raise CrankLimitError(crank_angle, linkage.crank_ranges)
        found = []
        for key, one in enumerate(BRANCHES):
            (points,) = four_bar_points(linkage, sweep.branch(one), values[4:6])
            transmission = degrees_text(float(sweep.branch(one).transmission_angles[0]))
            text = f"{one.value}, transmission angle {transmission}"
            found.append(Position(float(key), points, text))
        return tuple(found)

    def distance(self, key: float, other: float) -> float:
        """Return how far apart two positions at one crank angle are."""
        return abs(key - other)

    def branch(self, values: Sequence[float], crank_angle: float, key: float) -> Branch | None:
        """Return the branch of a position, from limit to limit or once around.

        Args:
            values: of the dimensions.
            crank_angle: of the position [rad].
            key: of the position.

        Returns:
            None if it is this position alone.

        Raises:
            KinematicsError: if there is no such linkage.
        """
        linkage, one = self.linkage(values), BRANCHES[round(key)]
        low, high = _range_around(crank_angle, linkage.crank_ranges)
        angles = np.linspace(low, high, max(2, math.ceil((high - low) / STEP)) + 1)
        sweep = linkage.sweep(angles).branch(one)
        # A row on a limit may lie beyond it by rounding.
        known = sweep.is_reachable
        angles, points = angles[known], four_bar_points(linkage, sweep, values[4:6])[known]
        if angles.size < 2:
            return None
        full = linkage.crank_turns_fully
        events = [(LIMIT, float(angles[row])) for row in (() if full else (0, -1))]
        events += [
            (ROCKER_END, centre.crank_angle)
            for centre in linkage.dead_centres
            if centre.kind in ROCKER_ENDS
            and centre.branch in (one, None)
            and (centre.crank_angle - angles[0]) % math.tau <= angles[-1] - angles[0]
        ]
        return Branch(
            Track(angles, np.full(angles.size, key), closed=full),
            points,
            tuple(
                Mark(_place_at(angle, angles, points[:, 2]), kind, angle) for kind, angle in events
            ),
            _words(linkage),
        )


def _range_around(crank_angle: float, ranges: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the crank's limits around a crank angle [rad]."""

    def beyond(ends: tuple[float, float]) -> float:
        middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
        return max(0.0, abs(math.remainder(crank_angle - middle, math.tau)) - half)

    # On a limit, it may be beyond it by rounding.
    return min(ranges, key=beyond)


def _place_at(crank_angle: float, angles: FloatArray, pins: FloatArray) -> Point:
    offsets = np.abs(np.remainder(angles - crank_angle + math.pi, math.tau) - math.pi)
    x, y = pins[int(offsets.argmin())].tolist()
    return x, y


def _words(linkage: FourBar) -> str:
    turns = "turns fully" if linkage.crank_turns_fully else "does not turn fully"
    extremes = linkage.transmission_extremes
    low, high = degrees_text(extremes.smallest), degrees_text(extremes.largest)
    name = linkage.grashof_class.value.capitalize()
    return f"{name}: the crank {turns}. Transmission angle {low} to {high}."


STEPS = 720  # of the crank in a full turn, between the rows of a branch
LETTERS = "ABC"
# A start is looked for at so many crank angles.
STARTS = 36
# Branches that turn fully, and those that turn back, are closed by then.
TURNS = 2
MARKED = {
    EventKind.TURNING_POINT: "The cranks turn back",
    EventKind.BIFURCATION: "Branches meet",
    EventKind.SINGULAR: "The continuation is not unique",
}


class ShownFMechanism:
    """An F-mechanism; the key of a position is its angle [rad].

    The attributes are those of ``ShownFourBar``.
    """

    skeleton = F_MECHANISM
    paths: tuple[int, ...] = (6, 7, 8)  # of the corners of the platform

    def __init__(self, mechanism: FMechanism) -> None:
        """Show the ``mechanism`` of a file."""
        linkage = mechanism.linkage
        self._base = as_points(np.array(linkage.pivots))
        self._platform = as_points(np.array(linkage.joints))
        self._counter_rotating = mechanism.counter_rotating
        self.dimensions: tuple[Dimension, ...] = (
            *(length(f"crank {letter}", r) for letter, r in zip(LETTERS, linkage.cranks)),
            *(length(f"rod {letter}", r) for letter, r in zip(LETTERS, linkage.rods)),
            phase("phase B", mechanism.phase_b),
            phase("phase C", mechanism.phase_c),
        )
        angles = np.arange(STARTS) * math.tau / STARTS
        self.crank_angle = float(angles[first_largest(mechanism.poses_batch(angles).counts)])
        self.key = 0.0

    def pivots(self, values: Sequence[float]) -> FloatArray:
        """Return the joints that do not move. Shape (3, 2) [m]."""
        del values
        return self._base

    def mechanism(self, values: Sequence[float]) -> FMechanism:
        """Return the mechanism with these dimensions.

        Raises:
            KinematicsError: if there is none.
        """
        cranks, rods, (b, c) = values[:3], values[3:6], values[6:8]
        return FMechanism(self._base, cranks, rods, self._platform, b, c, self._counter_rotating)

    def positions(self, values: Sequence[float], crank_angle: float) -> tuple[Position, ...]:
        """Return all positions at a crank angle [rad]; raises as that of ``ShownFourBar``."""
        mechanism = self.mechanism(values)
        pivots = mechanism.linkage.pivots
        found = [
            Position(
                pose.angle,
                f_mechanism_points(pivots, pose),
                f"platform at {degrees_text(pose.angle)}",
            )
            for pose in mechanism.poses(crank_angle)
        ]
        if not found:
            angle = number_text(crank_angle)
            raise KinematicsError(f"crank_angle = {angle} rad: the mechanism has no position there")
        return tuple(found)

    def distance(self, key: float, other: float) -> float:
        """Return how far apart two positions at one crank angle are [rad]."""
        return abs(math.remainder(key - other, math.tau))

    def branch(self, values: Sequence[float], crank_angle: float, key: float) -> Branch | None:
        """Return the branch of a position, through its turning points; as of ``ShownFourBar``."""
        mechanism = self.mechanism(values)
        poses = mechanism.poses(crank_angle)
        start = poses[first_smallest([self.distance(pose.angle, key) for pose in poses])]
        end = crank_angle + TURNS * math.tau
        trace = mechanism.trace(crank_angle, start, end, steps=TURNS * STEPS, through=True)
        if len(trace.crank_angle) < 2:
            return None
        curve = BranchCurve.of(trace)
        track = Track(curve.crank_angle, np.unwrap(curve.angle), trace.closed)
        return Branch(track, curve.points, _marks(trace), _turning(trace))


Shown = ShownFourBar | ShownFMechanism


def _marks(trace: FMechanismTrace) -> tuple[Mark, ...]:
    marks = (
        Mark(event.pose.position, MARKED[event.kind], event.crank_angle)
        for event in trace.events
        if event.kind in MARKED
    )
    # A branch that passes a place several times marks it once.
    return tuple({(mark.kind, mark.label): mark for mark in marks}.values())


def _turning(trace: FMechanismTrace) -> str:
    if trace.turns_fully:
        return "The cranks turn fully on this branch."
    if trace.turning_points or trace.closed:
        return "The cranks cannot turn fully on this branch."
    return f"The branch does not close within {TURNS} turns."
