"""The picture of a mechanism, in its own plane and in metres, whatever draws it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.panel.mechanisms.track import Track
from tri_glide_kinematics.vectors import FloatArray, Point
from tri_glide_kinematics.wording import number_text

NO_LINES = np.empty((0, 2, 2))


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
        lines: of its moving links. Shape (n, 2, 2) [m].
        joints: Shape (k, 2) [m].
        points: that draw the paths. Shape (p, 2) [m].
        text: what it is, in words.
    """

    key: float
    lines: FloatArray
    joints: FloatArray
    points: FloatArray
    text: str


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch that is followed.

    Attributes:
        track: the way along it.
        paths: that points draw on it. Each of shape (n, 2) [m].
        extent: corners of a box around all that moves. Shape (2, 2) [m].
        marks: limits, turning points and dead centres.
        text: what it is, in words.
    """

    track: Track
    paths: tuple[FloatArray, ...]
    extent: FloatArray
    marks: tuple[Mark, ...]
    text: str

    @property
    def events(self) -> str:
        """The events with their crank angles, in words."""
        marks = sorted(self.marks, key=lambda mark: mark.within_a_turn)
        kinds = dict.fromkeys(mark.kind for mark in self.marks)
        angles = {
            kind: dict.fromkeys(mark.label for mark in marks if mark.kind == kind) for kind in kinds
        }
        return " ".join(f"{kind} at {', '.join(angles[kind])}." for kind in kinds)


@dataclass(frozen=True, eq=False)
class Picture:
    """A mechanism as it is drawn.

    Attributes:
        pivots: joints that do not move. Shape (k, 2) [m].
        positions: all at the present crank angle.
        followed: index of the one on the followed branch; None if it has none at this angle.
        branch: the followed one; None before it is known.
    """

    pivots: FloatArray
    positions: tuple[Position, ...] = ()
    followed: int | None = None
    branch: Branch | None = None


def degrees_text(angle: float) -> str:
    """Return an angle [rad] as a person reads it."""
    return f"{number_text(math.degrees(angle), 4, scale=1e3)}°"


def chain(*joints: Sequence[float], closed: bool = False) -> FloatArray:
    """Return the lines from joint to joint, and back to the first if closed. Shape (n, 2, 2)."""
    return lines_along(np.array([*joints, joints[0]] if closed else joints, dtype=np.float64))


def lines_along(path: FloatArray) -> FloatArray:
    """Return the lines of a polyline. Shape (n, 2) to (n - 1, 2, 2)."""
    return np.stack([path[:-1], path[1:]], axis=1)


def box_around(*groups: FloatArray) -> FloatArray:
    """Return the lowest and the highest corner of a box around points. Shape (2, 2) [m]."""
    points = np.concatenate([group.reshape(-1, 2) for group in groups])
    return np.array([points.min(axis=0), points.max(axis=0)])
