"""What is set in the drives: read back, refused by name where it is wrong."""

from dataclasses import replace

import pytest
from group_rig import GroupRig, settings

from tri_glide_kinematics.drives import DriveState, DriveUnits, GroupState
from tri_glide_kinematics.errors import KinematicsError

OPERATIONAL = 5


def ended(rig: GroupRig, seconds: float = 5.0) -> GroupRig:
    return rig.until(GroupState.OFF, GroupState.FAULT, seconds=seconds)


def test_a_drive_is_set_up_for_the_period_to_stop_by_itself_and_for_its_pdos():
    rig = GroupRig().off()
    drive = rig.drives[0]
    asked = {
        (0x1006, 0): 2000,
        (0x1016, 1): 127 << 16 | 50,
        (0x1017, 0): 16,
        (0x1029, 1): 0,
        (0x6007, 0): 3,
        (0x605A, 0): 6,
        (0x605B, 0): 1,
        (0x605C, 0): 1,
        (0x605E, 0): 2,
        (0x6085, 0): 10_000_000,
        (0x1400, 2): 1,
        (0x1600, 1): 0x60400010,
        (0x1600, 2): 0x607A0020,
        (0x1800, 2): 1,
        (0x1A00, 1): 0x60410010,
        (0x1A00, 2): 0x60640020,
        (0x6099, 1): 50_000,
        (0x6098, 0): 18,
    }
    assert {address: drive.objects[address] for address in asked} == asked
    assert drive.objects[0x60C2, 1] * 10.0 ** drive.objects[0x60C2, 2] == pytest.approx(0.002)
    assert drive.objects[0x1401, 1] & 1 << 31
    assert rig.drives[1].objects[0x6098, 0] == 17
    assert drive.network_state == OPERATIONAL
    assert not rig.group.remarks


def test_a_value_that_cannot_be_written_is_good_if_it_is_right():
    for value, power in ((2, -3), (20, -4)):
        rig = GroupRig()
        faults, objects = rig.drives[1].faults, rig.drives[1].objects
        objects[0x60C2, 1], objects[0x60C2, 2] = value, power
        faults.read_only = {(0x60C2, 1), (0x60C2, 2), (0x1006, 0)}
        objects[0x1006, 0] = 2000
        rig.off()
    rig = GroupRig()
    rig.drives[1].faults.read_only = {(0x60C2, 1)}
    rig.drives[1].objects[0x60C2, 1] = 4
    assert ended(rig).group.state is GroupState.FAULT
    for part in ("axis 2 (node 2) has 4", "0x60C2:01 (interpolation time)", "2 was asked for"):
        assert part in rig.group.message


def test_what_is_rounded_is_refused_by_name():
    rig = GroupRig()
    rig.drives[2].faults.rounded[0x6085, 0] = 3_000
    assert ended(rig).group.state is GroupState.FAULT
    assert "axis 3 (node 3) has 9999000 for 0x6085:00" in rig.group.message


@pytest.mark.parametrize("address", [(0x1016, 1), (0x6007, 0), (0x605A, 0)])
def test_a_drive_that_cannot_come_to_rest_by_itself_is_refused(address):
    rig = GroupRig()
    rig.drives[0].faults.absent.add(address)
    assert ended(rig).group.state is GroupState.FAULT
    assert f"lacks 0x{address[0]:04X}" in rig.group.message


def test_what_else_is_absent_is_a_remark():
    absent = {(0x1029, 1), (0x60C2, 1), (0x60C2, 2), (0x6085, 0), (0x1401, 1), (0x6081, 0)}
    rig = GroupRig()
    rig.drives[0].faults.absent |= absent
    rig.on()
    assert len(rig.group.remarks) == 4
    assert all("axis 1 (node 1) lacks 0x" in remark for remark in rig.group.remarks)


def test_a_write_that_is_aborted_is_told_by_name_or_does_no_harm():
    """Whichever it is: nothing that is wrong is used, and no drive gets torque on the way."""
    good = GroupRig().off()
    writes = good.drives[0]._writes
    named = 0
    for number in range(1, writes + 1):
        rig = GroupRig()
        rig.drives[0].faults.abort_at = number
        ended(rig)
        assert all(drive.axis.state is DriveState.SWITCH_ON_DISABLED for drive in rig.drives)
        if rig.group.state is GroupState.FAULT:
            assert "axis 1 (node 1)" in rig.group.message and "0x" in rig.group.message
            named += 1
            rig.group.reset(rig.now)
            rig.off()
        differing = {
            address
            for address, value in rig.drives[0].objects.items()
            if value != good.drives[0].objects[address]
        }
        assert differing <= {(0x6081, 0), (0x6064, 0)}
    assert named > writes / 2


def test_slow_answers_are_waited_for():
    rig = GroupRig()
    rig.drives[1].faults.answer_delay = 0.3
    ended(rig, seconds=60.0)
    assert rig.group.state is GroupState.OFF


def test_a_drive_that_is_not_there_is_waited_for_and_named():
    rig = GroupRig()
    rig.bus.drives = rig.drives[:2]
    rig.run(8.0)
    assert rig.group.state is GroupState.SILENT
    assert rig.group.message == "waits for axis 3 (node 3)"


def test_settings_that_cannot_be_are_refused():
    drives = settings().drives
    with pytest.raises(KinematicsError, match="axis 1 and axis 3 have the same node id 1"):
        settings(drives=(*drives[:2], replace(drives[2], node=1)))
    with pytest.raises(KinematicsError, match="the computer and axis 2 have the same node id 2"):
        settings(own_node=2)
    with pytest.raises(KinematicsError, match=r"0\.1 ms"):
        settings(period=0.00215)
    with pytest.raises(KinematicsError, match="149 %"):
        settings(bitrate=250_000)
    with pytest.raises(KinematicsError, match=r"method 18 of homing of node 2 goes away from"):
        settings(drives=(drives[0], replace(drives[1], homing_method=18), drives[2]))
    low = replace(drives[2], homing_method=17, home_height=0.3)
    assert settings(drives=(replace(low, node=1), replace(low, node=2), low))
    with pytest.raises(KinematicsError, match="some drives go up in their homing, others down"):
        settings(drives=(*drives[:2], low))
    with pytest.raises(KinematicsError, match="2147483647 counts"):
        settings(drives=(*drives[:2], replace(drives[2], units=DriveUnits(4000, 1), brake=0.1)))
    words = "following error of axis 2 = 5000 must be below 4294967296 counts of the drive, it is 5"
    with pytest.raises(KinematicsError, match=words):
        settings(drives=(drives[0], replace(drives[1], largest_error=5000.0), drives[2]))
    assert "74 %" in GroupRig(bitrate=500_000).off().group.remarks[0]
