"""What a pick_node tells is shown as soon as it is heard."""

import numpy as np
from geometry_msgs.msg import Point

from tri_glide_interfaces.msg import PickState
from tri_glide_kinematics.panel.tabs.pick_view import PickView


def test_parts_and_counters_are_shown(server):
    view = PickView(server)
    view.draw(None)
    assert not view._folder.visible

    state = PickState(doing="picks parts", belt_velocity=-1e-9, parts=[3, 4], target=4, placed=7)
    state.positions = [Point(x=0.1, y=0.0, z=0.25), Point(x=-0.1, y=0.02, z=0.25)]
    view.draw(state)
    assert view._folder.visible
    for text in ("picks parts", "placed", "7", "0.0 mm/s"):
        assert text in view._table.content
    cloud = server.scene.get_handle_by_name("/parts")
    assert np.allclose(cloud.points, [(0.1, 0.0, 0.25), (-0.1, 0.02, 0.25)], atol=1e-3)

    view.draw(PickState(doing="all are placed"))
    assert len(server.scene.get_handle_by_name("/parts").points) == 0
