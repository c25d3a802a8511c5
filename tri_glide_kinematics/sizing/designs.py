"""Symmetric machines for a wish: what they need of each thing that the wish bounds.

For the kinematics only two numbers of a symmetric machine count: the difference of its radii, e,
and the length L of its arms. All else follows in closed form, or from the Jacobian at places.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.sizing.fields import Cells, Loads
from tri_glide_kinematics.sizing.wish import Demand, Objective, Volume, Wish, distances, heights_of
from tri_glide_kinematics.vectors import FloatArray

DEMANDS = tuple(Demand)


class Needs(NamedTuple):
    """What machines need, one column for each.

    Attributes:
        ratios: what each demand needs, as part of what it allows; in the order of ``Demand``, 0
            where nothing is demanded. Shape (8, n).
        size: of ``Objective.SIZE``. Shape (n,) [m^3].
        power: of ``Objective.POWER``. Shape (n,) [W].
    """

    ratios: FloatArray
    size: FloatArray
    power: FloatArray

    @property
    def worst(self) -> FloatArray:
        """The largest ratio of each; a machine does what is wished if it is at most 1. (n,)."""
        return np.asarray(self.ratios.max(axis=0))

    def of(self, objective: Objective) -> FloatArray:
        """Return the numbers that an objective makes least. Shape (n,)."""
        return self.size if objective is Objective.SIZE else self.power


class Spans(NamedTuple):
    """What follows from the distances of a volume from the anchors, one number for each machine.

    Attributes:
        nearest: least horizontal distance of a platform joint from its tower joint [m].
        farthest: largest one [m].
        least_rise: of an arm; NaN if it does not reach [m].
        largest_rise: of an arm [m].
    """

    nearest: FloatArray
    farthest: FloatArray
    least_rise: FloatArray
    largest_rise: FloatArray


def directions(orientation: float) -> FloatArray:
    """Return the directions of the towers from the axis. Shape (3, 2)."""
    angles = orientation + np.radians((90.0, 210.0, 330.0))
    return np.stack((np.cos(angles), np.sin(angles)), axis=1)


def span_of(volume: Volume, orientation: float, differences: FloatArray) -> FloatArray:
    """Return the least and the largest distance of a volume from the anchors of machines.

    Args:
        volume: seen from above.
        orientation: of the machines [rad].
        differences: of the radii of each machine. Shape (n,) [m].

    Returns:
        Shape (2, n) [m].
    """
    anchors = differences[:, np.newaxis, np.newaxis] * directions(orientation)
    least, largest = distances(volume, anchors.reshape(-1, 2))
    return np.stack((least.reshape(-1, 3).min(axis=1), largest.reshape(-1, 3).max(axis=1)))


def spans(wish: Wish, differences: FloatArray, lengths: FloatArray) -> Spans:
    """Return the spans of machines; both arrays have the shape (n,) [m]."""
    nearest, farthest = span_of(wish.volume, wish.orientation, differences)
    with np.errstate(invalid="ignore"):
        least = np.sqrt((lengths - farthest) * (lengths + farthest))
        largest = np.sqrt((lengths - nearest) * (lengths + nearest))
    return Spans(nearest, farthest, least, largest)


def loads_of(wish: Wish, lengths: FloatArray) -> Loads:
    """Return the loads of machines with arms of these lengths. Shape (n,) [m]."""
    # Arms of a uniform density: all is linear in their length.
    one, two = (Loads.of(wish.masses(length), (length,) * 3) for length in (1.0, 2.0))
    return Loads(*(a + (b - a) * (lengths - 1.0) for a, b in zip(one, two)))


def field_bounds(
    wish: Wish, differences: FloatArray, lengths: FloatArray, places: FloatArray, radius: float
) -> FloatArray:
    """Return condition number, position error and force about places, one machine for each.

    Args:
        wish: whose speed, acceleration and masses count.
        differences: of the radii. Shape (n,) [m].
        lengths: of the arms. Shape (n,) [m].
        places: Shape (n, 2) [m].
        radius: of the cells about them [m].

    Returns:
        Largest condition number, largest position error for errors of 1 of the sliders, and
        largest force of a slider [N] in each cell. Shape (3, n).
    """
    anchors = directions(wish.orientation)[:, :, np.newaxis] * differences
    cells = Cells.around(anchors - places.T, np.broadcast_to(lengths, (3, len(places))), radius)
    forces = cells.forces(loads_of(wish, lengths), wish.speed, wish.acceleration)
    return np.stack((cells.conditions(), cells.position_errors(), forces.max(axis=0)))


def needs(wish: Wish, differences: FloatArray, lengths: FloatArray, largest: FloatArray) -> Needs:
    """Return what machines need.

    Args:
        wish: for which they are.
        differences: of the radii. Shape (n,) [m].
        lengths: of the arms. Shape (n,) [m].
        largest: condition number, position error and force, as in ``field_bounds``, over the
            volume. Shape (3, n).
    """
    span = spans(wish, differences, lengths)
    bottom, top = heights_of(wish.volume)
    column = top - bottom + span.largest_rise + wish.end_margin
    radius = differences + wish.platform_radius
    condition, error, force = largest
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = lengths / span.least_rise
        speed = wish.speed * ratio
        needed = {
            Demand.BASE_RADIUS: differences,
            Demand.COLUMN_HEIGHT: column,
            Demand.CLEARANCE: wish.clearance / np.maximum(span.nearest, 1e-9),
            Demand.ARM_ANGLE: math.sin(wish.least_arm_angle) * ratio,
            Demand.CONDITION: condition,
            Demand.SLIDER_SPEED: speed,
            Demand.RESOLUTION: wish.drive_resolution * error,
            Demand.FORCE: force,
        }
        ratios = np.array([needed[each] / _allowed(wish, each) for each in DEMANDS])
    ratios[:, ~np.isfinite(ratios.sum(axis=0))] = np.inf
    with np.errstate(invalid="ignore", over="ignore"):
        return Needs(ratios, np.pi * radius * radius * column, force * speed)


def _allowed(wish: Wish, demand: Demand) -> float:
    """Return what a demand allows, infinity without a bound; 1 where it is part of the need."""
    if demand in (Demand.CLEARANCE, Demand.ARM_ANGLE):
        return 1.0
    allowed = getattr(wish, demand.value)
    if allowed is None:
        return math.inf
    return float(allowed) - (wish.platform_radius if demand is Demand.BASE_RADIUS else 0.0)
