"""How a planar mechanism is drawn, whatever draws it: its points, and what joins them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.equal_numbers import directions
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanismPose, FMechanismTrace, as_points
from tri_glide_kinematics.mechanisms.four_bar import AssembledFourBar, Branch, BranchSweep, FourBar
from tri_glide_kinematics.vectors import FloatArray

# Colours that stay apart for colour-blind readers as well (Okabe and Ito).
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
INK = "#262626"
CORNER_COLOURS = (ORANGE, BLUE, GREEN)


@dataclass(frozen=True)
class Link:
    """A bar between two points of a skeleton, both given by index."""

    start: int
    end: int
    colour: str
    width: float = 2.2


@dataclass(frozen=True)
class Skeleton:
    """How the points of a mechanism are joined; positions are arrays of shape (k, 2).

    Attributes:
        names: of the k points, as written beside them.
        links: bars.
        plate: indices of the corners of the rigid body with more than two points.
        plate_colour: of its edge and, lighter, of its face.
        pivots: indices of the points that are fixed.
        traced: indices of the points whose paths are of interest, with their colours.
    """

    names: tuple[str, ...]
    links: tuple[Link, ...]
    plate: tuple[int, ...]
    plate_colour: str
    pivots: tuple[int, ...]
    traced: tuple[tuple[int, str], ...]

    @property
    def edges(self) -> tuple[tuple[int, int], ...]:
        """Indices of the ends of all links, and of all sides of the plate after them."""
        links = tuple((link.start, link.end) for link in self.links)
        return links + tuple(zip(self.plate, self.plate[1:] + self.plate[:1]))

    def lines(self, points: FloatArray) -> FloatArray:
        """Return the edges in a position of shape (k, 2). Shape (n, 2, 2) [m]."""
        return points[np.array(self.edges)]


FOUR_BAR = Skeleton(
    names=("crank pivot", "crank pin", "rocker pin", "rocker pivot", "P"),
    links=(Link(0, 1, BLUE), Link(3, 2, GREEN)),
    plate=(1, 2, 4),
    plate_colour=ORANGE,
    pivots=(0, 3),
    traced=((4, PURPLE),),
)

F_MECHANISM = Skeleton(
    names=tuple(f"${corner}_{level}$" for level in (0, 1, 2) for corner in "ABC"),
    links=tuple(
        Link(level + corner, level + 3 + corner, CORNER_COLOURS[corner], width)
        for level, width in ((0, 3.2), (3, 1.6))
        for corner in (0, 1, 2)
    ),
    plate=(6, 7, 8),
    plate_colour=INK,
    pivots=(0, 1, 2),
    traced=tuple((6 + corner, CORNER_COLOURS[corner]) for corner in (0, 1, 2)),
)


@dataclass(frozen=True, eq=False)
class Line:
    """A line to be drawn.

    Attributes:
        places: that it joins; it is broken at NaN. Shape (n, 2) [m].
        colour: of the line.
        label: in the legend; none if empty.
        style: as matplotlib names it.
        width: of the line.
        opacity: from 0 to 1.
        joints: whether each place is marked as a joint.
    """

    places: FloatArray
    colour: str
    label: str = ""
    style: str = "-"
    width: float = 1.8
    opacity: float = 1.0
    joints: bool = False


def default_crank_angle(linkage: FourBar) -> float:
    """Return the crank angle [rad] at which a linkage was given, or one that is no special one."""
    if isinstance(linkage, AssembledFourBar):
        return linkage.assembled_crank_angle
    low, high = linkage.crank_ranges[0]
    return low + 0.7 * (high - low)


def default_branch(linkage: FourBar) -> Branch:
    """Return the branch on which a linkage was given, or the open one."""
    given = linkage.assembled_branch if isinstance(linkage, AssembledFourBar) else None
    return given or Branch.OPEN


def four_bar_points(
    linkage: FourBar, sweep: BranchSweep, coupler_point: Sequence[float]
) -> FloatArray:
    """Return the points of :data:`FOUR_BAR` over a sweep. Shape (n, 5, 2) [m]."""
    places = (
        linkage.crank_pivot,
        sweep.crank_pins,
        sweep.rocker_pins,
        linkage.rocker_pivot,
        sweep.point_of_coupler_plane(*coupler_point).position,
    )
    return np.stack(np.broadcast_arrays(*places), axis=-2)


@dataclass(frozen=True, eq=False)
class BranchCurve:
    """A branch as a curve to be drawn: its samples, with its events put in at their places.

    Attributes:
        crank_angle: angle of crank A, counted on over full turns, shape (m,) [rad].
        angle: platform angle in (-pi, pi], shape (m,) [rad].
        points: the points of :data:`F_MECHANISM`, shape (m, 9, 2) [m].
        reverses: whether the crank does so anywhere.
    """

    crank_angle: FloatArray
    angle: FloatArray
    points: FloatArray
    reverses: bool

    @classmethod
    def of(cls, branch: FMechanismTrace) -> BranchCurve:
        """Put the events of a branch between its samples."""
        events = branch.events
        at = [event.index for event in events]
        pivots = branch.linkage.pivots
        fixed = np.broadcast_to(as_points(np.array(pivots)), branch.crank_pins.shape)
        samples = np.concatenate([fixed, branch.crank_pins, branch.platform_joints], axis=1)
        at_events = [f_mechanism_points(pivots, event.pose) for event in events]
        angle = directions(np.exp(1j * branch.angle))
        return cls(
            np.insert(branch.crank_angle, at, [event.crank_angle for event in events]),
            np.insert(angle, at, [event.pose.angle for event in events]),
            np.insert(samples, at, at_events, axis=0),
            bool(branch.turning_points),
        )


def f_mechanism_points(pivots: Sequence[complex], pose: FMechanismPose) -> FloatArray:
    """Return the points of :data:`F_MECHANISM` in one position, shape (9, 2) [m]."""
    return np.concatenate([as_points(np.array(pivots)), pose.crank_pins, pose.platform_joints])


def bounds(places: FloatArray, margin: float = 0.1) -> FloatArray:
    """Return the corners of a box around all places.

    Args:
        places: rows with NaN do not count. Shape (..., 2) [m].
        margin: free border over the larger side.

    Returns:
        Lowest and highest x and y, shape (2, 2) [m].
    """
    flat = places.reshape(-1, 2)
    low, high = np.nanmin(flat, axis=0), np.nanmax(flat, axis=0)
    border = margin * float(np.max(high - low))
    return np.array([low - border, high + border])
