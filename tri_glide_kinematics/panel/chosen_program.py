"""The program that is chosen on the page, and what is known of it before and while it runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.machine import Bounds, MachineFacts, clock_text
from tri_glide_kinematics.panel.markup import note, table
from tri_glide_kinematics.panel.program_files import ProgramFolder
from tri_glide_kinematics.panel.program_reading import (
    Answer,
    Mark,
    NotRead,
    Reading,
    ReadingProcess,
    ReadProgram,
    mark_of,
    points_of_line,
    shown_text,
)
from tri_glide_kinematics.programs import Dialect, ProgramCheck, ProgramSettings, load_settings
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text

FROM_SETTINGS = "as in the settings"
LONGEST_LINE = 80  # characters of it that are shown
MOST_TOLD = 5  # words that a program has and the machine does not do


class ChosenProgram:
    """A file of the folder: it is read, and proved where that is asked for.

    Attributes:
        name: of the file; empty for none.
        dialect: in which it is read.
        read: what it means; None before that is known.
        check: the proof of it; None before that is there, or when it holds no more.
        error: why it is not read, or not proved.
    """

    def __init__(
        self, folder: ProgramFolder, settings_file: Path, present: Callable[[], Vector3 | None]
    ) -> None:
        """Choose none yet; the arguments are those of ``ProgramTab``."""
        self.name = ""
        self.dialect = FROM_SETTINGS
        self.read: ReadProgram | None = None
        self.check: ProgramCheck | None = None
        self.error = ""
        self._folder = folder
        self._settings_file = settings_file
        self._present = present
        self._facts: MachineFacts | None = None
        # Bounds for which the proof holds, and whether the machine has others since.
        self._bounds: Bounds | None = None
        self._is_outdated = False
        # Of what was read last: the machine, the marks of both files, and what they do not say.
        self._machine: MachineFacts | None = None
        self._marks: tuple[Mark, Mark] = ((), ())
        self._settings = ProgramSettings()
        self._process: ReadingProcess | None = None
        self._stream: BinaryIO | None = None
        # How long the steps take from each one on, by the check [s].
        self._left: FloatArray = np.zeros(1)

    @property
    def is_in_work(self) -> bool:
        """Whether it is being read or proved."""
        return self._process is not None

    @property
    def in_work(self) -> str:
        """What is being done with it, in words."""
        return f"{self.name} is being {'proved' if self.read is not None else 'read'}"

    @property
    def is_changed(self) -> bool:
        """Whether the files are others than those that were read."""
        return bool(self.name) and self._marks != self._marks_now()

    @property
    def changed(self) -> str:
        """That the files have changed, in words."""
        return f"{self.name}, or the settings of programs, were changed"

    @property
    def path(self) -> Path:
        """Where the file is.

        Raises:
            KinematicsError: if its name is none of a program.
        """
        return self._folder.path(self.name)

    def take_facts(self, facts: MachineFacts) -> None:
        """Take in what machine it is for; its proof holds for the limits of that time."""
        self._facts = facts
        bounds, self._bounds = self._bounds, facts.bounds
        if bounds in (None, self._bounds) or self.read is None:
            return
        # A proof that is under way begins anew, with the new bounds.
        is_check = self.is_in_work
        self._is_outdated |= not is_check and bool(self.check or self.error)
        self.check, self.error = None, ""
        if is_check:
            self.prove()

    @property
    def has_another_machine(self) -> bool:
        """Whether it was read for another machine than the present one; that is told once."""
        machine, self._machine = self._machine, self._facts
        if machine is self._facts or self._facts is None:
            return False
        return machine is None or not machine.is_same_machine(self._facts)

    def load(self) -> None:
        """Begin to read the file that is chosen, in place of what was read before."""
        self.close()
        self.read = self.check = None
        self.error = ""
        self._is_outdated = False
        if self._stream is not None:
            self._stream.close()
            self._stream = None
        if self.name:
            self._marks = self._marks_now()
            try:
                path = self.path
                self._settings = self._settings_now()
            except KinematicsError as error:
                self.error = shown_text(str(error), self._settings_file)
                return
            with suppress(OSError):
                self._stream = path.open("rb")
            self._begin(path, is_check=False)

    def prove(self) -> None:
        """Begin to prove what was read."""
        self.check, self.error, self._is_outdated = None, "", False
        self.close()
        self._begin(self.path, is_check=True)

    def close(self) -> None:
        """End the process that reads, if there is one."""
        if self._process is not None:
            self._process.end()
            self._process = None

    def take_answer(self) -> Answer | None:
        """Take what has been found out about the program; None if that is not there yet."""
        if self._process is None or self._process.answer is None:
            return None
        answer, self._process = self._process.answer, None
        if isinstance(answer, NotRead):
            self.error = answer.reason
        elif isinstance(answer, ProgramCheck):
            self.check = answer
            self._left = np.append(np.cumsum(answer.durations[::-1])[::-1], 0.0)
        else:
            self.read = answer
        return answer

    def _begin(self, path: Path, *, is_check: bool) -> None:
        facts, bounds = self._facts, self._bounds
        if facts is not None and bounds is not None:
            self._process = ReadingProcess(
                Reading(path, self._settings, facts.workspace, *bounds, is_check, self._marks[0])
            )

    def _marks_now(self) -> tuple[Mark, Mark]:
        return mark_of(self._folder.folder / self.name), mark_of(self._settings_file)

    def _settings_now(self) -> ProgramSettings:
        """Return what programs do not say themselves."""
        settings = load_settings(self._settings_file)
        if self.dialect != FROM_SETTINGS:
            settings = replace(settings, dialect=Dialect(self.dialect))
        if settings.start is None and settings.home is None:
            settings = replace(settings, start=self._present())
        return settings

    # Texts for the page

    @property
    def outside(self) -> str:
        """Which line leads outside the workspace, in words; empty for none."""
        if self.read is None or not self.read.outside:
            return ""
        return f"line {self.read.outside:,} leads outside the workspace"

    def text(self, *, is_running: bool) -> str:
        """Return what is known of it, for the page."""
        parts = []
        if self.is_in_work:
            parts.append(note(f"{self.in_work} ..."))
        if is_running and self.is_changed:
            text = f"{self.changed}: what runs is what was read before"
            parts.append(note(text, is_bad=True))
        if self.outside:
            parts.append(note(f"{self.outside} (drawn in red)", is_bad=True))
        if self.error:
            parts.append(note(self.error, is_bad=True))
        if self._is_outdated:
            text = "the limits or the shaper have changed since the check: check again"
            parts.append(note(text, is_bad=True))
        if self.read is not None:
            parts.append(table(self._facts_of(self.read)))
            told = self.read.program.told
            words = [f"line {each.line}: {each.word}: {each.reason}" for each in told[:MOST_TOLD]]
            if len(told) > MOST_TOLD:
                words.append(f"and {len(told) - MOST_TOLD} more")
            if words:
                parts.append(note(f"not done: {'; '.join(words)}"))
        return "".join(parts)

    def _facts_of(self, read: ReadProgram) -> list[tuple[str, ...]]:
        rows: list[tuple[str, ...]] = [("lines", f"{read.program.lines:,}")]
        for name, low, high in zip("xyz", read.lower, read.upper):
            rows.append((name, f"{_millimetres(low)} to {_millimetres(high)} mm"))
        if self.check is not None:
            rows.append(("way", f"{_millimetres(self.check.length)} mm"))
            rows.append(("duration", clock_text(self.check.duration)))
        else:
            rows.append(("duration", "not known before the check"))
        return rows

    def time_left(self, line: int, way: float) -> float | None:
        """Return how long the program takes from a ``line`` on [s]; None before the check.

        ``way`` is what is left of the present path [m]; NaN if that is not known.
        """
        read = self.read
        if read is None or self.check is None:
            return None
        present = read.steps_at(line)
        left = float(self._left[present.stop])
        for index in present:
            for run in read.program.steps[index].runs:
                behind = len(run.lines) - int(np.searchsorted(run.lines, line))
                part = behind / len(run.lines)
                if math.isfinite(way):
                    part = min(way / read.ways[index], 1.0)
                left += part * self.check.durations[index]
        return left

    def text_of(self, line: int) -> str:
        """Return what stands in a ``line`` of the file that was read."""
        starts = self.read.line_starts if self.read is not None else ()
        if self._stream is None or not 0 < line < len(starts):
            return ""
        begin, end = int(starts[line - 1]), int(starts[line])
        try:
            self._stream.seek(begin)
            text = self._stream.read(min(end - begin, 4 * LONGEST_LINE))
        except OSError:
            return ""
        return text.decode("utf-8", "replace").strip()[:LONGEST_LINE]

    def points_at(self, line: int) -> FloatArray:
        """Return the polyline that a ``line`` drives. Shape (n, 3) [m]; empty for none."""
        places: FloatArray = np.empty((0, 3))
        if self.read is not None and line:
            for index in self.read.steps_at(line):
                for run in self.read.program.steps[index].runs:
                    places = points_of_line(run, line)
        return places


def _millimetres(length: float) -> str:
    return number_text(round(1000.0 * length, 3))
