"""Stands in for the machine: follows joint commands and publishes measured joint states.

Its geometry and its height offsets are the true ones, which those who lead it may not know.
"""

from __future__ import annotations

import math

from geometry_msgs.msg import PoseStamped
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool

from tri_glide_kinematics.control import SimulatedPlate, SimulatedSliders, SliderFaults, TrueMachine
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.cdr import FIRST, SECOND, StampedTriples
from tri_glide_kinematics.ros.inputs import SliderMeasurements
from tri_glide_kinematics.ros.loop import Cycle
from tri_glide_kinematics.ros.parameters import (
    SIMULATOR_NODE,
    LiveParameters,
    ParameterError,
    Values,
    check_joint_names,
    check_travel,
    machine_of,
)
from tri_glide_kinematics.ros.serving import PatientServices
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text, vector_text

RELIABLE = QoSProfile(depth=10)

# A contact is told when it begins and when it ends, and again and again, so that who listens knows
# that the switch is there [s].
CONTACT_PERIOD = 0.02


class TruthOutputs:
    """The topics ``true_pose`` and ``contact`` of a simulated machine.

    Attributes:
        plate: that can be touched; another one counts from the next cycle on.
    """

    def __init__(self, node: Node, base_frame: str, period: float, plate: SimulatedPlate) -> None:
        """Publish as a part of ``node``, once each ``period`` [s]."""
        self.plate = plate
        pose = PoseStamped()
        pose.header.frame_id = base_frame
        point = pose.pose.position
        point.x, point.y, point.z = FIRST
        self._pose = StampedTriples(pose, 1)
        self._contact = Bool()
        self._poses = node.create_publisher(PoseStamped, "true_pose", RELIABLE)
        self._contacts = node.create_publisher(Bool, "contact", RELIABLE)
        self._quiet_cycles = max(1, round(CONTACT_PERIOD / period))
        self._quiet = self._quiet_cycles

    def publish(self, position: Vector3, seconds: int, nanoseconds: int) -> None:
        """Publish where the platform is [m], at this time, and whether it touches the plate."""
        is_touched = self.plate.is_touched(position)
        self._quiet += 1
        if is_touched != self._contact.data or self._quiet >= self._quiet_cycles:
            self._contact.data, self._quiet = is_touched, 0
            self._contacts.publish(self._contact)
        self._poses.publish(self._pose.at(seconds, nanoseconds, position))


class SimulatorNode(Node):
    """Three simulated sliders on topics."""

    def __init__(self) -> None:
        """Declare the parameters and start to measure.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with.
        """
        super().__init__("simulator_node")
        parameters = LiveParameters(self, SIMULATOR_NODE, _check)
        values = parameters.values
        self._period = 1.0 / values["rate"]
        self._reader = SliderMeasurements(values["joint_names"])
        self._reasons = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._sliders = SimulatedSliders(
            values["initial_heights"], values["lower_heights"], values["upper_heights"]
        )
        self._truth = TrueMachine(machine_of(values), values["height_offsets"])
        self._truth_outputs = TruthOutputs(
            self, values["base_frame"], self._period, _plate_of(values)
        )
        self._apply(values)
        parameters.on_change(self._apply)
        self._message = StampedTriples(
            JointState(name=values["joint_names"], position=FIRST, velocity=SECOND), 2
        )
        self._now = self.get_clock().now
        self._publisher = self.create_publisher(JointState, "joint_states", RELIABLE)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._reasons.end_of_second, clock=steady)
        # Best effort, so that no old command is sent again after the connection was lost.
        commands = self.create_subscription(
            JointState, "joint_commands", self._on_command, qos_profile_sensor_data, raw=True
        )
        self.cycle = Cycle((commands,), self._period, self._cycle)
        PatientServices(self)

    def _on_command(self, data: bytes) -> None:
        try:
            reading = self._reader.read(data)
        except KinematicsError as error:
            self._reasons.add(f"ignored a command: {error}")
            return
        if reading is None:
            return
        if all(map(math.isfinite, reading.heights)):
            self._sliders.command(reading.heights)
        else:
            self._reasons.add(
                f"ignored a command: heights {vector_text(reading.heights)} m are not finite"
            )

    def _cycle(self) -> None:
        self._sliders.step(self._period)
        measured = self._sliders.measure()
        seconds, nanoseconds = divmod(self._now().nanoseconds, 1_000_000_000)
        if measured is not None:
            self._publisher.publish(self._message.at(seconds, nanoseconds, *measured))
        try:
            position = self._truth.position(self._sliders.heights)
        except KinematicsError as error:
            self._reasons.add(f"no true pose: {error}")
            return
        self._truth_outputs.publish(position, seconds, nanoseconds)

    def _apply(self, values: Values) -> None:
        self._truth_outputs.plate = _plate_of(values)
        self._sliders.lag = values["lag"]
        self._sliders.encoder_resolution = values["encoder_resolution"]
        self._sliders.faults = SliderFaults(
            values["drop_out"],
            values["frozen_encoders"],
            values["encoder_offsets"],
            values["stuck_sliders"],
        )


def _plate_of(values: Values) -> SimulatedPlate:
    return SimulatedPlate(values["plate_height"], *values["plate_tilt"])


def _check(values: Values) -> None:
    check_joint_names(values)
    check_travel(values)
    for index, height in enumerate(values["initial_heights"]):
        lower, upper = values["lower_heights"][index], values["upper_heights"][index]
        if not lower <= height <= upper:
            raise ParameterError(
                f"initial_heights[{index}] = {number_text(height)} m must be between "
                f"{number_text(lower)} and {number_text(upper)} m"
            )
