"""fk_node as a process: poses and twists of a recorded slider path."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from sensor_msgs.msg import JointState

from tri_glide_kinematics.description import PASSIVE_JOINTS, Parts
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide, TriGlideGeometry

CALIBRATED = TriGlideGeometry(
    [[0.001, 0.201], [-0.1725, -0.0995], [0.174, -0.101]], [0.4003, 0.3996, 0.4011]
)


@pytest.fixture
def fk(client, nodes):
    """Return a function that starts fk_node, and one that sends it a measurement."""

    class Fk:
        def start(self, parameters=None):
            self.node = nodes.start("fk_node", parameters)
            self.poses = client.record(PoseStamped, "platform_pose")
            self.twists = client.record(TwistStamped, "platform_twist")
            self.publisher = client.publisher(JointState, "joint_states")

            # Until both directions are connected, measurements are sent again and again.
            def answered():
                self.send((0.6, 0.6, 0.6), (0.0, 0.0, 0.0), second=0)
                return self.poses and self.twists

            client.wait_for(answered, "fk_node")
            self.send((0.6, 0.6, 0.6), (0.0, 0.0, 0.0), second=1)
            client.wait_for(lambda: self.twists[-1].header.stamp.sec == 1, "the last of them")
            self.poses.clear()
            self.twists.clear()
            return self

        def send(
            self, heights, velocities=(), second=1, names=("slider_1", "slider_2", "slider_3")
        ):
            message = JointState(name=list(names))
            message.header.stamp.sec = second
            message.position = list(map(float, heights))
            message.velocity = list(map(float, velocities))
            self.publisher.publish(message)

        def pose_at(self, second):
            client.wait_for(
                lambda: self.poses and self.poses[-1].header.stamp.sec == second, "a pose"
            )
            return self.poses[-1]

    return Fk()


def test_recorded_path_gives_the_poses_it_was_made_from(client, fk):
    parameters = {
        "geometry": "calibrated",
        "anchors": [number for anchor in CALIBRATED.anchors for number in anchor],
        "arm_lengths": CALIBRATED.arm_lengths,
    }
    fk.start(parameters)
    machine = TriGlide(CALIBRATED)
    order = [4, 2, 0, 1, 3]
    for k in range(60):
        t = 0.15 * k
        position = (0.08 * math.cos(t), 0.08 * math.sin(1.3 * t), 0.25 + 0.05 * math.sin(0.7 * t))
        velocity = (-0.08 * math.sin(t), 0.104 * math.cos(1.3 * t), 0.035 * math.cos(0.7 * t))
        heights, rates = machine.inverse_velocity(position, velocity)
        names = ("slider_1", "slider_2", "slider_3", "gripper", "slider_10")
        heights, rates = (*heights, 0.01, 9.0), (*rates, 0.5, 9.0)
        # In an order of its own, and beside joints of others.
        fk.send(
            [heights[i] for i in order],
            [rates[i] for i in order],
            second=k + 2,
            names=[names[i] for i in order],
        )
        pose = fk.pose_at(k + 2)
        client.wait_for(lambda k=k: len(fk.twists) == k + 1, "the twist")
        twist = fk.twists[-1]
        point, linear = pose.pose.position, twist.twist.linear
        assert np.allclose((point.x, point.y, point.z), position, rtol=0.0, atol=1e-9)
        assert np.allclose((linear.x, linear.y, linear.z), velocity, rtol=0.0, atol=1e-9)
        assert pose.header.frame_id == twist.header.frame_id == "tri_glide_base"
        assert twist.header.stamp == pose.header.stamp
        assert pose.pose.orientation.w == 1.0
        angular = twist.twist.angular
        assert (angular.x, angular.y, angular.z) == (0.0, 0.0, 0.0)


def test_without_velocities_there_is_a_pose_alone(fk, client):
    fk.start()
    fk.send((0.6, 0.6, 0.6), (math.nan, 0.0, 0.0), second=2)
    fk.pose_at(2)
    # A second measurement, with velocities: had the first one had a twist, it would be here.
    fk.send((0.6, 0.6, 0.6), (0.1, 0.1, 0.1), second=3)
    fk.pose_at(3)
    client.wait_for(lambda: fk.twists, "the twist")
    assert [twist.header.stamp.sec for twist in fk.twists] == [3]
    assert fk.twists[0].twist.linear.z == pytest.approx(0.1)


def test_all_joints_of_the_urdf_are_told_while_somebody_listens(client, fk):
    offsets = (0.01, -0.02, 0.015)
    fk.start({"height_offsets": offsets})
    joints = client.record(JointState, "all_joint_states")
    machine, parts = TriGlide(DEFAULT_GEOMETRY), Parts.of(DEFAULT_GEOMETRY, 0.05)
    heights = (0.6, 0.61, 0.62)
    second = 2

    def told():
        # Not each measurement is told, and none before there is a connection.
        nonlocal second
        second += 1
        fk.send(heights, second=second)
        return joints

    client.wait_for(told, "all joints")
    message = joints[-1]
    true = tuple(map(sum, zip(heights, offsets)))
    expected = (*heights, *parts.passive_values(true, machine.forward(true)))
    assert message.name == ["slider_1", "slider_2", "slider_3", *PASSIVE_JOINTS]
    assert list(message.position) == pytest.approx(expected, abs=1e-12)
    assert 2 < message.header.stamp.sec <= second
    assert not message.velocity


def test_impossible_measurements_give_a_reason_and_no_pose(fk, client):
    fk.start()
    diagnostics = client.record(DiagnosticArray, "/diagnostics")
    good = (0.6, 0.61, 0.62)
    bad = [
        ((0.1, 0.9, 0.5), {}, "do not meet"),
        ((0.6, 0.6, 0.6), {"names": ("slider_1", "slider_2", "x")}, "lacks slider_3"),
    ]
    for second, (heights, others, reason) in enumerate(bad, 1):
        fk.send(heights, second=2 * second, **others)
        fk.send(good, second=2 * second + 1)
        fk.pose_at(2 * second + 1)
        assert {pose.header.stamp.sec % 2 for pose in fk.poses} == {1}
        # One line a second goes to the log; the next one waits for the next second.
        client.wait_for(lambda reason=reason: reason in fk.node.output, reason)
        begin = len(diagnostics)
        client.wait_for(
            lambda begin=begin: client.statuses(diagnostics[begin:], "fk_node"), "diagnostics"
        )
    fk.send((0.6, 0.6, 0.6), names=("a", "b", "c"))
    told = client.statuses(diagnostics, "fk_node")
    warning = next(status for status in told if status.level == DiagnosticStatus.WARN)
    assert "do not meet" in warning.message
