"""Reads the keys of one entry of a YAML file; those that nobody reads are mistakes."""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from tri_glide_kinematics.errors import KinematicsError

if TYPE_CHECKING:
    from tri_glide_kinematics.vectors import Vector3

# Units of lengths, in [m].
UNITS = {"m": 1.0, "mm": 0.001}

# Longer values are shortened in texts.
LONGEST_TEXT = 80
_SHORT = reprlib.Repr()
_SHORT.maxother = _SHORT.maxstring = _SHORT.maxlong = LONGEST_TEXT

# Bytes of a text that anybody reads whole: some minutes of an accelerometer.
LARGEST_TEXT = 64_000_000
# Characters that a terminal obeys, and other ends of a line than LF.
_CONTROLS = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")


class FileError(KinematicsError):
    """A file cannot be read, or something in it has no meaning.

    Attributes:
        file: that it is about.
        place: in it, for example ``step 2, segment 3``; empty if it is about all of it.
        reason: in words.
    """

    def __init__(self, file: str | Path, place: str, reason: str) -> None:
        """Store the ``file``, the ``place`` in it and the ``reason``."""
        super().__init__(": ".join(part for part in (str(file), place, reason) if part))
        self.file = file
        self.place = place
        self.reason = reason

    @classmethod
    @contextmanager
    def of_writing(cls, file: str | Path) -> Iterator[None]:
        """Raise the error where a ``file`` cannot be written."""
        try:
            yield
        except OSError as error:
            raise cls(file, "", f"cannot be written: {error.strerror or error}") from error

    @classmethod
    def keys_of(cls, file: str | Path) -> Keys:
        """Return the keys of a YAML ``file``; a mistake in them is an error of this class.

        Raises:
            FileError: of this class, if it cannot be read, is not YAML, or has no keys.
        """
        return Keys(str(file), "", load_yaml(file, cls), cls)


class DuplicateKeyError(yaml.YAMLError):
    """A key stands twice in one entry: YAML forbids that, and its library takes the last one.

    Attributes:
        key: that stands twice.
        lines: in which it does.
    """

    def __init__(self, first: yaml.ScalarNode, second: yaml.ScalarNode) -> None:
        """Store the two."""
        self.key = str(second.value)
        self.lines = (first.start_mark.line + 1, second.start_mark.line + 1)
        super().__init__(f"the key {shortened(self.key)} stands twice in one entry")

    @property
    def place(self) -> str:
        """The lines in words."""
        first, second = self.lines
        return f"line {first}" if first == second else f"lines {first} and {second}"


def yaml_tree(loader: Any) -> yaml.Node | None:
    """Return the tree of what a ``loader`` of PyYAML has to load; None for nothing.

    Raises:
        DuplicateKeyError: if a key stands twice in an entry of it.
        yaml.YAMLError: if it is not YAML.
    """
    root: yaml.Node | None = loader.get_single_node()
    left = [root]
    # An entry that is named may hold itself.
    known: set[int] = set()
    while left:
        node = left.pop()
        if not isinstance(node, yaml.CollectionNode) or id(node) in known:
            continue
        known.add(id(node))
        if not isinstance(node, yaml.MappingNode):
            left += reversed(node.value)
            continue
        seen: dict[tuple[str, str], yaml.ScalarNode] = {}
        for key, value in node.value:
            if isinstance(key, yaml.ScalarNode):
                name = (key.tag, key.value)
                if name in seen:
                    raise DuplicateKeyError(seen[name], key)
                seen[name] = key
            left += [value, key]
    return root


def load_text(
    file: str | Path,
    error_class: Callable[[Any, str, str], KinematicsError],
    most: int = LARGEST_TEXT,
) -> str:
    """Return a text in UTF-8, in UTF-16 with a mark, or in Latin-1; its lines end in LF.

    Args:
        file: its path.
        error_class: makes an error of the file, the place in it and the reason.
        most: bytes that it may have.

    Raises:
        KinematicsError: of this ``error_class``, if it cannot be read, is no text, or too large.
    """
    try:
        with Path(file).open("rb") as stream:
            data = stream.read(most + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise error_class(file, "", f"cannot be read: {reason}") from error
    if len(data) > most:
        raise error_class(file, "", f"is larger than {most:,} bytes: is it another file?")
    try:
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise error_class(file, "", "is no text")
    # What is told of it stays in one line.
    return _CONTROLS.sub("?", text.replace("\r\n", "\n").replace("\r", "\n"))


def load_yaml(file: str | Path, error_class: Callable[[Any, str, str], KinematicsError]) -> Any:
    """Return what a YAML file holds.

    Args:
        file: its path.
        error_class: makes an error of the file, the place in it and the reason.

    Raises:
        KinematicsError: of this ``error_class``, if it cannot be read, is not YAML, or a key in it
            stands twice.
    """
    with yaml_errors(file, error_class):
        # A safe loader: it makes nothing but plain data.
        loader = yaml.SafeLoader(Path(file).read_text(encoding="utf-8"))
        try:
            tree = yaml_tree(loader)
            return None if tree is None else loader.construct_document(tree)
        finally:
            loader.dispose()


@contextmanager
def yaml_errors(
    file: str | Path, error_class: Callable[[Any, str, str], KinematicsError]
) -> Iterator[None]:
    """Raise as ``load_yaml`` does where the body cannot read a YAML ``file``."""
    try:
        yield
    except (OSError, UnicodeDecodeError) as error:
        # The text of an OSError would name the file once more.
        reason = (error.strerror or error) if isinstance(error, OSError) else error
        raise error_class(file, "", f"cannot be read: {reason}") from error
    except DuplicateKeyError as error:
        raise error_class(file, error.place, str(error)) from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise error_class(file, place, f"is not YAML: {error.problem}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = shortened(" ".join(str(error).split()))
        raise error_class(file, "", f"is not YAML: {reason}") from error


def whole_yaml(content: Mapping[str, Any]) -> str:
    """Return YAML text, with a line for each entry, that is no YAML if it is cut off anywhere.

    All of it stands in one pair of braces.
    """
    parts = []
    for key, value in content.items():
        entries = value if isinstance(value, list) and value else None
        if entries and isinstance(entries[0], (Mapping, list)):
            text = "[\n" + ",\n".join(f"  {in_a_line(each)}" for each in entries) + "\n]"
        else:
            text = in_a_line(value)
        parts.append(f"{in_a_line(key)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def in_a_line(value: Any) -> str:
    """Return a value as YAML has it, in one line."""
    # In a list, as a value alone would get a mark of its end.
    text = yaml.safe_dump([value], default_flow_style=True, sort_keys=False, width=math.inf)
    return str(text).strip()[1:-1]


class Keys:
    """The keys of one entry, each read by its name.

    Attributes:
        place: of the entry, for the texts of errors.
        error_class: what is raised.
    """

    error_class: type[FileError] = FileError

    def __init__(
        self, file: str, place: str, values: Any, error_class: type[FileError] | None = None
    ) -> None:
        """Read from ``values``; None for the ``error_class`` of this kind of keys.

        Raises:
            FileError: if they are no keys with values.
        """
        self.place = place
        self.error_class = error_class or self.error_class
        self._file = file
        self._known: list[str] = []
        if not isinstance(values, Mapping):
            raise self.error(f"is {shortened(values)}, must be keys with values")
        self._values = values

    def error(self, reason: str, key: str = "") -> FileError:
        """Return the error that says the ``reason``, about a ``key`` or the whole entry."""
        return self.error_class(self._file, self._place_of(key), reason)

    def _place_of(self, key: str) -> str:
        return ", ".join(filter(None, (self.place, key)))

    def within(self, place: str, values: Any) -> Keys:
        """Return the keys of an entry at a ``place`` in the same file.

        Raises:
            FileError: if ``values`` are no keys with values.
        """
        return Keys(self._file, place, values, self.error_class)

    def section(self, key: str, default: Any = None) -> Keys:
        """Return the keys under a ``key``.

        Raises:
            FileError: if nothing stands there, or no keys with values.
        """
        return self.within(self._place_of(key), self.value(key, default))

    def items(self) -> list[tuple[str, Any]]:
        """Return each key with its value, where any key may stand."""
        self._known += self._values
        return [(str(key), value) for key, value in self._values.items()]

    @contextmanager
    def all_read(self) -> Iterator[None]:
        """Make what the numbers cannot mean an error of the file; in the end all keys are read.

        Raises:
            FileError: if something in them has no meaning, or a key has not been read.
        """
        try:
            yield
        except self.error_class:
            raise
        except KinematicsError as error:
            raise self.error(str(error)) from error
        self.finish()

    def has(self, key: str) -> bool:
        """Return whether something stands under a ``key``, which is known here."""
        self._known.append(key)
        return key in self._values

    def value(self, key: str, default: Any = None) -> Any:
        """Return what stands under a ``key``, as it is.

        Raises:
            FileError: if nothing does, and there is no default.
        """
        self._known.append(key)
        value = self._values.get(key, default)
        if value is None:
            raise self.error("is missing", key)
        return value

    def one_of(self, names: tuple[str, ...]) -> tuple[str, Any]:
        """Return the only key and its value.

        Raises:
            FileError: if there is another key than these ``names``, or more than one.
        """
        if len(self._values) != 1 or next(iter(self._values)) not in names:
            found = ", ".join(map(str, self._values)) or "nothing"
            raise self.error(f"has {found}, must have one of {', '.join(names)}")
        ((key, value),) = self._values.items()
        return str(key), value

    def number(self, key: str, default: float | None = None, *, least: float = -math.inf) -> float:
        """Return a number, which is ``least`` at least.

        Raises:
            FileError: if it is none, or less, or not finite.
        """
        number = self._number(key, self.value(key, default))
        if number < least:
            raise self.error(f"is {number:g}, must be at least {least:g}", key)
        return number

    def whole(self, key: str, least: int) -> int:
        """Return a whole number, which is ``least`` at least.

        Raises:
            FileError: if it is none, or less.
        """
        number = self.number(key, least=least)
        if number != int(number):
            raise self.error(f"is {number:g}, must be a whole number", key)
        return int(number)

    def vector(self, key: str, default: Sequence[float] | None = None) -> Vector3:
        """Return three numbers.

        Raises:
            FileError: if they are not that.
        """
        x, y, z = self.numbers(key, self.value(key, default), 3)
        return x, y, z

    def numbers(self, key: str, value: Any, count: int) -> tuple[float, ...]:
        """Return ``count`` numbers, from the ``value`` of a ``key``.

        Raises:
            FileError: if they are not that.
        """
        if not isinstance(value, list) or len(value) != count:
            wanted = f"a list of {count} numbers{', x and y' if count == 2 else ''}"
            raise self.error(f"is {shortened(value)}, must be {wanted}", key)
        return tuple(self._number(f"{key}[{index}]", each) for index, each in enumerate(value))

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text.

        Raises:
            FileError: if it is none.
        """
        value = self.value(key, default)
        if not isinstance(value, str):
            raise self.error(f"is {shortened(value)}, must be a text", key)
        return value

    def choice(self, key: str, names: Collection[str], default: str | None = None) -> str:
        """Return a text that is one of some ``names``.

        Raises:
            FileError: if it is none of them.
        """
        name = self.text(key, default)
        if name not in names and name != default:
            raise self.error(f"is {shortened(name)}, must be one of {', '.join(names)}", key)
        return name

    def texts(self, key: str, default: Sequence[str]) -> list[str]:
        """Return a list of texts.

        Raises:
            FileError: if it is none.
        """
        value = self.value(key, list(default))
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            raise self.error(f"is {shortened(value)}, must be a list of texts", key)
        return value

    def switch(self, key: str, default: bool | None = None) -> bool:
        """Return whether something is so.

        Raises:
            FileError: if it is neither true nor false.
        """
        value = self.value(key, default)
        if not isinstance(value, bool):
            raise self.error(f"is {shortened(value)}, must be true or false", key)
        return value

    def unit(self, default: str = "m") -> float:
        """Return the length of the unit that the key ``unit`` names, or of the ``default`` [m].

        Raises:
            FileError: if it is not known.
        """
        return UNITS[self.choice("unit", UNITS, default)]

    def entries(self, key: str, default: list[Any] | None = None) -> list[Any]:
        """Return a list, as it is.

        Raises:
            FileError: if it is none, or empty although there is no default.
        """
        value = self.value(key, default)
        if not isinstance(value, list) or (not value and default is None):
            wanted = "a list" if default is not None else "a list of one entry at least"
            raise self.error(f"is {shortened(value)}, must be {wanted}", key)
        return value

    def finish(self) -> None:
        """Complain about a key that has not been read.

        Raises:
            FileError: if there is one.
        """
        for key in self._values:
            if key not in self._known:
                known = ", ".join(dict.fromkeys(self._known))
                raise self.error(f"is not known here; known are {known}", str(key))

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
    """Return a value as it would be written, or the start of that."""
    text = value if isinstance(value, str) and len(value) > LONGEST_TEXT else _SHORT.repr(value)
    return text if len(text) <= LONGEST_TEXT else f"{text[:LONGEST_TEXT]}..."
