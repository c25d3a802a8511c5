"""Starts a tri-glide: ik_node and fk_node, and the simulator in place of a machine.

ros2 launch tri_glide_kinematics tri_glide.launch.py
ros2 launch tri_glide_kinematics tri_glide.launch.py simulator:=false parameters:=/my/machine.yaml
ros2 launch tri_glide_kinematics tri_glide.launch.py calibrated:=/my/calibrated.yaml
ros2 launch tri_glide_kinematics tri_glide.launch.py rviz:=true
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import (
    Command,
    EnvironmentVariable,
    LaunchConfiguration,
    OrSubstitution,
    PathJoinSubstitution,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare

from launch import LaunchContext, LaunchDescription
from tri_glide_kinematics.ros.starting import check_launch

PACKAGE = "tri_glide_kinematics"

# Each machine has the transforms of its own namespace.
TRANSFORMS = [("/tf", "tf"), ("/tf_static", "tf_static")]


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
        DeclareLaunchArgument(
            "description",
            default_value="false",
            choices=["true", "false"],
            description="whether robot_state_publisher tells URDF and transforms, for Foxglove",
        ),
        DeclareLaunchArgument(
            "rviz",
            default_value="false",
            choices=["true", "false"],
            description="whether RViz shows the machine; it brings the description with it",
        ),
    ]
    nodes = [
        _node("simulator_node", condition=IfCondition(LaunchConfiguration("simulator"))),
        _node("ik_node"),
        _node("fk_node"),
        _state_publisher(),
        _rviz(),
    ]
    transport = SetEnvironmentVariable("TRI_GLIDE_TRANSPORT", LaunchConfiguration("transport"))
    return LaunchDescription([*arguments, OpaqueFunction(function=_check), transport, *nodes])


def _check(context: LaunchContext) -> None:
    """Stop the launch, before anything starts, where something is named that is not there."""
    files = (
        LaunchConfiguration("parameters").perform(context),
        LaunchConfiguration("calibrated").perform(context),
    )
    shows = LaunchConfiguration("rviz").perform(context) == "true"
    describes = shows or LaunchConfiguration("description").perform(context) == "true"
    check_launch(files, ["robot_state_publisher"] * describes + ["rviz2"] * shows)


def _node(executable: str, condition: IfCondition | None = None) -> Node:
    return Node(
        package=PACKAGE,
        executable=executable,
        namespace=LaunchConfiguration("namespace"),
        parameters=[LaunchConfiguration("parameters"), LaunchConfiguration("calibrated")],
        output="screen",
        condition=condition,
    )


def _state_publisher() -> Node:
    """Return the node that makes transforms of the joints that fk_node tells."""
    urdf = Command(
        [
            *("'", ExecutableInPackage(executable="describe_machine", package=PACKAGE), "' '"),
            *(LaunchConfiguration("parameters"), "' '", LaunchConfiguration("calibrated")),
            *("' --node '/", LaunchConfiguration("namespace"), "/ik_node'"),
        ]
    )
    return Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            {
                "robot_description": ParameterValue(urdf, value_type=str),
                "publish_frequency": 50.0,
            }
        ],
        remappings=[("joint_states", "all_joint_states"), *TRANSFORMS],
        output="screen",
        condition=IfCondition(
            OrSubstitution(LaunchConfiguration("description"), LaunchConfiguration("rviz"))
        ),
    )


def _rviz() -> Node:
    view = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "tri_glide.rviz"])
    return Node(
        package="rviz2",
        executable="rviz2",
        namespace=LaunchConfiguration("namespace"),
        arguments=["-d", view],
        remappings=TRANSFORMS,
        output="screen",
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
