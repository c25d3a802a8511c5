"""Markers as bytes are those that rclpy would have written."""

import numpy as np
import pytest
from geometry_msgs.msg import Point
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from testing.calls import calls
from tri_glide_kinematics.ros.cdr import MarkerShape, marker_array

RNG = np.random.default_rng(1)
LINE = MarkerShape("a path", Marker.LINE_STRIP, (0.001, 0.0, 0.0), (0.25, 0.5, 1.0, 0.5))
BALL = MarkerShape("ball", Marker.SPHERE, (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 1.0))


def message_of(shapes, frame):
    """Return the message that is to be written, made as a user of rclpy makes it."""
    message = MarkerArray()
    for shape in shapes:
        marker = Marker(ns=shape.name, type=shape.kind)
        marker.header.frame_id = frame
        marker.action = Marker.DELETE if shape.is_deleted else Marker.ADD
        marker.scale.x, marker.scale.y, marker.scale.z = shape.sizes
        colour = marker.color
        colour.r, colour.g, colour.b, colour.a = shape.colour
        place = marker.pose.position
        place.x, place.y, place.z = shape.position
        marker.points = [Point(x=x, y=y, z=z) for x, y, z in shape.points.tolist()]
        message.markers.append(marker)
    return message


@pytest.mark.parametrize("length", range(10))
@pytest.mark.parametrize("counts", [(), (0,), (1,), (2, 0, 3), (0, 0, 5, 1)])
def test_rclpy_reads_what_it_would_have_written(length, counts):
    shapes = [
        LINE._replace(name="n" * (number + length // 2), points=RNG.normal(size=(count, 3)))
        for number, count in enumerate(counts)
    ]
    shapes.append(BALL._replace(position=(0.1, -0.2, 0.3), is_deleted=length % 2 == 1))
    shapes.append(BALL)
    written = marker_array(shapes, "f" * length)
    message = message_of(shapes, "f" * length)
    assert deserialize_message(written, MarkerArray) == message
    # What fills up to the next number may be anything.
    assert len(written) == len(serialize_message(message))


def test_points_of_any_order_in_memory_are_written():
    points = np.asfortranarray(RNG.normal(size=(7, 6)))[::2, ::2]
    shapes = [LINE._replace(points=points)]
    assert deserialize_message(marker_array(shapes, ""), MarkerArray) == message_of(shapes, "")


def test_many_points_hold_no_cycle():
    """No function is called more often for many points than for few."""

    def made(count):
        return calls(marker_array, [LINE._replace(points=RNG.normal(size=(count, 3)))] * 3, "base")

    assert made(3000) == made(30)
