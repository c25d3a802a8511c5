r"""The geometry of three printer firmwares as a special case of the twelve parameters.

All three hold the height of the nozzle $E_i$ at which each carriage meets its end stop with the
platform in the middle, so the carriage is then at $E_i + \sqrt{L_i^2 - R_i^2}$ above the bed, with
$R_i$ the distance of the anchor from the origin. Klipper and RepRapFirmware know one common radius:
every machine is like that about the centre of the circle through its anchors, so nothing but a
shift of x and y is lost. Numbers are in mm and degrees, as there.

Sources: Klipper, ``klippy/kinematics/delta.py``; Marlin, ``Marlin/src/module/delta.cpp``;
RepRapFirmware, ``LinearDeltaKinematics.cpp`` and its codes M665 and M666.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import permutations
from math import remainder
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.checks import finite_vector
from tri_glide_kinematics.equal_numbers import first_smallest
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3, three

# Angles of the towers A, B and C without corrections, counter-clockwise from the x axis [degrees].
TOWER_ANGLES = (210.0, 330.0, 90.0)
MM = 1000.0

# Digits behind the point: rounding errors are smaller, and what a firmware notices is larger.
DECIMALS = 10


def plain_text(value: float) -> str:
    """Return a number without an exponent, which G-code does not know; never ``-0``."""
    return f"{round(value, DECIMALS) + 0.0:.{DECIMALS}f}".rstrip("0").rstrip(".")


@dataclass(frozen=True)
class Towers:
    """The towers A, B and C.

    Attributes:
        radii: distances of the anchors from the axis. Shape (3,) [mm].
        angles: of the anchors. Shape (3,) [degrees].
        arms: their lengths. Shape (3,) [mm].
        heights: of the nozzle, in the middle, at each end stop. Shape (3,) [mm].
    """

    radii: Vector3
    angles: Vector3
    arms: Vector3
    heights: Vector3

    def __post_init__(self) -> None:
        """Check the numbers; each error is a ``KinematicsError``."""
        for each in fields(self):
            checked = finite_vector(each.name, getattr(self, each.name), 3)
            object.__setattr__(self, each.name, checked)

    def machine(self) -> tuple[TriGlideGeometry, Vector3]:
        """Return the machine, whose arms are A, B and C, and where its sliders meet the end stops.

        Raises:
            KinematicsError: if there is no such machine.
        """
        radii, arms, turned = np.array(self.radii), np.array(self.arms), np.radians(self.angles)
        anchors = radii[:, None] * np.column_stack((np.cos(turned), np.sin(turned)))
        geometry = TriGlideGeometry(anchors / MM, arms / MM)
        ends = self.heights + np.sqrt(np.square(arms) - np.square(radii))
        return geometry, three(ends / MM)


class Converted(NamedTuple):
    """A machine as the firmwares see it, about the centre of the circle through its anchors.

    Attributes:
        towers: with equal radii.
        order: which of our arms are A, B and C: indices, 0 to 2.
        shift: what is added to our x and y to get those of the firmware. Shape (2,) [m].
    """

    towers: Towers
    order: tuple[int, int, int]
    shift: tuple[float, float]


def towers_of(machine: MachineParameters, end_stops: Sequence[float]) -> Converted:
    """Return the towers of one of our machines.

    Args:
        machine: to be converted.
        end_stops: reported heights of the sliders there. Shape (3,) [m].

    Raises:
        KinematicsError: if no firmware has such a machine.
    """
    anchors = np.array(machine.geometry.anchors)
    center = circle_center(anchors)
    arms = np.array(machine.geometry.arm_lengths)
    ends = np.add(finite_vector("end_stops", end_stops, 3), machine.height_offsets)
    away = anchors - center
    angles = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    orders = [(i, j, 3 - i - j) for i, j in permutations(range(3), 2)]
    # Equal angles from -180 to 180 degrees.
    turns = [[remainder(angles[i] - at, 360.0) for i, at in zip(o, TOWER_ANGLES)] for o in orders]
    best = first_smallest([np.square(turn).sum() for turn in turns])
    order = list(orders[best])
    radii = np.linalg.norm(away, axis=1)
    with np.errstate(invalid="ignore"):
        heights = ends - np.sqrt(np.square(arms) - np.square(radii))
    found = Towers(
        three(MM * radii[order]),
        three(np.add(TOWER_ANGLES, turns[best])),
        three(MM * arms[order]),
        three(MM * heights[order]),
    )
    return Converted(found, orders[best], (float(-center[0]), float(-center[1])))


def circle_center(anchors: FloatArray) -> FloatArray:
    """Return the centre of the circle through three places. Shape (2,) [m]."""
    sides = anchors[1:] - anchors[0]
    return np.asarray(anchors[0] + np.linalg.solve(sides, 0.5 * np.square(sides).sum(axis=1)))
