"""The words of a program: a letter and a number each, line by line.

Ordinary lines are read thousands at a time. A line that is not ordinary (a word without a number, a
text, a wrong checksum) is read word by word when it is its turn, so that what stands behind the end
of a program does not matter.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
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

# Kinds of a byte as the reader takes it.
SPACE, LETTER, NUMBER, LINE_END, OTHER = range(5)
KINDS = np.full(256, OTHER, dtype=np.uint8)
for _kind, _bytes in (
    (SPACE, b" \t"),
    (LETTER, b"ABCDEFGHIJKLMNOPQRSTUVWXYZ"),
    (NUMBER, b"0123456789+-."),
    (LINE_END, b"\n"),
):
    KINDS[list(_bytes)] = _kind

# Leaves the numbers of a text.
WITHOUT_LETTERS = bytes(code if KINDS[code] == NUMBER else 32 for code in range(256))

# Of comments in brackets, one may stand within another.
COMMENT = re.compile(rb"\((?:[^()\n]|\([^()\n]*\))*\)|;[^\n]*")
CHECKSUM = re.compile(rb"\*[ \t]*(\d{1,3})[ \t]*$", re.MULTILINE)

# The same, for a line that is read word by word.
GAP = re.compile(r"(?:[ \t]|\((?:[^()]|\([^()]*\))*\)|;.*)*")
NAME = re.compile(r"[A-Za-z_]{2,}|\$[^\s;(]*")
FIRST_NAME = re.compile(rb"^[ \t]*([A-Z_]{2,})", re.MULTILINE | re.IGNORECASE)
SIGNED = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
WORD = re.compile(rf"([A-Za-z])(?:[ \t]*({SIGNED})(?![0-9.+-])|[ \t]*(\"[^\"]*\"))?")
LINE_CHECKSUM = re.compile(r"\*[ \t]*([0-9]+)[ \t]*(?:;.*)?$")
EXPONENT = re.compile(r"[Ee][-+]?[0-9]")
STRAY = re.compile(r"[^\s;(]+")
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


class Block(NamedTuple):
    """The words of some lines in succession.

    Attributes:
        first: number of the first line, from 1.
        letters: of all words.
        values: of all words.
        ends: how many words there are up to the end of each line.
        unusual: indices of the lines that have to be read alone; they have no words here.
    """

    first: int
    letters: str
    values: list[float]
    ends: list[int]
    unusual: frozenset[int]


class WordReader:
    """Reads the words of one program."""

    def __init__(
        self, file: str | Path, data: bytes, texts: frozenset[str], skips: bool, extrudes: bool
    ) -> None:
        """Prepare to read ``data``.

        Args:
            file: where they are from, for the texts of errors.
            data: the program.
            texts: commands, as ``M117``, behind which nothing of a line is read that is not
                ordinary.
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
        self._texts = texts
        self._skips = skips
        self._extrudes = extrudes

    @property
    def ends_in_a_line(self) -> bool:
        """Whether the last line has no end, as that of a file that is cut off."""
        return not self._data.endswith(b"\n")

    def names(self) -> list[str]:
        """Return the commands of several letters that lines begin with, each once."""
        found = dict.fromkeys(name.decode().upper() for name in FIRST_NAME.findall(self._data))
        return [name for name in found if not BRANCH.match(name)]

    def blocks(self, tell_part: TellPart) -> Iterator[Block]:
        """Yield all words, some lines after the other; ``tell_part`` gets the part that is done."""
        begin, line = 0, 1
        while begin < len(self._data):
            end = self._data.find(b"\n", min(begin + BLOCK, len(self._data))) + 1
            part = self._data[begin : end or len(self._data)]
            whole = part if part.endswith(b"\n") else part + b"\n"
            block = _block(whole, line, self._extrudes)
            yield block
            begin += len(part)
            line += len(block.ends)
            tell_part(begin / len(self._data))

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
            is_command = word.value is not None and f"{word.letter}{word.value:g}" in self._texts
            if is_command or word.letter in (NAMED, PERCENT):
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
    if KINDS[ord(rest[0]) % 256] == NUMBER:
        return "no letter stands before it"
    if rest.startswith(","):
        return "a number has a point, not a comma"
    return "this is no word: a letter and a number"


def _why_no_number(behind: str) -> str:
    if behind[0] in "#[":
        return "parameters and expressions are not understood; write the number instead"
    return f"{behind.split()[0]!r} is none"


def _block(data: bytes, first: int, extrudes: bool) -> Block:
    """Return the words of some whole lines, of which the ``first`` one has this number."""
    text = data.upper()
    if b";" in text or b"(" in text:
        text = COMMENT.sub(lambda found: b" " * len(found[0]), text)
    line_ends = np.flatnonzero(np.frombuffer(text, np.uint8) == ord("\n"))
    if b"*" in text:
        text = _without_checksums(data, text, line_ends)
    unusual = _unusual_lines(text, line_ends, extrudes)
    while True:
        if len(unusual):
            text = _without_lines(text, line_ends, unusual)
        try:
            values = list(map(float, text.translate(WITHOUT_LETTERS).split()))
        except ValueError:
            values = [math.inf]
        if np.abs(np.fromiter(values, float, len(values))).max(initial=0.0) <= LARGEST_NUMBER:
            break
        # One of them is no number, or too large. Who is at this line finds out which.
        unusual = np.arange(len(line_ends))
    codes = np.frombuffer(text, np.uint8)
    places = np.flatnonzero(KINDS[codes] == LETTER)
    letters = codes[places].tobytes().decode("ascii")
    ends = np.searchsorted(places, line_ends).tolist()
    return Block(first, letters, values, ends, frozenset(unusual.tolist()))


def _without_checksums(data: bytes, text: bytes, line_ends: NDArray[np.intp]) -> bytes:
    """Return ``text`` without the checksums that are right; others stay, and are no words."""
    found = list(CHECKSUM.finditer(text))
    stars = np.array([each.start() for each in found], dtype=np.intp)
    said = np.array([int(each[1]) for each in found])
    lines = np.searchsorted(line_ends, stars)
    starts = np.concatenate(([0], line_ends[:-1] + 1))[lines]
    # From each line's start to its star, and from there to the next start, which does not count.
    bounds = np.stack((starts, stars), axis=1).ravel()
    if not len(bounds) or (stars == starts).any():
        return text
    sums = np.bitwise_xor.reduceat(np.frombuffer(data, np.uint8), bounds)[::2]
    made = bytearray(text)
    for each in np.flatnonzero(sums == said).tolist():
        made[found[each].start() : found[each].end()] = b" " * len(found[each][0])
    return bytes(made)


def _unusual_lines(text: bytes, line_ends: NDArray[np.intp], extrudes: bool) -> NDArray[np.intp]:
    """Return the indices of the lines that are no row of letters with a number each."""
    codes = np.frombuffer(text, np.uint8)
    kinds = KINDS[codes]
    if not extrudes:
        # An E that may begin an exponent is no letter.
        kinds[1:][(codes[1:] == ord("E")) & (kinds[:-1] == NUMBER)] = OTHER
    places = np.flatnonzero(kinds != SPACE)
    solid = kinds[places]
    is_letter, is_number = solid == LETTER, solid == NUMBER
    begins = is_number.copy()
    begins[1:] &= ~(is_number[:-1] & (np.diff(places) == 1))
    wrong = solid == OTHER
    # The last one is the end of a line.
    wrong[:-1] |= is_letter[:-1] & ~begins[1:]
    wrong[1:] |= begins[1:] & ~is_letter[:-1]
    wrong[0] |= begins[0]
    found = np.searchsorted(line_ends, places[wrong])
    return np.asarray(found[np.diff(found, prepend=-1) > 0])


def _without_lines(text: bytes, line_ends: NDArray[np.intp], lines: NDArray[np.intp]) -> bytes:
    made = bytearray(text)
    for line in lines.tolist():
        begin = int(line_ends[line - 1]) + 1 if line else 0
        end = int(line_ends[line])
        made[begin:end] = b" " * (end - begin)
    return bytes(made)
