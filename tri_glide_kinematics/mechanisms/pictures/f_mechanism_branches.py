"""The branches of an F-mechanism as curves that can be drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tri_glide_kinematics.mechanisms.f_mechanism import (
    EventKind,
    FMechanism,
    FMechanismOverview,
    FMechanismPose,
    FMechanismTrace,
)
from tri_glide_kinematics.mechanisms.pictures.drawing import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    Link,
    Skeleton,
)
from tri_glide_kinematics.rounding import SAME_PART, directions, first_largest
from tri_glide_kinematics.vectors import FloatArray

CORNER_COLOURS = (ORANGE, BLUE, GREEN)

SAMPLES = 1440
"""Crank angles over one turn at which a branch is drawn."""

FEWEST_SAMPLES = 300
"""Positions of a branch that make it look smooth."""

ON_BRANCH = 1e-6
"""Branches that pass a position within this [rad, sizes] both pass through it."""

SKELETON = Skeleton(
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


@dataclass(frozen=True)
class BranchCurve:
    """A branch as a curve to be drawn: its samples, with its events put in at their places.

    Attributes:
        crank_angle: angle of crank A, counted on over full turns, shape (m,) [rad].
        angle: platform angle in (-pi, pi], shape (m,) [rad].
        points: the points of :data:`SKELETON`, shape (m, 9, 2) [m].
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
        pivots = [(pivot.real, pivot.imag) for pivot in branch.linkage.pivots]
        samples = np.concatenate(
            [
                np.broadcast_to(pivots, branch.crank_pins.shape),
                branch.crank_pins,
                branch.platform_joints,
            ],
            axis=1,
        )
        return cls(
            np.insert(branch.crank_angle, at, [event.crank_angle for event in events]),
            np.insert(
                directions(np.exp(1j * branch.angle)), at, [event.pose.angle for event in events]
            ),
            np.insert(
                samples,
                at,
                [skeleton_points(branch.linkage.pivots, e.pose) for e in events],
                axis=0,
            ),
            bool(branch.turning_points),
        )


def skeleton_points(pivots: Sequence[complex], pose: FMechanismPose) -> FloatArray:
    """Return the points of :data:`SKELETON` in one position, shape (9, 2) [m]."""
    fixed = tuple((pivot.real, pivot.imag) for pivot in pivots)
    return np.array(fixed + pose.crank_pins + pose.platform_joints)


def detailed_overview(
    mechanism: FMechanism, samples: int = SAMPLES, fewest: int = FEWEST_SAMPLES
) -> FMechanismOverview:
    """Return an overview whose branches all have samples enough to be drawn.

    Args:
        mechanism: to be drawn.
        samples: number of crank angles over one turn.
        fewest: number of samples that a branch has at least, however little the crank moves on it.
    """
    overview = mechanism.overview(samples)
    branches = tuple(_refined(mechanism, branch, fewest) for branch in overview.branches)
    return replace(overview, branches=branches)


def _refined(mechanism: FMechanism, branch: FMechanismTrace, fewest: int) -> FMechanismTrace:
    """Follow a branch on which the crank moves to and fro again, if it has too few samples."""
    if len(branch.angle) >= fewest or not branch.closed or not branch.turning_points:
        return branch
    turning = [event.crank_angle for event in branch.turning_points]
    # A range that ends just in the turning points would cut the branch off there.
    beyond = 0.01 * (max(turning) - min(turning))
    crank_angles = np.linspace(min(turning) - beyond, max(turning) + beyond, fewest)
    best = first_largest(np.abs(branch.singularity))
    start = float(branch.crank_angle[best])
    return mechanism.trace(start, branch.pose(best), crank_angles=crank_angles, through=True)


def describe(branch: FMechanismTrace) -> str:
    """Say in a few words how far the cranks can turn on a branch."""
    if branch.turns_fully:
        turns = abs(round(branch.turns))
        return "turns fully" if turns == 1 else f"turns fully, closes after {turns} turns"
    count = len(branch.turning_points)
    text = f"{count} turning point{'' if count == 1 else 's'}"
    last = branch.events[-1].kind
    if last is EventKind.SINGULAR:
        return f"{text}, ends in a singular position"
    return text if last is EventKind.CLOSED else f"{text}, not closed"


def evenly(curve: BranchCurve, count: int) -> list[int]:
    """Return indices of up to ``count`` positions that are spread evenly over a branch.

    Even in the crank angle where the crank turns one way; even in crank and platform angle
    together where it reverses, since the platform is fast there.
    """
    steps = np.abs(np.diff(curve.crank_angle))
    if curve.reverses:
        turn = np.abs(np.diff(curve.angle))
        steps = steps + np.minimum(turn, math.tau - turn)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0.0, way[-1], count, endpoint=False)
    # A position that lies where it is wanted is taken, even if it seems to lie just before.
    return sorted(set(np.searchsorted(way, wanted - SAME_PART * way[-1]).tolist()))


def branch_through(overview: FMechanismOverview, pose: FMechanismPose) -> int:
    """Return the index of the branch on which a position lies."""

    def distance(branch: FMechanismTrace) -> float:
        curve = BranchCurve.of(branch)
        turns = np.stack([curve.crank_angle - pose.crank_angle, curve.angle - pose.angle])
        turns = np.abs(np.angle(np.exp(1j * turns)))
        apart = np.linalg.norm(curve.points[:, 6:] - pose.platform_joints, axis=(1, 2))
        return float(np.min(turns.sum(axis=0) + apart / branch.linkage.size))

    distances = [distance(branch) for branch in overview.branches]
    # In a bifurcation it lies on two branches, of which the first is taken.
    return next(i for i, found in enumerate(distances) if found <= min(distances) + ON_BRANCH)


def angle_that_is_drawn(overview: FMechanismOverview) -> float:
    """Return the middle of the first range of crank angles with the most positions [rad]."""
    most = overview.counts == overview.counts.max()
    first = int(np.argmax(most))
    rest = ~most[first:]
    length = int(np.argmax(rest)) if rest.any() else len(rest)
    return float(overview.crank_angles[first + length // 2])
