"""The machine of an ``ik_node``, as programs run on it."""

from __future__ import annotations

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from tri_glide_interfaces.msg import MachineState
from tri_glide_interfaces.msg import Output as OutputMessage
from tri_glide_kinematics.programs import MachineNow, Output
from tri_glide_kinematics.ros.goal_sender import GoalSender, output_message
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS, vector_of
from tri_glide_kinematics.ros.outputs import state_of

# A subscriber that comes later is told the latest message.
LATEST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class ProgramLink(GoalSender):
    """A ``ProgramMachine``: goals, outputs, and the state of the machine; made once for a node.

    Attributes:
        machine: its newest state; None before the first.
    """

    def __init__(self, node: Node) -> None:
        """Run programs as a part of ``node``."""
        super().__init__(node)
        self.machine: MachineState | None = None
        self._outputs = node.create_publisher(OutputMessage, "outputs", LATEST_OUTPUTS)
        node.create_subscription(MachineState, "ik_node/machine_state", self._take, LATEST)

    @property
    def now(self) -> MachineNow | None:
        """What the machine does; None before it has told it."""
        told = self.machine
        if told is None:
            return None
        place = vector_of(told.position)
        return MachineNow(state_of(told), told.stops, told.speed, place, told.segment)

    @property
    def has_delivered(self) -> bool:
        """Whether all outputs have arrived."""
        return bool(self._outputs.wait_for_all_acked(Duration()))

    def put_out(self, output: Output) -> None:
        """Change an output, now."""
        self._outputs.publish(output_message(output))

    def _take(self, message: MachineState) -> None:
        self.machine = message
