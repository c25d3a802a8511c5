"""The fixtures of all integration tests."""

from node_harness import client, machine, namespace, nodes, other_machine, ros_context, ros_domain

__all__ = [
    "client",
    "machine",
    "namespace",
    "nodes",
    "other_machine",
    "ros_context",
    "ros_domain",
]
