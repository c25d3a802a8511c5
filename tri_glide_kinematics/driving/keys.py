"""Reads the keys of one entry of a YAML file; those that nobody reads are mistakes."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping
from typing import Any

from tri_glide_kinematics.driving.errors import DriveFileError
from tri_glide_kinematics.vectors import Vector3

# Longer values are shortened in texts.
LONGEST_TEXT = 80
_SHORT = reprlib.Repr()
_SHORT.maxother = _SHORT.maxstring = _SHORT.maxlong = LONGEST_TEXT


class Keys:
    """The keys of one entry, each read by its name.

    Attributes:
        place: of the entry, for the texts of errors.
    """

    def __init__(self, file: str, place: str, values: Any) -> None:
        """Read from ``values``.

        Raises:
            DriveFileError: if they are no keys with values.
        """
        self.place = place
        self._file = file
        self._known: list[str] = []
        if not isinstance(values, Mapping):
            raise self.error(f"is {shortened(values)}, must be keys with values")
        self._values = values

    def error(self, reason: str, key: str = "") -> DriveFileError:
        """Return the error that says the ``reason``, about a ``key`` or the whole entry."""
        return DriveFileError(self._file, ", ".join(filter(None, (self.place, key))), reason)

    def value(self, key: str, default: Any = None) -> Any:
        """Return what stands under a ``key``, as it is.

        Raises:
            DriveFileError: if nothing does, and there is no default.
        """
        self._known.append(key)
        value = self._values.get(key, default)
        if value is None:
            raise self.error("is missing", key)
        return value

    def one_of(self, names: tuple[str, ...]) -> tuple[str, Any]:
        """Return the only key and its value.

        Raises:
            DriveFileError: if there is another key than these ``names``, or more than one.
        """
        if len(self._values) != 1 or next(iter(self._values)) not in names:
            found = ", ".join(map(str, self._values)) or "nothing"
            raise self.error(f"has {found}, must have one of {', '.join(names)}")
        ((key, value),) = self._values.items()
        return str(key), value

    def number(self, key: str, default: float | None = None, *, least: float = -math.inf) -> float:
        """Return a number, which is ``least`` at least.

        Raises:
            DriveFileError: if it is none, or less, or not finite.
        """
        number = self._number(key, self.value(key, default))
        if number < least:
            raise self.error(f"is {number:g}, must be at least {least:g}", key)
        return number

    def vector(self, key: str) -> Vector3:
        """Return three numbers.

        Raises:
            DriveFileError: if they are not that.
        """
        value = self.value(key)
        if not isinstance(value, list) or len(value) != 3:
            raise self.error(f"is {shortened(value)}, must be a list of 3 numbers, x, y and z", key)
        x, y, z = (self._number(f"{key}[{index}]", each) for index, each in enumerate(value))
        return x, y, z

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text.

        Raises:
            DriveFileError: if it is none.
        """
        value = self.value(key, default)
        if not isinstance(value, str):
            raise self.error(f"is {shortened(value)}, must be a text", key)
        return value

    def entries(self, key: str) -> list[Any]:
        """Return a list, as it is.

        Raises:
            DriveFileError: if it is none, or empty.
        """
        value = self.value(key)
        if not isinstance(value, list) or not value:
            raise self.error(f"is {shortened(value)}, must be a list of one entry at least", key)
        return value

    def finish(self) -> None:
        """Complain about a key that has not been read.

        Raises:
            DriveFileError: if there is one.
        """
        for key in self._values:
            if key not in self._known:
                raise self.error(f"is not known here; known are {', '.join(self._known)}", str(key))

    def _number(self, key: str, value: Any) -> float:
        # YAML takes 1e-3, without a point, for a word.
        if not isinstance(value, bool) and isinstance(value, (int, float, str)):
            try:
                number = float(value)
            except (ValueError, OverflowError):
                pass
            else:
                if math.isfinite(number):
                    return number
        raise self.error(f"is {shortened(value)}, must be a finite number", key)


def shortened(value: object) -> str:
    """Return a value as it would be written, or the begin of that."""
    text = value if isinstance(value, str) and len(value) > LONGEST_TEXT else _SHORT.repr(value)
    return text if len(text) <= LONGEST_TEXT else f"{text[:LONGEST_TEXT]}..."
