"""The other forms of joint commands, and the chain to ros2_control by topics."""

import math
from pathlib import Path

import numpy as np
import pytest
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from testing.commands import KINEMATICS, LIMITS
from testing.machine import JOINTS

TARGET = (0.06, -0.04, 0.3)
# Setpoints are near enough to one another to be compared with trajectories.
RATE = 100.0  # 1/s
PERIOD = 1.0 / RATE  # s
DOCUMENT = Path(__file__).parents[2] / "docs" / "ros2_control.md"


def seconds(point):
    return point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec


def test_all_outputs_agree(machine, client):
    arrays = client.record(Float64MultiArray, "forward_command")
    trajectories = client.record(JointTrajectory, "joint_trajectory")
    setpoints = client.record(JointState, "joint_commands")
    # A linear move is replaced by a sooner plan: that is a second trajectory.
    outputs = ["joint_state", "forward_command", "joint_trajectory"]
    machine.start({"command_outputs": outputs, "motion": "slider", "rate": RATE})
    client.wait_for(
        lambda: arrays and client.node.count_publishers("joint_trajectory"), "all outputs"
    )
    before = machine.heights()
    machine.move(TARGET)
    client.wait_for(lambda: trajectories, "the trajectory")
    client.wait_for(
        lambda: math.dist(arrays[-1].data, KINEMATICS.inverse(TARGET)) < 1e-5, "the last array"
    )
    heights = {machine.heights(message) for message in machine.commands}
    assert {tuple(message.data) for message in arrays} <= heights

    trajectory = trajectories[0]
    assert len(trajectories) == 1
    assert trajectory.joint_names == list(JOINTS)
    assert (trajectory.header.stamp.sec, trajectory.header.stamp.nanosec) == (0, 0)
    times = np.array([seconds(point) for point in trajectory.points])
    assert times[0] > 0.0
    assert (np.diff(times) > 0.0).all()
    positions = np.array([point.positions for point in trajectory.points])
    velocities = np.array([point.velocities for point in trajectory.points])
    accelerations = np.array([point.accelerations for point in trajectory.points])
    assert positions[0] == pytest.approx(before, abs=1e-3)
    assert positions[-1] == pytest.approx(KINEMATICS.inverse(TARGET), abs=1e-9)
    assert velocities[-1] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert (np.abs(velocities) <= np.array(LIMITS.velocity) * (1.0 + 1e-6)).all()
    assert (np.abs(accelerations) <= np.array(LIMITS.acceleration) * (1.0 + 1e-6)).all()
    # The trajectory is the one that the stream of setpoints follows, from its first step on.
    commanded = np.array([machine.heights(message) for message in setpoints])
    is_moving = np.any(np.diff(commanded, axis=0, prepend=commanded[:1]) != 0.0, axis=1)
    moving = commanded[is_moving]
    # By their nominal stamps: a busy computer loses some.
    stamps = np.array([client.time_of(message) for message in setpoints])[is_moving]
    clock = PERIOD * (np.diff(stamps, prepend=stamps[0]) // round(1e9 * PERIOD)).cumsum()
    inside = times <= clock[-1]
    for slider in range(3):
        streamed = np.interp(times[inside], clock, moving[:, slider])
        assert np.allclose(streamed, positions[inside, slider], rtol=0.0, atol=2e-5)


def test_a_stop_is_a_trajectory_too(machine, client):
    trajectories = client.record(JointTrajectory, "joint_trajectory")
    machine.start({"command_outputs": ["joint_state", "joint_trajectory"], "speed_scale": 0.2})
    client.wait_for(lambda: client.node.count_publishers("joint_trajectory"), "the output")
    machine.get_going(TARGET, 0.1)
    client.stop()
    machine.wait_for_state("idle")
    machine.catch_up()
    client.wait_for(lambda: len(trajectories) == 2, "the trajectory of the stop")
    client.send_twist((0.0, 0.0, 0.1))
    reason = "no jog and no moving target while command_outputs has joint_trajectory"
    client.wait_for(lambda: reason in machine.ik.output, reason)
    last = trajectories[-1].points[-1]
    assert list(last.positions) == pytest.approx(machine.heights(), abs=1e-9)
    assert list(last.velocities) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def documented_remaps(node):
    """Return the remaps of a node's command line in the documentation."""
    for line in DOCUMENT.read_text().replace("\\\n", " ").splitlines():
        if f"ros2 run tri_glide_kinematics {node} " in line:
            words = line.split()
            return [word for word in words if ":=/" in word]
    raise AssertionError(f"{DOCUMENT.name} has no command line of {node}")


class TopicHardware:
    """Stands in for ros2_control: a forward controller, a joint state broadcaster and
    joint_state_topic_hardware_interface with its default topics, its QoS and its threshold."""

    def __init__(self, client, rate=500.0):
        self.states = None
        self.commanded = None
        self.sent = 0
        self._commands = client.publisher(JointState, "/robot_joint_commands", QoSProfile(depth=1))
        self._broadcast = client.publisher(JointState, "/joint_states")
        node = client.node
        node.create_subscription(
            JointState, "/robot_joint_states", self._on_state, qos_profile_sensor_data
        )
        node.create_subscription(
            Float64MultiArray, "/slider_controller/commands", self._on_array, QoSProfile(depth=1)
        )
        node.create_timer(1.0 / rate, self._update)

    def _on_state(self, message):
        self.states = message

    def _on_array(self, message):
        self.commanded = list(message.data)

    def _update(self):
        if self.states is None:
            return
        self._broadcast.publish(self.states)
        if self.commanded is None:
            return
        if sum(abs(a - b) for a, b in zip(self.states.position, self.commanded)) > 1e-5:
            self._commands.publish(JointState(name=JOINTS, position=self.commanded))
            self.sent += 1


def test_documented_remaps_fit_the_topic_hardware_interface(machine, client, nodes):
    hardware = TopicHardware(client)

    def arguments(node):
        return [word for remap in documented_remaps(node) for word in ("-r", remap)]

    nodes.start("simulator_node", arguments=arguments("simulator_node"))
    machine.ik = nodes.start(
        "ik_node",
        {"command_outputs": ["forward_command"], "tracking_error_limit": 0.2},
        arguments=arguments("ik_node"),
    )
    client.wait_for(lambda: hardware.commanded, "the chain to close")
    machine.wait_for_state("idle")
    machine.wait_until_targets_get_there()
    machine.wait_for_new_state("idle", lambda: client.send_pose(TARGET))
    client.wait_for(
        lambda: math.dist(hardware.states.position, KINEMATICS.inverse(TARGET)) < 5e-5,
        "the sliders at the target",
    )
    assert hardware.sent
