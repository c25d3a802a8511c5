"""Starts a tri-glide as tri_glide.launch.py does, and the services for mechanisms.

ros2 launch tri_glide_kinematics tri_glide_and_mechanisms.launch.py
"""

from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

PACKAGE = "tri_glide_kinematics"


def generate_launch_description() -> LaunchDescription:
    """Return the machine and the mechanism node; the arguments are those of tri_glide.launch.py."""
    machine = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(
            PathJoinSubstitution([FindPackageShare(PACKAGE), "launch", "tri_glide.launch.py"])
        )
    )
    mechanisms = Node(
        package=PACKAGE,
        executable="mechanism_node",
        namespace=LaunchConfiguration("namespace"),
        output="screen",
    )
    return LaunchDescription([machine, mechanisms])
