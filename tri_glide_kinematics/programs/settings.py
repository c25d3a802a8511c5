"""What a program does not say: its dialect, and the offsets, tools and places of a machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tri_glide_kinematics.checks import finite_vector, member, non_negative, positive
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.files import SETTINGS, find_file
from tri_glide_kinematics.keys import FileError
from tri_glide_kinematics.motion.path import LARGEST_PLACE, LARGEST_SPEED, LEAST_SPEED
from tri_glide_kinematics.programs.dialects import Dialect
from tri_glide_kinematics.vectors import Vector3, scaled

WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
# An offset or a place that nothing names [m].
NOWHERE: Vector3 = (0.0, 0.0, 0.0)


class SettingsError(FileError):
    """A file of settings cannot be read, or something in it has no meaning."""


@dataclass(frozen=True)
class ProgramSettings:
    """What a program does not say itself; all places are of the platform.

    Attributes:
        dialect: that it is written in; None for the one that it shows (``guess_dialect``).
        start: where the platform is when it begins; where G28 leads, if none is named [m].
        home: where G28 leads; None if there is no such place [m].
        offsets: where the zero of G54 and the others is; that of the machine if not named [m].
        tools: offset of each tool by its number, which G43 adds [m].
        tolerance: largest deviation from the path where the program names none [m].
        feed: speed before the first F; None for that of the dialect [m/s].
        block_delete: whether lines that begin with a slash are left out.
        optional_stop: whether M1 stops.
        ignored: commands, such as ``M104``, that do not concern the motion.
    """

    dialect: Dialect | None = None
    start: Vector3 | None = None
    home: Vector3 | None = None
    offsets: Mapping[str, Vector3] = field(default_factory=dict)
    tools: Mapping[int, Vector3] = field(default_factory=dict)
    tolerance: float = 5e-5
    feed: float | None = None
    block_delete: bool = True
    optional_stop: bool = True
    ignored: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        """Check them.

        Raises:
            KinematicsError: if a number is none or out of bounds, or an offset has no such name.
        """
        if self.dialect is not None:
            member("dialect", self.dialect, Dialect)
        places = {"start": self.start, "home": self.home, **self.offsets}
        places |= {f"tool {number}": offset for number, offset in self.tools.items()}
        for name, place in places.items():
            if place is not None:
                for number in finite_vector(name, place, 3):
                    if abs(number) > LARGEST_PLACE:
                        bound = f"within {LARGEST_PLACE:g}"
                        raise OutOfBoundsError(name, number, bound, "m", LARGEST_PLACE)
        for name in self.offsets:
            if name not in WORK_OFFSETS:
                raise KinematicsError(f"offset {name} must be one of {', '.join(WORK_OFFSETS)}")
        for number in self.tools:
            if not isinstance(number, int) or isinstance(number, bool) or number < 1:
                raise KinematicsError(f"tool {number!r} must be a whole number, at least 1")
        if non_negative("tolerance", self.tolerance, "m") > LARGEST_PLACE:
            raise OutOfBoundsError("tolerance", self.tolerance, f"at most {LARGEST_PLACE:g}", "m")
        if (
            self.feed is not None
            and positive("feed", self.feed, "m/s", LARGEST_SPEED) < LEAST_SPEED
        ):
            raise OutOfBoundsError("feed", self.feed, f"at least {LEAST_SPEED:g}", "m/s")

    @property
    def begin(self) -> Vector3:
        """Where the platform is when the program begins [m]."""
        return self.start or self.home or NOWHERE


def load_settings(file: str | Path, others: ProgramSettings | None = None) -> ProgramSettings:
    """Read settings from a YAML file.

    Its lengths are in the unit that it names. If it names none, they are in mm if it names a
    dialect whose programs are in mm, else in m.

    Args:
        file: to be read.
        others: that hold where the file names nothing; None for those by default.

    Raises:
        SettingsError: if it cannot be read, or something in it has no meaning.
    """
    keys = SettingsError.keys_of(file)
    plain = others or ProgramSettings()
    name = keys.choice("dialect", [dialect.value for dialect in Dialect], "")
    dialect = Dialect(name) if name else plain.dialect
    unit = keys.unit("mm" if name and dialect is not Dialect.NIST else "m")

    def places(key: str, plainly: Mapping[Any, Vector3]) -> dict[Any, Vector3]:
        values = keys.value(key, {})
        named = keys.within(key, values)
        return {**plainly, **{name: scaled(named.vector(name), unit) for name in values}}

    def place(key: str, plainly: Vector3 | None) -> Vector3 | None:
        return scaled(keys.vector(key), unit) if keys.has(key) else plainly

    def length(key: str, plainly: float | None) -> float | None:
        return unit * keys.number(key, least=0.0) if keys.has(key) else plainly

    try:
        settings = ProgramSettings(
            dialect,
            place("start", plain.start),
            place("home", plain.home),
            places("offsets", plain.offsets),
            places("tools", plain.tools),
            length("tolerance", plain.tolerance) or 0.0,
            length("feed", plain.feed) or None,
            keys.switch("block_delete", plain.block_delete),
            keys.switch("optional_stop", plain.optional_stop),
            frozenset(each.upper() for each in keys.texts("ignored", sorted(plain.ignored))),
        )
    except SettingsError:
        raise
    except KinematicsError as error:
        raise keys.error(str(error)) from error
    keys.finish()
    return settings


def load_own_settings(file: str | Path) -> ProgramSettings:
    """Read settings; where the ``file`` names nothing, those that come with this package hold.

    Raises:
        SettingsError: if one of them cannot be read, or something in it has no meaning.
    """
    return load_settings(find_file(Path(file)), load_settings(find_file(Path(SETTINGS))))
