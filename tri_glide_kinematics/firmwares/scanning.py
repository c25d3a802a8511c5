"""What stands in the settings of a firmware: each value by its name, with its place.

Klipper: ``printer.cfg`` with its includes and what SAVE_CONFIG appends, where a value that stands
above wins (``klippy/configfile.py``). Marlin: ``Configuration.h`` with its conditions, and what
M503 prints. RepRapFirmware: ``config.g`` with the files that it runs (M98, M501).
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path

from tri_glide_kinematics.keys import FileError, shortened

# Larger files are none of settings [bytes].
MOST_BYTES = 4_000_000
# Files that one includes, and names that one stands for, nested.
DEEPEST = 20
LONGEST_EXPRESSION = 200

SAVED = re.compile(r"#\*# <-+ SAVE_CONFIG -+>")
PREFIX = "#*#"
OPTION = re.compile(r"([^:=\s][^:=]*?)\s*[:=]\s*(.*)")
DIRECTIVE = re.compile(r"\s*#\s*(\w+)\s*(.*)", re.DOTALL)
DEFINE = re.compile(r"(\w+)(?:\s+(.*))?$", re.DOTALL)
ASKED = re.compile(r"\b(ENABLED|DISABLED|EITHER|ANY|BOTH|ALL|NONE|defined)\s*\(([\w\s,]*)\)")
WORD = re.compile(r'\s*([A-Z])\s*("(?:[^"]|"")*"|\{[^}]*\}|[-+.:\d]*)')
# Before a command that a host has logged.
LOGGED = re.compile(r"(?:.*?\b(?:Recv|Send):)?\s*(?:echo:)?\s*(?=[GM]\d)", re.IGNORECASE)


class Firmware(Enum):
    """A firmware of printers."""

    KLIPPER = "klipper"
    MARLIN = "marlin"
    REPRAP = "reprap"


class FirmwareError(FileError):
    """A file of a firmware cannot be read, or something in it has no meaning here."""


@dataclass(frozen=True)
class Said:
    """A value as it is written.

    Attributes:
        text: of the value.
        file: in which it stands.
        line: from 1.
        doubt: line of a condition that is not understood, and that it stands under; 0 if there is
            none.
    """

    text: str
    file: str
    line: int
    doubt: int = 0


@dataclass
class Sayings:
    """All values of some files of one firmware.

    Attributes:
        firmware: whose they are.
        said: by name: ``stepper_a.angle`` of Klipper, ``DELTA_RADIUS`` of Marlin, and a command
            with its letter, ``M665 L``, of RepRapFirmware and of what Marlin prints.
        notes: what a person has to know.
        used: names that were asked for and found.
    """

    firmware: Firmware
    said: dict[str, Said] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    used: dict[str, None] = field(default_factory=dict)

    def error(self, name: str, reason: str) -> FirmwareError:
        """Return the error about a value that was found."""
        where = self.said[name]
        return FirmwareError(where.file, f"line {where.line}", f"{name} {reason}")

    def numbers(self, name: str, bound: float = math.inf) -> list[float] | None:
        """Return the numbers of a value; None if it is not there.

        Raises:
            FirmwareError: if they are none, or above ``bound`` in absolute value.
        """
        where = self.said.get(name)
        if where is None:
            return None
        if where.doubt:
            raise self.error(
                name, f"stands under the condition of line {where.doubt}, which is not understood"
            )
        self.used[name] = None
        try:
            numbers = [self._number(part, 0) for part in self._parts(where.text)]
        except (ValueError, ArithmeticError, SyntaxError, RecursionError, MemoryError):
            numbers = [math.nan]
        for number in numbers:
            if not math.isfinite(number):
                raise self.error(name, f"is {shortened(where.text)}, must be a finite number")
            if abs(number) > bound:
                raise self.error(name, f"= {number:g} must be at most {bound:g} in absolute value")
        return numbers

    def number(self, name: str, bound: float = math.inf) -> float | None:
        """Return the one number of a value; None if it is not there.

        Raises:
            FirmwareError: if it is none, or above ``bound`` in absolute value.
        """
        numbers = self.numbers(name, bound)
        if numbers is not None and len(numbers) != 1:
            raise self.error(name, f"has {len(numbers)} numbers, must have one")
        return None if numbers is None else numbers[0]

    def _parts(self, text: str) -> list[str]:
        if self.firmware is Firmware.MARLIN and text.startswith("{"):
            return text.strip("{} ").split(",")
        return text.split(":") if self.firmware is Firmware.REPRAP else [text]

    def _number(self, text: str, depth: int) -> float:
        """Return the value of a text; in Marlin, of an expression in C."""
        if self.firmware is not Firmware.MARLIN:
            return float(text)
        if len(text) > LONGEST_EXPRESSION or depth > DEEPEST:
            raise ValueError
        plain = re.sub(r"(?<=[\d.])[fFlLuU]+\b", "", text.strip())
        return calculated(ast.parse(plain, mode="eval").body, lambda name: self._named(name, depth))

    def _named(self, name: str, depth: int) -> float:
        where = self.said.get(name)
        if where is None or where.doubt:
            raise ValueError
        self.used[name] = None
        return self._number(where.text, depth + 1)


def _quotient(first: float, second: float) -> float:
    # Whole numbers are divided as in C.
    is_whole = isinstance(first, int) and isinstance(second, int)
    return int(first / second) if is_whole else first / second


OPERATORS: Mapping[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: _quotient,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: operator.not_,
    ast.And: lambda *each: all(each),
    ast.Or: lambda *each: any(each),
}


def calculated(node: ast.expr, named: Callable[[str], float]) -> float:
    """Return the value of an expression with numbers, names, and the basic operators.

    Raises:
        ValueError: if there is something else in it.
    """
    match node:
        case ast.Constant(value=bool() | int() | float() as value):
            return value
        case ast.Name(id=name):
            return named(name)
        case ast.UnaryOp(op=op, operand=inner):
            parts = [inner]
        case ast.BinOp(left=left, op=op, right=right):
            parts = [left, right]
        case ast.BoolOp(op=op, values=parts):
            pass
        case _:
            raise ValueError
    if type(op) not in OPERATORS:
        raise ValueError
    return OPERATORS[type(op)](*(calculated(each, named) for each in parts))


def text_of(file: Path) -> str:
    """Return the text of a file, in UTF-8, UTF-16 with a mark, or Latin-1; its lines end in LF.

    Raises:
        FirmwareError: if it cannot be read, or is no text.
    """
    try:
        if file.exists() and not file.is_file():
            raise FirmwareError(file, "", "is no regular file")
        data = file.read_bytes() if file.stat().st_size <= MOST_BYTES else b"\0"
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FirmwareError(file, "", f"cannot be read: {reason}") from error
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise FirmwareError(file, "", "is no text, or too large for settings")
    return re.sub("\r\n?", "\n", text)


def guessed(file: Path, text: str) -> Firmware:
    """Return whose settings a file holds, by its name and by words that only one of them has.

    Raises:
        FirmwareError: if that is not certain.
    """
    if re.search(r"^\s*\[(?:printer|stepper_[abc]|include .*)\]", text, re.MULTILINE):
        return Firmware.KLIPPER
    if re.search(r"^\s*#\s*define\s+\w", text, re.MULTILINE):
        return Firmware.MARLIN
    if re.search(r"^.*\becho:|^\s*M851\b|^\s*M665\b[^;\n]*[SAC]\s*-?\d", text, re.MULTILINE):
        return Firmware.MARLIN
    if file.suffix == ".g" or re.search(
        r"^\s*M(?:569|584|574|669|671)\b|^\s*M665\b[^;\n]*:|^\s*M666\b[^;\n]*[AB]\s*-?\d",
        text,
        re.MULTILINE,
    ):
        return Firmware.REPRAP
    raise FirmwareError(
        file,
        "",
        "its firmware is not certain: it has no [printer] of Klipper, no #define DELTA_... or M503 "
        "of Marlin, no M665 of RepRapFirmware; name it with --from",
    )


def scanned(firmware: Firmware, files: Iterable[tuple[Path, str]]) -> Sayings:
    """Return all values of files with their texts; of two, the later one wins.

    Raises:
        FirmwareError: if a line has no meaning, or a file that another one includes is missing.
    """
    sayings = Sayings(firmware)
    for file, text in files:
        if firmware is Firmware.KLIPPER:
            _scan_klipper(file, text, sayings)
        elif firmware is Firmware.MARLIN and re.search(r"^\s*#\s*define\b", text, re.MULTILINE):
            _scan_header(file, text, sayings)
        else:
            _scan_commands(file, text, sayings, ())
    return sayings


def _scan_klipper(file: Path, text: str, sayings: Sayings) -> None:
    lines = list(enumerate(text.split("\n"), 1))
    begin = next((i for i, (_, line) in enumerate(lines) if SAVED.match(line)), len(lines))
    saved: dict[str, Said] = {}
    for number, line in lines[begin:]:
        if line.strip() and not line.startswith(PREFIX):
            raise FirmwareError(
                file,
                f"line {number}",
                f"below SAVE_CONFIG, a line must begin with {PREFIX}: else Klipper takes nothing "
                "of what it has saved",
            )
    # The remarks of the block end where its first section begins.
    block = [(number, line[4:]) for number, line in lines[begin:]]
    while block and not block[0][1].startswith("["):
        del block[0]
    _scan_options(file, lines[:begin], sayings.said, ())
    _scan_options(file, block, saved, ())
    for name, where in saved.items():
        kept = sayings.said.setdefault(name, where)
        if kept.text != where.text:
            sayings.notes.append(
                f"{name} is {kept.text} of {Path(kept.file).name}, line {kept.line}: it wins over "
                f"{where.text}, which SAVE_CONFIG keeps"
            )


def _scan_options(
    file: Path, lines: Iterable[tuple[int, str]], said: dict[str, Said], trail: tuple[Path, ...]
) -> None:
    section, name, indent = "", "", 0
    for number, line in lines:
        content = re.sub(r"(^|\s);.*", "", line.partition("#")[0]).rstrip()
        stripped = content.lstrip()
        if not stripped:
            continue
        place = f"line {number}"
        depth = len(content) - len(stripped)
        option = OPTION.match(stripped)
        if name and depth > indent:
            said[name] = replace(said[name], text=f"{said[name].text}\n{stripped}".strip())
        elif stripped.startswith("[") and "]" in stripped:
            section, name = stripped[1 : stripped.rindex("]")].strip(), ""
            if section.startswith("include "):
                _include(file, place, section[8:].strip(), said, (*trail, file.resolve()))
        elif option is None or not section:
            reason = "is in no section" if option else "is no [section], and no NAME: VALUE"
            raise FirmwareError(file, place, f"{shortened(stripped)} {reason}")
        else:
            name, indent = f"{section}.{option[1].lower()}", depth
            said[name] = Said(option[2], str(file), number)


def _include(
    file: Path, place: str, wanted: str, said: dict[str, Said], trail: tuple[Path, ...]
) -> None:
    """Read the files that a line of Klipper includes, by a name or a pattern."""
    try:
        folder = Path(wanted).parent
        found = sorted((file.parent / folder).glob(Path(wanted).name))
    except (OSError, ValueError, NotImplementedError, IndexError) as error:
        raise FirmwareError(file, place, f"[include {shortened(wanted)}]: {error}") from error
    if not found and not re.search(r"[*?\[]", wanted):
        raise FirmwareError(
            file, place, f"[include {shortened(wanted)}]: there is no such file in {file.parent}"
        )
    for each in found:
        if each.resolve() in trail or len(trail) > DEEPEST:
            raise FirmwareError(file, place, f"[include {wanted}] leads in a circle")
        _scan_options(each, enumerate(text_of(each).split("\n"), 1), said, trail)


def _scan_header(file: Path, text: str, sayings: Sayings) -> None:
    """Read the definitions of a header of Marlin."""
    text = re.sub(
        r"//[^\n]*|/\*.*?(?:\*/|\Z)", lambda each: "\n" * each[0].count("\n"), text, flags=re.DOTALL
    )
    said = sayings.said
    # Of each #if: whether its branch holds, whether one of its branches did (None: not known), its
    # line.
    open_ifs: list[tuple[bool | None, bool | None, int]] = []
    lines = enumerate(text.split("\n"), 1)
    for number, line in lines:
        while line.endswith("\\"):
            line = line[:-1] + next(lines, (0, ""))[1]
        directive = DIRECTIVE.match(line)
        if directive is None:
            continue
        word, rest = directive[1], directive[2].strip()
        if word in ("if", "ifdef", "ifndef"):
            holds = _condition(word, rest, said)
            open_ifs.append((holds, holds, number))
        elif word in ("elif", "else", "endif"):
            if not open_ifs:
                raise FirmwareError(file, f"line {number}", f"#{word} has no #if")
            _, past, first = open_ifs.pop()
            if word != "endif":
                asked = True if word == "else" else _condition(word, rest, said)
                holds = _both(asked, None if past is None else not past)
                open_ifs.append((holds, _either(past, asked), first))
        elif word in ("define", "undef") and all(each[0] is not False for each in open_ifs):
            named = DEFINE.match(rest)
            doubt = next((each[2] for each in open_ifs if each[0] is None), 0)
            if named and word == "undef":
                said.pop(named[1], None)
            elif named:
                said[named[1]] = Said((named[2] or "").strip(), str(file), number, doubt)
    if open_ifs:
        raise FirmwareError(file, f"line {open_ifs[-1][2]}", "#if has no #endif: is it cut off?")


def _condition(word: str, text: str, said: Mapping[str, Said]) -> bool | None:
    """Return whether a condition holds; None if it is not understood."""
    if word in ("ifdef", "ifndef"):
        return (text in said) == (word == "ifdef")

    def answer(asked: re.Match[str]) -> str:
        names = [name.strip() for name in asked[2].split(",")]
        given = [name in said for name in names]
        if asked[1] != "defined":
            given = [name in said and said[name].text in ("", "1", "true") for name in names]
        if asked[1] in ("DISABLED", "NONE"):
            return str(not any(given))
        return str(all(given) if asked[1] in ("BOTH", "ALL") else any(given))

    plain = ASKED.sub(answer, text).replace("&&", " and ").replace("||", " or ")
    plain = re.sub(r"!(?!=)", " not ", plain).strip()
    try:
        if len(plain) > LONGEST_EXPRESSION:
            raise ValueError
        return bool(calculated(ast.parse(plain, mode="eval").body, _unknown))
    except (ValueError, ArithmeticError, SyntaxError, RecursionError, MemoryError):
        return None


def _unknown(name: str) -> float:
    raise ValueError(name)


def _both(first: bool | None, second: bool | None) -> bool | None:
    return False if False in (first, second) else None if None in (first, second) else True


def _either(first: bool | None, second: bool | None) -> bool | None:
    return True if True in (first, second) else None if None in (first, second) else False


COMMANDS = {
    Firmware.MARLIN: ("M665", "M666", "M201", "M203", "M204", "M851", "G20"),
    Firmware.REPRAP: ("M665", "M666", "M201", "M203", "M204", "M208", "M669", "M98", "M501", "G20"),
}


def _scan_commands(file: Path, text: str, sayings: Sayings, trail: tuple[Path, ...]) -> None:
    """Read commands, one a line, of RepRapFirmware or as Marlin prints them."""
    for number, line in enumerate(text.split("\n"), 1):
        place = f"line {number}"
        content = re.sub(r'("[^"]*")|;.*', lambda each: each[1] or "", line)
        logged = LOGGED.match(content)
        plain = content[logged.end() if logged else 0 :].strip()
        head = re.match(r"([GM])0*(\d+)(?![\d.])", plain, re.IGNORECASE)
        command = f"{head[1].upper()}{head[2]}" if head else ""
        if head is None or command not in COMMANDS[sayings.firmware]:
            continue
        if command == "G20":
            raise FirmwareError(file, place, "G20 (inches) is not read: only millimetres are")
        if sayings.firmware is Firmware.REPRAP and content[:1].isspace():
            raise FirmwareError(file, place, f"{command} stands under a condition: take it out")
        rest = re.sub(r'"[^"]*"|[^"]+', lambda e: e[0] if e[0][0] == '"' else e[0].upper(), plain)
        rest = rest[head.end() :]
        words = dict(WORD.findall(rest))
        if WORD.sub("", rest).strip():
            raise FirmwareError(file, place, f"{shortened(plain)} is not understood")
        if command in ("M98", "M501"):
            name = words.get("P", '"config-override.g"').strip('"').rpartition("/")[2]
            other = file.parent / name
            if other.resolve() in trail or len(trail) > DEEPEST:
                raise FirmwareError(file, place, f"{command} leads in a circle")
            if other.is_file():
                _scan_commands(other, text_of(other), sayings, (*trail, file.resolve()))
            else:
                sayings.notes.append(
                    f"{file.name}, {place}: {command} runs {name}, which is not beside it: what "
                    "it sets is not known"
                )
            continue
        end = " S1" if command == "M208" and words.pop("S", "0") == "1" else ""
        for letter, value in words.items():
            sayings.said[f"{command} {letter}{end}"] = Said(value, str(file), number)
