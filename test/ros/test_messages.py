import math
import struct
from contextlib import suppress

import pytest
from geometry_msgs.msg import PoseStamped, TwistStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.clock import Clock
from rclpy.duration import Duration
from rclpy.serialization import serialize_message
from rclpy.time import Time
from soak import many

from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, OutOfBoundsError, Refusal
from tri_glide_kinematics.ros.messages import (
    RefusedMessageError,
    age_of_target,
    moving_target,
    target_position,
    target_velocity,
    told_pose,
    told_state,
    told_twist,
)

NAMES = ["slider_1", "slider_2", "slider_3"]
BASE, PLATFORM = "base", "platform"


# The bits of 30, 0 and 280, which a client sent as integers.
AS_FLOATS = struct.unpack("3d", struct.pack("3q", 30, 0, 280))


def pose(position=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0), frame=BASE):
    message = PoseStamped()
    message.header.frame_id = frame
    point, q = message.pose.position, message.pose.orientation
    point.x, point.y, point.z = position
    q.x, q.y, q.z, q.w = orientation
    return told_pose(serialize_message(message))


def twist(linear=(0.0, 0.0, 0.0), angular=(0.0, 0.0, 0.0), frame=BASE):
    message = TwistStamped()
    message.header.frame_id = frame
    v, w = message.twist.linear, message.twist.angular
    v.x, v.y, v.z = linear
    w.x, w.y, w.z = angular
    return told_twist(serialize_message(message))


def test_a_target_is_neither_too_old_nor_of_another_clock():
    clock, timeout = Clock(), 1000.0
    assert (
        500.0
        <= age_of_target((clock.now() - Duration(seconds=500)).to_msg(), clock, timeout)
        <= timeout
    )
    for stamp in (
        Time(),
        clock.now() - Duration(seconds=2000),
        clock.now() + Duration(seconds=2000),
    ):
        with pytest.raises(RefusedMessageError) as caught:
            age_of_target(stamp.to_msg(), clock, timeout)
        assert caught.value.refusal is Refusal.STAMP


@given(st.text(max_size=9), st.text(max_size=9), st.integers(0, 2**31 - 1), st.data())
def test_bytes_say_what_the_message_says_and_too_few_are_refused(frame, child, sec, data):
    message = Odometry(child_frame_id=child.replace("\0", ""))
    message.header.frame_id = frame.replace("\0", "")
    message.header.stamp.sec, message.header.stamp.nanosec = sec, 999_999_999
    point, linear = message.pose.pose.position, message.twist.twist.linear
    point.x, point.z, linear.x, linear.z = 0.1, 0.2, 0.3, 0.4
    message.pose.covariance[35], message.twist.covariance[35] = 5.0, 6.0
    written = bytes(serialize_message(message))
    told = told_state(written)
    assert (told.stamp, told.frame) == (message.header.stamp, message.header.frame_id)
    assert [told.numbers[at] for at in (0, 2, 6, 42, 43, 45, 84)] == [0.1, 0.2, 1, 5, 0.3, 0.4, 6]
    for read in (told_pose, told_twist, told_state):
        with pytest.raises(RefusedMessageError, match="bytes are no"):
            read(written[: data.draw(st.integers(0, 60))])
    with pytest.raises(RefusedMessageError, match=f"{len(written) - 1} bytes are no state"):
        told_state(written[:-1])


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(data):
    for read in (told_pose, told_twist, told_state):
        with suppress(RefusedMessageError):
            read(b"\0\1\0\0" + data)


@pytest.mark.parametrize("frame", [BASE, ""])
@pytest.mark.parametrize("orientation", [(0, 0, 0, 1), (0, 0, 0, -1), (1e-7, 0, -1e-7, 1)])
def test_target_pose(frame, orientation):
    message = pose((0.1, 0.2, 0.3), map(float, orientation), frame)
    assert target_position(message, BASE) == (0.1, 0.2, 0.3)


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"frame": PLATFORM}, RefusedMessageError, "frame_id 'platform', it must be 'base'"),
        ({"position": (0.0, math.nan, 0.0)}, NotFiniteError, "position.y = nan"),
        ({"position": (0.0, 0.0, -math.inf)}, NotFiniteError, "position.z = -inf"),
        ({"position": AS_FLOATS}, OutOfBoundsError, "position.x = 1.48219694e-322 m must be 0 ("),
        ({"orientation": (0.0, 0.0, 0.1, 0.995)}, RefusedMessageError, "cannot rotate"),
        ({"orientation": (0.0, 0.0, 0.0, 0.0)}, RefusedMessageError, "w 0"),
        ({"orientation": (0.0, 0.0, 0.0, 2.0)}, RefusedMessageError, "w 2"),
        ({"orientation": (math.nan, 0.0, 0.0, 1.0)}, RefusedMessageError, "x nan"),
        ({"orientation": (0.0, math.nan, 0.0, 1.0)}, RefusedMessageError, "y nan"),
        ({"orientation": (0.0, 0.0, math.nan, 1.0)}, RefusedMessageError, "z nan"),
        ({"orientation": (0.0, 0.0, 0.0, math.nan)}, RefusedMessageError, "w nan"),
        ({"orientation": (0.0, 2e-6, 0.0, 1.0)}, RefusedMessageError, "y 2e-06"),
    ],
)
def test_target_pose_refused(changes, error, text):
    with pytest.raises(error) as raised:
        target_position(pose(**changes), BASE)
    assert text in str(raised.value)


@pytest.mark.parametrize("frame", [BASE, PLATFORM, ""])
def test_target_twist(frame):
    assert target_velocity(twist((0.1, 0.2, 0.3), frame=frame), BASE, PLATFORM) == (0.1, 0.2, 0.3)


def test_the_state_of_a_target_that_is_no_number_in_full_is_refused_and_its_speed_is_zero():
    state = Odometry()
    point, linear = state.pose.pose.position, state.twist.twist.linear
    state.pose.pose.orientation.w = 1.0
    linear.x, linear.y, linear.z = 0.1, 5e-324, -1e-310
    point.x, point.y, point.z = -0.02, 0.0, 0.28
    assert moving_target(told_state(serialize_message(state)), BASE) == (
        (-0.02, 0.0, 0.28),
        (0.1, 0.0, 0.0),
    )
    point.y = -5e-324
    with pytest.raises(OutOfBoundsError, match=r"target state position\.y = -4\.9\d*e-324 m"):
        moving_target(told_state(serialize_message(state)), BASE)
    state.header.frame_id = "somewhere"
    with pytest.raises(RefusedMessageError, match="frame_id 'somewhere'"):
        moving_target(told_state(serialize_message(state)), BASE)


def test_velocities_that_fade_out_come_to_zero():
    message = twist((0.1, -5e-324, 1e-310), (0.0, 0.0, 5e-324))
    assert target_velocity(message, BASE, PLATFORM) == (0.1, 0.0, 0.0)


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"frame": "map"}, RefusedMessageError, "'map', it must be 'base' or 'platform' or empty"),
        ({"linear": (math.inf, 0.0, 0.0)}, NotFiniteError, "linear.x = inf"),
        ({"angular": (0.0, 0.0, math.nan)}, NotFiniteError, "angular.z = nan"),
        ({"angular": (0.0, 0.0, 1e-9)}, RefusedMessageError, "angular velocity (0, 0, 1e-09)"),
    ],
)
def test_target_twist_refused(changes, error, text):
    with pytest.raises(error) as raised:
        target_velocity(twist(**changes), BASE, PLATFORM)
    assert text in str(raised.value)


@pytest.mark.slow
@settings(max_examples=many(30), derandomize=True, database=None)
@given(st.lists(st.floats(), min_size=7, max_size=7), st.text(max_size=5))
def test_any_pose_is_accepted_or_refused(numbers, frame):
    message = pose(numbers[:3], numbers[3:], frame)
    try:
        position = target_position(message, BASE)
    except KinematicsError:
        return
    assert all(map(math.isfinite, position))
