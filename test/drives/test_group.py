"""Three drives are led as one: what happens to one of them stops all, and nothing moves unasked."""

from collections.abc import Callable
from itertools import pairwise

import pytest
from group_rig import PERIOD, GroupRig
from soak import many

from testing.simulated_bus import SimulatedBus
from tri_glide_kinematics.drives import (
    BusError,
    CobId,
    Command,
    DriveError,
    DriveState,
    GroupState,
    Setpoint,
    SimulatedDrive,
)
from tri_glide_kinematics.errors import KinematicsError

WITH_TORQUE = {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE}


def states(rig: GroupRig) -> list[DriveState]:
    return [drive.axis.state for drive in rig.drives]


def in_motion() -> GroupRig:
    """Return drives that swing at their highest speed, 0.25 m/s."""
    rig = GroupRig(
        (0.86, 0.86, 0.86), homing_speed=0.2, homing_slow_speed=0.05, homing_acceleration=4.0
    ).homed()
    return rig.swing(1.125)


def test_enabling_anywhere_moves_nothing_with_noise_of_the_encoders():
    """At both ends, too; 60 s of it in a long run."""
    heights = (0.3, 0.9, 0.61)
    rig = GroupRig(heights, noise=1.0).on()
    for _ in range(many(6)):
        rig.run(1.0)
        assert rig.group.state is GroupState.ON
        for height, now in zip(heights, rig.true_heights):
            assert abs(now - height) <= 1.001e-6


def test_targets_are_where_the_drives_are_while_operation_is_not_enabled():
    rig = GroupRig((0.4, 0.5, 0.6))
    sent: list[tuple[Command, ...]] = []
    send_cycle = rig.bus.send_cycle
    rig.bus.send_cycle = lambda commands: (sent.append(tuple(commands)), send_cycle(commands))[1]  # type: ignore[method-assign, assignment]
    rig.on()
    for commands in sent:
        for command, drive in zip(commands, rig.drives):
            assert command.position == drive.objects[0x6064, 0]
    words = [commands[0].control_word for commands in sent if commands]
    assert [word for i, word in enumerate(words) if word not in words[:i]] == [0, 6, 7, 15]
    rig.group.disable(rig.now)
    rig.off()
    for drive in rig.drives:
        drive.axis.position += 1_000.0
    rig.run(0.1)
    assert [each.position for each in sent[-1]] == [each.objects[0x6064, 0] for each in rig.drives]


def leave(drive: SimulatedDrive) -> None:
    drive.axis.drop_out()


def fail(drive: SimulatedDrive) -> None:
    drive.axis.fail(0x7305)


def warn(drive: SimulatedDrive) -> None:
    drive.axis.tell(0x4210)


def lose_power(drive: SimulatedDrive) -> None:
    drive.reboot()


def fall_silent(drive: SimulatedDrive) -> None:
    drive.faults.is_mute = True


def lose_answers(drive: SimulatedDrive) -> None:
    drive.faults.lost_statuses = 1_000_000


@pytest.mark.parametrize(
    ("happen", "told", "noticed"),
    [
        (fail, ("error code (0x603F) 0x7305", "EMCY 0x7305"), 0.0),
        (warn, ("error code (0x603F) 0x4210", "EMCY 0x4210", "tells an error"), 0.0),
        (leave, ("has left OPERATION ENABLED", "no EMCY"), 0.0),
        # It tells its start when it has booted; before, it is only silent.
        (lose_power, ("has not answered SYNC 5 times",), 5 * PERIOD),
        (fall_silent, ("tells no heartbeat",), 0.05),
        (lose_answers, ("has not answered SYNC 5 times",), 5 * PERIOD),
    ],
)
def test_what_happens_to_one_drive_stops_the_others_within_two_periods(happen, told, noticed):
    rig = in_motion()
    began = rig.now
    happen(rig.drives[1])
    others = rig.drives[0], rig.drives[2]
    rig.until_true(lambda: all(d.axis.state is DriveState.QUICK_STOP_ACTIVE for d in others))
    assert rig.now - began <= noticed + 2 * PERIOD + 1e-9
    assert rig.group.state is GroupState.FAULT
    assert rig.group.heights is None and rig.group.velocities is None
    rig.run(1.5)
    for text in ("axis 2 (node 2)", "error code (0x603F)", *told):
        assert text in rig.group.message
    assert all(d.axis.velocity == 0.0 and d.axis.holds for d in others)
    # A reset enables nothing, and one that does not help says so.
    rig.group.reset(rig.now)
    rig.until_true(lambda: rig.group.state is not GroupState.SILENT)
    assert DriveState.OPERATION_ENABLED not in states(rig)
    if happen is not fall_silent and happen is not lose_answers:
        assert rig.group.state is GroupState.OFF
        assert rig.group.is_homed == (happen is not lose_power)
        rig.run(1.0)
        assert WITH_TORQUE.isdisjoint(states(rig))
        rig.group.enable(rig.now)
        rig.until(GroupState.ON)


def test_some_lost_answers_are_no_fault():
    rig = in_motion()
    for _ in range(5):
        rig.drives[2].faults.lost_statuses = 4
        rig.swing(0.5)
        assert rig.group.state is GroupState.ON


def test_answers_that_all_come_late_are_no_fault_and_a_bus_without_any_is_one():
    rig = in_motion()
    for count, state in ((20, GroupState.ON), (1_000_000, GroupState.FAULT)):
        for drive in rig.drives:
            drive.faults.lost_statuses = count
        rig.swing(0.06)
        assert rig.group.state is state
        if state is GroupState.ON:
            rig.swing(0.5)
    assert "has not answered SYNC 26 times" in rig.group.message


def test_vendor_bits_change_nothing():
    rig = GroupRig(
        (0.86, 0.86, 0.86), homing_speed=0.2, homing_slow_speed=0.05, homing_acceleration=4.0
    )
    for drive in rig.drives:
        drive.faults.vendor_bits = 0xC180
    rig.homed().swing(0.5)
    assert rig.group.state is GroupState.ON


def test_setpoints_that_cease_end_in_rest_and_late_ones_are_not_carried_out():
    rig = in_motion()
    rig.until(GroupState.BRAKING, seconds=0.1)
    speeds, late = [], Setpoint(rig.now, (0.8, 0.8, 0.8), (0.1, 0.1, 0.1))
    while rig.group.state is not GroupState.HOLDING:
        speeds.append(rig.drives[0].axis.velocity)
        assert not rig.group.put(late, rig.now)
        rig.step()
    rig.run(0.5)
    assert max(abs(b - a) for a, b in pairwise(speeds)) <= 1.6 * 10e6 * PERIOD
    place = rig.true_heights
    assert "no setpoints come" in rig.group.message and rig.group.heights is not None
    assert not rig.group.put(late, rig.now)
    rig.run(0.5)
    assert rig.true_heights == place and set(states(rig)) == {DriveState.OPERATION_ENABLED}
    rig.group.enable(rig.now)
    rig.swing(0.5, reach=0.01)
    assert rig.group.state is GroupState.ON and rig.true_heights != place


def test_disabling_in_motion_brakes_first_and_takes_the_torque_last():
    rig = in_motion()
    rig.group.disable(rig.now)
    rig.until_true(lambda: set(states(rig)) != {DriveState.OPERATION_ENABLED})
    assert all(abs(drive.axis.velocity) < 1_000.0 for drive in rig.drives)
    rig.off()


@pytest.mark.parametrize("disable", [True, False])
def test_an_enabling_while_they_brake_is_carried_out_at_rest(disable):
    """It does not lead back to where the sliders were while they moved."""
    rig = in_motion()
    if disable:
        rig.group.disable(rig.now)
    rig.until(GroupState.BRAKING, seconds=0.1)
    rig.group.enable(rig.now)
    rig.until_true(lambda: rig.drives[0].axis.velocity == 0.0, seconds=0.1)
    place = rig.true_heights
    rig.until(GroupState.ON, seconds=1.0)
    rig.run(0.5)
    assert rig.true_heights == pytest.approx(place, abs=1e-6)
    rig.group.disable(rig.now)
    rig.group.enable(rig.now)
    rig.group.disable(rig.now)
    rig.off().run(0.5)
    assert set(states(rig)) == {DriveState.SWITCH_ON_DISABLED}


def test_what_begins_to_move_after_a_disabling_is_not_followed():
    """Drives whose brakes take their time are enabled still."""
    rig = GroupRig(playout_delay=0.5).homed()
    rig.run(0.5).swing(0.1)
    rig.bus.is_lost = lambda frame: frame[0] & 0x780 == CobId.TARGET
    rig.group.disable(rig.now)
    rig.bus.sent.clear()
    rig.run(0.7)
    targets = {frame for _, frame in rig.bus.sent if frame[0] == CobId.TARGET + 1}
    assert len(targets) == 1 and DriveState.OPERATION_ENABLED in states(rig)


def test_setpoints_from_somewhere_else_are_not_followed():
    rig = in_motion()
    rig.until(GroupState.HOLDING)
    rig.group.enable(rig.now)
    x, y, z = rig.group.heights
    for heights in ((x, y + 0.0011, z), (x, y, 5.0), (float("nan"), y, z)):
        with pytest.raises(KinematicsError, match=r"setpoint of axis|a jump at rest of 0\.0011"):
            rig.group.put(Setpoint(rig.now, heights, (0.0, 0.0, 0.0)), rig.now)
    with pytest.raises(KinematicsError, match=r"velocity of the setpoint of axis 2 = 1\.7"):
        rig.group.put(Setpoint(rig.now, (x, y, z), (0.0, 1.7, 0.0)), rig.now)
    # In motion, too, and with a stamp that follows.
    place = rig.true_heights
    with pytest.raises(KinematicsError, match=r"a jump at rest of 0\.00995"):
        rig.group.put(Setpoint(rig.now + PERIOD, (x - 0.01, y, z), (0.1, 0.0, 0.0)), rig.now)
    rig.run(0.1)
    assert rig.true_heights == pytest.approx(place, abs=1e-5)
    rig.swing(0.1)
    place = rig.group.heights
    for _ in range(20):
        setpoint = Setpoint(rig.now, (x - 0.1, y, z), (0.0, 0.0, 0.0))
        rig.group.put(setpoint, rig.now)
        rig.step()
    assert rig.group.state is GroupState.FAULT and "jumps by" in rig.group.message
    assert rig.true_heights == pytest.approx(place, abs=0.01)


def test_a_mode_that_is_not_confirmed_gives_no_torque():
    rig = GroupRig().off()
    rig.drives[2].axis.step = lambda dt: None  # type: ignore[method-assign]
    rig.group.enable(rig.now)
    rig.until(GroupState.FAULT)
    assert "axis 3 (node 3) shows mode 0 (0x6061), 8 was asked for" in rig.group.message
    assert set(states(rig)) == {DriveState.SWITCH_ON_DISABLED}


def broken(rig: GroupRig, name: str) -> Callable[..., None]:
    def call(*_: object) -> None:
        raise BusError(f"cannot {name}")

    return call


@pytest.mark.parametrize("name", ["received", "send_cycle", "send_heartbeat", "read"])
def test_a_bus_that_is_lost_is_told_at_once_and_nothing_is_sent_until_a_reset(name):
    rig = in_motion()
    whole = getattr(rig.bus, name)
    setattr(rig.bus, name, broken(rig, name))
    if name == "read":
        rig.drives[1].axis.fail(0x7305)
    rig.until(GroupState.BUS_LOST, seconds=0.02)
    assert rig.group.message == f"cannot {name}" and rig.group.heights is None
    setattr(rig.bus, name, whole)
    count = len(rig.bus.sent)
    rig.run(1.0)
    assert len(rig.bus.sent) == count
    # The drives have missed the heartbeat, and hold.
    assert DriveState.QUICK_STOP_ACTIVE in states(rig)
    for call in (rig.group.enable, rig.group.home, rig.group.disable):
        with pytest.raises(DriveError, match=f"BUS_LOST, cannot {name}"):
            call(rig.now)
    rig.group.reset(rig.now)
    rig.off()
    assert rig.group.is_homed
    rig.group.enable(rig.now)
    rig.until(GroupState.ON)


def test_who_was_without_power_while_the_bus_was_lost_has_to_be_homed():
    rig = in_motion()
    rig.bus.is_off = True
    rig.until(GroupState.BUS_LOST)
    rig.drives[0].reboot()
    rig.bus.is_off = False
    rig.run(1.0).group.reset(rig.now)
    rig.off()
    assert not rig.group.is_homed


def test_of_two_that_lead_the_same_drives_the_second_sends_nothing():
    rig = GroupRig().on()
    other = GroupRig()
    other.bus.drives = rig.drives
    for _ in range(300):
        count = len(rig.bus.sent)
        rig.step()
        for _, frame in list(rig.bus.sent)[count:]:
            other.bus.hear(frame)
        other.bus.now = other.now = rig.now
        other.group.step(rig.now)
    assert not other.bus.sent
    assert other.group.state is GroupState.FAULT
    assert "somebody else sends COB-ID 0x" in other.group.message
    assert rig.group.state is GroupState.ON
    rig.bus.hear((0x80, b""))
    rig.step()
    assert rig.group.state is GroupState.FAULT and "COB-ID 0x080" in rig.group.message
    rig.step()
    assert set(states(rig)) == {DriveState.QUICK_STOP_ACTIVE}


def test_two_drives_with_one_node_id_are_found():
    rig = GroupRig().on()
    status = bytes.fromhex("37020000000000")
    for _ in range(550):
        rig.bus.hear((0x182, status))
        rig.step()
    assert rig.group.state is GroupState.FAULT
    assert "axis 2 (node 2) answers a SYNC twice" in rig.group.message


def test_a_computer_that_was_away_does_not_go_on():
    rig = in_motion()
    rig.now += 0.2
    rig.bus.advance(rig.now)
    assert set(states(rig)) == {DriveState.QUICK_STOP_ACTIVE}
    rig.group.step(rig.now)
    assert rig.group.state is GroupState.FAULT
    rig.run(1.0)
    assert set(states(rig)) == {DriveState.QUICK_STOP_ACTIVE}


def test_drives_that_have_stopped_before_the_start_keep_their_torque_until_a_reset():
    rig = in_motion()
    rig.bus = SimulatedBus(rig.drives, rig.now)
    again = GroupRig()
    again.drives, again.bus, again.now = rig.drives, rig.bus, rig.now
    again.group.__init__(rig.bus, again.settings)  # type: ignore[misc]
    again.until(GroupState.FAULT)
    assert "takes a reset" in again.group.message
    assert set(states(rig)) == {DriveState.QUICK_STOP_ACTIVE}
    again.group.reset(again.now)
    again.off()
