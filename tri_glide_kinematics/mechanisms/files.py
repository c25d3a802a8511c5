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

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.keys import load_yaml
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.mechanisms.landing_gear import LandingGear
from tri_glide_kinematics.vectors import Point


class MechanismFileError(KinematicsError):
    """A file that should describe a mechanism does not."""

    def __init__(self, path: str, key: str, reason: str) -> None:
        """Store the ``path``, the ``key`` in it that is wrong (or nothing), and the ``reason``."""
        super().__init__(f"{path}: {key}: {reason}" if key else f"{path}: {reason}")
        self.path = path
        self.key = key
        self.reason = reason


Mechanism = FourBar | FMechanism | LandingGear

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
    if not isinstance(values, Mapping):
        raise MechanismFileError(str(path), kind, "must hold keys with values")
    section = _Section(path, kind, values)
    try:
        read = _READERS[kind](section)
    except MechanismFileError:
        raise
    except KinematicsError as error:
        raise MechanismFileError(str(path), kind, str(error)) from error
    return read


class _Section:
    """The keys of one mechanism, each read once; those that nobody reads are mistakes."""

    def __init__(self, path: str | Path, name: str, values: Mapping[Any, Any]) -> None:
        self._path = str(path)
        self._name = name
        self._values = values
        self._known: list[str] = []

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def number(self, key: str, default: float | None = None) -> float:
        return self._number(key, self._value(key, default))

    def angle(self, key: str, default: float | None = None) -> float:
        """Return in [rad] what the file holds in degrees."""
        return math.radians(self.number(f"{key}_degrees", default))

    def flag(self, key: str, default: bool) -> bool:
        value = self._value(key, default)
        if not isinstance(value, bool):
            raise self._error(key, f"is {value!r}, must be true or false")
        return value

    def numbers(
        self, key: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        return self._numbers(key, self._value(key, default), count, "numbers")

    def matrix(self, key: str, count: int) -> tuple[tuple[float, ...], ...]:
        rows = self._list(key, self._value(key), count, f"rows of {count} numbers")
        names = (f"{key}[{index}]" for index in range(count))
        return tuple(self._numbers(name, row, count, "numbers") for name, row in zip(names, rows))

    def point(self, key: str, default: Point | None = None) -> Point:
        return self._point(key, self._value(key, default))

    def points(self, key: str, count: int) -> tuple[Point, ...]:
        items = self._list(key, self._value(key), count, "points [x, y]")
        return tuple(self._point(f"{key}[{index}]", item) for index, item in enumerate(items))

    def finish(self) -> None:
        """Complain about a key that has not been read."""
        for key in self._values:
            if key not in self._known:
                raise self._error(key, f"is not known here; known are {', '.join(self._known)}")

    def _value(self, key: str, default: Any = None) -> Any:
        self._known.append(key)
        value = self._values.get(key, default)
        if value is None:
            raise self._error(key, "is missing")
        return value

    def _number(self, key: str, value: Any) -> float:
        # YAML takes 1e-3, without a point, for a word.
        if not isinstance(value, bool) and isinstance(value, (int, float, str)):
            try:
                return float(value)
            except (ValueError, OverflowError):
                pass
        raise self._error(key, f"is {value!r}, must be a number")

    def _numbers(self, key: str, value: Any, count: int, what: str) -> tuple[float, ...]:
        items = self._list(key, value, count, what)
        return tuple(self._number(f"{key}[{index}]", item) for index, item in enumerate(items))

    def _list(self, key: str, value: Any, count: int, what: str) -> list[Any]:
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise self._error(key, f"is {value!r}, must be a list of {count} {what}")
        return list(value)

    def _point(self, key: str, value: Any) -> Point:
        x, y = self._numbers(key, value, 2, "numbers, x and y")
        return x, y

    def _error(self, key: Any, reason: str) -> MechanismFileError:
        return MechanismFileError(self._path, f"{self._name}.{key}", reason)


def _read_four_bar(section: _Section) -> MechanismFile:
    coupler_point = section.point("coupler_point", (0.0, 0.0))
    tolerance = section.number("tolerance", 1e-12)
    linkage: FourBar
    if "crank_pin" in section:
        crank_pivot, crank_pin, rocker_pin, rocker_pivot = map(section.point, _JOINTS)
        section.finish()
        linkage = FourBar.from_joints(crank_pivot, crank_pin, rocker_pin, rocker_pivot, tolerance)
    else:
        crank, coupler, rocker, ground = map(section.number, _LINKS)
        crank_pivot = section.point("crank_pivot", (0.0, 0.0))
        ground_angle = section.angle("ground_angle", 0.0)
        section.finish()
        linkage = FourBar(crank, coupler, rocker, ground, crank_pivot, ground_angle, tolerance)
    return MechanismFile(linkage, coupler_point)


def _read_f_mechanism(section: _Section) -> MechanismFile:
    base = section.points("base", 3)
    crank_lengths = section.numbers("crank_lengths", 3)
    rod_lengths = section.numbers("rod_lengths", 3)
    platform = section.points("platform", 3)
    phases = section.angle("phase_b", 0.0), section.angle("phase_c", 0.0)
    counter_rotating = section.flag("counter_rotating", False)
    section.finish()
    return MechanismFile(
        FMechanism(base, crank_lengths, rod_lengths, platform, *phases, counter_rotating)
    )


def _read_landing_gear(section: _Section) -> MechanismFile:
    numbers = {key: section.number(key) for key in _GEAR_NUMBERS}
    inertia = section.matrix("gear_inertia", 3)
    gravity = section.numbers("gravity", 3, (0.0, 0.0, -9.80665))
    section.finish()
    return MechanismFile(LandingGear(gear_inertia=inertia, gravity=gravity, **numbers))


_READERS: dict[str, Callable[[_Section], MechanismFile]] = {
    "four_bar": _read_four_bar,
    "f_mechanism": _read_f_mechanism,
    "landing_gear": _read_landing_gear,
}
