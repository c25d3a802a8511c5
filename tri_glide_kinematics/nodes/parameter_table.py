"""Parameters as data: one entry says all there is to know about one parameter of a node.

Declaration, checks and documentation are derived from it. No ROS in here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, OutOfBoundsError

Value: TypeAlias = Any
Values: TypeAlias = Mapping[str, Value]


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

    @property
    def is_array(self) -> bool:
        """Whether the value is an array."""
        return isinstance(self.default, tuple)

    @property
    def type_name(self) -> str:
        """Type in words, for example ``double[3]``."""
        element = self.default[0] if self.is_array else self.default
        name = {bool: "bool", int: "integer", float: "double", str: "string"}[type(element)]
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
        """Return ``value``, an array as a tuple.

        Raises:
            ParameterError: if the number of elements is wrong or an element is no valid choice.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is outside the bounds.
        """
        if not self.is_array:
            self._check(self.name, value)
            return value
        elements = tuple(value)
        wanted = len(self.default)
        if not elements or (len(elements) != wanted and not self.any_size):
            raise ParameterError(f"{self.name} has {len(elements)} elements, expected {wanted}")
        for index, element in enumerate(elements):
            self._check(f"{self.name}[{index}]", element)
        return elements

    def _check(self, name: str, value: Value) -> None:
        if self.choices and value not in self.choices:
            raise ParameterError(f"{name} = {value!r} must be one of {', '.join(self.choices)}")
        if isinstance(value, float) and not math.isfinite(value):
            raise NotFiniteError(name, value)
        if self.minimum is not None and value < self.minimum:
            raise OutOfBoundsError(name, value, f"at least {self.minimum:g}", self.unit)
        if self.maximum is not None and value > self.maximum:
            raise OutOfBoundsError(name, value, f"at most {self.maximum:g}", self.unit)


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


def _as_yaml(value: Value) -> str:
    """Return a value as one would write it in a parameter file."""
    if isinstance(value, tuple):
        return "[" + ", ".join(_as_yaml(element) for element in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)
