"""What a status says about the machine that it is about."""

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from tri_glide_kinematics.control import Health, Level
from tri_glide_kinematics.ros.outputs.machine_state import status_message


@pytest.mark.parametrize(
    ("name", "hardware_id"),
    [
        ("ik_node", "tri_glide"),
        ("cell_1/ik_node", "cell_1/tri_glide"),
        ("cell_1/fk_node", "cell_1/tri_glide"),
        ("hall/cell_2/ik_node", "hall/cell_2/tri_glide"),
    ],
)
def test_machines_in_different_namespaces_have_different_hardware(name, hardware_id):
    assert status_message(name, Health(Level.OK, "", {})).hardware_id == hardware_id


def test_values_are_written_as_in_messages():
    status = status_message(
        "ik_node", Health(Level.OK, "", {"speed": -0.0, "count": 3, "way": 1e-17})
    )
    assert [entry.value for entry in status.values] == ["0", "3", "0"]


@pytest.mark.parametrize("level", Level)
def test_a_level_has_the_same_name_in_messages(level):
    status = status_message("ik_node", Health(level, "", {}))
    assert status.level == getattr(DiagnosticStatus, level.name)
