"""Notices another node that publishes setpoints where this one does: one machine, one leader."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import ReliabilityPolicy

from tri_glide_kinematics.control import Cause, Reason
from tri_glide_kinematics.ros.loop import steady_timer

PERIOD = 0.2  # s, from look to look

# For this time after the start nobody can know who else is there [s]. Participants that did not
# hear each other at once find each other when one of them announces itself again: after a second
# (the profiles in config/), by default of Fast DDS after three.
SETTLING = 1.2

# A node that died without a word stays known for this time at most, the default of Fast DDS [s]. It
# is the one that died who chose it: nodes with one of the profiles in config/ have 5 s.
LEASE = 20.0

# The name of a node comes a moment later than its publishers [s].
NAMING = 0.5
UNNAMED = "a node of unknown name"


class OtherPublishers:
    """Looks for other publishers of a node's topics, now and then."""

    def __init__(
        self, node: Node, publishers: Iterable[Publisher], tell: Callable[[Reason | None], None]
    ) -> None:
        """Look from now on for publishers that ``node`` should have alone.

        ``tell`` gets what ``look`` returns, now and each ``PERIOD`` seconds: first, that nothing is
        known yet.
        """
        self._node = node
        self._own = Counter(publisher.topic_name for publisher in publishers)
        self._settled = time.monotonic() + SETTLING
        self._unnamed_since = math.inf
        tell(self.look())
        steady_timer(node, PERIOD, lambda: tell(self.look()))

    def look(self) -> Reason | None:
        """Return why this node should not lead, with a text of one line, or None.

        It asks what is known on this computer: no message is sent or waited for.
        """
        now = time.monotonic()
        found = {topic: publisher_names(self._node, topic) for topic in self._own}
        if any(UNNAMED in names for names in found.values()):
            self._unnamed_since = min(self._unnamed_since, now)
        else:
            self._unnamed_since = math.inf
        if now - self._unnamed_since < NAMING:
            found = {
                topic: [name for name in names if name != UNNAMED] for topic, names in found.items()
            }
        text = other_publishers(self._node.get_fully_qualified_name(), self._own, found)
        if text is not None:
            return Reason(Cause.OTHER_PUBLISHER, text)
        if now < self._settled:
            topics = ", ".join(self._own)
            text = f"looks for other publishers of {topics}, for {SETTLING:g} s at the start"
            return Reason(Cause.LOOKING_FOR_OTHERS, text)
        return None


def publisher_names(
    node: Node, topic: str, reliability: ReliabilityPolicy | None = None
) -> list[str]:
    """Return the full names of the nodes that publish a ``topic``, as far as ``node`` knows.

    Args:
        node: that asks.
        topic: its full name.
        reliability: that the publishers have; None for all of them.
    """
    return [
        _full_name(info.node_namespace, info.node_name)
        for info in node.get_publishers_info_by_topic(topic)
        if reliability in (None, info.qos_profile.reliability)
    ]


def other_publishers(
    node: str, own: Mapping[str, int], found: Mapping[str, Iterable[str]]
) -> str | None:
    """Name those who publish on the topics of ``node`` beside it, None if nobody does.

    Publishers are counted, as another node may have the same full name.

    Args:
        node: full name of the node that asks.
        own: how many publishers it has on each of its topics.
        found: full names of the nodes behind all publishers of each of these topics, its own
            too.
    """
    others = []
    for topic, names in found.items():
        strangers = Counter(names) - Counter({node: own[topic]})
        for name in sorted(strangers):
            who = f"another {name}" if name == node else name
            others.append(f"{who} publishes {topic}")
    if not others:
        return None
    return (
        f"{', '.join(others)} as well: end one of them "
        f"(one that has died is forgotten within {LEASE:g} s)"
    )


def _full_name(namespace: str, name: str) -> str:
    """Return the full name, or a text if the middleware has not learnt the name, or never will."""
    if not name or name.startswith("_NODE_NAME_UNKNOWN"):
        return UNNAMED
    return f"{namespace.rstrip('/')}/{name}"
