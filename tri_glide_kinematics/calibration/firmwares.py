r"""Parameter sets of three printer firmwares as special cases of the twelve parameters.

All three hold the height of the nozzle $E_i$ at which each carriage meets its end stop with the
platform in the middle, so the carriage is then at $E_i + \sqrt{L_i^2 - R_i^2}$ above the bed, with
$R_i$ the distance of the anchor from the origin. Klipper and RepRapFirmware know one common radius:
every machine is like that about the centre of the circle through its anchors, so nothing but a
shift of x and y is lost. Their numbers are in mm and degrees, and so are the fields here.

Sources: Klipper, ``klippy/kinematics/delta.py``; Marlin, ``Marlin/src/module/delta.cpp``;
RepRapFirmware, ``LinearDeltaKinematics.cpp`` and its codes M665 and M666.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import permutations
from math import remainder
from typing import Generic, TypeVar

import numpy as np

from tri_glide_kinematics.calibration.fit import MachineParameters
from tri_glide_kinematics.checks import finite, finite_vector
from tri_glide_kinematics.equal_numbers import first_smallest
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3, three

# Angles of the towers A, B and C without corrections, counter-clockwise from the x axis [degrees].
TOWER_ANGLES = (210.0, 330.0, 90.0)
MM = 1000.0

# Digits behind the point: rounding errors are smaller, and what a firmware notices is larger.
DECIMALS = 10

Settings = TypeVar("Settings", covariant=True)


def plain_text(value: float) -> str:
    """Return a number without an exponent, which G-code does not know; never ``-0``."""
    return f"{round(value, DECIMALS) + 0.0:.{DECIMALS}f}".rstrip("0").rstrip(".")


@dataclass(frozen=True)
class Converted(Generic[Settings]):
    """The settings of a firmware for one of our machines.

    Attributes:
        settings: of the firmware.
        towers: which of our arms are its towers A, B and C: indices, 0 to 2.
        shift: what is added to our x and y to get those of the firmware. Shape (2,) [m].
    """

    settings: Settings
    towers: tuple[int, int, int]
    shift: tuple[float, float]


@dataclass(frozen=True)
class _Settings:
    """Numbers of a firmware, which are finite."""

    def __post_init__(self) -> None:
        """Check the numbers; each error is a ``KinematicsError``."""
        for each in fields(self):
            value = getattr(self, each.name)
            is_vector = each.type == "Vector3"
            checked = finite_vector(each.name, value, 3) if is_vector else finite(each.name, value)
            object.__setattr__(self, each.name, checked)


@dataclass(frozen=True)
class KlipperDelta(_Settings):
    """``[printer]`` and ``[stepper_a]`` to ``[stepper_c]`` of Klipper.

    Attributes:
        delta_radius: [mm].
        angles: of the towers. Shape (3,) [degrees].
        arm_lengths: Shape (3,) [mm].
        position_endstops: height of the nozzle, in the middle, at each end stop. Shape (3,) [mm].
    """

    delta_radius: float
    angles: Vector3
    arm_lengths: Vector3
    position_endstops: Vector3

    def machine(self, end_stops: Sequence[float] = (0.0, 0.0, 0.0)) -> MachineParameters:
        """Return the machine; its arms are A, B and C.

        Args:
            end_stops: reported heights of the sliders there; zeros if they are counted from there.
                Shape (3,) [m].

        Raises:
            KinematicsError: if no machine has these settings.
        """
        radii = [self.delta_radius] * 3
        return _machine(radii, self.angles, self.arm_lengths, self.position_endstops, end_stops)

    @classmethod
    def of(
        cls, machine: MachineParameters, end_stops: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Converted[KlipperDelta]:
        """Return the settings for a machine; ``end_stops`` as in ``machine``."""
        towers = _Towers(machine, end_stops)
        radius = float(towers.radii.mean())
        settings = cls(radius, three(towers.angles), three(towers.arms), three(towers.heights))
        return Converted(settings, towers.order, towers.shift)

    def __str__(self) -> str:
        """Return the lines of ``printer.cfg``."""
        lines = ["[printer]", f"delta_radius: {plain_text(self.delta_radius)}"]
        for i, name in enumerate("abc"):
            lines += [
                f"[stepper_{name}]",
                f"angle: {plain_text(self.angles[i])}",
                f"arm_length: {plain_text(self.arm_lengths[i])}",
                f"position_endstop: {plain_text(self.position_endstops[i])}",
            ]
        return "\n".join(lines)


@dataclass(frozen=True)
class MarlinDelta(_Settings):
    """``DELTA_...`` of Marlin's ``Configuration.h``; each tower has trims to common values.

    Attributes:
        height: of the nozzle after homing, ``DELTA_HEIGHT`` [mm].
        endstop_adj: how far each carriage moves after it has met its end stop, 0 or less: downwards
            [mm]. Shape (3,).
        radius: [mm].
        radius_trim: of each tower. Shape (3,) [mm].
        diagonal_rod: [mm].
        diagonal_rod_trim: of each tower. Shape (3,) [mm].
        tower_angle_trim: Shape (3,) [degrees].
    """

    height: float
    endstop_adj: Vector3
    radius: float
    radius_trim: Vector3
    diagonal_rod: float
    diagonal_rod_trim: Vector3
    tower_angle_trim: Vector3

    def machine(self, end_stops: Sequence[float] = (0.0, 0.0, 0.0)) -> MachineParameters:
        """Return the machine, as in ``KlipperDelta``."""
        return _machine(
            np.add(self.radius, self.radius_trim),
            np.add(TOWER_ANGLES, self.tower_angle_trim),
            np.add(self.diagonal_rod, self.diagonal_rod_trim),
            np.subtract(self.height, self.endstop_adj),
            end_stops,
        )

    @classmethod
    def of(
        cls, machine: MachineParameters, end_stops: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Converted[MarlinDelta]:
        """Return the settings for a machine, with one radius: trims would only shift x and y."""
        towers = _Towers(machine, end_stops)
        rod, height = float(towers.arms.mean()), float(towers.heights.min())
        settings = cls(
            height,
            three(height - towers.heights),
            float(towers.radii.mean()),
            (0.0, 0.0, 0.0),
            rod,
            three(towers.arms - rod),
            three(towers.angles - TOWER_ANGLES),
        )
        return Converted(settings, towers.order, towers.shift)

    def __str__(self) -> str:
        """Return the lines of ``Configuration.h``."""

        def braced(values: Vector3) -> str:
            return "{ " + ", ".join(map(plain_text, values)) + " }"

        return "\n".join(
            (
                f"#define DELTA_HEIGHT {plain_text(self.height)}",
                f"#define DELTA_ENDSTOP_ADJ {braced(self.endstop_adj)}",
                f"#define DELTA_RADIUS {plain_text(self.radius)}",
                f"#define DELTA_RADIUS_TRIM_TOWER {braced(self.radius_trim)}",
                f"#define DELTA_DIAGONAL_ROD {plain_text(self.diagonal_rod)}",
                f"#define DELTA_DIAGONAL_ROD_TRIM_TOWER {braced(self.diagonal_rod_trim)}",
                f"#define DELTA_TOWER_ANGLE_TRIM {braced(self.tower_angle_trim)}",
            )
        )


@dataclass(frozen=True)
class RepRapFirmwareDelta(_Settings):
    """M665 and M666 of RepRapFirmware.

    Attributes:
        diagonal_rods: M665 L. Shape (3,) [mm].
        radius: M665 R [mm].
        homed_height: M665 H, of the nozzle after homing [mm].
        angle_corrections: M665 X, Y, Z. Shape (3,) [degrees].
        endstop_adjustments: M666 X, Y, Z; upwards, their mean is zero. Shape (3,) [mm].
    """

    diagonal_rods: Vector3
    radius: float
    homed_height: float
    angle_corrections: Vector3
    endstop_adjustments: Vector3

    def machine(self, end_stops: Sequence[float] = (0.0, 0.0, 0.0)) -> MachineParameters:
        """Return the machine, as in ``KlipperDelta``."""
        return _machine(
            [self.radius] * 3,
            np.add(TOWER_ANGLES, self.angle_corrections),
            self.diagonal_rods,
            np.add(self.homed_height, self.endstop_adjustments),
            end_stops,
        )

    @classmethod
    def of(
        cls, machine: MachineParameters, end_stops: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Converted[RepRapFirmwareDelta]:
        """Return the settings for a machine; ``end_stops`` as in ``machine``."""
        towers = _Towers(machine, end_stops)
        height = float(towers.heights.mean())
        settings = cls(
            three(towers.arms),
            float(towers.radii.mean()),
            height,
            three(towers.angles - TOWER_ANGLES),
            three(towers.heights - height),
        )
        return Converted(settings, towers.order, towers.shift)

    def __str__(self) -> str:
        """Return the lines of ``config.g``."""
        rods = ":".join(map(plain_text, self.diagonal_rods))
        turns, ends = (
            " ".join(f"{axis}{plain_text(value)}" for axis, value in zip("XYZ", values))
            for values in (self.angle_corrections, self.endstop_adjustments)
        )
        radius, height = plain_text(self.radius), plain_text(self.homed_height)
        return f"M665 L{rods} R{radius} H{height} {turns}\nM666 {ends}"


class _Towers:
    """A machine as the firmwares see it, about the centre of the circle through its anchors.

    Attributes:
        order: our arms that are towers A, B and C.
        shift: of x and y [m].
        radii, angles, arms, heights: of A, B and C; heights of the nozzle at the end stops. Each of
            shape (3,) [mm], [degrees].
    """

    def __init__(self, machine: MachineParameters, end_stops: Sequence[float]) -> None:
        anchors = np.array(machine.geometry.anchors)
        center = circle_center(anchors)
        arms = np.array(machine.geometry.arm_lengths)
        ends = np.add(finite_vector("end_stops", end_stops, 3), machine.height_offsets)
        away = anchors - center
        angles = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
        orders = [(i, j, 3 - i - j) for i, j in permutations(range(3), 2)]
        # Equal angles from -180 to 180 degrees.
        turns = [
            [remainder(angles[i] - at, 360.0) for i, at in zip(o, TOWER_ANGLES)] for o in orders
        ]
        best = first_smallest([np.square(turn).sum() for turn in turns])
        order = list(orders[best])
        self.order = orders[best]
        self.shift = (float(-center[0]), float(-center[1]))
        radii = np.linalg.norm(away, axis=1)
        self.radii = MM * radii[order]
        self.angles = np.add(TOWER_ANGLES, turns[best])
        self.arms = MM * arms[order]
        self.heights = MM * (ends - np.sqrt(np.square(arms) - np.square(radii)))[order]


def circle_center(anchors: FloatArray) -> FloatArray:
    """Return the centre of the circle through three places. Shape (2,) [m]."""
    sides = anchors[1:] - anchors[0]
    return np.asarray(anchors[0] + np.linalg.solve(sides, 0.5 * np.square(sides).sum(axis=1)))


def _machine(
    radii: Sequence[float] | FloatArray,
    angles: Sequence[float] | FloatArray,
    arms: Sequence[float] | FloatArray,
    heights: Sequence[float] | FloatArray,
    end_stops: Sequence[float],
) -> MachineParameters:
    """Return the machine of firmware settings [mm], [degrees]."""
    lengths, distances = np.array(arms) / MM, np.array(radii) / MM
    turned = np.radians(angles)
    anchors = distances[:, None] * np.column_stack((np.cos(turned), np.sin(turned)))
    geometry = TriGlideGeometry(anchors, lengths)
    rises = np.sqrt(np.square(lengths) - np.square(distances))
    ends = np.array(heights) / MM + rises
    return MachineParameters(geometry, three(ends - finite_vector("end_stops", end_stops, 3)))
