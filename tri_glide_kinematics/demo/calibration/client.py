"""The node of the demonstration: it moves the platform, asks for a calibration, sees the truth."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.demo.client import START_TIMEOUT, DemoError
from tri_glide_kinematics.ros.goal_sender import GoalSender
from tri_glide_kinematics.ros.outputs import LATCHED
from tri_glide_kinematics.vectors import Vector3

MOVE_TIMEOUT = 30.0  # s
ANSWER_TIMEOUT = 60.0  # s; a probe answers when it is back
NAP = 0.05  # s
# The simulated sliders follow late: they rest if poses one after the other agree [m].
RESTING_POSES = 20
RESTING = 1e-7


class CalibrationClient(Node):
    """Moves, asks, and looks at the true pose, which no real machine publishes."""

    def __init__(self, namespace: str) -> None:
        """Join the machine in ``namespace``."""
        super().__init__("tri_glide_calibration_demo", namespace=namespace)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self._goals = GoalSender(self)
        self._clients_of: dict[str, Any] = {}

    def wait_for_machine(self) -> None:
        """Wait until ik_node leads the machine and takes goals."""
        states: list[int] = []

        def on_state(message: MachineState) -> None:
            states.append(message.state)

        # Of each ik_node a new one: the last state of one that has ended is none of the next.
        told = self.create_subscription(MachineState, "ik_node/machine_state", on_state, LATCHED)
        try:
            self._wait_for(
                lambda: self._goals.is_ready and states[-1:] == [MachineState.IDLE],
                START_TIMEOUT,
                "starting ik_node",
            )
        finally:
            self.destroy_subscription(told)

    def wait_until_gone(self) -> None:
        """Wait until no ik_node is there any more."""
        self._wait_for(lambda: not self._goals.is_ready, START_TIMEOUT, "ending ik_node")

    def move(self, position: Vector3) -> None:
        """Move the platform to where ik_node believes that ``position`` is [m].

        Raises:
            DemoError: if it does not get there.
        """
        goal = self._goals.move_to(position)
        self._wait_for(lambda: goal.result is not None, MOVE_TIMEOUT, "a motion")
        if not goal.has_succeeded:
            raise DemoError(f"no motion to {position}: {goal.result.text}")

    def true_position(self) -> Vector3:
        """Return where the platform truly rests [m].

        Raises:
            DemoError: if it does not come to rest.
        """
        places: list[Vector3] = []

        def on_pose(message: PoseStamped) -> None:
            point = message.pose.position
            places.append((point.x, point.y, point.z))

        def is_resting() -> bool:
            newest = places[-RESTING_POSES:]
            return len(newest) == RESTING_POSES and all(
                max(values) - min(values) < RESTING for values in zip(*newest)
            )

        poses = self.create_subscription(PoseStamped, "true_pose", on_pose, qos_profile_sensor_data)
        try:
            self._wait_for(is_resting, MOVE_TIMEOUT, "coming to rest")
        finally:
            self.destroy_subscription(poses)
        return places[-1]

    def ask(self, kind: type, service: str, request: Any) -> Any:
        """Return the response of a service of calibration_node.

        Raises:
            DemoError: if it has no success.
        """
        if service not in self._clients_of:
            self._clients_of[service] = self.create_client(kind, f"calibration_node/{service}")
        client = self._clients_of[service]
        self._wait_for(client.service_is_ready, START_TIMEOUT, "starting calibration_node")
        future = client.call_async(request)
        self._wait_for(future.done, ANSWER_TIMEOUT, f"the answer to {service}")
        response = future.result()
        if not response.success:
            raise DemoError(f"{service}: {response.message}")
        return response

    def _wait_for(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise DemoError(f"{what} took longer than {timeout:g} s")
            self._executor.spin_once(timeout_sec=NAP)
