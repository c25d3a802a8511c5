"""Random letters in place of all texts with which ik_node tells how it is, and how goals ended.

Whoever decides by such a text decides wrongly then. It is for a process of a node, before it runs.
"""

from __future__ import annotations

import random
from string import ascii_lowercase
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.publisher import Publisher

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.ros.inputs import MotionActions

# The nodes of a launcher that is made while this variable is set have random texts.
VARIABLE = "TRI_GLIDE_TEST_RANDOM_TEXTS"

LENGTH = 12


def random_text(_: str = "") -> str:
    """Return letters without a meaning."""
    return "".join(random.choices(ascii_lowercase, k=LENGTH))


def install() -> None:
    """Let this process publish random texts."""
    publish: Any = Publisher.publish
    with_outcome: Any = MotionActions._with_outcome

    def published(publisher: Any, message: Any) -> None:
        if isinstance(message, MachineState):
            for field, kind in message.get_fields_and_field_types().items():
                if kind == "string":
                    setattr(message, field, random_text())
        elif isinstance(message, DiagnosticStatus):
            message.message = random_text()
            for value in message.values:
                value.value = random_text()
        publish(publisher, message)

    def outcome(actions: Any, result: Any, goal: Any) -> Any:
        result = with_outcome(actions, result, goal)
        result.text = random_text()
        return result

    # mypy allows no other method in place of one.
    setattr(Publisher, "publish", published)  # noqa: B010
    setattr(MotionActions, "_with_outcome", outcome)  # noqa: B010
