"""The parameters of a running node: changes are checked as a set before they take effect."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy import parameter as rclpy_parameter
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.loop import steady_timer
from tri_glide_kinematics.settings import (
    PARAMETERS_OF_ALL,
    Parameter,
    ParameterError,
    Values,
    change_text,
    check_names,
    check_sources,
    sources_of,
    start_text,
)

# More changes than these in a second become one line of the log.
LINES_PER_SECOND = 5

Type = rclpy_parameter.Parameter.Type


class LiveParameters:
    """The values of a node's parameters.

    Ranges in the descriptors are enforced by rclpy for scalars only, and each parameter by itself.
    So every proposed set is checked here as a whole, before any of it takes effect.
    """

    def __init__(
        self,
        node: Node,
        table: Iterable[Parameter],
        check: Callable[[Values], object] = lambda values: None,
    ) -> None:
        """Declare the parameters of ``table``, check the values they start with, and log these.

        ``check`` raises a KinematicsError if values do not fit together.

        Raises:
            KinematicsError: if the values that the node is started with are not valid, or if
                some of what it is started with has no meaning for it.
        """
        self._table = {entry.name: entry for entry in table}
        self._check = check
        self._apply: Callable[[Values], None] | None = None
        self._values: dict[str, Any] = {}
        warnings = check_sources(sources_of(sys.argv[1:]), node.get_fully_qualified_name())
        self._declare(node)
        check(self._values)
        log = node.get_logger()
        for warning in warnings:
            log.warning(warning)
        text = start_text(self._table.values(), self._values)
        log.info(f"{node.get_fully_qualified_name()} starts with {text}")
        # A call of its own: rclpy refuses a place that logs with two severities, and all that go
        # through a ReasonLog are one place to it.
        self._changes = ReasonLog(lambda text: log.info(text), LINES_PER_SECOND)
        steady_timer(node, 1.0, self._changes.end_of_second)
        node.add_pre_set_parameters_callback(self._pre_set)
        node.add_on_set_parameters_callback(self._on_set)
        node.add_post_set_parameters_callback(self._post_set)
        answer_each_call(node)

    @property
    def values(self) -> Values:
        """All values by name, arrays as tuples."""
        return self._values

    def on_change(self, apply: Callable[[Values], None]) -> None:
        """Have ``apply`` called with all values after each change."""
        self._apply = apply

    def _declare(self, node: Node) -> None:
        overrides = _overrides(node)
        # Some are declared by ROS itself, use_sim_time for instance.
        unknown = [name for name in overrides if not node.has_parameter(name)]
        check_names(unknown, self._table, PARAMETERS_OF_ALL)
        for entry in self._table.values():
            value = overrides.get(entry.name, entry.default)
            self._values[entry.name] = value = entry.checked(value)
            node.declare_parameter(
                entry.name,
                list(value) if entry.is_array else value,
                _descriptor(entry),
                ignore_override=True,
            )

    def _pre_set(self, changes: list[rclpy_parameter.Parameter]) -> list[rclpy_parameter.Parameter]:
        """Return the changes with doubles for integers where doubles are wanted.

        ROS tells the two apart; a person who writes 500 for 500.0 does not.
        """
        return [self._with_double(change) for change in changes]

    def _with_double(self, change: rclpy_parameter.Parameter) -> rclpy_parameter.Parameter:
        entry = self._table.get(change.name)
        if entry is None or entry.element_type is not float:
            return change
        if change.type_ == Type.INTEGER:
            return rclpy_parameter.Parameter(change.name, Type.DOUBLE, float(change.value))
        if change.type_ == Type.INTEGER_ARRAY:
            doubles = [float(number) for number in change.value]
            return rclpy_parameter.Parameter(change.name, Type.DOUBLE_ARRAY, doubles)
        return change

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
        before, self._values = self._values, {**self._values, **known}
        text = change_text(self._table.values(), before, self._values)
        if text:
            self._changes.add(text)
        if self._apply is not None:
            self._apply(self._values)

    def _known(self, changes: list[rclpy_parameter.Parameter]) -> Values:
        """Return the checked values of those that are in the table (use_sim_time is not)."""
        return {
            change.name: self._table[change.name].checked(change.value)
            for change in changes
            if change.name in self._table
        }


def _overrides(node: Node) -> dict[str, Any]:
    """Return the values that the command line and the parameter files have for a node."""
    with node.handle:
        found = node.handle.get_parameters(rclpy_parameter.Parameter)
    return {name: parameter.value for name, parameter in found.items()}


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


TYPES = frozenset(kind.value for kind in Type)


def answer_each_call(node: Node) -> None:
    """Have the services that set parameters of a ``node`` answer each call, with a reason."""
    callbacks = {SetParameters: _set_each, SetParametersAtomically: _set_all}
    for service in node.services:
        if service.srv_type in callbacks:
            service.callback = partial(callbacks[service.srv_type], node)


def _set_each(
    node: Node, request: SetParameters.Request, response: SetParameters.Response
) -> SetParameters.Response:
    response.results = [_result(node, (message,)) for message in request.parameters]
    return response


def _set_all(
    node: Node, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
) -> SetParametersAtomically.Response:
    response.result = _result(node, request.parameters)
    return response


def _result(node: Node, messages: Iterable[ParameterMessage]) -> SetParametersResult:
    """Set parameters as a set, and tell what came of it."""
    try:
        return node.set_parameters_atomically([_parameter(message) for message in messages])
    except (KinematicsError, ParameterNotDeclaredException) as error:
        reason = str(error)
    except Exception as error:
        reason = f"internal error: {type(error).__name__}: {error}"
        node.get_logger().error(f"parameters: {reason}")
    return SetParametersResult(successful=False, reason=reason)


def _parameter(message: ParameterMessage) -> rclpy_parameter.Parameter:
    kind = message.value.type
    if kind not in TYPES:
        raise ParameterError(
            f"{message.name}: type = {kind} must be {min(TYPES)} to {max(TYPES)}, "
            "see rcl_interfaces/msg/ParameterType"
        )
    return rclpy_parameter.Parameter.from_parameter_msg(message)
