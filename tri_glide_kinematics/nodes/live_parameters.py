"""Declares the parameters of a node, and validates and applies changes to them as a set."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy import parameter as rclpy_parameter
from rclpy.node import Node

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.nodes.parameter_table import Parameter, Values


class LiveParameters:
    """The values of a node's parameters.

    Ranges in the descriptors are enforced by rclpy for scalars only, and each parameter by itself.
    So every proposed set is checked here as a whole, before any of it takes effect.
    """

    def __init__(
        self, node: Node, table: Iterable[Parameter], check: Callable[[Values], None]
    ) -> None:
        """Declare the parameters of ``table`` and check the values they start with.

        Args:
            node: whose parameters they are.
            table: the parameters.
            check: raises a KinematicsError if values do not fit together.

        Raises:
            KinematicsError: if the values that the node is started with are not valid.
        """
        self._table = {entry.name: entry for entry in table}
        self._check = check
        self._apply: Callable[[Values], None] | None = None
        self._values: dict[str, Any] = {}
        for entry in self._table.values():
            default = list(entry.default) if entry.is_array else entry.default
            declared = node.declare_parameter(entry.name, default, _descriptor(entry))
            self._values[entry.name] = entry.checked(declared.value)
        check(self._values)
        node.add_on_set_parameters_callback(self._on_set)
        node.add_post_set_parameters_callback(self._post_set)

    @property
    def values(self) -> Values:
        """All values by name, arrays as tuples."""
        return self._values

    def on_change(self, apply: Callable[[Values], None]) -> None:
        """Have ``apply`` called with all values after each change."""
        self._apply = apply

    def _on_set(self, changes: list[rclpy_parameter.Parameter]) -> SetParametersResult:
        try:
            self._check({**self._values, **self._known(changes)})
        except KinematicsError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _post_set(self, changes: list[rclpy_parameter.Parameter]) -> None:
        known = self._known(changes)
        if not known:
            return
        self._values = {**self._values, **known}
        if self._apply is not None:
            self._apply(self._values)

    def _known(self, changes: list[rclpy_parameter.Parameter]) -> Values:
        """Return the checked values of those that are in the table (use_sim_time is not)."""
        return {
            change.name: self._table[change.name].checked(change.value)
            for change in changes
            if change.name in self._table
        }


def _descriptor(entry: Parameter) -> ParameterDescriptor:
    """Return what ROS tools show about a parameter."""
    descriptor = ParameterDescriptor(
        description=entry.description,
        read_only=not entry.live,
        additional_constraints=entry.bounds,
    )
    if entry.minimum is not None and entry.maximum is not None:
        if isinstance(entry.default, float):
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(entry.minimum), to_value=float(entry.maximum))
            ]
        elif isinstance(entry.default, int):
            descriptor.integer_range = [
                IntegerRange(from_value=int(entry.minimum), to_value=int(entry.maximum), step=1)
            ]
    return descriptor
