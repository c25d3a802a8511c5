import pytest
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from tri_glide_kinematics.ros.cdr import FIRST, SECOND, NoSuchPlaceError, StampedTriples


def set_point(point, numbers):
    point.x, point.y, point.z = numbers


def pose(numbers):
    message = PoseStamped()
    message.header.frame_id = "somewhere"
    message.pose.orientation.x = 0.5
    set_point(message.pose.position, numbers)
    return message


def twist(numbers):
    message = TwistStamped()
    set_point(message.twist.linear, numbers)
    return message


def joint_state(positions, velocities):
    return JointState(name=["a", "bc", "d"], position=positions, velocity=velocities)


@pytest.mark.parametrize(
    ("make", "places"), [(pose, 1), (twist, 1), (joint_state, 2)], ids=["pose", "twist", "joints"]
)
def test_the_bytes_are_those_of_the_message(make, places):
    triples = StampedTriples(make(*(FIRST, SECOND)[:places]), places)
    for count in range(3):
        numbers = [[0.1 + count, -1e300, 0.0], [float("inf"), 2.0, -3.0 * count]][:places]
        message = make(*numbers)
        message.header.stamp.sec, message.header.stamp.nanosec = -count, 4_000_000_000
        data = triples.at(-count, 4_000_000_000, *numbers)
        assert deserialize_message(data, type(message)) == message


def test_earlier_bytes_stay_as_they_are():
    triples = StampedTriples(pose(FIRST), 1)
    first = triples.at(1, 2, (3.0, 4.0, 5.0))
    triples.at(6, 7, (8.0, 9.0, 10.0))
    assert deserialize_message(first, PoseStamped).pose.position.x == 3.0


@pytest.mark.parametrize("numbers", [(1.0, 2.0, 3.0), (FIRST[0], FIRST[1], 0.0)])
def test_marks_have_to_be_there(numbers):
    with pytest.raises(NoSuchPlaceError, match="in 0 places"):
        StampedTriples(pose(numbers), 1)


def test_marks_have_to_be_there_once():
    message = twist(FIRST)
    set_point(message.twist.angular, FIRST)
    with pytest.raises(NoSuchPlaceError, match="in 2 places"):
        StampedTriples(message, 1)
