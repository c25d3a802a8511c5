"""Recordings with something wrong are accused of it, and those of the engine of nothing."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from motion_machine import MACHINE, WORKSPACE
from recorded_motions import DRIVES, LIMITS, jogs, moves, paths, record, stamps_of, upright
from soak import some

from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    AddedBound,
    AddedBoundError,
    ForceLimits,
    MotionKind,
    PlatformSpeedLimit,
    SliderLimits,
)
from tri_glide_kinematics.motion.limits import UsedParts, largest_value
from tri_glide_kinematics.recordings import Kind, Recording, WrongPeriodError, judge
from tri_glide_kinematics.workspace import Cylinder, Workspace, WorkspaceLimits

RATES = (500.0, 1000.0)
TALL = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)


def kinds_of(judgement) -> set[Kind]:
    return {each.kind for each in judgement.violations}


def judged(recording, rate=1000.0, workspace=WORKSPACE, limits=LIMITS, **options):
    return judge(recording, workspace, limits, 1.0 / rate, **options)


def moving_row(recording, share: float) -> int:
    """Return a row in motion, at a share of them."""
    moving = np.flatnonzero((np.abs(recording.velocities) > 0.02).all(axis=1))
    moving = moving[(moving > 3) & (moving < len(recording.stamps) - 60)]
    return int(moving[int(share * (len(moving) - 1))])


def without(recording, rows) -> Recording:
    kept = np.setdiff1d(np.arange(len(recording.stamps)), rows)
    return replace(
        recording,
        stamps=recording.stamps[kept],
        heights=recording.heights[kept],
        velocities=recording.velocities[kept],
    )


def changed(recording, name, row, value) -> Recording:
    numbers = getattr(recording, name).copy()
    numbers[row] = value
    return replace(recording, **{name: numbers})


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("factor", [1.00001, 1.001, 1.5])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_limit_that_is_passed_by_little_is_found(order, factor, rate):
    recording = record(upright, 0, 1.0 / rate)
    lower = LIMITS.times(*(1.0 / factor if order == index else 1.0 for index in range(3)))
    found = judged(recording, rate, limits=lower)
    kind = (Kind.VELOCITY, Kind.ACCELERATION, Kind.JERK)[order]
    # With the jerk limit, the bound between heights and velocities is lower, too.
    assert kinds_of(found) - {Kind.PUBLISHED_VELOCITY} == {kind}
    (each,) = (one for one in found.violations if one.kind is kind)
    assert each.value == pytest.approx(factor, rel=1e-5)
    assert each.bound == 1.0
    assert each.first <= each.time
    assert f"{lower.table[order, 1]:.4g}"[:4] in each.text
    assert "slider 2" in each.text


@pytest.mark.parametrize("count", [1, 2, 40])
@pytest.mark.parametrize("rate", RATES)
def test_setpoints_that_are_missing_are_a_gap_and_nothing_else(rate, count):
    recording = record(moves, 1, 1.0 / rate)
    row = moving_row(recording, 0.4)
    cut = without(recording, np.arange(row, row + count))
    found = judged(cut, rate)
    # A pause in motion is a gap in any case.
    assert kinds_of(found) == kinds_of(judged(cut, rate, may_pause=True)) == {Kind.GAP}
    (gap,) = found.violations
    assert gap.time == pytest.approx(recording.stamps[row + count], abs=1e-9)
    assert gap.value == pytest.approx((count + 1) / rate, abs=8e-4)
    assert gap.rows == 1


@pytest.mark.parametrize("periods", [2, 3, 20])
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_setpoints_that_stop_for_a_while_are_a_gap(periods, share):
    """The heights go on where they were: so nothing but the gap is wrong, in motion or at rest."""
    recording = record(upright, 0, 1e-3)
    row = moving_row(recording, share) if share else 2600
    late = recording.stamps + periods * 1e-3 * (np.arange(len(recording.stamps)) >= row)
    found = judged(replace(recording, stamps=late))
    assert kinds_of(found) == {Kind.GAP}
    assert "without a setpoint, at most 2.500 ms" in found.violations[0].text
    assert judged(replace(recording, stamps=late), longest_gap=0.03).violations == ()


@pytest.mark.parametrize("back", [0.0, 1e-6, 1e-3, 5.0])
def test_a_stamp_that_is_not_after_the_one_before_is_found(back):
    recording = record(jogs, 3, 1e-3)
    row = len(recording.stamps) // 3
    found = judged(changed(recording, "stamps", row, recording.stamps[row - 1] - back))
    assert kinds_of(found) == {Kind.ORDER}
    assert found.violations[0].rows == 1


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["stamps", "heights", "velocities"])
def test_what_is_no_number_is_found_and_what_follows_is_judged(name, number):
    recording = record(moves, 4, 2e-3)
    row = moving_row(recording, 0.3)
    place = row if name == "stamps" else (row, 1)
    broken = changed(recording, name, place, number)
    found = judged(broken, 500.0)
    assert kinds_of(found) == {Kind.NOT_FINITE}
    assert found.violations[0].rows == 1
    assert found.violations[0].time == pytest.approx(recording.stamps[row], abs=3e-3)
    jump = changed(broken, "heights", slice(row + 30, None), broken.heights[row + 30 :] + 1e-3)
    assert {Kind.NOT_FINITE, Kind.VELOCITY} <= kinds_of(judged(jump, 500.0))


def test_a_jump_of_a_micrometre_is_found():
    recording = record(paths, 5, 1e-3, kind=MotionKind.LINEAR)
    row = moving_row(recording, 0.5)
    higher = recording.heights[row] + 1e-6
    found = judged(changed(recording, "heights", row, higher))
    assert Kind.JERK in kinds_of(found)
    assert found.violations[-1].rows <= 4


def test_setpoints_that_were_exchanged_are_found():
    recording = record(moves, 6, 1e-3)
    row = moving_row(recording, 0.5)
    order = np.arange(len(recording.stamps))
    order[[row, row + 1]] = order[[row + 1, row]]
    heights, velocities = recording.heights[order], recording.velocities[order]
    found = judged(replace(recording, heights=heights, velocities=velocities))
    assert {Kind.PUBLISHED_VELOCITY, Kind.JERK} <= kinds_of(found)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda rates: -rates,
        lambda rates: 1.001 * rates,
        lambda rates: np.roll(rates, 1, axis=0),
        lambda rates: np.zeros_like(rates),
        lambda rates: rates[:, ::-1],
    ],
)
def test_published_velocities_that_are_not_those_of_the_heights_are_found(wrong):
    recording = record(moves, 7, 1e-3)
    velocities = wrong(recording.velocities)
    found = judged(replace(recording, velocities=velocities))
    assert kinds_of(found) == {Kind.PUBLISHED_VELOCITY}


@pytest.mark.parametrize("passed", [1e-7, 1e-3])
@pytest.mark.parametrize("end", ["lower", "upper"])
def test_travel_is_found_when_it_is_passed_by_a_tenth_of_a_micrometre(end, passed):
    recording = record(moves, 8, 1e-3)
    lowest, highest = recording.heights.min(axis=0), recording.heights.max(axis=0)
    lower = tuple(lowest + passed) if end == "lower" else TALL.lower_heights
    upper = tuple(highest - passed) if end == "upper" else TALL.upper_heights
    limits = replace(TALL, lower_heights=lower, upper_heights=upper)
    found = judged(recording, workspace=Workspace(MACHINE, limits))
    assert kinds_of(found) == {Kind.TRAVEL}
    assert found.violations[0].value == pytest.approx(passed, rel=1e-3)
    assert f"{end} end of slider travel" in found.violations[0].text


def reach_margin_of(positions) -> float:
    across = np.array(MACHINE.geometry.anchors) - positions[:, np.newaxis, :2]
    return float(min(MACHINE.geometry.arm_lengths) - np.linalg.norm(across, axis=-1).max())


# Limits that positions pass by 0.1 mm, or a percent, and what they are accused of.
PASSED = {
    "box": (lambda all: {"box_upper": tuple(all.max(axis=0) - 1e-4)}, Kind.PLACE),
    "cylinder": (
        lambda all: {
            "cylinder": Cylinder(0.0, 0.0, np.hypot(*all[:, :2].T).max() - 1e-4, 0.0, 1.0)
        },
        Kind.PLACE,
    ),
    "reach": (lambda all: {"reach_margin": reach_margin_of(all) + 1e-4}, Kind.REACH),
    "condition": (
        lambda all: {"max_condition_number": 0.99 * MACHINE.condition_number_batch(all).max()},
        Kind.CONDITION,
    ),
}


@pytest.mark.parametrize("shape", PASSED)
def test_a_place_outside_the_workspace_is_found(shape):
    recording = record(moves, 9, 1e-3)
    passed_by, kind = PASSED[shape]
    limits = replace(TALL, **passed_by(MACHINE.forward_batch(recording.heights)))
    found = judged(recording, workspace=Workspace(MACHINE, limits))
    assert kinds_of(found) == {kind}
    assert "outside the workspace at" in found.violations[0].text


def two_stretches(rest_seconds: float):
    """A machine that was disabled, moved by hand, and enabled again."""
    first, second = record(upright, 0, 1e-3), record(moves, 1, 1e-3)
    waits = 20
    begin = first.stamps[-1] + rest_seconds
    stamps = (first.stamps, begin + 1e-3 * np.arange(waits), begin + 1e-3 * waits + second.stamps)
    heights = np.vstack((np.tile(second.heights[0], (waits, 1)), second.heights))
    moved = np.array((0.01, -0.02, 0.01))
    return Recording(
        np.concatenate(stamps),
        np.vstack((first.heights, heights + moved)),
        np.vstack((first.velocities, np.zeros((waits, 3)), second.velocities)),
    )


@pytest.mark.parametrize("has_velocities", [False, True])
def test_a_pause_at_rest_is_a_gap_unless_there_may_be_some(has_velocities):
    recording = two_stretches(2.0)
    if not has_velocities:
        recording = replace(recording, velocities=None)
    assert kinds_of(judged(recording)) == {Kind.GAP}
    found = judged(recording, may_pause=True)
    assert found.violations == ()
    assert found.beginnings == 2
    assert found.longest_gap < 2.5e-3


def test_a_velocity_that_is_rounding_is_no_motion():
    """The end of a motion is published as 1e-17 or 1e-16 m/s where its last bits do not cancel."""
    recording = two_stretches(2.0)
    velocities = recording.velocities + 1e-16 * (recording.velocities == 0.0)
    rounded = judged(replace(recording, velocities=velocities), may_pause=True)
    assert rounded.violations == ()
    assert rounded.last_speed == 0.0
    slow = np.where(recording.velocities == 0.0, 1e-9, recording.velocities)
    assert judged(replace(recording, velocities=slow), may_pause=True).last_speed == 1e-9


def test_heights_of_drives_are_judged_as_true_ones():
    recording = record(moves, 2, 1e-3)
    offsets = (0.05, -0.02, 0.01)
    told = replace(recording, heights=recording.heights - offsets)
    assert judged(told, height_offsets=offsets).violations == ()


def test_few_digits_are_no_violation_and_hide_no_large_one():
    """Micrometres in a table make a jerk of 4000 m/s^3 at 1 kHz of nothing."""
    recording = record(upright, 0, 1e-3)
    rounded = replace(recording, heights=np.round(recording.heights, 6), velocities=None)
    assert Kind.JERK in kinds_of(judged(rounded))
    known = replace(rounded, resolution=5e-7)
    assert judged(known).violations == ()
    lower = LIMITS.times(1.0 / 1.01, 1.0, 1.0)
    assert kinds_of(judged(known, limits=lower)) == {Kind.VELOCITY}


# Both hold the machine back more than its sliders do.
QUICK = SliderLimits.uniform(1.5, 30.0, 2000.0)
MASSES = Masses.uniform(1.0, 0.2, 1.0, coulomb=2.0, viscous=5.0)
SPEED = PlatformSpeedLimit(MACHINE, 0.3)
FORCE = ForceLimits(SliderForces(MACHINE, MASSES), (45.0,) * 3, (20.0,) * 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "is_shaped", "added"),
    [
        (1, False, (SPEED, FORCE)),
        *some(
            [
                (0, True, ()),
                (0, True, (FORCE,)),
                (1, False, ()),
                *product(range(2, 20), (False, True), [()]),
            ],
            1,
        ),
    ],
)
@pytest.mark.parametrize("drive", DRIVES, ids=lambda drive: drive.__name__)
def test_what_the_engine_puts_out_is_accused_of_nothing(drive, seed, is_shaped, added):
    rate = RATES[seed % 2]
    kind = MotionKind.LINEAR if seed % 3 else MotionKind.SLIDER
    limits = QUICK.with_added(*added) if added else LIMITS
    recording = record(drive, seed, 1.0 / rate, kind=kind, is_shaped=is_shaped, limits=limits)
    found = judged(recording, rate, limits=limits)
    assert found.violations == ()
    assert found.beginnings == 1
    assert found.rows == len(recording.stamps)
    assert np.ptp(recording.heights) > 1e-3
    assert found.last_speed == np.abs(recording.velocities[-1]).max()
    assert set(found.added) == {
        Kind.FORCE if each is FORCE else Kind.PLATFORM_SPEED for each in added
    }
    # A jog is slow, and a shaper is not asked for here.
    if added and drive is not jogs:
        assert max(found.added.values()) > 0.9
    # Without velocities, too.
    assert judged(replace(recording, velocities=None), rate, limits=limits).violations == ()


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("drive", [moves, paths, upright], ids=lambda drive: drive.__name__)
def test_a_platform_that_is_too_fast_is_found(drive, rate):
    recording = record(drive, 1, 1.0 / rate, limits=QUICK)
    velocities = [
        MACHINE.forward_velocity(*row)[1] for row in zip(recording.heights, recording.velocities)
    ]
    fastest = float(np.linalg.norm(velocities, axis=1).max())
    # Where the speed is steady, a mean over a period is as exact as the heights.
    little = 1e-5 if drive is upright else 2e-3
    for factor in (1.0 + little, 1.5):
        limits = QUICK.with_added(PlatformSpeedLimit(MACHINE, fastest / factor))
        found = judged(recording, rate, limits=limits)
        assert kinds_of(found) == {Kind.PLATFORM_SPEED}
        (each,) = found.violations
        assert each.value == pytest.approx(factor, rel=0.5 * little)
        assert f"{each.value:.6f} of its limit, {fastest / factor:.9g} m/s" in each.text
    kept = PlatformSpeedLimit(MACHINE, fastest * (1.0 + 0.5 * little))
    assert judged(recording, rate, limits=QUICK.with_added(kept)).violations == ()


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("drive", [moves, paths, upright], ids=lambda drive: drive.__name__)
def test_a_slider_that_needs_too_much_force_is_found(drive, rate):
    recording = record(drive, 1, 1.0 / rate, limits=QUICK)
    unbounded = ForceLimits(FORCE.forces, (1e6,) * 3, (1e6,) * 3)
    used = judged(recording, rate, limits=QUICK.with_added(unbounded)).added[Kind.FORCE]
    needed = 1e6 * used
    assert 30.0 < needed < 200.0
    for factor in (1.01, 1.5):
        limit = ForceLimits(FORCE.forces, (needed / factor,) * 3, (1e6,) * 3)
        found = judged(recording, rate, limits=QUICK.with_added(limit))
        assert kinds_of(found) == {Kind.FORCE}
        (each,) = found.violations
        assert each.value == pytest.approx(factor)
        assert f"needs {needed:.6g} N" in each.text
        assert "upwards" in each.text
    # Of a heavier payload, the same motion needs more.
    heavy = SliderForces(MACHINE, MASSES.with_payload(0.5))
    limit = ForceLimits(heavy, (needed,) * 3, (1e6,) * 3)
    assert kinds_of(judged(recording, rate, limits=QUICK.with_added(limit))) == {Kind.FORCE}


def test_forces_by_differences_are_those_of_the_setpoints():
    """But for the change of the acceleration over a period, which is a mean there."""
    recording = record(moves, 1, 1e-3, limits=QUICK)
    rates = recording.velocities
    accelerations = np.gradient(rates, 1e-3, axis=0)
    forces = FORCE.forces.forces_batch(recording.heights, rates, accelerations)
    needed = judged(recording, limits=QUICK.with_added(FORCE)).added[Kind.FORCE]
    exact = max((forces / 45.0).max(), (-forces / 20.0).max())
    assert needed == pytest.approx(exact, rel=0.02)


class LiftLimit(AddedBound):
    """A largest acceleration of the platform along z: a bound that only this test knows."""

    name = "the lift limit"
    order = 2
    machine = MACHINE
    largest = 4.0  # m/s^2

    def used(self, position, half):
        """Return which part of it is used."""
        orders = np.array((2.0, 6.0, 12.0, 20.0))[:, np.newaxis]
        values, rest = orders * position.values[2:, 2], orders[3] * position.bounds[5, 2]
        most = [
            largest_value(np.vstack((sign * values[:3], rest)), np.zeros_like(rest), half)
            for sign in (1.0, -1.0)
        ]
        return UsedParts(np.max(most, axis=0) / self.largest, np.abs(values[0]) / self.largest)

    def error(self, part, time):
        """Return the error of a motion that uses more of it."""
        return AddedBoundError("lift", part * self.largest, self.largest, "m/s^2", time)


@pytest.mark.parametrize("drive", [moves, upright], ids=lambda drive: drive.__name__)
def test_a_bound_of_ones_own_is_planned_and_judged(drive):
    limits = QUICK.with_added(LiftLimit())
    found = judged(record(drive, 1, 1e-3, limits=limits), limits=limits)
    assert found.violations == ()
    assert 0.9 < found.added[Kind.ADDED_BOUND] < 1.001
    (wrong,) = judged(record(drive, 1, 1e-3, limits=QUICK), limits=limits).violations
    assert wrong.kind is Kind.ADDED_BOUND
    assert wrong.value > 1.5
    assert f"the motion uses {wrong.value:.6f} of the lift limit" == wrong.text


def test_few_digits_are_no_force():
    limits = QUICK.with_added(SPEED, FORCE)
    recording = record(upright, 0, 1e-3, limits=limits)
    rounded = replace(recording, heights=np.round(recording.heights, 6), velocities=None)
    assert Kind.FORCE in kinds_of(judged(rounded, limits=limits))
    assert judged(replace(rounded, resolution=5e-7), limits=limits).violations == ()


def test_places_without_a_pose_have_no_speed_and_no_force():
    recording = record(moves, 9, 1e-3)
    heights = recording.heights.copy()
    heights[500] = (0.3, 1.5, 0.3)
    found = judged(replace(recording, heights=heights), limits=LIMITS.with_added(SPEED, FORCE))
    assert Kind.REACH in kinds_of(found)
    assert all(np.isfinite(part) for part in found.added.values())


def test_another_rate_is_told():
    recording = record(moves, 2, 1e-3)
    with pytest.raises(WrongPeriodError, match=r"1\.00\d ms apart, and the rate is 500 Hz") as told:
        judged(recording, 500.0)
    assert told.value.period == 2e-3


def test_large_recordings_are_judged_in_blocks(monkeypatch):
    recording = record(moves, 1, 1e-3)
    row = moving_row(recording, 0.4)
    heights = recording.heights.copy()
    heights[row:] += 1e-5
    broken = replace(recording, heights=heights)
    whole = judged(broken)
    weak = ForceLimits(FORCE.forces, (22.0,) * 3, (22.0,) * 3)
    limits = LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.1), weak)
    bounded = judged(broken, limits=limits)
    assert {Kind.PLATFORM_SPEED, Kind.FORCE} <= kinds_of(bounded)
    monkeypatch.setattr("tri_glide_kinematics.recordings.judgement.BLOCK", row - 1)
    assert judged(broken) == whole
    assert judged(broken, limits=limits) == bounded


def test_bad_input_is_refused():
    recording = record(moves, 1, 2e-3)
    with pytest.raises(KinematicsError, match="1 setpoints, at least 2"):
        judged(without(recording, np.arange(1, len(recording.stamps))), 500.0)
    with pytest.raises(KinematicsError, match="longest_gap"):
        judged(recording, 500.0, longest_gap=-1.0)
    assert (np.diff(stamps_of(1000, 1e-3, np.random.default_rng(0))) > 0.0).all()
