"""Answers of the services that set parameters, also to what rclpy raises an error at.

rclpy's own leave a call unanswered if a value in it has an unknown type, for instance.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.parameters.table import ParameterError

TYPES = frozenset(kind.value for kind in Parameter.Type)


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


def _parameter(message: ParameterMessage) -> Parameter:
    kind = message.value.type
    if kind not in TYPES:
        raise ParameterError(
            f"{message.name}: type = {kind} must be {min(TYPES)} to {max(TYPES)}, "
            "see rcl_interfaces/msg/ParameterType"
        )
    return Parameter.from_parameter_msg(message)
