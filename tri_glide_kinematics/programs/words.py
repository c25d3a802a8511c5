"""The words of a program: a letter and a number each, line by line.

A line that is not ordinary (a word without a number, a text, a wrong checksum) is read word by word
when it is its turn, so that what stands behind the end of a program does not matter.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, reduce
from operator import xor
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.keys import FileError

# So much of a program is read together [bytes].
BLOCK = 1 << 19

# No number of a word is larger. Numbers of outputs have 32 bits in messages, and products of
# numbers with units and parts stay finite.
LARGEST_NUMBER = 1e9

# No more of a word is written into a text [characters].
LONGEST_WORD = 60

# Of comments in brackets, one may stand within another.
COMMENT = re.compile(rb"\((?:[^()\n]|\([^()\n]*\))*\)|;[^\n]*")
CHECKSUM = re.compile(rb"\*[ \t]*(\d{1,3})[ \t]*$")

# An ordinary line, without comments: words with numbers whose size is no question. Each number can
# be matched in one way only, so that a line that is none is soon found out.
ORDINARY_WORD = rb"[ \t]*[A-Z][ \t]*[-+]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+)"
# Leaves the numbers of such a line, or takes them away.
SPACES_FOR_LETTERS = bytes(32 if chr(code).isalpha() else code for code in range(128)) + bytes(128)
NO_LETTERS = b"0123456789+-. \t"

# The same, for a line that is read word by word.
GAP = re.compile(r"(?:[ \t]|\((?:[^()]|\([^()]*\))*\)|;.*)*")
NAME = re.compile(r"[A-Za-z_]{2,}|\$[^\s;(]*")
FIRST_NAME = re.compile(rb"^[ \t]*([A-Z_]{2,})", re.MULTILINE | re.IGNORECASE)
SIGNED = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
WORD = re.compile(rf"([A-Za-z])(?:[ \t]*({SIGNED})(?![0-9.+-])|[ \t]*(\"[^\"]*\"))?")
LINE_CHECKSUM = re.compile(r"\*[ \t]*([0-9]+)[ \t]*(?:;.*)?$")
EXPONENT = re.compile(r"[Ee][-+]?[0-9]")
STRAY = re.compile(r"[^\s;(]+")
# What is no command in a line (a quoted text, a comment), and then one that does not belong to a
# longer word.
NO_COMMAND = re.compile(r"\"[^\"]*\"|\((?:[^()]|\([^()]*\))*\)|;.*")
COMMAND = re.compile(r"(?<![A-Za-z_])[GM][ \t]*[0-9]", re.IGNORECASE)
# Of a subroutine, a branch or a loop of RS274/NGC (a number of a program has no name behind it),
# and of RepRapFirmware.
BRANCH = re.compile(
    r"[ \t]*(?:O(?:<|[ \t]*\d+[ \t]*[a-z]{2})"
    r"|(?:if|elif|else|while|break|continue|var|global|set|abort)\b)",
    re.IGNORECASE,
)

# Letters of words that are none: a name of several letters (or an order to grbl, which begins with
# $), and the sign at both ends of a program.
NAMED, PERCENT = "@", "%"


class ProgramError(FileError):
    """Something in a program is not understood, or cannot be driven; nothing of it is.

    Attributes:
        line: number of the line, from 1; 0 if it is about the whole file.
        column: number of the character in it, from 1; 0 if it is about the whole line.
        word: as it is written; empty if there is none.
    """

    def __init__(self, file: str | Path, line: int, column: int, word: str, reason: str) -> None:
        """Store where it is, the ``word``, and the ``reason``, which says what would help."""
        counted = (("line", line), ("column", column))
        place = ", ".join(f"{name} {number}" for name, number in counted if number)
        told = word if len(word) <= LONGEST_WORD else f"{word[:LONGEST_WORD]}..."
        if not told.isprintable():
            # A terminal obeys some characters; they are written as in Python instead.
            told = repr(told)[1:-1]
        super().__init__(file, place, f"{told}: {reason}" if word else reason)
        self.line = line
        self.column = column
        self.word = word


class Word(NamedTuple):
    """A word of a line that is read alone.

    Attributes:
        letter: in upper case; ``NAMED`` or ``PERCENT`` for what is none.
        value: its number; None if it has none, or a text.
        column: of its letter, from 1.
        text: as it is written.
    """

    letter: str
    value: float | None
    column: int
    text: str


# Gets which part of a long work is done, from 0 to 1.
TellPart = Callable[[float], object]


def tell_nobody(_: float) -> None:
    """Tell nobody which part of a work is done."""


class WordReader:
    """Reads the words of one program."""

    def __init__(
        self,
        file: str | Path,
        data: bytes,
        texts: frozenset[str],
        told: frozenset[str],
        skips: bool,
        extrudes: bool,
    ) -> None:
        """Prepare to read ``data``.

        Args:
            file: where they are from, for the texts of errors.
            data: the program.
            texts: commands, as ``M117``, behind which nothing of a line is read that is not
                ordinary.
            told: others, as ``M104``, of which the same is true unless a command stands there.
            skips: whether a line that begins with a slash is left out.
            extrudes: whether an E right behind a number is a word of its own; else the number has
                an exponent, which is not understood.

        Raises:
            ProgramError: if it is a text in UTF-16, or none.
        """
        self._file = file
        if data.startswith((b"\xff\xfe", b"\xfe\xff")) or data[:2].count(0) == 1:
            reason = "is no text in UTF-8 or ASCII, but in UTF-16 as it seems: save it as UTF-8"
            raise ProgramError(file, 0, 0, "", reason)
        if data.startswith(b"\0"):
            reason = "is no text in UTF-8 or ASCII: it begins with zero bytes, as a damaged file"
            raise ProgramError(file, 0, 0, "", reason)
        # Ctrl-Z is the end of a file of DOS.
        data = data.removeprefix(b"\xef\xbb\xbf").removesuffix(b"\x1a")
        if b"\r" in data:
            data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        self._data = data
        self._texts, self._told = texts, told
        self._skips = skips
        self._extrudes = extrudes
        # An E that may begin an exponent is no letter.
        of_number = b"" if extrudes else b"(?!E)"
        self._ordinary = re.compile(rb"(?:%b%b)*[ \t]*" % (ORDINARY_WORD, of_number))

    @property
    def ends_in_a_line(self) -> bool:
        """Whether the last line has no end, as that of a file that is cut off."""
        return not self._data.endswith(b"\n")

    def names(self) -> list[str]:
        """Return the commands of several letters that lines begin with, each once."""
        found = dict.fromkeys(name.decode().upper() for name in FIRST_NAME.findall(self._data))
        return [name for name in found if not BRANCH.match(name)]

    @property
    def count(self) -> int:
        """Number of lines."""
        return self._data.count(b"\n") + bool(self._data and self.ends_in_a_line)

    def lines(self, tell_part: TellPart) -> Iterator[tuple[int, str, list[float] | None]]:
        """Yield each line that says something: its number, letters and numbers of its words.

        A line that has to be read alone has no numbers here. ``tell_part`` gets the part that is
        done, now and then.
        """
        begin, number, size = 0, 0, len(self._data)
        is_ordinary = self._ordinary.fullmatch
        while begin < size:
            end = self._data.find(b"\n", min(begin + BLOCK, size)) + 1 or size
            sources = self._data[begin:end].removesuffix(b"\n")
            text = COMMENT.sub(lambda found: b" " * len(found[0]), sources.upper())
            for source, line in zip(sources.split(b"\n"), text.split(b"\n")):
                number += 1
                if b"*" in line:
                    line = _without_checksum(source, line)
                if not is_ordinary(line):
                    yield number, "", None
                elif letters := line.translate(None, NO_LETTERS).decode():
                    yield number, letters, [*map(float, line.translate(SPACES_FOR_LETTERS).split())]
            begin = end
            tell_part(begin / size)

    def error(self, line: int, index: int, reason: str) -> ProgramError:
        """Return the error about a word of a line.

        Args:
            line: its number.
            index: of the word; negative if it is about the whole line.
            reason: what is wrong, and what would help.
        """
        words = self.words_of(line) if line else []
        if not 0 <= index < len(words):
            return ProgramError(self._file, line, 0, "", reason)
        return ProgramError(self._file, line, words[index].column, words[index].text, reason)

    def words_of(self, line: int) -> list[Word]:
        """Return the words of one line.

        Raises:
            ProgramError: if it is no row of words.
        """
        source = self._data[self._starts[line - 1] : self._starts[line]].removesuffix(b"\n")
        text = source.decode("utf-8", errors="replace")
        words: list[Word] = []
        place = len(text) - len(text.lstrip(" \t/"))
        if "/" in text[:place] and self._skips:
            return words
        while (place := self._gap_end(text, place)) < len(text):
            if text[place] == "*" and self._is_checked(source, text, line, place):
                break
            word = self._word(text, line, place, is_first=all(each.letter == "N" for each in words))
            words.append(word)
            place += len(word.text)
            name = "" if word.value is None else f"{word.letter}{word.value:g}"
            is_told = name in self._told and not COMMAND.search(NO_COMMAND.sub(" ", text[place:]))
            if is_told or name in self._texts or word.letter in (NAMED, PERCENT):
                break
        return words

    @cached_property
    def _starts(self) -> NDArray[np.int64]:
        """Where each line begins, and the end."""
        ends = np.flatnonzero(np.frombuffer(self._data, np.uint8) == ord("\n")) + 1
        last = [] if self._data.endswith(b"\n") else [len(self._data)]
        return np.concatenate(([0], ends, last)).astype(np.int64)

    def _gap_end(self, text: str, place: int) -> int:
        found = GAP.match(text, place)
        return found.end() if found else place

    def _is_checked(self, source: bytes, text: str, line: int, place: int) -> bool:
        """Check the checksum at a ``place`` of a line, if it is one."""
        found = LINE_CHECKSUM.match(text, place)
        if not found:
            return False
        expected = 0
        for code in source[: len(text[:place].encode())]:
            expected ^= code
        if int(found[1]) != expected:
            reason = f"the checksum of this line is {expected}: it has been changed, or damaged"
            raise ProgramError(self._file, line, place + 1, found[0].strip(), reason)
        return True

    def _word(self, text: str, line: int, place: int, is_first: bool) -> Word:
        """Return the word at a ``place`` of a line."""
        if text[place] == PERCENT:
            found = STRAY.match(text, place)
            return Word(PERCENT, None, place + 1, found[0] if found else PERCENT)
        if BRANCH.match(text):
            reason = "subroutines, branches, loops and variables are not understood: write out the "
            raise ProgramError(
                self._file, line, place + 1, text.strip(), f"{reason}lines that they lead to"
            )
        name = NAME.match(text, place) if is_first else None
        if name:
            return Word(NAMED, None, place + 1, name[0])
        found = WORD.match(text, place)
        stray = STRAY.match(text, place)
        written = stray[0] if stray else text[place]
        if not found:
            reason = _why_no_word(text[place:])
            raise ProgramError(self._file, line, place + 1, written, reason)
        letter, number, quoted = found.groups()
        behind = text[found.end() : found.end() + 1]
        if number is None and quoted is None and behind not in ("", " ", "\t", ";", "(", "*"):
            reason = f"{letter} has no number: {_why_no_number(text[found.end() :])}"
            raise ProgramError(self._file, line, place + 1, written, reason)
        if number is not None and not self._extrudes and EXPONENT.match(text, found.end()):
            reason = f"{letter} has a number with an exponent: write it without"
            raise ProgramError(self._file, line, place + 1, written, reason)
        value = None if number is None else float(number)
        if value is not None and abs(value) > LARGEST_NUMBER:
            reason = f"its number must be from {-LARGEST_NUMBER:.0f} to {LARGEST_NUMBER:.0f}"
            raise ProgramError(self._file, line, place + 1, found[0].rstrip(), reason)
        return Word(letter.upper(), value, place + 1, found[0].rstrip())


class Told(NamedTuple):
    """Something that a program says and that is not done.

    Attributes:
        word: a letter or a command.
        line: the first that says it.
        reason: why it is not done.
    """

    word: str
    line: int
    reason: str


class Remarks:
    """What is to be said of the present line: errors, and what is not done.

    Attributes:
        line: its number, from 1.
    """

    def __init__(self, reader: WordReader) -> None:
        """Prepare to say something of the lines of a ``reader``."""
        self.line = 0
        self._reader = reader
        self._told: dict[str, Told] = {}

    def fail(self, index: int, reason: str) -> NoReturn:
        """Raise the error about a word of the line; negative for all of it."""
        raise self._reader.error(self.line, index, reason)

    def fail_at(self, letters: str, reason: str) -> NoReturn:
        """Raise the error about the first word of the line with one of these ``letters``."""
        words = self._reader.words_of(self.line)
        self.fail(next((n for n, word in enumerate(words) if word.letter in letters), -1), reason)

    def tell(self, word: str, reason: str) -> None:
        """Tell that a ``word`` is not done, with the ``reason``; once only."""
        self._told.setdefault(word, Told(word, self.line, reason))

    @property
    def told(self) -> tuple[Told, ...]:
        """What is not done, each once."""
        return tuple(self._told.values())


class Line:
    """The words of a line, each to be taken by whoever gives it a meaning.

    Attributes:
        commands: index of each word G, and then of each word M, by its name, such as ``G59.1``.
        fail: raises the error about the word with an index; negative for the whole line.
        axes_are_taken: whether a command has given X, Y and Z a meaning that is no motion.
    """

    def __init__(
        self,
        letters: str,
        values: Sequence[float | None],
        fail: Callable[[int, str], NoReturn],
    ) -> None:
        """Take the ``letters`` of the words, and the number of each."""
        self.fail = fail
        self.axes_are_taken = False
        self._words: dict[str, tuple[float | None, int]] = {}
        commands: dict[str, dict[str, int]] = {"G": {}, "M": {}}
        for index, (letter, value) in enumerate(zip(letters, values)):
            if letter in commands:
                name = self._command(letter, value, index)
                if name in commands[letter]:
                    fail(index, "it stands twice on this line")
                commands[letter][name] = index
            elif letter not in self._words:
                self._words[letter] = value, index
            elif letter != "N":
                # M110 sets the number of the line that it stands on.
                fail(index, f"{letter} stands twice on this line: make two lines of it")
        self.commands = commands["G"] | commands["M"]

    def _command(self, letter: str, value: float | None, index: int) -> str:
        """Return the name of a command."""
        tenfold = -1 if value is None else round(10.0 * value)
        if value is None or abs(10.0 * value - tenfold) > 1e-6 or tenfold < 0:
            self.fail(index, "this is no number of a command")
        return f"{letter}{tenfold / 10:g}"

    def index(self, letter: str) -> int:
        """Return the index of a word that is not taken yet, -1 if there is none."""
        return self._words[letter][1] if letter in self._words else -1

    def having(self, letters: str) -> list[str]:
        """Return the ``letters`` whose words are there, and not taken yet."""
        return [letter for letter in letters if letter in self._words]

    def take(self, letter: str) -> float | None:
        """Return the number of a word, which has a meaning then; None if there is none."""
        if letter not in self._words:
            return None
        value, index = self._words.pop(letter)
        if value is None:
            self.fail(index, f"{letter} has no number")
        return value

    def whole(self, letter: str) -> int | None:
        """Return the number of a word that is whole and not negative."""
        index = self.index(letter)
        value = self.take(letter)
        if value is None:
            return None
        if value < 0.0 or value != int(value):
            self.fail(index, "it must be a whole number, at least 0")
        return int(value)

    def drop(self, letter: str) -> bool:
        """Leave out a word, with or without a number; return whether it is there."""
        return self._words.pop(letter, None) is not None

    def finish(self) -> None:
        """Check that each word has had a meaning."""
        for letter, (value, index) in self._words.items():
            if value is None:
                self.fail(index, f"{letter} has no number")
            if letter in "ABCUVW":
                if value == 0.0:
                    # Where an axis stays, the tool does not turn.
                    continue
                self.fail(index, f"there is no axis {letter}: the platform only translates")
            self.fail(
                index, f"{letter} has no meaning on this line: take it away if it is not needed"
            )


def _why_no_word(rest: str) -> str:
    if rest.startswith("("):
        if ")" in rest:
            return "a comment needs as many ) as it has (, two at most: leave the inner ones out"
        return "the comment has no end: ) is missing on its line"
    if rest[0] in "#[":
        return "parameters and expressions are not understood: write numbers instead"
    if rest[0] in "0123456789+-.":
        return "no letter stands before it"
    if rest.startswith(","):
        return "a number has a point, not a comma"
    return "this is no word: a letter and a number"


def _why_no_number(behind: str) -> str:
    if behind[0] in "#[":
        return "parameters and expressions are not understood; write the number instead"
    return f"{behind.split()[0]!r} is none"


def _without_checksum(source: bytes, line: bytes) -> bytes:
    """Return a ``line`` without its checksum if that is right for its ``source``."""
    found = CHECKSUM.search(line)
    if found and reduce(xor, source[: found.start()], 0) == int(found[1]):
        return line[: found.start()]
    return line
