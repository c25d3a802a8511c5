"""Parameters as data: one entry says all there is to know about one parameter of a node.

Declaration, checks and documentation are derived from it. No ROS in here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.wording import number_text

Value: TypeAlias = Any
Values: TypeAlias = Mapping[str, Value]

TYPE_NAMES = {bool: "bool", int: "integer", float: "double", str: "string"}


class ParameterError(KinematicsError):
    """A parameter has a value that its node cannot work with."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a node.

    Attributes:
        name: as in the parameter file.
        default: its type is the type of the parameter; a tuple stands for an array of fixed size.
        meaning: one line.
        unit: SI unit, empty if there is none.
        minimum: least value allowed, of each element in an array.
        maximum: greatest value allowed, of each element in an array.
        choices: the only values allowed, of each element in an array.
        live: whether it can be set while the node runs.
        any_size: whether an array may have another number of elements (but not none).
        told: whether a node names it at its start, even if it has its default.
    """

    name: str
    default: Value
    meaning: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    live: bool = False
    any_size: bool = False
    told: bool = False

    @property
    def is_array(self) -> bool:
        """Whether the value is an array."""
        return isinstance(self.default, tuple)

    @property
    def element_type(self) -> type[Any]:
        """Type of the value, or of each element in an array."""
        return type(self.default[0] if self.is_array else self.default)

    @property
    def type_name(self) -> str:
        """Type in words, for example ``double[3]``."""
        name = TYPE_NAMES[self.element_type]
        if not self.is_array:
            return name
        return f"{name}[]" if self.any_size else f"{name}[{len(self.default)}]"

    @property
    def bounds(self) -> str:
        """The values allowed, in words; empty if all are."""
        if self.choices:
            return ", ".join(f"`{choice}`" for choice in self.choices)
        if self.minimum is not None and self.maximum is not None:
            return f"{self.minimum:g} to {self.maximum:g}"
        return ""

    @property
    def description(self) -> str:
        """Meaning and unit, as a tool shows them."""
        return f"{self.meaning} [{self.unit}]" if self.unit else self.meaning

    def checked(self, value: Value) -> Value:
        """Return ``value``, an array as a tuple, and integers as doubles where these are wanted.

        Raises:
            ParameterError: if the type or the number of elements is wrong, or an element is no
                valid choice.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is outside the bounds.
        """
        if not self.is_array:
            return self._checked(self.name, value)
        if isinstance(value, tuple(TYPE_NAMES)):
            raise ParameterError(f"{self.name} = {value!r} must be an array, {self.type_name}")
        # ROS gives an empty array without a type the value None.
        elements = () if value is None else tuple(value)
        wanted = len(self.default)
        if not elements or (len(elements) != wanted and not self.any_size):
            expected = "at least one" if self.any_size else str(wanted)
            raise ParameterError(f"{self.name} has {len(elements)} elements, expected {expected}")
        return tuple(
            self._checked(f"{self.name}[{index}]", element)
            for index, element in enumerate(elements)
        )

    def text(self, value: Value) -> str:
        """Return a value of this parameter with its unit, for a line in the log."""
        if self.is_array:
            text = "[" + ", ".join(map(_as_text, value)) + "]"
        else:
            text = _as_text(value)
        return f"{text} {self.unit}" if self.unit else text

    def _checked(self, name: str, value: Value) -> Value:
        if self.element_type is float and type(value) is int:
            value = float(value)
        if type(value) is not self.element_type:
            wanted = TYPE_NAMES[self.element_type]
            raise ParameterError(f"{name} = {_shown(value)} must be a {wanted}")
        if self.choices and value not in self.choices:
            raise ParameterError(f"{name} = {value!r} must be one of {', '.join(self.choices)}")
        if isinstance(value, float) and not math.isfinite(value):
            raise NotFiniteError(name, value)
        if self.minimum is not None and value < self.minimum:
            raise OutOfBoundsError(name, value, f"at least {self.minimum:g}", self.unit)
        if self.maximum is not None and value > self.maximum:
            largest = self.maximum if self.unit == "m" else math.inf
            raise OutOfBoundsError(name, value, f"at most {self.maximum:g}", self.unit, largest)
        return value


def markdown_table(parameters: Iterable[Parameter]) -> str:
    """Return the parameters as a table in Markdown."""
    lines = [
        "| parameter | type | default | unit | bounds | live | meaning |",
        "|---|---|---|---|---|---|---|",
    ]
    for parameter in parameters:
        cells = (
            f"`{parameter.name}`",
            parameter.type_name,
            f"`{_as_yaml(parameter.default)}`",
            parameter.unit,
            parameter.bounds,
            "yes" if parameter.live else "no",
            parameter.meaning,
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def plain_list(parameters: Iterable[Parameter]) -> str:
    """Return the parameters as text for a terminal, two lines each."""
    lines = []
    for parameter in parameters:
        facts = (
            f"{parameter.type_name} {parameter.unit}".rstrip(),
            f"default {_as_yaml(parameter.default)}",
            parameter.bounds.replace("`", ""),
            "live" if parameter.live else "",
        )
        lines.append(f"  {parameter.name} ({'; '.join(filter(None, facts))})")
        lines.append(f"      {parameter.meaning.replace('`', '')}")
    return "\n".join(lines)


def start_text(parameters: Iterable[Parameter], values: Values) -> str:
    """Return what a node says about its parameters at its start: the main and the changed ones."""
    texts = []
    table = tuple(parameters)
    if not table:
        return "no parameters"
    for parameter in table:
        value = values[parameter.name]
        changed = value != parameter.default
        if changed or parameter.told:
            default = f" (default {parameter.text(parameter.default)})" if changed else ""
            texts.append(f"{parameter.name} {parameter.text(value)}{default}")
    return ", ".join([*texts, "all else as by default"])


def change_text(parameters: Iterable[Parameter], before: Values, after: Values) -> str:
    """Return which values differ, for example ``speed_scale: 1 -> 0.5``; empty if none does."""
    return ", ".join(
        f"{parameter.name}: {parameter.text(old)} -> {parameter.text(new)}"
        for parameter in parameters
        if (old := before[parameter.name]) != (new := after[parameter.name])
    )


def _shown(value: Value) -> str:
    """Return a value of the wrong type as text; what ROS makes of an empty array is None."""
    if isinstance(value, (bytes, *TYPE_NAMES)):
        return repr(value)
    return str(list(value or ()))


def _as_text(value: Value) -> str:
    return number_text(value, scale=0.0) if isinstance(value, float) else _as_yaml(value)


def _as_yaml(value: Value) -> str:
    """Return a value as one would write it in a parameter file."""
    if isinstance(value, tuple):
        return "[" + ", ".join(_as_yaml(element) for element in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)
