"""Which sections are for a node is decided by ROS; here it is compared with what we tell of it."""

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from tri_glide_kinematics.settings import is_for, sections_of

SECTIONS = (
    "/ik_node",
    "/fk_node",
    "/*",
    "/**",
    "/*/ik_node",
    "/**/ik_node",
    "/cell_1/ik_node",
    "/cell_1/**",
    "/cell_1/*",
    "/*/*",
    "/a/cell_1/ik_node",
    "/a/**/ik_node",
    "/a/*/ik_node",
    "/**/cell_1/**",
)


@pytest.mark.parametrize("namespace", ["/", "/cell_1", "/a/cell_1"])
def test_sections_are_for_the_nodes_that_ros_gives_them_to(ros_domain, tmp_path, namespace):
    path = tmp_path / "parameters.yaml"
    path.write_text(
        "".join(
            f"{section}:\n  ros__parameters:\n    p{index}: 1\n"
            for index, section in enumerate(SECTIONS)
        )
    )
    assert sections_of(str(path)) == SECTIONS
    context = Context()
    rclpy.init(args=["--ros-args", "--params-file", str(path)], context=context)
    try:
        node = Node("ik_node", namespace=namespace, context=context)
        with node.handle:
            given = set(node.handle.get_parameters(Parameter))
        name = node.get_fully_qualified_name()
        node.destroy_node()
    finally:
        context.try_shutdown()
    assert given == {f"p{i}" for i, section in enumerate(SECTIONS) if is_for(section, name)}
