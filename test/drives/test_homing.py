"""All three drives look for their switches together, and stop together where one fails."""

import random

import pytest
from group_rig import PERIOD, QUICK, GroupRig
from soak import many, seed

from tri_glide_kinematics.drives import DriveError, DriveState, GroupState, Switch

TOP = 0.88


def homing(heights: tuple[float, ...], **changes: float) -> GroupRig:
    rig = GroupRig(heights, **{**QUICK, **changes}).off()
    rig.group.home(rig.now)
    return rig


def all_stop_within(rig: GroupRig, seconds: float) -> None:
    """Go on until all have come to rest; they begin to brake in the same cycle."""
    rig.until(GroupState.FAULT, seconds=seconds)
    rig.run(2 * PERIOD)
    assert all(drive.axis.state is not DriveState.OPERATION_ENABLED for drive in rig.drives)
    rig.run(0.2)
    assert all(drive.axis.velocity == 0.0 for drive in rig.drives)
    assert not rig.group.is_homed and rig.group.heights is None


def test_heights_are_right_to_a_count_wherever_it_begins():
    """A tenth of the starts is on the switch, and encoders have noise of half a count."""
    rng = random.Random(seed(2))
    for _ in range(many(20)):
        heights = tuple(rng.uniform(0.8, 0.89) for _ in range(3))
        rig = homing(heights)
        for drive in rig.drives:
            drive.axis.slider.noise = 0.3
        rig.until(GroupState.ON)
        assert rig.group.is_homed and not rig.group.waiting_axes
        for drive in rig.drives:
            drive.axis.slider.noise = 0.0
        rig.run(0.05)
        for told, true in zip(rig.group.heights, rig.true_heights):
            assert abs(told - true) <= 1.001e-6
        place = rig.true_heights
        rig.run(0.5)
        assert rig.true_heights == pytest.approx(place, abs=1.001e-6)


def test_they_go_up_together_at_the_same_speed():
    rig = homing((0.5, 0.55, 0.6))
    rig.until_true(lambda: any(drive.axis.velocity for drive in rig.drives))
    assert rig.group.waiting_axes == (0, 1, 2) and rig.group.heights is None
    for _ in range(500):
        rig.step()
        ways = [now - began for now, began in zip(rig.true_heights, (0.5, 0.55, 0.6))]
        assert max(ways) - min(ways) <= 2e-6
    assert ways[0] > 0.15


def test_a_homing_from_on_is_as_good_and_limits_of_the_travel_are_set_after_it():
    rig = homing((0.85, 0.86, 0.87)).until(GroupState.ON)
    rig.group.home(rig.now)
    assert not rig.group.is_homed
    rig.run(0.1)
    assert all(d.objects[0x607D, 2] == 2**31 - 1 for d in rig.drives)
    rig.until(GroupState.ON)
    limits = [(d.objects[0x607D, 1], d.objects[0x607D, 2]) for d in rig.drives]
    assert limits == [(-580_000, 20_000), (-20_000, 580_000), (-580_000, 20_000)]


def test_another_method_by_setting():
    rig = GroupRig((0.7, 0.7, 0.7), **QUICK)
    for drive in rig.settings.drives:
        object.__setattr__(drive, "homing_method", 37)
    rig.homed()
    assert rig.group.heights == pytest.approx((TOP, TOP, TOP))
    assert rig.true_heights == pytest.approx((0.7, 0.7, 0.7))


@pytest.mark.parametrize(
    ("switch", "end", "timeout", "text"),
    [
        (Switch.STICKS, 0.0, 60.0, "went down 5"),
        (Switch.NEVER, 0.0, 1.5, "has not found its switch within 1.5 s"),
        (Switch.NEVER, -600_000.0, 60.0, "has gone 0.65"),
        # It runs against its end.
        (Switch.NEVER, 0.0, 60.0, "EMCY 0x8611"),
    ],
)
def test_a_switch_that_sticks_or_never_comes_stops_all(switch, end, timeout, text):
    rig = GroupRig((0.8, 0.5, 0.8), **{**QUICK, "homing_timeout": timeout}).off()
    slider = rig.drives[1].axis.slider
    slider.switch, slider.lower = switch, end
    rig.group.home(rig.now)
    all_stop_within(rig, 65.0)
    assert "axis 2 (node 2)" in rig.group.message and text in rig.group.message


def test_a_drive_that_fails_or_starts_anew_meanwhile_stops_all():
    for happen, text in (
        (lambda drive: drive.reboot(), "axis 3 (node 3) has not answered SYNC 5 times"),
        (lambda drive: drive.axis.fail(0x7305), "EMCY 0x7305"),
        (lambda drive: setattr(drive.axis, "_homing_failed", True), "error of homing"),
    ):
        rig = homing((0.5, 0.5, 0.5)).run(0.5)
        happen(rig.drives[2])
        all_stop_within(rig, 0.05)
        assert text in rig.group.message


def test_a_homing_that_is_cancelled_brakes_and_holds():
    rig = homing((0.5, 0.5, 0.5)).run(0.5)
    rig.group.cancel_home(rig.now)
    rig.until(GroupState.HOLDING)
    assert {drive.axis.state for drive in rig.drives} == {DriveState.QUICK_STOP_ACTIVE}
    assert all(drive.axis.velocity == 0.0 for drive in rig.drives)
    assert "cancelled" in rig.group.message and not rig.group.is_homed
    with pytest.raises(DriveError):
        rig.group.cancel_home(rig.now)
    rig.group.home(rig.now)
    rig.until(GroupState.ON)
    assert rig.group.is_homed


def test_disabling_stops_a_homing():
    rig = homing((0.5, 0.5, 0.5)).run(0.5)
    rig.group.disable(rig.now)
    rig.off()
    assert all(drive.axis.velocity == 0.0 for drive in rig.drives)


def test_a_drive_that_falls_silent_at_the_end_of_a_homing_stops_all():
    """While the new counts are averaged there is a target for a quick stop, too."""
    rig = homing((0.87, 0.87, 0.87))
    rig.until_true(lambda: not rig.group.waiting_axes and rig.drives[0].axis._is_homed)
    rig.drives[0].faults.lost_statuses = 1_000_000
    all_stop_within(rig, 0.05)


def test_answers_that_come_two_at_once_do_not_hide_that_a_drive_counts_anew():
    rig = GroupRig((0.8204,) * 3, **QUICK).off()
    received, kept = rig.bus.received, []

    def late():
        kept.append(received())
        return kept.pop(0) + kept.pop(0) if len(kept) == 2 else []

    rig.bus.received = late
    rig.group.home(rig.now)
    rig.until(GroupState.ON)
    assert rig.group.is_homed
