"""Publishes setpoints in the forms that controllers and drives take."""

from __future__ import annotations

import math
from array import array

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from tri_glide_kinematics.control import NominalTime
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.engine import MotionEngine
from tri_glide_kinematics.motion.limits import SampledPlan, SliderState
from tri_glide_kinematics.ros.cdr import FIRST, SECOND, THIRD, StampedTriples, joint_trajectory
from tri_glide_kinematics.settings import Values
from tri_glide_kinematics.vectors import FloatArray, Vector3, minus

RELIABLE = QoSProfile(depth=10)

# A last step of a trajectory that is shorter than this is part of the one before it [s].
SHORTEST_STEP = 1e-8


class JogOutputError(KinematicsError):
    """An output cannot follow a jog."""

    refusal = Refusal.UNSUPPORTED


class CommandOutputs:
    """The publishers that the parameter ``command_outputs`` asks for.

    Here, and nowhere else, true heights become those that the drives are told.

    Attributes:
        publishers: of what moves the machine.
    """

    def __init__(self, node: Node, values: Values) -> None:
        """Create the publishers on ``node``."""
        self._now = node.get_clock().now
        self._is_simulated: bool = node.get_parameter("use_sim_time").value
        self._times = NominalTime(1.0 / values["rate"])
        self._joint_names = list(values["joint_names"])
        self._base_frame = values["base_frame"]
        self._trajectory_step = values["trajectory_step"]
        self._offsets: Vector3 = values["height_offsets"]
        self._plan_number = 0
        joint_state = JointState(name=self._joint_names, position=FIRST, velocity=SECOND)
        joint_state.header.frame_id = self._base_frame
        self._joint_state = StampedTriples(joint_state, 2)
        joint_state.effort = THIRD
        self._joint_state_with_effort = StampedTriples(joint_state, 3)
        self._array = Float64MultiArray()

        def publisher(output: str, kind: type, topic: str) -> Publisher | None:
            if output not in values["command_outputs"]:
                return None
            return node.create_publisher(kind, topic, RELIABLE)

        self._joint_states = publisher("joint_state", JointState, "joint_commands")
        self._arrays = publisher("forward_command", Float64MultiArray, "forward_command")
        self._trajectories = publisher("joint_trajectory", JointTrajectory, "joint_trajectory")
        made = (self._joint_states, self._arrays, self._trajectories)
        self.publishers = [publisher for publisher in made if publisher is not None]

    def check_jogging(self) -> None:
        """Check that all outputs can follow a jog.

        Raises:
            JogOutputError: if one of them takes whole trajectories: a jog has no end to plan.
        """
        if self._trajectories is not None:
            raise JogOutputError(
                "no jog and no moving target while command_outputs has joint_trajectory"
            )

    def publish(
        self, setpoint: SliderState, engine: MotionEngine, forces: Vector3 | None = None
    ) -> None:
        """Publish the setpoint of a cycle, and the plan of ``engine`` if it is a new one.

        ``forces`` are those of the sliders, of shape (3,) [N], or None where none are known.
        """
        heights = minus(setpoint.heights, self._offsets)
        if self._joint_states is not None:
            now = self._now().nanoseconds
            # Simulated time need not pass as the motion does.
            if not self._is_simulated:
                now = self._times.stamp(setpoint.velocities, now)
            stamp = divmod(now, 1_000_000_000)
            numbers = heights, setpoint.velocities
            if forces is None:
                self._joint_states.publish(self._joint_state.at(*stamp, *numbers))
            else:
                message = self._joint_state_with_effort
                self._joint_states.publish(message.at(*stamp, *numbers, forces))
        if self._arrays is not None:
            self._array.data = array("d", heights)
            self._arrays.publish(self._array)
        if self._trajectories is not None:
            number, self._plan_number = self._plan_number, engine.plan_number
            if number != self._plan_number and engine.time_to_rest > 0.0:
                # Its stamp is 0, which tells the receiver to begin at once: no clock is shared.
                points = plan_points(engine, self._trajectory_step)
                points = points._replace(heights=points.heights - np.array(self._offsets))
                trajectory = joint_trajectory(self._joint_names, self._base_frame, *points)
                self._trajectories.publish(trajectory)


def plan_points(engine: MotionEngine, step: float) -> SampledPlan:
    """Return all of the plan of an ``engine`` from now on, until the sliders stand still.

    The points are ``step`` [s] apart; the last one may follow sooner.
    """
    steps = max(1, math.ceil((engine.time_to_rest - SHORTEST_STEP) / step))
    times: FloatArray = step * np.arange(1.0, steps + 1.0)
    times[-1] = engine.time_to_rest
    return engine.sample_plan(times)
