"""The picture of a mechanism, in its own plane and in metres, whatever draws it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tri_glide_kinematics.equal_numbers import first_smallest
from tri_glide_kinematics.mechanisms.pictures import bounds
from tri_glide_kinematics.vectors import FloatArray, Point
from tri_glide_kinematics.wording import number_text


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
        """Corners of a box around all points, which is asked for in each drawing. (2, 2) [m]."""
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
