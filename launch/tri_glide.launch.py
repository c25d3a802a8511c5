"""Starts a tri-glide: ik_node and fk_node, and the simulator in place of a machine.

ros2 launch tri_glide_kinematics tri_glide.launch.py
ros2 launch tri_glide_kinematics tri_glide.launch.py simulator:=false parameters:=/my/machine.yaml
ros2 launch tri_glide_kinematics tri_glide.launch.py calibrated:=/my/calibrated.yaml
"""

from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import EnvironmentVariable, LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

PACKAGE = "tri_glide_kinematics"


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the nodes."""
    arguments = [
        DeclareLaunchArgument(
            "simulator",
            default_value="true",
            choices=["true", "false"],
            description="whether the simulator stands in for a machine",
        ),
        DeclareLaunchArgument(
            "namespace",
            default_value="",
            description="of all nodes and topics; each machine has its own",
        ),
        DeclareLaunchArgument(
            "parameters",
            default_value=PathJoinSubstitution(
                [FindPackageShare(PACKAGE), "config", "tri_glide.yaml"]
            ),
            description="parameter file of all nodes",
        ),
        DeclareLaunchArgument(
            "calibrated",
            # The same once more, which changes nothing.
            default_value=LaunchConfiguration("parameters"),
            description="parameter file that wins over the other one: what `calibrate` has written",
        ),
        DeclareLaunchArgument(
            "transport",
            default_value=EnvironmentVariable("TRI_GLIDE_TRANSPORT", default_value="cell"),
            choices=["cell", "computer"],
            description="how messages travel: on all network interfaces, or on this computer only",
        ),
    ]
    nodes = [
        _node("simulator_node", condition=IfCondition(LaunchConfiguration("simulator"))),
        _node("ik_node"),
        _node("fk_node"),
    ]
    transport = SetEnvironmentVariable("TRI_GLIDE_TRANSPORT", LaunchConfiguration("transport"))
    return LaunchDescription([*arguments, transport, *nodes])


def _node(executable: str, condition: IfCondition | None = None) -> Node:
    return Node(
        package=PACKAGE,
        executable=executable,
        namespace=LaunchConfiguration("namespace"),
        parameters=[LaunchConfiguration("parameters"), LaunchConfiguration("calibrated")],
        output="screen",
        condition=condition,
    )
