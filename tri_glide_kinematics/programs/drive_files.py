"""Drive files: the steps of a file such as ``config/drive_example.yaml``.

All of a file is checked before anything moves, as far as that is possible without the machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.keys import FileError, Keys
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.programs.program import Dwell, MoveStep, PathStep, Step, Work
from tri_glide_kinematics.vectors import Vector3, scaled, three


class DriveFileError(FileError):
    """A file of moves, paths and waits cannot be read, or something in it has no meaning."""


STEPS = ("move", "path", "wait")
SEGMENTS = {
    "line": SegmentKind.LINE,
    "arc": SegmentKind.ARC_THROUGH,
    "circle": SegmentKind.ARC_ABOUT,
}


@dataclass(frozen=True)
class DriveFile(Work):
    """The contents of a drive file.

    Attributes:
        frame: of all places; empty for that of the machine.
        steps: in their order.
        file: where it is from.
    """

    lines = size = 0
    sha256 = ""

    frame: str
    steps: tuple[Step, ...]
    file: str = ""


class _Numbers(NamedTuple):
    """A segment as numbers [m], [rad], with tolerance [m] and speed [m/s], 0 for none."""

    kind: SegmentKind
    numbers: tuple[float, ...]
    tolerance: float
    speed: float


def load_drive(file: str | Path) -> DriveFile:
    """Read a file.

    Raises:
        DriveFileError: if it cannot be read, or something in it has no meaning; the text names
            file, step and number.
    """
    return _Reader(str(file), DriveFileError.keys_of(file)).drive()


class _Reader:
    """Reads the steps of one file, each from where the one before it ends."""

    def __init__(self, file: str, keys: Keys) -> None:
        self._file = file
        self._keys = keys
        self._unit = keys.unit()
        defaults = keys.within("defaults", keys.value("defaults", {}))
        self._tolerance = defaults.number("tolerance", 0.0, least=0.0)
        self._speed = defaults.number("speed", 0.0, least=0.0)
        defaults.finish()
        self._here: Vector3 | None = None

    def drive(self) -> DriveFile:
        frame = self._keys.text("frame", "")
        entries = self._keys.entries("steps")
        self._keys.finish()
        steps = tuple(self._step(*each) for each in enumerate(entries, 1))
        return DriveFile(frame, steps, self._file)

    def _step(self, number: int, entry: Any) -> Step:
        place = f"step {number}"
        kind, keys = self._kind_of(place, entry, STEPS)
        try:
            step = self._read(kind, keys)
        except DriveFileError:
            raise
        except KinematicsError as error:
            raise keys.error(str(error)) from error
        keys.finish()
        return step

    def _kind_of(self, place: str, entry: Any, kinds: tuple[str, ...]) -> tuple[str, Keys]:
        """Return the kind of an entry, and its keys."""
        kind, values = self._keys.within(place, entry).one_of(kinds)
        return kind, self._keys.within(f"{place} ({kind})", values)

    def _read(self, kind: str, keys: Keys) -> Step:
        if kind == "wait":
            return Dwell(keys.number("seconds", least=0.0))
        if kind == "move":
            self._here = self._place(keys, "to")
            return MoveStep(self._here, self._unit * keys.number("speed", 0.0, least=0.0))
        entries = keys.entries("segments")
        segments = [
            self._segment(f"{keys.place}, segment {number}", entry)
            for number, entry in enumerate(entries, 1)
        ]
        return self._path(segments)

    def _path(self, segments: Sequence[_Numbers]) -> PathStep:
        flat = FlatPath.of(
            [segment.kind for segment in segments],
            [number for segment in segments for number in segment.numbers],
            [segment.tolerance for segment in segments],
            [segment.speed for segment in segments],
            0.0,
        )
        if self._here is not None:
            path = at_once(flat.path_from(self._here))
            self._here = path.end
            return PathStep(flat, path)
        last = segments[-1]
        if last.kind != SegmentKind.ARC_ABOUT:
            self._here = three(last.numbers[-3:])
        return PathStep(flat, None)

    def _segment(self, place: str, entry: Any) -> _Numbers:
        kind, keys = self._kind_of(place, entry, tuple(SEGMENTS))
        numbers: tuple[float, ...]
        if kind == "line":
            numbers = self._place(keys, "to")
        elif kind == "arc":
            numbers = (*self._place(keys, "via"), *self._place(keys, "to"))
        else:
            angle = math.radians(keys.number("angle"))
            numbers = (*self._place(keys, "centre"), *keys.vector("axis"), angle)
        tolerance = self._unit * keys.number("tolerance", self._tolerance, least=0.0)
        speed = self._unit * keys.number("speed", self._speed, least=0.0)
        # For people.
        keys.text("name", "")
        keys.finish()
        return _Numbers(SEGMENTS[kind], numbers, tolerance, speed)

    def _place(self, keys: Keys, key: str) -> Vector3:
        return scaled(keys.vector(key), self._unit)
