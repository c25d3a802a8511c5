"""What ik_node publishes, recorded as ROS 2 does, is judged without ROS."""

import numpy as np
from mcap.writer import Writer
from rclpy.serialization import serialize_message

from testing.commands import LIMITS, PERIOD
from testing.machine import JOINTS
from tri_glide_kinematics.recordings import DEFINITION, MESSAGE, judge, load_recording
from tri_glide_kinematics.settings import IK_NODE, machine_of, workspace_limits_of
from tri_glide_kinematics.workspace import Workspace

# The client of a test may be kept from its turns: so gaps are none of this.
GAP = 10.0


def save(file, messages, client):
    """Write messages with their own bytes, as rosbag2 does."""
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema(MESSAGE, "ros2msg", DEFINITION.encode())
        channel = writer.register_channel("/cell/joint_commands", "cdr", schema)
        for message in messages:
            time = client.time_of(message)
            writer.add_message(channel, time, serialize_message(message), time)
        writer.finish()


def test_a_run_of_ik_node_is_accused_of_nothing(running_machine, tmp_path):
    machine, client = running_machine, running_machine.client
    machine.forget()
    machine.move((0.06, -0.03, 0.28))
    machine.get_going((-0.05, 0.05, 0.2), 0.2)
    # A busy computer may have arrived before the stop.
    client.stop()
    machine.wait_for_state("idle")
    machine.move((0.0, 0.0, 0.25))
    save(tmp_path / "run_0.mcap", machine.commands, client)
    values = {entry.name: entry.default for entry in IK_NODE}
    workspace = Workspace(machine_of(values), workspace_limits_of(values))
    recording = load_recording(tmp_path, JOINTS)
    assert len(recording.stamps) == len(machine.commands)
    heights = [machine.heights(message) for message in machine.commands]
    np.testing.assert_array_equal(recording.heights, heights)
    found = judge(recording, workspace, LIMITS, PERIOD, longest_gap=GAP)
    assert found.violations == ()
    assert 0.5 < max(found.largest) <= 1.0 + 1e-6
    # The same run is accused if the limits are a little lower than those that it has used.
    lower = LIMITS.times(*(0.999 * part for part in found.largest))
    # A late setpoint that is not where the lower jerk lets it be would begin anew, and its jerk be
    # judged no more: so gaps are none of this, either.
    accused = judge(recording, workspace, lower, PERIOD, longest_gap=GAP)
    kinds = {each.kind.value for each in accused.violations}
    assert {"velocity", "acceleration", "jerk"} <= kinds
