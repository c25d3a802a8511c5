"""What is kept of a machine on disk: how far its last program came, work zeros, own buttons.

There is one file of each for each machine. After a lost power supply all are known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import yaml

from tri_glide_kinematics.files import file_of_machine, write_file
from tri_glide_kinematics.keys import FileError, load_yaml
from tri_glide_kinematics.programs.program import Program, Work
from tri_glide_kinematics.programs.settings import NOWHERE, WORK_OFFSETS, ProgramSettings
from tri_glide_kinematics.vectors import Vector3, three

# How often it is kept, a little oftener than once a second [s].
KEEP_PERIOD = 0.8


class KeptError(FileError):
    """A program cannot go on from what is kept: it cannot be read, or is about another program."""


class RunState(Enum):
    """What a run of a program does."""

    RUNNING = "running"
    WAITING = "waiting"
    STOPPING = "stopping"
    ENDED = "ended"


@dataclass(frozen=True)
class KeptLine:
    """How far a program came.

    Attributes:
        program: the file that it is from.
        size: of its text [bytes].
        sha256: of its text, in hexadecimal digits.
        line: that was driven, or would have been the next one.
        state: at that time.
        is_whole: whether all of it has been driven.
    """

    program: str
    size: int
    sha256: str
    line: int
    state: RunState
    is_whole: bool = False

    @classmethod
    def of(cls, program: Work, line: int, state: RunState, is_whole: bool = False) -> KeptLine:
        """Return how far a ``program`` came."""
        file = str(Path(program.file).absolute())
        return cls(file, program.size, program.sha256, line, state, is_whole)

    def write(self, file: Path) -> None:
        """Write this to a ``file``, whose folder is made if there is none.

        Raises:
            OSError: if it cannot be written; what was there before still is.
        """
        _write(file, {**vars(self), "state": self.state.value})


class LineKeeper:
    """Keeps how far a program came, now and then."""

    def __init__(self, file: Path, program: Work, say: Callable[[str], object]) -> None:
        """Keep it in a ``file``; ``say`` gets the reason why that is not possible."""
        self._file: Path | None = file
        self._program = program
        self._say = say
        self._last: KeptLine | None = None
        self._kept_at = -math.inf

    def keep(self, line: int, state: RunState, is_whole: bool, now: float) -> None:
        """Keep it if it is new, or at its time [s]; see ``KeptLine``."""
        is_new = self._last is None or self._last.state is not state
        if self._file is None or not (is_new or now >= self._kept_at + KEEP_PERIOD):
            return
        self._kept_at = now
        told = KeptLine.of(self._program, line, state, is_whole)
        if told == self._last:
            return
        self._last = told
        try:
            told.write(self._file)
        except OSError as error:
            self._say(f"how far the program comes is not kept: {error}")
            self._file = None


def default_kept_file(namespace: str = "") -> Path:
    """Return where it is kept how far the last program of the machine in a ``namespace`` came.

    Raises:
        NoHomeError: if the user has no home.
    """
    return file_of_machine("program_progress", namespace).with_suffix(".yaml")


def _write(file: Path, content: Mapping[str, Any]) -> None:
    """Write what is kept to a ``file``, whose folder is made if there is none."""
    file.parent.mkdir(parents=True, exist_ok=True)
    write_file(file, yaml.safe_dump(dict(content), sort_keys=False))


def load_kept(file: Path) -> KeptLine:
    """Read what is kept in a ``file``.

    Raises:
        KeptError: if it cannot be read, or something in it has no meaning.
    """
    keys = KeptError.keys_of(file)
    state = RunState(keys.choice("state", [each.value for each in RunState]))
    is_whole = keys.switch("is_whole")
    size, line = keys.whole("size", 0), keys.whole("line", 1)
    texts = keys.text("program"), keys.text("sha256")
    keys.finish()
    return KeptLine(texts[0], size, texts[1], line, state, is_whole)


def line_to_go_on_from(file: Path, program: Program) -> int:
    """Return the line from which a ``program`` goes on, by what is kept in a ``file``.

    Raises:
        KeptError: if nothing can be read there, it is about another program, the program has
            changed since, or all of it has been driven.
    """
    kept = load_kept(file)
    if (kept.size, kept.sha256) != (program.size, program.sha256):
        if Path(kept.program) == Path(program.file).absolute():
            reason = f"{program.file} has changed since it was driven up to line {kept.line}"
        else:
            reason = f"the program that was driven last is {kept.program}, not {program.file}"
        raise KeptError(file, "", f"{reason}: choose the line yourself")
    if kept.is_whole:
        raise KeptError(file, "", f"{program.file} has been driven to its end")
    return kept.line


# Work zeros: each takes the place of the offset of the settings with its name.


def default_zeros_file(namespace: str = "") -> Path:
    """Return where the work zeros of the machine in a ``namespace`` are kept.

    Raises:
        NoHomeError: if the user has no home.
    """
    return file_of_machine("work_zero", namespace).with_suffix(".yaml")


def load_zeros(file: Path) -> dict[str, Vector3]:
    """Return the work zeros in a ``file`` by their names, such as ``G54`` [m]; none without it.

    Raises:
        KinematicsError: if it cannot be read, or something in it has no meaning.
    """
    if not file.exists():
        return {}
    keys = KeptError.keys_of(file)
    zeros = {name: keys.vector(name) for name in WORK_OFFSETS if keys.has(name)}
    keys.finish()
    return dict(ProgramSettings(offsets=zeros).offsets)


def write_zeros(file: Path, zeros: Mapping[str, Vector3]) -> None:
    """Keep work zeros [m] in a ``file``, whose folder is made if there is none.

    Raises:
        KinematicsError: if a name or a place has no meaning.
        OSError: if it cannot be written; what was there before still is.
    """
    offsets = ProgramSettings(offsets=zeros).offsets
    _write(file, {name: list(place) for name, place in offsets.items()})


def with_kept_zeros(settings: ProgramSettings, file: Path) -> ProgramSettings:
    """Return ``settings`` in which the work zeros of a ``file`` hold.

    Raises:
        KinematicsError: as for ``load_zeros``.
    """
    return replace(settings, offsets={**settings.offsets, **load_zeros(file)})


def touched_off(zero: Vector3 | None, place: Vector3, axes: Iterable[int], value: float) -> Vector3:
    """Return the work zero with which a ``place`` [m] has a ``value`` [m] along some ``axes``.

    Along the others it stays what it was: ``zero`` [m], that of the machine for None.
    """
    moved = list(zero or NOWHERE)
    for axis in axes:
        moved[axis] = place[axis] - value
    return three(moved)


# Own buttons: short programs of the operator, by their names.


def buttons_file(zeros: Path) -> Path:
    """Return where own buttons are kept: beside the work ``zeros`` of their machine."""
    return zeros.with_suffix(".buttons.yaml")


def load_buttons(file: Path) -> dict[str, str]:
    """Return the programs in a ``file`` by their names; none without it.

    Raises:
        KeptError: if it cannot be read, or something in it has no meaning.
    """
    buttons = load_yaml(file, KeptError) if file.exists() else {}
    if not isinstance(buttons, dict) or not all(
        isinstance(each, str) for each in (*buttons, *buttons.values())
    ):
        raise KeptError(file, "", "must have a text for each name")
    return buttons


def write_buttons(file: Path, buttons: Mapping[str, str]) -> None:
    """Keep programs by their names in a ``file``, whose folder is made if there is none.

    Raises:
        OSError: if it cannot be written; what was there before still is.
    """
    _write(file, buttons)
