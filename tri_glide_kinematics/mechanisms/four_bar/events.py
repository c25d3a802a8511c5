"""Events of a sweep of the crank: limits and change points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from tri_glide_kinematics.mechanisms.four_bar.analysis import DeadCentreKind
from tri_glide_kinematics.mechanisms.four_bar.linkage import FourBar
from tri_glide_kinematics.vectors import FloatArray, Point


class SweepEventKind(Enum):
    """The event at which coupler and rocker are in line."""

    LIMIT = "limit"
    """The crank gets no farther."""
    CHANGE_POINT = "change point"
    """Both branches meet, and the linkage can go on along either."""


@dataclass(frozen=True)
class SweepEvent:
    """A limit or a change point that a sweep meets.

    Attributes:
        kind: which of both.
        row: index of the last crank angle of the sweep that does not lie beyond it.
        crank_angle: of the event, counted on over full turns, in [rad].
        rocker_angle: in [rad], in (-pi, pi].
        rocker_pin: in [m].
    """

    kind: SweepEventKind
    row: int
    crank_angle: float
    rocker_angle: float
    rocker_pin: Point


def sweep_events(linkage: FourBar, crank_angles: FloatArray) -> tuple[SweepEvent, ...]:
    """Limits and change points in the order in which a sweep meets them.

    Args:
        linkage: that is swept.
        crank_angles: rising or falling. Shape (n,) [rad].
    """
    lengths = linkage.lengths
    is_change_point = {
        DeadCentreKind.COUPLER_ROCKER_STRETCHED: lengths.stretches,
        DeadCentreKind.COUPLER_ROCKER_FOLDED: lengths.folds,
    }
    sense = -1.0 if crank_angles[-1] < crank_angles[0] else 1.0
    lower, upper = sorted((float(crank_angles[0]), float(crank_angles[-1])))
    pivot_x, pivot_y = linkage.rocker_pivot
    events = []
    for centre in linkage.dead_centres:
        if centre.kind not in is_change_point:
            continue
        kind = SweepEventKind.CHANGE_POINT if is_change_point[centre.kind] else SweepEventKind.LIMIT
        rocker_pin = (
            pivot_x + linkage.rocker * math.cos(centre.rocker_angle),
            pivot_y + linkage.rocker * math.sin(centre.rocker_angle),
        )
        first = math.ceil((lower - centre.crank_angle) / math.tau)
        last = math.floor((upper - centre.crank_angle) / math.tau)
        for turn in range(first, last + 1):
            angle = centre.crank_angle + turn * math.tau
            row = int(np.searchsorted(sense * crank_angles, sense * angle, side="right")) - 1
            events.append(SweepEvent(kind, row, angle, centre.rocker_angle, rocker_pin))
    return tuple(sorted(events, key=lambda event: sense * event.crank_angle))
