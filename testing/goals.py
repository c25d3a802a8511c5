"""A client of one action, with bounded waiting."""

from __future__ import annotations

import math
import time
from typing import Any

from action_msgs.srv import CancelGoal
from geometry_msgs.msg import PoseStamped
from rclpy.action import ActionClient
from rclpy.qos import QoSProfile, qos_profile_services_default

from testing.client import Probe
from tri_glide_interfaces.action import FollowPath, MoveTo


class SentGoal:
    """A goal that is on its way, and all that the server says about it.

    Attributes:
        feedback: all messages of it.
        accepted: whether it is; None until that is known.
        response: of the result, with its status; None until it is there.
        responses: how many results came.
        sent: time.monotonic() of that [s].
        asked: time.monotonic() when the result was asked for [s].
        ended: time.monotonic() when the first of them came [s].
    """

    def __init__(self, client: Probe, actions: ActionClient, goal: Any) -> None:
        """Send a ``goal``."""
        self.feedback: list[Any] = []
        self.accepted: bool | None = None
        self.response: Any = None
        self.responses = 0
        self.asked = self.ended = math.inf
        self._client = client
        self._handle: Any = None
        self.sent = time.monotonic()
        future = actions.send_goal_async(
            goal, feedback_callback=lambda message: self.feedback.append(message.feedback)
        )
        future.add_done_callback(lambda done: self._on_accepted(done.result()))

    def wait_until_accepted(self) -> SentGoal:
        """Wait for the first answer."""
        self._client.wait_for(lambda: self.accepted is not None, "an answer to a goal")
        return self

    def result(self) -> Any:
        """Wait for the end and return the result."""
        self._client.wait_for(lambda: self.response is not None, "the result of a goal")
        return self.response.result

    @property
    def status(self) -> int:
        """Status that came with the result."""
        return int(self.response.status)

    def cancel(self) -> Any:
        """Ask for the end and return the answer to that."""
        self.wait_until_accepted()
        future = self.cancel_without_waiting()
        self._client.wait_for(future.done, "an answer to a cancel")
        return future.result()

    def ask_again(self) -> Any:
        """Ask for the result once more."""
        return self._handle.get_result_async()

    def cancel_without_waiting(self) -> Any:
        """Ask for the end."""
        return self._handle.cancel_goal_async()

    def _on_accepted(self, handle: Any) -> None:
        self._handle = handle
        self.accepted = handle.accepted
        if handle.accepted:
            self.asked = time.monotonic()
            handle.get_result_async().add_done_callback(self._on_result)

    def _on_result(self, future: Any) -> None:
        self.response = future.result()
        self.responses += 1
        self.ended = min(self.ended, time.monotonic())


class GoalClient:
    """A client of the actions of ik_node."""

    def __init__(self, client: Probe, answers: QoSProfile = qos_profile_services_default) -> None:
        """Be a part of the node of ``client``, and keep as many ``answers`` until it looks."""
        self._client = client
        self._move_to, self._follow_path = (
            ActionClient(
                client.node,
                kind,
                name,
                goal_service_qos_profile=answers,
                result_service_qos_profile=answers,
            )
            for kind, name in ((MoveTo, "ik_node/move_to"), (FollowPath, "ik_node/follow_path"))
        )

    def wait_for_server(self) -> None:
        """Wait until the server is there."""
        self._client.wait_for(self._move_to.server_is_ready, "move_to")
        self._client.wait_for(self._follow_path.server_is_ready, "follow_path")

    def move_to(self, position: Any, frame: str = "tri_glide_base", **fields: Any) -> SentGoal:
        """Send a goal to be at a ``position`` [m], with more ``fields`` of the goal."""
        self.wait_for_server()
        pose = PoseStamped()
        pose.header.frame_id = frame
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = map(float, position)
        return SentGoal(self._client, self._move_to, MoveTo.Goal(pose=pose, **fields))

    def follow(self, points: Any, frame: str = "tri_glide_base", **fields: Any) -> SentGoal:
        """Send a goal to go through ``points`` [m], or what the ``fields`` of the goal say."""
        self.wait_for_server()
        fields.setdefault("kinds", [FollowPath.Goal.LINE] * len(points))
        fields.setdefault("numbers", [float(number) for point in points for number in point])
        goal = FollowPath.Goal(**fields)
        goal.header.frame_id = frame
        return SentGoal(self._client, self._follow_path, goal)

    def close(self) -> None:
        """Be a client no more."""
        self._move_to.destroy()
        self._follow_path.destroy()


ERROR_NONE = CancelGoal.Response.ERROR_NONE
