"""Paths out of the bytes of messages: as rclpy reads them, whatever their frames, only faster."""

import math
import random
import struct
from contextlib import suppress
from itertools import product

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.serialization import serialize_message
from soak import some

from testing.calls import most_calls_of_a_piece
from tri_glide_interfaces.action import FollowPath
from tri_glide_interfaces.msg import Output
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, Refusal
from tri_glide_kinematics.interruptible import ROWS, at_once
from tri_glide_kinematics.motion.path import (
    MOST_SEGMENTS,
    SegmentKind,
    TooManySegmentsError,
    polyline_from,
)
from tri_glide_kinematics.ros.inputs import path_messages, path_points
from tri_glide_kinematics.ros.inputs.path_messages import AT_A_TIME, flat_path, path_outputs
from tri_glide_kinematics.ros.messages import RefusedMessageError

BASE = "tri_glide_base"


def path(count, frame=BASE, frames=None, seed=1):
    source = random.Random(seed)
    message = Path()
    message.header.frame_id = frame
    message.header.stamp.sec = 7
    for index in range(count):
        pose = PoseStamped()
        pose.header.frame_id = frames[index % len(frames)] if frames else frame
        pose.header.stamp.nanosec = source.randrange(1000)
        point = pose.pose.position
        point.x, point.y, point.z = (source.uniform(-1.0, 1.0) for _ in "xyz")
        message.poses.append(pose)
    return message


def points_of(message):
    return [
        [pose.pose.position.x, pose.pose.position.y, pose.pose.position.z] for pose in message.poses
    ]


def read(message, base=BASE):
    return at_once(path_points(serialize_message(message), base))


@pytest.mark.parametrize("length", range(12))
@pytest.mark.parametrize("count", [0, 1, 2, 3, 17])
def test_it_reads_what_rclpy_reads_with_frames_of_any_length(length, count):
    base = "f" * length
    message = path(count, base)
    np.testing.assert_array_equal(read(message, base), np.reshape(points_of(message), (count, 3)))


@pytest.mark.parametrize("frames", [("", BASE), (BASE, ""), ("", "", BASE, "")])
def test_empty_frames_may_be_among_them(frames):
    message = path(301, "", frames)
    np.testing.assert_array_equal(read(message), points_of(message))


def test_foreign_frames_are_refused_wherever_they_are():
    for message in (
        path(5, "world"),
        path(5, BASE, ["world"]),
        path(5, BASE, [BASE, BASE, BASE, BASE, "world"]),
        path(5, BASE, [BASE, BASE, BASE, "tri_glide_case", BASE]),
    ):
        with pytest.raises(RefusedMessageError, match="target path has frame_id"):
            read(message)


def test_a_turned_pose_is_refused_with_its_number():
    message = path(5)
    message.poses[3].pose.orientation.z = 0.1
    with pytest.raises(RefusedMessageError, match="pose 4 of the target path is turned"):
        read(message)
    message.poses[3].pose.orientation.z = float("nan")
    with pytest.raises(RefusedMessageError, match="pose 4 of the target path is turned"):
        read(message)


def test_positions_that_are_no_numbers_in_full_are_refused_with_their_number():
    message = path(5)
    message.poses[3].pose.position.y = 5e-324
    text = r"position\.y of pose 4 of the target path = 4\.9\d*e-324 m must be 0 "
    with pytest.raises(OutOfBoundsError, match=text):
        read(message)
    goal = FollowPath.Goal(kinds=[0, 0], numbers=[0.0, 0.1, 0.2, 0.0, 1e-310, 0.2])
    with pytest.raises(OutOfBoundsError, match=r"numbers\[4\] = 1e-310 must be 0 "):
        flat_path(goal, BASE, 0.002)


def test_bytes_of_the_other_order_are_read_too():
    point = (0.1, -0.2, 0.3)
    header = struct.pack(">iI", 7, 8) + struct.pack(">I", 1) + b"\0\0\0\0"
    pose = header + struct.pack(">7d", *point, 0.0, 0.0, 0.0, 1.0)
    # Stamp, empty text and a word to fill up; the number of poses takes its place in the head.
    data = b"\x00\x00\x00\x00" + struct.pack(">iI", 7, 8) + struct.pack(">I", 1) + b"\0\0\0\0"
    data += struct.pack(">I", 1) + struct.pack(">iI", 7, 8) + struct.pack(">I", 1) + b"\0"
    data += bytes(-(len(data) - 4) % 8) + pose[len(header) :]
    np.testing.assert_array_equal(at_once(path_points(data, BASE)), [point])


@pytest.mark.slow
def test_what_is_cut_off_or_made_up_is_refused_or_read_but_never_fails_otherwise():
    source = random.Random(3)
    for frames in (None, ["", BASE]):
        whole = serialize_message(path(9, BASE, frames))
        for end in range(len(whole)):
            with pytest.raises(KinematicsError):
                at_once(path_points(whole[:end], BASE))
        for _ in some(range(3000), 1000):
            data = bytearray(whole)
            for _ in range(source.randint(1, 4)):
                data[source.randrange(len(data))] = source.randrange(256)
            try:
                at_once(path_points(bytes(data), BASE))
            except KinematicsError:
                continue


@pytest.mark.parametrize("body", [b"", b"\0", bytes(3), bytes(4), bytes(16), b"\xff" * 64])
def test_no_header_with_any_body_raises_anything_but_a_refusal(body):
    whole = serialize_message(path(2))
    kinds = product((0, 1, 2, 3, 6, 7, 8, 9, 11, 128, 255), repeat=2)
    for header in (b"", b"\0", *map(bytes, kinds)):
        for data in (header + body, header + b"\0\0" + body, header + whole[2:]):
            with suppress(KinematicsError):
                at_once(path_points(data, BASE))


@pytest.mark.parametrize("frames", [None, ["", BASE]])
def test_five_thousand_poses_are_read_in_short_pieces(frames):
    data = serialize_message(path(5_000, BASE, frames))
    points, calls = most_calls_of_a_piece(path_points(data, BASE))
    assert points.shape == (5_000, 3)
    # Some for each hundred poses that are looked for a frame in.
    assert calls < 6000


def test_more_poses_than_a_path_may_have_are_refused_by_their_number_alone():
    data = bytearray(serialize_message(path(1)))
    place = data.index(struct.pack("<I", 1), 16)
    data[place : place + 4] = struct.pack("<I", MOST_SEGMENTS + 1)
    with pytest.raises(TooManySegmentsError, match=f"{MOST_SEGMENTS + 1} segments, at most"):
        at_once(path_points(bytes(data), BASE))


@pytest.mark.parametrize("odd", [0, 1, 39, 40, 41, 85])
def test_one_frame_that_differs_is_read_wherever_it_is(odd, monkeypatch):
    monkeypatch.setattr(path_messages, "AT_A_TIME", 40)
    message = path(90, "")
    message.poses[odd].header.frame_id = BASE
    np.testing.assert_array_equal(read(message), points_of(message))


def test_no_piece_of_a_long_path_is_long():
    """Each piece reads so many poses at most, and so do all pieces that make a path of them."""
    count = 12_000
    data = serialize_message(path(count, ""))
    reading = path_points(data, BASE)
    assert sum(1 for _ in reading) >= count // AT_A_TIME
    making = polyline_from((2.0, 0.0, 0.0), at_once(path_points(data, BASE)), 0.001)
    assert sum(1 for _ in making) >= count // ROWS + count // AT_A_TIME


def test_goals_are_read_as_arrays_and_in_their_frame():
    goal = FollowPath.Goal(kinds=[0, 1, 2, 3], numbers=[0.01 * number for number in range(24)])
    segments = flat_path(goal, BASE, 0.002)
    assert segments.kinds.tolist() == list(SegmentKind)
    assert segments.tolerances.tolist() == [0.002] * 4
    assert [getattr(FollowPath.Goal, kind.name) for kind in SegmentKind] == list(SegmentKind)
    goal.header.frame_id = "world"
    with pytest.raises(RefusedMessageError, match="path has frame_id 'world'"):
        flat_path(goal, BASE, 0.002)


def goal_with(segments, values):
    outputs = [Output(name="pin", number=1, value=value) for value in values]
    return FollowPath.Goal(output_segments=segments, outputs=outputs)


def test_outputs_of_a_goal_are_told_in_their_order():
    assert path_outputs(goal_with([], []), 3) is None
    outputs = path_outputs(goal_with([0, 2, 2], [1.0, 2.0, 3.0]), 3)
    assert list(outputs.segments) == [0, 2, 2]
    assert [output.value for output in outputs.told] == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("segments", "values", "text"),
    [
        ([1], [], r"output_segments has shape (1,), expected (0,), one for each of outputs"),
        ([], [1.0], r"output_segments has shape (0,), expected (1,), one for each of outputs"),
        ([3], [1.0], r"output_segments[0] = 3 must be at most 2, the last segment"),
        ([1, 0], [1.0] * 2, r"output_segments[1] = 0 must be at least 1, as the one before it"),
        ([1], [math.nan], r"outputs[0].value = nan is not a finite number"),
    ],
)
def test_outputs_that_cannot_be_are_refused_with_number_and_bound(segments, values, text):
    with pytest.raises(KinematicsError) as refusal:
        path_outputs(goal_with(segments, values), 3)
    assert str(refusal.value) == text
    assert refusal.value.refusal is not Refusal.OTHER
