"""The meaning of a program in G-code: paths, dwells, outputs and stops.

A line says at most one motion and what holds from then on (``codes.py``). Whatever is not
understood is an error with line and column, before anything moves. Positions are those of the
platform in metres, whatever the units of the program.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from tri_glide_kinematics.motion.path import LARGEST_SPEED, LEAST_SPEED, SHORTEST
from tri_glide_kinematics.programs.codes import (
    IGNORED_HELP,
    RAPID,
    STRAIGHT,
    carry_out,
    go_home,
    help_of,
    tell_extrusion,
)
from tri_glide_kinematics.programs.dialects import (
    CONCERNING,
    CUSTOMS,
    MOTORS_OFF,
    TEXTS,
    Dialect,
    guess_dialect,
)
from tri_glide_kinematics.programs.machining import Machining
from tri_glide_kinematics.programs.program import Program
from tri_glide_kinematics.programs.settings import ProgramSettings
from tri_glide_kinematics.programs.words import (
    NAMED,
    PERCENT,
    Line,
    ProgramError,
    Remarks,
    TellPart,
    WordReader,
    tell_nobody,
)

# Steps whose square is shorter make no segment [m^2].
SHORTEST_SQUARED = SHORTEST * SHORTEST

_JOG_HELP = "write what is to be driven as lines of G1, and not as jogs"
# So many commands that are not understood are named at once.
MOST_NAMES = 8


class _Straight(NamedTuple):
    """Where the words of a line with a straight move stand; -1 for none."""

    g: int
    x: int
    y: int
    z: int
    f: int


def _straight(letters: str) -> _Straight | None:
    """Return where the words of a line are, if it can be no other than a straight move."""
    if len(set(letters)) < len(letters) or not set(letters) <= set("NGXYZFE"):
        return None
    return _Straight(*(letters.find(letter) for letter in "GXYZF"))


def read_program(
    text: str | bytes,
    settings: ProgramSettings | None = None,
    file: str | Path = "program",
    tell_part: TellPart = tell_nobody,
) -> Program:
    """Find out what a program means.

    Args:
        text: of the program.
        settings: what it does not say itself.
        file: where it is from, for the texts of errors.
        tell_part: gets which part of it is read, now and then.

    Raises:
        ProgramError: if something in it is not understood.
    """
    data = text.encode() if isinstance(text, str) else text
    settings = settings or ProgramSettings()
    if settings.dialect is not None:
        return _Interpreter(str(file), data, settings, settings.dialect).program(tell_part)
    guess = guess_dialect(data)
    dialect = guess.dialect if guess else Dialect.NIST
    program = _Interpreter(str(file), data, settings, dialect).program(tell_part)
    return replace(program, guess=str(guess or "read as nist: nothing shows another dialect"))


class _Interpreter:
    """Goes through the lines of one program."""

    def __init__(self, file: str, data: bytes, settings: ProgramSettings, dialect: Dialect) -> None:
        self._file = file
        self._size, self._digest = len(data), hashlib.sha256(data).hexdigest()
        customs = CUSTOMS[dialect]
        self._ignored, self._told_names = settings.ignored, customs.names
        read = (MOTORS_OFF | CONCERNING.keys()) - settings.ignored
        told = (customs.told | settings.ignored) - read - TEXTS
        skips, extrudes = settings.block_delete, customs.extrudes
        self._reader = WordReader(file, data, TEXTS - read, told, skips, extrudes)
        self._remarks = Remarks(self._reader)
        self._machine = Machining(settings, dialect, self._remarks)
        self._straight: dict[str, _Straight | None] = {}
        self._is_after_percent = False

    def program(self, tell_part: TellPart) -> Program:
        """Return the whole program."""
        machine, remarks, lines = self._machine, self._remarks, self._reader.count
        for remarks.line, letters, values in self._reader.lines(tell_part):
            if values is None:
                self._read_alone()
            else:
                self._read(letters, values)
            if machine.has_ended:
                break
        else:
            self._check_end(lines)
        tell_part(1.0)
        machine.writer.finish()
        if not machine.writer.steps:
            raise ProgramError(self._file, 0, 0, "", "it says nothing that can be done")
        steps = tuple(machine.writer.steps)
        return Program(self._file, steps, self._remarks.told, lines, self._size, self._digest)

    def _read(self, letters: str, values: list[float]) -> None:
        """Carry out an ordinary line."""
        machine, straight = self._machine, self._straight
        # Most lines have the same letters as others before.
        if letters not in straight:
            straight[letters] = _straight(letters)
            if "E" in letters and straight[letters]:
                tell_extrusion(machine)
        places = straight[letters]
        if places is not None and _move_straight(machine, values, places):
            return
        if any(letter == "M" and f"M{value:g}" in TEXTS for letter, value in zip(letters, values)):
            # What stands behind it is a text, though it looks like words.
            self._read_alone()
        else:
            carry_out(machine, Line(letters, values, self._remarks.fail))

    def _read_alone(self) -> None:
        """Carry out a line that is not ordinary."""
        machine, remarks = self._machine, self._remarks
        words = self._reader.words_of(remarks.line)
        if not words:
            return
        if words[0].letter == PERCENT:
            # The first one may begin the program, the second one ends it.
            is_begun = not machine.writer.is_empty or machine.modes.motion is not None
            machine.has_ended = self._is_after_percent or is_begun
            if machine.has_ended and words[0].text.strip(PERCENT):
                remarks.fail(0, "only % alone ends a program: take away what stands behind it")
            self._is_after_percent = True
            return
        for index, word in enumerate(words):
            if word.letter == NAMED:
                self._carry_out_name(word.text.upper(), index)
                return
        letters = "".join(word.letter for word in words)
        carry_out(machine, Line(letters, [word.value for word in words], remarks.fail))

    def _carry_out_name(self, name: str, index: int) -> None:
        """Carry out a line that begins with a name, or an order to grbl."""
        machine, remarks = self._machine, self._remarks
        if name == "$H" and machine.dialect is Dialect.GRBL:
            go_home(machine, Line("", (), remarks.fail), index)
        elif name.startswith("$J") or not self._is_told_name(name):
            help_text = _JOG_HELP if name.startswith("$J") else help_of(name)
            if help_text is IGNORED_HELP:
                names = [each for each in self._reader.names() if not self._is_told_name(each)]
                help_text += f": {', '.join(names[:MOST_NAMES])}"
            remarks.fail(index, f"this command is not understood: {help_text}")
        else:
            remarks.tell(name, "it does not concern the motion")

    def _is_told_name(self, name: str) -> bool:
        return name in self._ignored or name.startswith(self._told_names)

    def _check_end(self, lines: int) -> None:
        """Check that a program without an end of its own is not cut off.

        A last line without an end may be part of a longer one, which matters if it does something.
        """
        self._remarks.line = lines
        if self._reader.ends_in_a_line and lines and self._machine.writer.has_done(lines):
            reason = "this last line has no end, and the program none (M2, M30 or %), so it may be "
            self._remarks.fail(-1, f"{reason}cut off: if it is whole, end the line")


def _move_straight(machine: Machining, values: Sequence[float], places: _Straight) -> bool:
    """Carry out a line with a straight move, or with F alone; return whether it is one.

    If not, nothing has been done. Most lines of most programs are read here, and not word by word.
    """
    g, x, y, z, f = places
    modes = machine.modes
    motion = modes.motion
    if g >= 0:
        code = values[g]
        if code == 1.0:
            motion = STRAIGHT
        elif code == 0.0:
            motion = RAPID
        else:
            return False
    if motion is not STRAIGHT and motion is not RAPID:
        return False
    unit = modes.unit
    if f >= 0:
        speed = values[f] * unit / machine.customs.feed_time
        if not LEAST_SPEED <= speed * machine.feed.part <= LARGEST_SPEED:
            return False
        machine.feed.ask(speed)
    modes.motion = motion
    here, end = machine.here, machine.writer.end
    if modes.absolute:
        shift = machine.offsets.shift
        if x >= 0:
            here[0] = values[x] * unit + shift[0]
        if y >= 0:
            here[1] = values[y] * unit + shift[1]
        if z >= 0:
            here[2] = values[z] * unit + shift[2]
    else:
        if x >= 0:
            here[0] += values[x] * unit
        if y >= 0:
            here[1] += values[y] * unit
        if z >= 0:
            here[2] += values[z] * unit
    dx, dy, dz = here[0] - end[0], here[1] - end[1], here[2] - end[2]
    if dx * dx + dy * dy + dz * dz >= SHORTEST_SQUARED:
        rapid = motion is RAPID
        machine.add_line(rapid, rapid and not machine.customs.rapid_at_feed)
    return True
