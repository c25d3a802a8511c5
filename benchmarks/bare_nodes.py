"""Nodes of nothing but rclpy, to which the nodes of this project are compared.

``python -m benchmarks.bare_nodes ROLE [RATE]`` runs one of them as a process.
"""

import sys
from array import array
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

NAMES = ["slider_1", "slider_2", "slider_3"]

# Messages are imported where they are used: the time a bare node takes to start is a figure.


def bare(_: float) -> Node:
    """Return a node that does nothing."""
    return Node("bare")


def timer(rate: float) -> Node:
    """Return a node that publishes a JointState by a timer, and listens to nothing."""
    node = Node("timer")
    _publish_by_timer(node, "joint_commands", rate, [0.6, 0.6, 0.6])
    return node


def setpoints(rate: float) -> Node:
    """Return a node that takes in a pose and publishes it as a JointState by a timer."""
    from geometry_msgs.msg import PoseStamped

    node = Node("setpoints")
    heights = [0.6, 0.6, 0.6]

    def on_pose(message: PoseStamped) -> None:
        point = message.pose.position
        heights[:] = point.x, point.y, point.z

    node.create_subscription(PoseStamped, "target_pose", on_pose, 10)
    _publish_by_timer(node, "joint_commands", rate, heights)
    return node


def machine(rate: float) -> Node:
    """Return a node that takes in a JointState and publishes it again by a timer."""
    from sensor_msgs.msg import JointState

    node = Node("machine")
    heights = [0.6, 0.6, 0.6]

    def on_command(message: JointState) -> None:
        heights[:] = message.position

    node.create_subscription(JointState, "joint_commands", on_command, qos_profile_sensor_data)
    _publish_by_timer(node, "joint_states", rate, heights)
    return node


def pose(_: float, *, with_twist: bool = False) -> Node:
    """Return a node that answers each JointState with a PoseStamped, and maybe a TwistStamped."""
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from sensor_msgs.msg import JointState

    node = Node("pose_and_twist" if with_twist else "pose")
    place, motion = PoseStamped(), TwistStamped()
    places = node.create_publisher(PoseStamped, "platform_pose", 10)
    motions = node.create_publisher(TwistStamped, "platform_twist", 10) if with_twist else None

    def on_joint_state(measured: JointState) -> None:
        place.header.stamp = motion.header.stamp = measured.header.stamp
        point, linear = place.pose.position, motion.twist.linear
        point.x, point.y, point.z = measured.position
        places.publish(place)
        if motions is not None:
            linear.x, linear.y, linear.z = measured.velocity
            motions.publish(motion)

    node.create_subscription(JointState, "joint_states", on_joint_state, qos_profile_sensor_data)
    return node


def server(_: float) -> Node:
    """Return a node that answers an empty service call."""
    from std_srvs.srv import Trigger

    node = Node("server")

    def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        return response

    node.create_service(Trigger, "~/trigger", answer)
    return node


ROLES: dict[str, Callable[[float], Node]] = {
    "pose_and_twist": partial(pose, with_twist=True),
    **{role.__name__: role for role in (bare, timer, setpoints, machine, pose, server)},
}


def main(role: str, rate: float = 0.0) -> None:
    """Run one node until it is interrupted."""
    rclpy.init()
    node = ROLES[role](rate)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:
        # A signal may come while a callback publishes, which then fails: rclpy's errors are such.
        if rclpy.ok():
            raise
    finally:
        # The thread that a signal wakes may do the same at this very moment.
        with suppress(RuntimeError):
            rclpy.try_shutdown()


def _publish_by_timer(node: Node, topic: str, rate: float, heights: list[float]) -> None:
    from sensor_msgs.msg import JointState

    message = JointState(name=NAMES, velocity=[0.0, 0.0, 0.0])
    publisher = node.create_publisher(JointState, topic, 10)

    def publish() -> None:
        message.position = array("d", heights)
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    node.create_timer(1.0 / rate, publish, clock=Clock(clock_type=ClockType.STEADY_TIME))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
