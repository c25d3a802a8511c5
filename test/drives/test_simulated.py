"""A simulated drive does what CiA 301 and 402 say, and has faults where that is asked for."""

import itertools
import random

import pytest
from drive_rig import ENABLE, PERIOD, QUICK_STOP, RESET, SHUT_DOWN, Rig

from tri_glide_kinematics.drives import DriveState, Emergency, Heartbeat, Slider, Switch

TOP = 580_000


def enabled(*positions: float, slider: Slider | None = None) -> Rig:
    rig = Rig(positions or (300_000.0,), slider)
    rig.set_up()
    rig.enable()
    assert all(drive.axis.state is DriveState.OPERATION_ENABLED for drive in rig.drives)
    return rig


def moving(rig: Rig, speed: float = 1000.0) -> float:
    """Move at so many counts in a period; return where the targets have got."""
    target, own = float(rig.statuses[1].position), 0.0
    while own < speed:
        own = min(own + 20.0, speed)
        target += own
        rig.cycle(ENABLE, round(target))
    for _ in range(20):
        target += own
        rig.cycle(ENABLE, round(target))
    return target


def test_entries_are_refused_with_the_codes_of_cia_301():
    rig = Rig()
    codes = {
        (0x6041, 0, 1): 0x06010002,
        (0x605A, 0, 9): 0x06090031,
        (0x6060, 0, 7): 0x06090030,
        (0x1600, 1, 0x60400010): 0x08000022,
    }
    for (index, subindex, value), code in codes.items():
        assert rig.write(index, subindex, value).abort_code == code
    rig.drive.faults.absent.add((0x6007, 0))
    rig.drive.faults.read_only.add((0x60C2, 1))
    rig.drive.faults.rounded[0x6085, 0] = 1000
    assert rig.read(0x6007).abort_code == 0x06020000
    assert rig.write(0x60C2, 1, 2).abort_code == 0x06010002
    rig.write(0x6085, 0, 123_456)
    assert rig.read(0x6085).value == 123_000
    rig.drive.faults.abort_at = 7
    assert rig.write(0x6085, 0, 1000).abort_code == 0x08000000
    rig.drive.faults.answer_delay = 0.3
    began = rig.bus.now
    assert rig.read(0x1000).value == 0x00020192
    assert rig.bus.now - began == pytest.approx(0.3, abs=PERIOD)


def test_mappings_are_written_before_it_is_operational_and_targets_act_at_sync():
    rig = enabled()
    assert rig.write(0x1600, 0, 0).abort_code == 0x08000022
    assert rig.read(0x1600, 2).value == 0x607A0020
    rig.bus.is_lost = lambda frame: frame[0] == 0x80
    rig.cycle(ENABLE, 500)
    assert rig.read(0x607A).value == 0
    rig.bus.is_lost = lambda frame: False
    rig.cycle(ENABLE, 500)
    assert rig.read(0x607A).value == 500


def test_it_follows_and_a_quick_stop_brakes_and_keeps_torque():
    rig = enabled()
    rig.write(0x6085, 0, 5_000_000)
    moving(rig)
    assert rig.drive.axis.velocity == pytest.approx(500_000.0, rel=0.01)
    speeds = []
    for _ in range(100):
        status = rig.cycle(QUICK_STOP, 0)
        speeds.append(rig.drive.axis.velocity)
    # 2 ms at 5,000,000 counts/s², and never more.
    steps = [a - b for a, b in itertools.pairwise(speeds)]
    assert max(steps) == pytest.approx(10_000.0)
    assert speeds[-1] == 0.0
    assert status.status_word & 0x6F == DriveState.QUICK_STOP_ACTIVE
    # By 0x605A = 6, it is enabled again from there.
    rig.cycle(ENABLE, status.position)
    assert rig.drive.axis.state is DriveState.OPERATION_ENABLED


@pytest.mark.parametrize(
    ("option", "state"),
    [
        (0, DriveState.OPERATION_ENABLED),
        (1, DriveState.FAULT),
        (2, DriveState.SWITCH_ON_DISABLED),
        (3, DriveState.QUICK_STOP_ACTIVE),
    ],
)
def test_a_lost_heartbeat_acts_by_0x6007_within_its_time(option: int, state: DriveState):
    rig = enabled()
    rig.write(0x6007, 0, option)
    moving(rig)
    rig.bus.send_heartbeat(5)
    lost = rig.bus.now
    rig.beats = False
    rig.pass_time(1.0)
    assert rig.drive.axis.state is state
    times = [time - lost for time, text in rig.drive.history if text == "heartbeat lost"]
    assert times == [pytest.approx(0.020, abs=0.001)]
    codes = [event.code for event in rig.events if isinstance(event, Emergency)]
    assert codes == [0x8130]


def test_a_fault_brakes_lets_go_and_is_reset_by_an_edge():
    rig = enabled(slider=Slider(has_brake=False))
    moving(rig)
    rig.drive.axis.fail(0x7500)
    rig.cycle(ENABLE, 0)
    assert rig.drive.axis.state is DriveState.FAULT_REACTION_ACTIVE
    rig.pass_time(2.0)
    assert rig.drive.axis.state is DriveState.FAULT
    assert rig.read(0x603F).value == 0x7500
    # Nothing holds it: it has fallen.
    assert rig.drive.axis.position == 0.0
    for word in (0x80, 0x80, 0x00):
        rig.cycle(word, 0)
    assert rig.drive.axis.state is DriveState.SWITCH_ON_DISABLED
    codes = [event.code for event in rig.events if isinstance(event, Emergency)]
    assert codes == [0x7500, 0]


def test_a_jump_of_the_target_is_a_following_error():
    rig = enabled()
    rig.cycle(ENABLE, 100_000)
    rig.pass_time(0.01)
    assert rig.read(0x603F).value == 0x8611


def home(rig: Rig, method: int = 18) -> int:
    """Home; return the last status word."""
    settings = {(0x6060, 0): 6, (0x6098, 0): method, (0x6099, 1): 200_000, (0x6099, 2): 5_000}
    for (index, subindex), value in (settings | {(0x609A, 0): 5_000_000}).items():
        assert not rig.write(index, subindex, value).error
    rig.cycle(ENABLE, 0)
    for _ in range(3000):
        word = rig.cycle(ENABLE | 0x10, 0).status_word
        if word & 0x3400 == 0x1400 or word & 0x2000:
            break
    return word


def test_homing_finds_the_switch_from_anywhere_to_one_count():
    choice = random.Random(5)
    for method, edge in ((18, TOP), (17, 20_000)):
        for start in (edge, edge + 5000, choice.uniform(100_000, 500_000)):
            rig = enabled(start)
            assert home(rig, method) & 0x3400 == 0x1400
            assert rig.statuses[1].position == pytest.approx(rig.drive.axis.position - edge, abs=1)


def test_switches_that_stick_or_never_come_let_homing_not_succeed():
    for switch in (Switch.STICKS, Switch.NEVER):
        rig = enabled(500_000.0, slider=Slider(switch=switch))
        assert not home(rig) & 0x1000
    # It ran against the end.
    assert rig.read(0x603F).value == 0x8611


def test_a_reset_forgets_all_and_tells_so():
    rig = enabled()
    rig.bus.send_state(1, RESET)
    rig.pass_time(0.1)
    states = [event.state for event in rig.events if isinstance(event, Heartbeat)]
    assert states[0] == states[-1] == 0
    assert rig.read(0x60C2, 1).value == 10
    rig.drive.faults.is_mute = True
    rig.set_up()
    rig.events.clear()
    rig.pass_time(1.0)
    assert not [event for event in rig.events if isinstance(event, Heartbeat)]


def test_vendor_bits_lost_statuses_and_noise_change_no_state():
    rig = enabled(slider=Slider(noise=2.0))
    rig.drive.faults.vendor_bits = 0xC100
    rig.events.clear()
    rig.drive.faults.lost_statuses = 1
    target = rig.read(0x607A).value
    positions = {rig.cycle(ENABLE, target).position for _ in range(100)}
    assert len(positions) > 3
    assert rig.statuses[1].status_word & 0xC100 == 0xC100
    assert rig.drive.axis.state is DriveState.OPERATION_ENABLED
    assert rig.drive.axis.velocity == 0.0


def test_operation_is_left_without_an_error():
    rig = enabled()
    rig.drive.axis.drop_out()
    assert rig.cycle(ENABLE, 0).status_word & 0x6F == DriveState.SWITCH_ON_DISABLED
    rig.cycle(SHUT_DOWN, 0)
    assert rig.drive.axis.state is DriveState.READY_TO_SWITCH_ON
