"""Answers questions about planar mechanisms and the landing gear by services."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from tri_glide_interfaces.srv import (
    SolveFMechanism,
    SolveFourBar,
    SolveLandingGear,
    TraceFMechanism,
    TraceFourBar,
)
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle
from tri_glide_kinematics.ros.mechanisms import (
    check_numbers,
    solve_f_mechanism,
    solve_four_bar,
    solve_landing_gear,
    trace_f_mechanism,
    trace_four_bar,
)
from tri_glide_kinematics.ros.serving import CALLS, Answers, PatientServices

Fill = Callable[[Any, Any], None]

SERVICES: tuple[tuple[str, type, Fill], ...] = (
    ("solve_four_bar", SolveFourBar, solve_four_bar),
    ("trace_four_bar", TraceFourBar, trace_four_bar),
    ("solve_f_mechanism", SolveFMechanism, solve_f_mechanism),
    ("trace_f_mechanism", TraceFMechanism, trace_f_mechanism),
    ("solve_landing_gear", SolveLandingGear, solve_landing_gear),
)


class MechanismNode(Node):
    """Holds nothing between two requests: each is answered from what it brings."""

    def __init__(self) -> None:
        """Offer the services."""
        super().__init__("mechanism_node")
        LiveParameters(self, ())
        self._answers = Answers(self)
        services = (
            self.create_service(kind, f"~/{name}", self._callback(name, fill), qos_profile=CALLS)
            for name, kind, fill in SERVICES
        )
        self.cycle = Cycle(tuple(services))
        PatientServices(self)

    def _callback(self, name: str, fill: Fill) -> Callable[[Any, Any], Any]:
        """Return the callback of a service with this ``name``."""

        def answer(request: Any, response: Any) -> Any:
            with self._answers.told_in(response, name):
                check_numbers(request)
                fill(request, response)
            return response

        return answer
