"""Answers to services that carry their own success and reason."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rclpy.node import Node

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.reason_log import ReasonLog

LINES_PER_SECOND = 10


class Answers:
    """Turns what a request leads to into ``success`` and ``message`` of its response.

    So no request ends the node, and nobody who asks waits for ever.
    """

    def __init__(self, node: Node) -> None:
        """Log by ``node`` what is refused, a few lines a second."""
        self._logger = node.get_logger()
        self._refused = ReasonLog(self._logger.warning, lines_per_second=LINES_PER_SECOND)
        node.create_timer(1.0, self._refused.end_of_second)

    @contextmanager
    def told_in(self, response: Any, name: str) -> Iterator[None]:
        """Tell in the ``response`` of a service, with this ``name``, what its body comes to."""
        try:
            yield
            response.success = True
        except KinematicsError as error:
            response.message = str(error)
            self._refused.add(f"{name}: {error}")
        except Exception as error:
            _empty(response)
            response.message = f"internal error: {type(error).__name__}: {error}"
            self._logger.error(f"{name}: {traceback.format_exc()}")


def _empty(message: Any) -> None:
    """Give all fields of a ``message`` the values of a new one."""
    new = type(message)()
    for field in new.get_fields_and_field_types():
        setattr(message, field, getattr(new, field))
