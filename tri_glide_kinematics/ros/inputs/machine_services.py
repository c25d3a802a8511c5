"""The services of a node that moves a machine: stop, pause and resume, enable and disable."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from tri_glide_kinematics.control import MotionController
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.reason_log import RefusalLog
from tri_glide_kinematics.ros.outputs import StateReports
from tri_glide_kinematics.ros.serving import CALLS


class MachineServices:
    """``~/stop``, ``~/pause``, ``~/resume`` and ``~/enable``.

    Attributes:
        urgent: those that are looked at in each cycle.
    """

    def __init__(
        self,
        node: Node,
        controller: MotionController,
        reports: StateReports,
        refused: RefusalLog,
        look_for_others: Callable[[], None],
    ) -> None:
        """Offer them as a part of ``node``.

        ``reports`` tell of new states before an answer is given; ``look_for_others`` looks who else
        moves the machine, before it is enabled.
        """
        self._controller = controller
        self._reports = reports
        self._refused = refused
        self._look_for_others = look_for_others
        node.create_service(SetBool, "~/enable", self._on_enable, qos_profile=CALLS)
        self.urgent = (
            node.create_service(Trigger, "~/stop", self._on_stop, qos_profile=CALLS),
            node.create_service(Trigger, "~/pause", self._on_pause, qos_profile=CALLS),
            node.create_service(Trigger, "~/resume", self._on_resume, qos_profile=CALLS),
        )

    def _on_stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self._controller.stop()
        response.success = True
        self._reports.tell()
        return response

    def _on_pause(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._asked(self._controller.pause, response)

    def _on_resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._asked(self._controller.resume, response)

    def _asked(self, ask: Callable[[], str], response: Trigger.Response) -> Trigger.Response:
        """Answer that something is done, or why it is not."""
        try:
            response.message = ask()
            response.success = True
        except KinematicsError as error:
            response.message = str(error)
        self._reports.tell()
        return response

    def _on_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        try:
            if request.data:
                self._look_for_others()
                response.message = self._controller.enable(time.monotonic())
            else:
                response.message = self._controller.disable()
            response.success = True
        except KinematicsError as error:
            response.message = str(error)
            what = "enable" if request.data else "disable"
            self._refused.refuse(f"refused to {what}: {error}", error.refusal)
        self._reports.tell()
        return response
