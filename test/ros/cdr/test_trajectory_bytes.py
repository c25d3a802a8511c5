"""Trajectories as bytes are those that rclpy would have written."""

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from testing.calls import calls
from tri_glide_kinematics.motion.limits import SampledPlan
from tri_glide_kinematics.ros.cdr import joint_trajectory

RNG = np.random.default_rng(1)


def plan(count):
    times = np.cumsum(RNG.uniform(0.0, 0.7, count))
    return SampledPlan(times, *(RNG.normal(size=(count, 3)) for _ in range(3)))


def message_of(names, frame, sampled):
    """Return the message that is to be written, made as a user of rclpy makes it."""
    message = JointTrajectory(joint_names=names)
    message.header.frame_id = frame
    for instant, *numbers in zip(*sampled):
        point = JointTrajectoryPoint()
        point.positions, point.velocities, point.accelerations = map(np.ndarray.tolist, numbers)
        stamp = divmod(round(instant * 1e9), 1_000_000_000)
        point.time_from_start.sec, point.time_from_start.nanosec = stamp
        message.points.append(point)
    return message


@pytest.mark.parametrize("length", range(10))
@pytest.mark.parametrize("count", [1, 2, 17])
def test_rclpy_reads_what_it_would_have_written(length, count):
    names, frame, sampled = [f"{'s' * length}_{number}" for number in range(3)], "base", plan(count)
    written = joint_trajectory(names, frame, *sampled)
    assert deserialize_message(written, JointTrajectory) == message_of(names, frame, sampled)


def test_many_points_hold_no_cycle():
    """No function is called more often for many points than for few."""
    names = ["a", "b", "c"]
    few, many = (calls(joint_trajectory, names, "base", *plan(count)) for count in (20, 200))
    assert many == few
