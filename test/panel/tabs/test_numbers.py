"""The numbers on the page."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine import Pose
from tri_glide_kinematics.panel.tabs.live_view import edge_distance, edge_row, numbers_table
from tri_glide_kinematics.panel.words import bar, note, table
from tri_glide_kinematics.settings import IK_NODE

FACTS = MachineFacts({parameter.name: parameter.default for parameter in IK_NODE})
POSITION = (0.02, -0.01, 0.25)


def test_the_nearest_edge_is_an_edge() -> None:
    distance, direction = edge_distance(FACTS, POSITION)
    signs = {"+": 1.0, "-": -1.0}
    step = signs[direction[0]]
    axis = "xyz".index(direction[1])
    for factor, is_inside in ((0.999, True), (1.001, False)):
        place = list(POSITION)
        place[axis] += factor * step * distance
        if is_inside:
            FACTS.workspace.check_position(place)
        else:
            with pytest.raises(KinematicsError):
                FACTS.workspace.check_position(place)


def test_the_table_has_all_numbers() -> None:
    pose = Pose(FACTS.machine.inverse(POSITION), POSITION)
    edge = edge_row(FACTS, POSITION)
    text = numbers_table(FACTS, pose, edge, (0.5, -0.95, 0.0), "3 in a second, 7 in all")
    for part in (
        "20.00 mm",
        "-10.00 mm",
        "250.00 mm",
        "500.0 mm/s",
        "3 in a second",
        "condition number",
        "edge",
        edge[1],
    ):
        assert part in text
    # 0.95 of the limit is much, 0.5 is not.
    assert text.count('class="much"') == 1


def test_limits_are_scaled_with_the_speed() -> None:
    slow = FACTS.with_changes({"speed_scale": 0.5})
    pose = Pose(FACTS.machine.inverse(POSITION), POSITION)
    assert 'class="much" style="width:100%"' in numbers_table(
        slow, pose, edge_row(slow, POSITION), (0.5, 0.0, 0.0), ""
    )


def test_a_place_outside_is_told() -> None:
    heights = (0.95, 0.95, 0.95)
    pose = Pose(heights, FACTS.machine.forward(heights))
    edge = edge_row(FACTS, pose.position)
    assert edge[1] == "0.0 mm"
    text = numbers_table(FACTS, pose, edge, None, "")
    assert "0.0 mm" in text
    assert "velocity" not in text


def test_what_comes_from_elsewhere_is_text() -> None:
    assert "<script>" not in note("<script>") + table([("<script>",)])
    assert "width:100%" in bar(7.0)
    assert "width:0%" in bar(-1.0)


def test_live_parameters_leave_the_machine_as_it_is() -> None:
    assert FACTS.is_same_machine(FACTS.with_changes({"speed_scale": 0.5}))
    assert not FACTS.is_same_machine(FACTS.with_changes({"arm_length": 0.5}))
