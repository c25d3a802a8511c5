"""Every node with height offsets: a pose that is commanded is the pose that is reached."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from testing.goals import GoalClient
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry

OFFSETS = (0.0011, -0.0008, 0.0005)
GEOMETRY = TriGlideGeometry(
    [[0.0004, 0.2003], [-0.1729, -0.0996], [0.1735, -0.1004]], [0.4003, 0.3996, 0.4001]
)
TRUTH = {
    "geometry": "calibrated",
    "anchors": [number for anchor in GEOMETRY.anchors for number in anchor],
    "arm_lengths": GEOMETRY.arm_lengths,
    "height_offsets": OFFSETS,
}
TARGET = (0.05, -0.03, 0.27)
# Rounding of the encoders, in the worst direction.
ENCODERS = 3e-6


def place(message):
    point = message.pose.position
    return point.x, point.y, point.z


def reached(client, poses, target):
    """Wait until the newest pose is at the target."""
    client.wait_for(lambda: poses and math.dist(place(poses[-1]), target) < ENCODERS, "the target")


def test_all_nodes_that_know_the_machine_agree_with_the_truth(machine, client, nodes):
    nodes.start("fk_node", TRUTH)
    true_poses = client.record(PoseStamped, "true_pose")
    poses = client.record(PoseStamped, "platform_pose")
    arrays = client.record(Float64MultiArray, "forward_command")
    trajectories = client.record(JointTrajectory, "joint_trajectory")
    outputs = ["joint_state", "forward_command", "joint_trajectory"]
    machine.start({**TRUTH, "command_outputs": outputs}, TRUTH)
    client.wait_for(
        lambda: arrays and client.node.count_publishers("joint_trajectory"), "all outputs"
    )
    machine.move(TARGET)
    reached(client, true_poses, TARGET)
    reached(client, poses, TARGET)
    heights = np.subtract(TriGlide(GEOMETRY).inverse(TARGET), OFFSETS)
    client.wait_for(lambda: math.dist(arrays[-1].data, heights) < 1e-9, "the last array")
    assert machine.heights() == pytest.approx(heights, abs=1e-9)
    assert trajectories[-1].points[-1].positions == pytest.approx(heights, abs=1e-9)

    # Each of the other ways to lead the machine.
    GoalClient(client).move_to((-0.04, 0.02, 0.22)).result()
    reached(client, true_poses, (-0.04, 0.02, 0.22))
    assert "fault" not in machine.states_since(0)
