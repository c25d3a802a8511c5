"""Stands in for the machine: follows joint commands and publishes measured joint states.

Its geometry and its height offsets are the true ones, which those who lead it may not know.
"""

from __future__ import annotations

import math
import random
import time

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool

from tri_glide_interfaces.msg import MachineState, Output
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.programs import SWITCHED_OFF
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.cdr import FIRST, SECOND, THIRD, StampedTriples
from tri_glide_kinematics.ros.inputs import SliderMeasurements, StampedReading
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle, steady_timer
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS
from tri_glide_kinematics.ros.outputs import LATCHED
from tri_glide_kinematics.ros.serving import PatientServices
from tri_glide_kinematics.settings import (
    SIMULATOR_NODE,
    ParameterError,
    Values,
    check_joint_names,
    check_travel,
    forces_of,
    machine_of,
    position_control_of,
    swing_of,
)
from tri_glide_kinematics.simulation import (
    DriveTime,
    PlatformState,
    Setpoint,
    SimulatedDrives,
    SimulatedOutputs,
    SimulatedPlate,
    SimulatedSliders,
    SimulatedSwing,
    SliderFaults,
    TrueMachine,
)
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text, refused_text, vector_text

RELIABLE = QoSProfile(depth=10)

# A contact is told when it begins and when it ends, and again and again, so that who listens knows
# that the switch is there [s].
CONTACT_PERIOD = 0.02

# Number of setpoints that may wait after a stall where each of them counts.
WAITING_SETPOINTS = 1000

# ik_node, which tells its state twice a second at least, is gone after a longer silence [s].
SILENCE = 1.0

# Time [ns] that equally spaced stamps of a sensor may be away from the clock.
CLOCK_TOLERANCE = 20_000_000

GRAVITY = 9.80665  # m/s^2
# REP 145: such an element says that there is no such estimate.
NOT_ESTIMATED = -1.0


class TruthOutputs:
    """The topics ``true_pose``, ``contact`` and ``imu/data_raw`` of a simulated machine.

    Attributes:
        plate: that can be touched; another one counts from the next cycle on.
    """

    def __init__(
        self, node: Node, base_frame: str, platform_frame: str, period: float, plate: SimulatedPlate
    ) -> None:
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
        self._platform_frame = platform_frame
        self._imus = node.create_publisher(Imu, "imu/data_raw", RELIABLE)
        self._random = random.Random(1)
        self._stamp = 0
        self.set_noise(0.0)

    def set_noise(self, deviation: float) -> None:
        """Have the accelerometer err by so much (standard deviation) [m/s^2]."""
        self._noise = deviation
        imu = Imu()
        imu.header.frame_id = self._platform_frame
        imu.orientation_covariance[0] = imu.angular_velocity_covariance[0] = NOT_ESTIMATED
        imu.linear_acceleration_covariance[0::4] = [deviation**2] * 3
        acceleration = imu.linear_acceleration
        acceleration.x, acceleration.y, acceleration.z = FIRST
        self._imu = StampedTriples(imu, 1)

    def catch_up(self, dt: float, now: int) -> float:
        """Leave out the time by which the next stamps would be behind ``now`` [ns], and return it.

        A little is not left out, so that stamps are equally spaced as a rule [s].
        """
        behind = now - self._stamp - round(1e9 * dt)
        if not self._stamp or behind <= CLOCK_TOLERANCE:
            return 0.0
        self._stamp += behind
        return 1e-9 * behind

    def stamp_after(self, dt: float, now: int) -> int:
        """Let ``dt`` [s] pass, and return the stamp then; ``now`` is the time of the clock [ns]."""
        self._stamp += round(1e9 * dt)
        if abs(self._stamp - now) > CLOCK_TOLERANCE:
            self._stamp = now
        return self._stamp

    def publish(self, state: PlatformState, nanoseconds: int) -> None:
        """Publish the ``state`` that the platform has at a time [ns]."""
        position = state.position
        is_touched = self.plate.is_touched(position)
        self._quiet += 1
        if is_touched != self._contact.data or self._quiet >= self._quiet_cycles:
            self._contact.data, self._quiet = is_touched, 0
            self._contacts.publish(self._contact)
        stamp = divmod(nanoseconds, 1_000_000_000)
        self._poses.publish(self._pose.at(*stamp, position))
        if self._imus.get_subscription_count():
            self._imus.publish(self._imu.at(*stamp, self._felt(state.acceleration)))

    def _felt(self, acceleration: Vector3) -> Vector3:
        """Return what an accelerometer tells: gravity as well, and noise [m/s^2]."""
        x, y, z = acceleration
        if self._noise > 0.0:
            gauss, noise = self._random.gauss, self._noise
            x, y, z = x + gauss(0.0, noise), y + gauss(0.0, noise), z + gauss(0.0, noise)
        return x, y, z + GRAVITY


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
            self,
            values["base_frame"],
            values["platform_frame"],
            self._period,
            _plate_of(values),
        )
        self._drive_time = DriveTime(values["setpoint_period"])
        self._swing: SimulatedSwing | None = None
        self._platform: PlatformState | None = None
        self._apply(values)
        parameters.on_change(self._apply)
        message = JointState(name=values["joint_names"], position=FIRST, velocity=SECOND)
        self._message = StampedTriples(message, 2)
        message.effort = THIRD
        self._message_with_forces = StampedTriples(message, 3)
        self._now = self.get_clock().now
        self._publisher = self.create_publisher(JointState, "joint_states", RELIABLE)
        steady_timer(self, 1.0, self._reasons.end_of_second)
        # Best effort, so that no old command is sent again after the connection was lost.
        depth = WAITING_SETPOINTS if values["setpoint_period"] else qos_profile_sensor_data.depth
        quality = QoSProfile(depth=depth, reliability=qos_profile_sensor_data.reliability)
        commands = self.create_subscription(
            JointState, "joint_commands", self._on_command, quality, raw=True
        )
        self._outputs = SimulatedOutputs(SWITCHED_OFF, SILENCE)
        self._true_outputs = self.create_publisher(Output, "true_outputs", LATEST_OUTPUTS)
        self.create_subscription(Output, "outputs", self._on_output, LATEST_OUTPUTS)
        signs = self.create_subscription(
            MachineState, "ik_node/machine_state", self._on_sign_of_life, LATCHED, raw=True
        )
        self.cycle = Cycle((commands, signs), self._period, self._cycle)
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
            self._drive_time.command(self._setpoint(reading, data))
        else:
            self._reasons.add(
                f"ignored a command: heights {vector_text(reading.heights)} m are not finite"
            )

    def _on_output(self, message: Output) -> None:
        self._outputs.set(message.name, message.number, message.value)

    def _on_sign_of_life(self, _: bytes) -> None:
        self._outputs.hear(time.monotonic())

    def _setpoint(self, reading: StampedReading, data: bytes) -> Setpoint:
        """Return the setpoint of a command; its efforts are the feed-forward of the drives."""
        setpoint = Setpoint(reading.heights)
        if self._sliders.drives is None:
            return setpoint
        if reading.velocities is not None:
            setpoint = setpoint._replace(velocities=reading.velocities)
        message = deserialize_message(data, JointState)
        forces = dict(zip(message.name, message.effort))
        try:
            f1, f2, f3 = (forces[name] for name in self._values["joint_names"])
        except KeyError:
            return setpoint
        if all(map(math.isfinite, (f1, f2, f3))):
            return setpoint._replace(forces=(f1, f2, f3))
        text = vector_text((f1, f2, f3))
        self._reasons.add(f"ignored the efforts of a command: {text} N are not finite")
        return setpoint

    def _cycle(self) -> None:
        for name, number, value in self._outputs.look(time.monotonic()):
            self._true_outputs.publish(Output(name=name, number=number, value=value))
        states = []
        now = self._now().nanoseconds
        if not self._values["setpoint_period"]:
            # Time passes by the clock: in cycles that did not come, the platform swung on, unseen.
            missed = self._truth_outputs.catch_up(self._period, now)
            if missed:
                self._swung(missed)
        for setpoint, dt in self._drive_time.steps(self._period):
            if setpoint is not None:
                self._sliders.command(setpoint)
            try:
                self._sliders.step(dt)
            except KinematicsError as error:
                self._reasons.add(f"the drives have torn the machine apart: {error}")
            self._platform = self._swung(dt)
            if self._platform is not None:
                states.append((self._platform, self._truth_outputs.stamp_after(dt, now)))
        seen = self._seen()
        measured = self._sliders.measure(seen)
        if measured is not None:
            # Those of a platform that swings have the time of that.
            nanoseconds = states[-1][1] if seen and states else self._now().nanoseconds
            stamp = divmod(nanoseconds, 1_000_000_000)
            exerted = self._sliders.exerted
            if exerted is None:
                self._publisher.publish(self._message.at(*stamp, *measured))
            else:
                message = self._message_with_forces
                self._publisher.publish(message.at(*stamp, *measured, exerted))
        for state, nanoseconds in states:
            self._truth_outputs.publish(state, nanoseconds)

    def _swung(self, dt: float) -> PlatformState | None:
        """Return the platform after a step of the sliders of ``dt`` [s], if there is a pose."""
        try:
            position = self._truth.position(self._sliders.heights)
        except KinematicsError as error:
            self._reasons.add(f"no true pose: {error}")
            return None
        if self._swing is None:
            self._swing = SimulatedSwing(position, swing_of(self._values))
        return self._swing.step(position, dt)

    def _seen(self) -> tuple[Vector3, Vector3] | None:
        """Return the heights and rates that the encoders look at; None for those of the drives."""
        if self._platform is None or not self._values["encoders_see_swing"]:
            return None
        try:
            return self._truth.heights(self._platform.position, self._platform.velocity)
        except KinematicsError as error:
            self._reasons.add(f"measured without the swing: {error}")
            return None

    def _apply(self, values: Values) -> None:
        self._values = values
        if self._swing is not None:
            self._swing.model = swing_of(values)
        self._truth_outputs.plate = _plate_of(values)
        self._truth_outputs.set_noise(values["accelerometer_noise"])
        self._sliders.lag = values["lag"]
        self._apply_drives(values)
        self._sliders.encoder_resolution = values["encoder_resolution"]
        self._sliders.faults = SliderFaults(
            values["drop_out"],
            values["frozen_encoders"],
            values["encoder_offsets"],
            values["stuck_sliders"],
        )

    def _apply_drives(self, values: Values) -> None:
        forces = forces_of(values, self._truth.machine)
        control = position_control_of(values, forces)
        drives = self._sliders.drives
        if forces is None or control is None:
            self._sliders.drives = None
        elif drives is None:
            heights = self._sliders.heights
            self._sliders.drives = SimulatedDrives(forces, control, heights)
        else:
            drives.forces, drives.control = forces, control


def _plate_of(values: Values) -> SimulatedPlate:
    return SimulatedPlate(values["plate_height"], *values["plate_tilt"])


def _check(values: Values) -> None:
    check_joint_names(values)
    check_travel(values)
    swing_of(values)
    position_control_of(values, forces_of(values, machine_of(values)))
    for index, height in enumerate(values["initial_heights"]):
        lower, upper = values["lower_heights"][index], values["upper_heights"][index]
        if not lower <= height <= upper:
            raise ParameterError(
                f"initial_heights[{index}] = {refused_text(height)} m must be between "
                f"{number_text(lower)} and {number_text(upper)} m"
            )
