"""Stands in for a belt with parts, a camera and a gripper, beside a simulated machine."""

from __future__ import annotations

import time
from itertools import groupby
from typing import Any

from geometry_msgs.msg import Point, PoseStamped, Vector3, Vector3Stamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Header

from tri_glide_interfaces.msg import Output, SeenPart, SeenParts
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS, ahead_of_steady, vector_of
from tri_glide_kinematics.ros.outputs import LATCHED
from tri_glide_kinematics.ros.serving import PatientServices
from tri_glide_kinematics.settings import SIMULATED_CELL_NODE, simulated_cell_of
from tri_glide_kinematics.vectors import plus

RELIABLE = QoSProfile(depth=10)

# Of looking what has come in: a gripper closes by this late [s].
PERIOD = 0.002


class SimulatedCellNode(Node):
    """A simulated belt, camera and gripper on topics. Its time begins with the node."""

    def __init__(self) -> None:
        """Declare the parameters and start the belt.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with.
        """
        super().__init__("simulated_cell_node")
        self._values = values = LiveParameters(self, SIMULATED_CELL_NODE, simulated_cell_of).values
        self._encoder, self._camera, self._gripper = simulated_cell_of(values)
        self._begin = time.monotonic()
        # By how much the clock of this node is ahead of the time of the cell [s].
        self._ahead = self._begin + ahead_of_steady(self.get_clock())
        self._holds: bool | None = None
        self._belts = self.create_publisher(JointState, "belt_states", RELIABLE)
        self._pictures = self.create_publisher(SeenParts, "seen_parts", RELIABLE)
        self._held = self.create_publisher(Bool, "part_held", LATCHED)
        self._grips = self.create_publisher(Vector3Stamped, "true_grip_errors", RELIABLE)
        on_output: Any = self._on_output
        on_pose: Any = self._on_pose
        outputs = self.create_subscription(Output, "outputs", on_output, LATEST_OUTPUTS)
        poses = self.create_subscription(PoseStamped, "true_pose", on_pose, RELIABLE)
        self.cycle = Cycle((outputs, poses), PERIOD, self._cycle)
        PatientServices(self)

    def _header(self, then: float, frame: str) -> Header:
        stamp = Time(nanoseconds=max(round(1e9 * (then + self._ahead)), 1)).to_msg()
        return Header(stamp=stamp, frame_id=frame)

    def _cycle(self) -> None:
        now = time.monotonic() - self._begin
        self._ahead = self._begin + ahead_of_steady(self.get_clock())
        for then, position in self._encoder.take(now):
            message = JointState(name=[self._values["belt_joint"]], position=[position])
            message.header = self._header(then, "")
            self._belts.publish(message)
        for then, seen in groupby(self._camera.take(now), key=lambda sighting: sighting.time):
            picture = SeenParts(header=self._header(then, self._camera.name))
            for _, (x, y, z), kind, identity, angle, _ in seen:
                point = Point(x=x, y=y, z=z)
                part = SeenPart(id=identity, kind=kind, position=point, angle=angle)
                picture.parts.append(part)
            self._pictures.publish(picture)

    # When a message was sent counts: it may have waited here, and the stamps of poses are nominal.
    def _on_output(self, message: Output, info: dict[str, int]) -> None:
        values = self._values
        if (message.name, message.number) == (values["gripper_output"], values["gripper_number"]):
            sent = 1e-9 * info["source_timestamp"] - self._ahead
            self._gripper.order(message.value != 0.0, sent)

    def _on_pose(self, message: PoseStamped, info: dict[str, int]) -> None:
        """Let the gripper take what is there, where the platform truly is."""
        now = 1e-9 * info["source_timestamp"] - self._ahead
        point = plus(vector_of(message.pose.position), self._values["gripper_point"])
        before = len(self._gripper.grips)
        holds = self._gripper.step(now, point)
        for then, _, (x, y, z) in self._gripper.grips[before:]:
            error = Vector3Stamped(header=self._header(then, self._values["base_frame"]))
            error.vector = Vector3(x=x, y=y, z=z)
            self._grips.publish(error)
        if holds is not self._holds:
            self._holds = holds
            self._held.publish(Bool(data=holds))
