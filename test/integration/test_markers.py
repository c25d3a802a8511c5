"""What RViz and Foxglove are shown of a machine."""

import numpy as np
import pytest
from visualization_msgs.msg import Marker, MarkerArray

from testing.client import LATCHED

TARGET = (0.04, -0.03, 0.3)
NEXT = (0.0, 0.0, 0.28)


def newest(messages):
    """Return the newest markers by name."""
    return {marker.ns: marker for marker in messages[-1].markers}


def shown(messages):
    """Return the names of what is shown, if all messages have been taken in."""
    names = set()
    for message in messages:
        for marker in message.markers:
            (names.discard if marker.action == Marker.DELETE else names.add)(marker.ns)
    return names


def place(point):
    return point.x, point.y, point.z


def test_workspace_and_target_are_shown_to_whoever_looks_and_gone_when_they_are(machine, client):
    machine.start({"space": "cylinder", "cylinder_radius": 0.1, "cylinder_z": [0.2, 0.4]})
    machine.move(TARGET)
    markers = client.record(MarkerArray, "markers", LATCHED)
    client.wait_for(lambda: shown(markers) == {"workspace", "target"}, "workspace and target")
    assert all(message.markers for message in markers)
    found = newest(markers)
    assert found["target"].type == Marker.SPHERE
    assert place(found["target"].pose.position) == TARGET
    outline = found["workspace"]
    assert outline.type == Marker.LINE_LIST
    points = np.array([place(point) for point in outline.points])
    assert np.hypot(points[:, 0], points[:, 1]).max() == pytest.approx(0.1, abs=1e-3)
    assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((0.2, 0.4), abs=1e-3)
    for marker in found.values():
        assert marker.header.frame_id == "tri_glide_base"
        assert marker.color.a > 0.0

    # Nothing is told again while nothing changes.
    count = len(markers)
    machine.move(NEXT)
    client.wait_for(lambda: place(newest(markers)["target"].pose.position) == NEXT, "the target")
    assert len(markers) == count + 1
    assert newest(markers)["workspace"] == outline

    # A jog has no target.
    client.send_twist((0.0, 0.0, 0.02))
    client.wait_for(lambda: shown(markers) == {"workspace"}, "the target to be gone")

    # Who comes later is shown the same.
    late = client.record(MarkerArray, "markers", LATCHED)
    client.wait_for(lambda: late, "the markers once more")
    assert late[-1] == markers[-1]
