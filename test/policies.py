"""What the policies of SROS 2 allow each node, and what the graph of ROS shows that it uses."""

from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path
from xml.etree import ElementTree

from rclpy.node import Node

POLICY = Path(__file__).parents[1] / "config" / "security_policy.xml"
# The names that a node uses, by the permission that it takes.
Uses = dict[str, set[str]]
# Which permission of an action what belongs to it takes.
OF_ACTIONS = {"publish": "execute", "reply": "execute", "subscribe": "call", "request": "call"}
ACTION = "/_action/"


def allowed() -> dict[str, Uses]:
    """Return what the policies allow, by node."""
    profiles = ElementTree.parse(POLICY).iterfind("enclaves/enclave/profiles/profile")
    return {profile.attrib["node"]: _permissions(profile) for profile in profiles}


def used(seen_by: Node, name: str, namespace: str) -> Uses:
    """Return what the node with a ``name`` in a ``namespace`` uses, as far as ``seen_by`` knows."""
    looks: dict[str, Callable[[str, str], Iterable[tuple[str, list[str]]]]] = {
        "publish": seen_by.get_publisher_names_and_types_by_node,
        "subscribe": seen_by.get_subscriber_names_and_types_by_node,
        "reply": seen_by.get_service_names_and_types_by_node,
        "request": seen_by.get_client_names_and_types_by_node,
    }
    uses: Uses = defaultdict(set)
    for permission, look in looks.items():
        for full, _ in look(name, namespace):
            topic, action, _ = full.partition(ACTION)
            uses[OF_ACTIONS[permission] if action else permission].add(
                _relative(topic, name, namespace)
            )
    return uses


def _permissions(profile: ElementTree.Element) -> Uses:
    uses: Uses = defaultdict(set)
    for names in profile:
        for permission, rule in names.attrib.items():
            assert rule == "ALLOW", "all else is denied anyway"
            uses[permission] |= {str(name.text) for name in names}
    return uses


def _relative(full: str, name: str, namespace: str) -> str:
    """Return a name as it stands in a policy, which does not know the namespace."""
    for start, short in ((f"{namespace}/{name}/", "~/"), (f"{namespace}/", "")):
        if full.startswith(start):
            return short + full[len(start) :]
    return full
