"""Setpoints come back from files as they were, and what is no recording is told."""

import sys

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE

from tri_glide_kinematics.motion import plan_move
from tri_glide_kinematics.recordings import (
    DEFINITION,
    MESSAGE,
    RecordingError,
    load_recording,
    save_csv,
    save_mcap,
)
from tri_glide_kinematics.tables import TableError

JOINTS = ("slider_1", "slider_2", "slider_3")
FRAME = "tri_glide_base"


@pytest.fixture(scope="module")
def setpoints():
    motion = plan_move(WORKSPACE, LIMITS, (0.0, 0.0, 0.2), (0.08, 0.03, 0.3))
    return motion.sample(1e-3 * np.arange(300))


def write_messages(file, messages):
    """Write joint states: topic, names, positions, velocities, and efforts, of each."""
    from mcap_ros2.writer import Writer

    with file.open("wb") as stream, Writer(stream) as writer:
        schema = writer.register_msgdef(MESSAGE, DEFINITION)
        other = writer.register_msgdef("std_msgs/msg/Empty", "")
        writer.write_message("/tick", other, {}, 1)
        for number, (topic, names, positions, velocities, *efforts) in enumerate(messages):
            header = {"stamp": {"sec": 1_700_000_000, "nanosec": 1000 * number}, "frame_id": FRAME}
            content = {"name": names, "position": positions, "velocity": velocities}
            content["effort"] = efforts[0] if efforts else []
            writer.write_message(topic, schema, {"header": header, **content}, number)


def test_a_table_has_all_digits(setpoints, tmp_path):
    file = tmp_path / "setpoints.csv"
    save_csv(file, setpoints, MACHINE.forward_batch(setpoints.heights))
    read = load_recording(file, JOINTS)
    np.testing.assert_array_equal(read.stamps, setpoints.times)
    np.testing.assert_array_equal(read.heights, setpoints.heights)
    np.testing.assert_array_equal(read.velocities, setpoints.velocities)
    assert read.resolution < 1e-15
    head = file.read_text().splitlines()[0].split(",")
    assert head[0] == "time [s]"
    assert head[7:] == [
        *(f"acceleration_{i} [m/s^2]" for i in (1, 2, 3)),
        "x [m]",
        "y [m]",
        "z [m]",
    ]


def test_a_table_of_others_needs_times_and_heights_only(tmp_path):
    file = tmp_path / "setpoints.csv"
    file.write_text(
        "time,height_1,height_2,height_3,load\n5.0,0.123,0.5,nan,3\n5.1,0.2,0.5,0.6,3\n"
    )
    read = load_recording(file, JOINTS)
    assert read.velocities is None
    np.testing.assert_allclose(read.stamps, [0.0, 0.1])
    assert read.resolution == pytest.approx(5e-7)
    assert np.isnan(read.heights[0, 2])


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_recording_of_ros_comes_back(setpoints, tmp_path, kind):
    """Of ten parts of a folder, the tenth is behind the second."""
    if kind == "file":
        place = tmp_path / "motion.mcap"
        save_mcap(place, setpoints, JOINTS, FRAME)
    else:
        place = tmp_path
        for number in range(12):
            rows = slice(25 * number, 25 * number + 25)
            part = setpoints._replace(
                **{name: getattr(setpoints, name)[rows] for name in setpoints._fields}
            )
            save_mcap(tmp_path / f"motion_{number}.mcap", part, JOINTS, FRAME)
        (tmp_path / "metadata.yaml").touch()
    read = load_recording(place, JOINTS)
    np.testing.assert_allclose(read.stamps, setpoints.times, atol=1e-9)
    np.testing.assert_array_equal(read.heights, setpoints.heights)
    np.testing.assert_array_equal(read.velocities, setpoints.velocities)


def test_joints_are_read_by_name_in_any_namespace(tmp_path):
    file = tmp_path / "a.mcap"
    names = ["gripper", *reversed(JOINTS)]
    row = ("/cell_1/joint_commands", names, [9.0, 3.0, 2.0, 1.0], [9.0, 30.0, 20.0, 10.0])
    write_messages(file, [row, row])
    read = load_recording(file, JOINTS)
    assert read.heights.tolist() == [[1.0, 2.0, 3.0]] * 2
    assert read.velocities.tolist() == [[10.0, 20.0, 30.0]] * 2
    np.testing.assert_allclose(read.stamps, [0.0, 1e-6], atol=1e-12)
    assert load_recording(file, JOINTS, "/cell_1/joint_commands").heights.shape == (2, 3)


def test_efforts_are_read_where_there_are_some(tmp_path):
    file = tmp_path / "a.mcap"
    row = ("/joint_states", list(reversed(JOINTS)), [3.0, 2.0, 1.0], [0.0] * 3)
    write_messages(file, [row, (*row, [30.0, 20.0, 10.0])])
    efforts = load_recording(file, JOINTS, "joint_states").efforts
    np.testing.assert_array_equal(efforts, [[np.nan] * 3, [10.0, 20.0, 30.0]])
    write_messages(file, [row, row])
    assert load_recording(file, JOINTS, "joint_states").efforts is None
    table = tmp_path / "a.csv"
    heads = [f"{name}_{i}" for name in ("height", "effort") for i in (1, 2, 3)]
    table.write_text(f"time,{','.join(heads)} [N]\n0,1,2,3,10,20,30\n1,1,2,3,10,20,30\n")
    assert load_recording(table, JOINTS).efforts.tolist() == [[10.0, 20.0, 30.0]] * 2
    table.write_text(f"time,{','.join(heads)} [kN]\n0,1,2,3,10,20,30\n")
    with pytest.raises(TableError, match="effort_3 is in kN, must be in N"):
        load_recording(table, JOINTS)


NAMES = list(JOINTS)
ROW = [0.5, 0.5, 0.5]


@pytest.mark.parametrize(
    ("messages", "reason"),
    [
        ([], "has no messages of joint_commands; it has /tick"),
        ([("/joint_states", NAMES, ROW, ROW)], "it has /joint_states, /tick"),
        ([("/my_joint_commands", NAMES, ROW, ROW)], "has no messages of joint_commands"),
        ([(f"/{n}/joint_commands", NAMES, ROW, ROW) for n in "ab"], "and /b/joint_commands: name"),
        ([("joint_commands", ["slider_1", "b", "c"], ROW, ROW)], "message 1.*no joint slider_2"),
        ([("joint_commands", NAMES, ROW[:2], ROW)], "2 positions, 3 velocities and 0 efforts of "),
        ([("joint_commands", NAMES, ROW, each) for each in (ROW, [])], "and others without"),
    ],
)
def test_what_is_no_recording_of_setpoints_is_told(tmp_path, messages, reason):
    file = tmp_path / "a.mcap"
    write_messages(file, messages)
    with pytest.raises(RecordingError, match=reason):
        load_recording(file, JOINTS)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.mcap", b"nothing of the kind", "cannot be read as MCAP"),
        ("a.mcap", b"", "cannot be read as MCAP"),
        ("a.db3", b"", "is no recording"),
        ("a.csv", b"1,2,3\n", "has no head; it must have the columns time .s., height_1 .m."),
    ],
)
def test_a_file_that_is_none_is_told(tmp_path, name, content, reason):
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(RecordingError, match=reason):
        load_recording(file, JOINTS)


def test_a_recording_that_was_cut_off_is_told(setpoints, tmp_path):
    file = tmp_path / "a.mcap"
    save_mcap(file, setpoints, JOINTS, FRAME)
    file.write_bytes(file.read_bytes()[:4000])
    with pytest.raises(RecordingError, match="cannot be read as MCAP"):
        load_recording(file, JOINTS)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("time,height_1,height_2\n1,2,3\n", "has no column height_3"),
        ("height_1,height_2,height_3\n1,2,3\n", "has no column time"),
        ("time,velocity_1\n1,2\n", "has no column"),
        ("time [ms],height_1,height_2,height_3\n1,2,3,4\n", "time is in ms, must be in s"),
    ],
)
def test_a_table_without_its_columns_is_told(tmp_path, text, reason):
    file = tmp_path / "a.csv"
    file.write_text(text)
    with pytest.raises(TableError, match=reason) as told:
        load_recording(file, JOINTS)
    assert told.value.line == 1


def test_missing_files_and_a_missing_package_are_told(setpoints, tmp_path, monkeypatch):
    with pytest.raises(RecordingError, match=r"has no file that ends in \.mcap"):
        load_recording(tmp_path, JOINTS)
    with pytest.raises(RecordingError, match="cannot be read: No such file"):
        load_recording(tmp_path / "none.mcap", JOINTS)
    with pytest.raises(RecordingError, match="cannot be written: No such file"):
        save_csv(tmp_path / "none" / "a.csv", setpoints, setpoints.heights)
    (tmp_path / "a.mcap").touch()
    monkeypatch.setitem(sys.modules, "mcap_ros2.writer", None)
    monkeypatch.setitem(sys.modules, "mcap.reader", None)
    for action in (
        lambda: save_mcap(tmp_path / "b.mcap", setpoints, JOINTS, FRAME),
        lambda: load_recording(tmp_path / "a.mcap", JOINTS),
    ):
        with pytest.raises(RecordingError, match="pip install mcap-ros2-support"):
            action()
