"""Random messages of every type that the nodes take, from plausible to absurd."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterValue
from sensor_msgs.msg import JointState

from testing.machine import JOINTS
from tri_glide_kinematics.settings import NODES

any_float = st.floats() | st.floats(-1.0, 1.0)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
frames = st.sampled_from(["", "tri_glide_base", "tri_glide_platform", "map"]) | texts
seconds = st.integers(-(2**31), 2**31 - 1)


def _header(message: Any, frame: str, second: int) -> Any:
    message.header.frame_id = frame
    message.header.stamp.sec = second
    return message


@st.composite
def poses(draw: st.DrawFn) -> PoseStamped:
    """Draw a target pose, every second one within reach."""
    message = _header(PoseStamped(), draw(frames), draw(seconds))
    point, q = message.pose.position, message.pose.orientation
    if draw(st.booleans()):
        point.x, point.y = draw(st.floats(-0.15, 0.15)), draw(st.floats(-0.15, 0.15))
        point.z = draw(st.floats(0.0, 0.6))
    else:
        point.x, point.y, point.z = draw(any_float), draw(any_float), draw(any_float)
    if draw(st.booleans()):
        q.x, q.y, q.z, q.w = (draw(any_float) for _ in range(4))
    return message


@st.composite
def twists(draw: st.DrawFn) -> TwistStamped:
    """Draw a target twist."""
    message = _header(TwistStamped(), draw(frames), draw(seconds))
    v, w = message.twist.linear, message.twist.angular
    v.x, v.y, v.z = draw(any_float), draw(any_float), draw(any_float)
    if draw(st.booleans()):
        w.x, w.y, w.z = draw(any_float), draw(any_float), draw(any_float)
    return message


@st.composite
def target_states(draw: st.DrawFn, now: Callable[[], Any]) -> Odometry:
    """Draw the state of a moving target; every second one is of now, and may be followed."""
    message = _header(Odometry(), draw(frames), draw(seconds))
    place, velocity = message.pose.pose.position, message.twist.twist.linear
    if draw(st.booleans()):
        message.header.stamp = now()
        message.header.frame_id = ""
        near = st.floats(-0.1, 0.1)
        place.x, place.y, place.z = draw(near), draw(near), draw(st.floats(0.2, 0.4))
    else:
        place.x, place.y, place.z = draw(any_float), draw(any_float), draw(any_float)
        turned = message.pose.pose.orientation
        turned.x, turned.w = draw(any_float), draw(any_float)
    velocity.x, velocity.y, velocity.z = draw(any_float), draw(any_float), draw(any_float)
    return message


@st.composite
def joint_states(draw: st.DrawFn) -> JointState:
    """Draw a message for measured or commanded heights, every second one of our joints."""
    message = _header(JointState(), draw(frames), draw(seconds))
    if draw(st.booleans()):
        message.name = draw(st.permutations(JOINTS))
        message.position = [draw(st.floats(0.3, 0.9) | any_float) for _ in JOINTS]
        if draw(st.booleans()):
            message.velocity = [draw(any_float) for _ in JOINTS]
    else:
        message.name = draw(st.lists(st.sampled_from([*JOINTS, ""]) | texts, max_size=6))
        message.position = draw(st.lists(any_float, max_size=6))
        message.velocity = draw(st.lists(any_float, max_size=6))
        message.effort = draw(st.lists(any_float, max_size=6))
    return message


@st.composite
def parameter_values(draw: st.DrawFn) -> ParameterValue:
    """Draw a value whose type number may not fit its content, or exist at all."""
    value = ParameterValue(type=draw(st.integers(0, 12)))
    value.bool_value = draw(st.booleans())
    value.integer_value = draw(st.integers(-(2**63), 2**63 - 1))
    value.double_value = draw(any_float)
    value.string_value = draw(texts)
    value.bool_array_value = draw(st.lists(st.booleans(), max_size=4))
    value.double_array_value = draw(st.lists(any_float, max_size=4))
    value.integer_array_value = draw(st.lists(st.integers(-9, 9), max_size=4))
    value.string_array_value = draw(st.lists(texts, max_size=4))
    return value


def parameters(node: str) -> st.SearchStrategy[Parameter]:
    """Draw a parameter that the node has, or has not, with any value."""
    known = [*(entry.name for entry in NODES[node]), "use_sim_time"]
    names = st.sampled_from(known) | texts
    return st.builds(
        lambda name, value: Parameter(name=name, value=value), names, parameter_values()
    )
