"""Measurements on a machine: touches of a plate, positions, distances.

All slider heights are the *reported* ones, as the drives (and ``joint_states``) say them. A
``height_offset`` is what is **added** to a reported height to get the true one above the base.

The place that is measured is that of the platform centre. A tip that is fixed to the platform moves
as the centre does; its constant offset shifts all that is measured, which only matters where a
position or a plate is given in the frame of the machine.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from tri_glide_kinematics.checks import finite, finite_vector, positive
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.vectors import Vector3


class CalibrationError(KinematicsError):
    """Measurements from which no calibration can be made."""


# The frame of the machine itself: positions in it are neither turned nor shifted.
BASE = "base"


@dataclass(frozen=True)
class Plate:
    """A flat plate: its surface is z = height + tilt[0] x + tilt[1] y in the frame of the machine.

    Unknown numbers are fitted, too.

    Attributes:
        name: plates of one name are one plate.
        height: of the surface at x = y = 0; None if it is not known [m].
        tilt: slopes of the surface along x and y; None if they are not known. Shape (2,).
    """

    name: str = "bed"
    height: float | None = 0.0
    tilt: tuple[float, float] | None = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if one of them is NaN or infinite.
            WrongShapeError: if there are not two slopes.
        """
        if self.height is not None:
            _store(self, "height", finite(f"height of plate {self.name!r}", self.height))
        if self.tilt is not None:
            _store(self, "tilt", finite_vector(f"tilt of plate {self.name!r}", self.tilt, 2))


@dataclass(frozen=True)
class Touch:
    """The platform touches a plate.

    Attributes:
        heights: reported ones of the sliders. Shape (3,) [m].
        plate: that is touched.
        standard_deviation: of the vertical distance between platform and plate [m].
    """

    heights: Vector3
    plate: Plate = field(default_factory=Plate)
    standard_deviation: float = 1e-5

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            WrongShapeError: if there are not three heights.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if the standard deviation is not greater than zero.
        """
        _store_heights(self, "heights", self.heights)
        _store_deviation(self, self.standard_deviation)


@dataclass(frozen=True)
class MeasuredPosition:
    """A camera or a tracker says where the platform is.

    Attributes:
        heights: reported ones of the sliders. Shape (3,) [m].
        position: that was measured. Shape (3,) [m].
        frame: of the position. ``base`` is that of the machine; any other name is a frame that is
            turned and shifted by an unknown amount, which is fitted, too.
        standard_deviation: of each coordinate [m].
    """

    heights: Vector3
    position: Vector3
    frame: str = BASE
    standard_deviation: float = 5e-5

    def __post_init__(self) -> None:
        """Check the numbers, as in ``Touch``."""
        _store_heights(self, "heights", self.heights)
        _store(self, "position", finite_vector("measured position", self.position, 3))
        _store_deviation(self, self.standard_deviation)


@dataclass(frozen=True)
class Distance:
    """The distance between two positions of the platform: ruler, calliper, gauge, printed part.

    Attributes:
        heights_from: reported ones at one end. Shape (3,) [m].
        heights_to: reported ones at the other end. Shape (3,) [m].
        distance: that was measured [m].
        standard_deviation: of it [m].
    """

    heights_from: Vector3
    heights_to: Vector3
    distance: float
    standard_deviation: float = 5e-5

    def __post_init__(self) -> None:
        """Check the numbers, as in ``Touch``; the distance has to be greater than zero, too."""
        _store_heights(self, "heights_from", self.heights_from)
        _store_heights(self, "heights_to", self.heights_to)
        _store(self, "distance", positive("measured distance", self.distance, "m"))
        _store_deviation(self, self.standard_deviation)


Measurement = Touch | MeasuredPosition | Distance


def names_of(measurements: Sequence[Measurement]) -> list[str]:
    """Return a name for each: its kind and its number among those, from 1."""
    kinds = {Touch: "touch", MeasuredPosition: "position", Distance: "distance"}
    counts: Counter[str] = Counter()
    names = []
    for one in measurements:
        kind = kinds[type(one)]
        counts[kind] += 1
        names.append(f"{kind} {counts[kind]}")
    return names


def _store(measurement: object, name: str, value: object) -> None:
    object.__setattr__(measurement, name, value)


def _store_heights(measurement: object, name: str, heights: Sequence[float]) -> None:
    _store(measurement, name, finite_vector(name, heights, 3))


def _store_deviation(measurement: object, value: float) -> None:
    _store(measurement, "standard_deviation", positive("standard_deviation", value, "m"))
