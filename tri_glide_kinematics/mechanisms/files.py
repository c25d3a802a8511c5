"""Reads mechanisms from YAML files such as those in ``config/``.

A file holds one section that is named after the kind of mechanism. Lengths are in [m], points are
``[x, y]`` in [m]; angles are in degrees, and the names of their keys say so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tri_glide_kinematics.keys import FileError, Keys, load_yaml, shortened
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.mechanisms.landing_gear import LandingGear
from tri_glide_kinematics.vectors import Point


class MechanismFileError(FileError):
    """A file that should describe a mechanism does not.

    Attributes:
        path: of the file.
        key: in it that is wrong; empty if it is about all of it.
    """

    def __init__(self, path: str | Path, key: str, reason: str) -> None:
        """Store the ``path``, the ``key`` and the ``reason``."""
        super().__init__(path, key, reason)
        self.path, self.key = str(path), key


Mechanism = FourBar | FMechanism | LandingGear

# Default of points that a file may leave out [m].
_ORIGIN = [0.0, 0.0]
_LINKS = ("crank", "coupler", "rocker", "ground")
_JOINTS = ("crank_pivot", "crank_pin", "rocker_pin", "rocker_pivot")
_GEAR_NUMBERS = (
    *("l1", "l2", "l3", "l4"),
    *("gear_mass", "wheel_mass", "wheel_axial_inertia", "wheel_transverse_inertia"),
)


@dataclass(frozen=True)
class MechanismFile:
    """The contents of a mechanism file.

    Attributes:
        mechanism: which kind it is, its class says.
        coupler_point: of a four-bar linkage, the point of the coupler plane that draws the coupler
            curve: from the crank pin towards the rocker pin, and to the left of it, in [m]. The
            crank pin itself if the file names none.
    """

    mechanism: Mechanism
    coupler_point: Point = (0.0, 0.0)


def load_mechanism(path: str | Path) -> MechanismFile:
    """Read a file.

    Raises:
        MechanismFileError: if it cannot be read, or describes no mechanism; the text names the file
            and the key.
    """
    content = load_yaml(str(path), MechanismFileError)
    kinds = ", ".join(_READERS)
    if not isinstance(content, Mapping) or len(content) != 1:
        raise MechanismFileError(str(path), "", f"must hold one section, named one of {kinds}")
    ((kind, values),) = content.items()
    if kind not in _READERS:
        raise MechanismFileError(
            str(path), str(kind), f"is no kind of mechanism: must be one of {kinds}"
        )
    section = _Section(str(path), kind, values)
    with section.all_read():
        return _READERS[kind](section)


class _Section(Keys):
    """The keys of one mechanism."""

    error_class = MechanismFileError

    def error(self, reason: str, key: str = "") -> FileError:
        return MechanismFileError(self._file, ".".join(filter(None, (self.place, key))), reason)

    def angle(self, key: str) -> float:
        """Return in [rad] what the file holds in degrees; 0 without it."""
        return math.radians(self.number(f"{key}_degrees", 0.0))

    def point(self, key: str, default: Any = None) -> Point:
        return self._point(key, self.value(key, default))

    def points(self, key: str) -> list[Point]:
        rows = self._three(key, "points [x, y]")
        return [self._point(f"{key}[{index}]", row) for index, row in enumerate(rows)]

    def matrix(self, key: str) -> list[tuple[float, ...]]:
        rows = self._three(key, "rows of 3 numbers")
        return [self.numbers(f"{key}[{index}]", row, 3) for index, row in enumerate(rows)]

    def _three(self, key: str, wanted: str) -> list[Any]:
        rows = self.value(key)
        if not isinstance(rows, list) or len(rows) != 3:
            raise self.error(f"is {shortened(rows)}, must be a list of 3 {wanted}", key)
        return rows

    def _point(self, key: str, value: Any) -> Point:
        x, y = self.numbers(key, value, 2)
        return x, y


def _read_four_bar(section: _Section) -> MechanismFile:
    coupler_point = section.point("coupler_point", _ORIGIN)
    tolerance = section.number("tolerance", 1e-12)
    linkage: FourBar
    if section.has("crank_pin"):
        crank_pivot, crank_pin, rocker_pin, rocker_pivot = map(section.point, _JOINTS)
        linkage = FourBar.from_joints(crank_pivot, crank_pin, rocker_pin, rocker_pivot, tolerance)
    else:
        crank, coupler, rocker, ground = map(section.number, _LINKS)
        crank_pivot = section.point("crank_pivot", _ORIGIN)
        ground_angle = section.angle("ground_angle")
        linkage = FourBar(crank, coupler, rocker, ground, crank_pivot, ground_angle, tolerance)
    return MechanismFile(linkage, coupler_point)


def _read_f_mechanism(section: _Section) -> MechanismFile:
    base = section.points("base")
    crank_lengths = section.vector("crank_lengths")
    rod_lengths = section.vector("rod_lengths")
    platform = section.points("platform")
    phases = section.angle("phase_b"), section.angle("phase_c")
    counter_rotating = section.switch("counter_rotating", False)
    return MechanismFile(
        FMechanism(base, crank_lengths, rod_lengths, platform, *phases, counter_rotating)
    )


def _read_landing_gear(section: _Section) -> MechanismFile:
    numbers = {key: section.number(key) for key in _GEAR_NUMBERS}
    inertia = section.matrix("gear_inertia")
    gravity = section.vector("gravity", [0.0, 0.0, -9.80665])
    return MechanismFile(LandingGear(gear_inertia=inertia, gravity=gravity, **numbers))


_READERS: dict[str, Callable[[_Section], MechanismFile]] = {
    "four_bar": _read_four_bar,
    "f_mechanism": _read_f_mechanism,
    "landing_gear": _read_landing_gear,
}
