"""Shaped trajectories: straight, inside all limits, and without a swing behind them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from motion_machine import LIMITS, MACHINE, WORKSPACE, each_kind
from timed_paths import random_path

from testing.swing_behind import left_after
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import (
    CommandStream,
    MotionKind,
    PlatformPath,
    SliderLimitError,
    SliderTravelError,
    plan_move,
    time_path,
)
from tri_glide_kinematics.motion.limits import AT_REST, Series, SliderState
from tri_glide_kinematics.motion.shaped.bends import DrivenPart
from tri_glide_kinematics.motion.shaped.shaped import ShapedTrajectory, largest_of
from tri_glide_kinematics.motion.shaped.slowed import SlowedPlan
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.motion.trajectory import CubicPlan, SequencePlan, Trajectory, checked
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace

SHAPER = Shaper.of(ShaperKind.EI, Mode(15.0, 0.03))


def random_ends(count: int, seed: int = 6) -> list[tuple]:
    """Return pairs of positions inside the workspace."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform((-0.1, -0.1, 0.2), (0.1, 0.1, 0.38), (count, 2, 3))
    return [(tuple(a), tuple(b)) for a, b in ends.tolist()]


def shaped(plan: Trajectory, shaper: Shaper = SHAPER) -> ShapedTrajectory:
    return ShapedTrajectory(MACHINE, shaper, (DrivenPart(0.0, plan, 0.0),))


def shaped_moves(count: int, kind: MotionKind, shaper: Shaper = SHAPER) -> Iterator[Trajectory]:
    """Yield so many planned moves with a shaper."""
    for start, end in random_ends(count):
        yield plan_move(WORKSPACE, LIMITS, start, end, kind=kind, shaper=shaper)


def assert_setpoints_are_samples(motion: Trajectory, times: FloatArray) -> None:
    for time, *expected in zip(times.tolist(), *motion.sample(times)[1:]):
        for found, values in zip(motion.at(time), expected):
            np.testing.assert_allclose(found, values, rtol=0.0, atol=1e-11)


START, END = random_ends(1)[0]
PLAN = plan_move(WORKSPACE, LIMITS, START, END)


@each_kind
def test_it_keeps_the_limits_by_bounds_and_as_a_drive_sees_them(kind):
    for motion in shaped_moves(8, kind):
        use = at_once(motion.limit_use(LIMITS)).use
        assert use.max() <= 1.0 + 1e-8
        stream = CommandStream.from_heights(
            motion.sample(np.arange(0.0, motion.duration + 0.01, 0.001)).heights, 0.001
        )
        for seen, bound, most in zip(
            (stream.velocities, stream.accelerations, stream.jerks), LIMITS.table, use
        ):
            assert (np.abs(seen).max(axis=0) <= most * bound * (1.0 + 1e-6) + 1e-7).all()


@each_kind
def test_bounds_are_near_what_is_reached(kind):
    for motion in shaped_moves(4, kind):
        sampled = motion.sample(np.linspace(0.0, motion.duration, 5000))
        use = at_once(motion.limit_use(LIMITS)).use
        reached = (
            np.abs(sampled.velocities).max(axis=0),
            np.abs(sampled.accelerations).max(axis=0),
        )
        np.testing.assert_allclose(use[0], reached[0] / LIMITS.velocity, atol=0.002)
        np.testing.assert_allclose(use[1], reached[1] / LIMITS.acceleration, atol=0.05)


@each_kind
def test_setpoints_are_those_of_the_samples_and_of_their_differences(kind):
    (motion,) = shaped_moves(1, kind)
    times = np.linspace(0.001, motion.duration + 0.01, 200)
    assert_setpoints_are_samples(motion, times)
    dt = 1e-6
    sampled, later = motion.sample(times), motion.sample(times + dt)
    np.testing.assert_allclose(
        (later.heights - sampled.heights) / dt,
        0.5 * (later.velocities + sampled.velocities),
        atol=1e-8,
    )
    np.testing.assert_allclose(
        (later.velocities - sampled.velocities) / dt,
        0.5 * (later.accelerations + sampled.accelerations),
        atol=1e-3,
    )


def plans() -> list[Trajectory]:
    """Return a plan of each sort that is shaped: moves, a path, a part of a path and the next."""
    moves = [plan_move(WORKSPACE, LIMITS, START, END, kind=kind) for kind in MotionKind]
    whole = time_path(random_path(5, most=4), WORKSPACE, LIMITS)
    return [*moves, whole, SequencePlan([whole], 0.3 * whole.duration)]


each_plan = pytest.mark.parametrize("plan", plans(), ids=lambda plan: type(plan).__name__)


@each_plan
def test_plans_know_how_the_platform_moves(plan):
    knots = plan.knots()
    times = np.concatenate(([-0.1], 0.5 * (knots[1:] + knots[:-1]), [plan.duration + 0.1]))
    expected = plan.platform_series(MACHINE, times, np.zeros(len(times))).values
    for number, time in enumerate(times.tolist()):
        position, velocity, acceleration = expected[:3, :, number]
        values = (*position, *velocity, *2.0 * acceleration)
        np.testing.assert_allclose(plan.platform_at(MACHINE, time), values, rtol=0.0, atol=1e-11)


@each_plan
def test_setpoints_are_those_of_the_samples_where_plans_are_replaced(plan):
    past = 0.4 * plan.duration
    parts = [DrivenPart(-past, plan, 0.0), DrivenPart(0.03, plan, past + 0.03)]
    motion = ShapedTrajectory(MACHINE, SHAPER, parts)
    times = np.append(np.linspace(0.0, motion.duration + 0.05, 300), motion.duration)
    assert_setpoints_are_samples(motion, times)


@each_kind
@pytest.mark.parametrize("frequency", [8.0, 15.0, 40.0])
def test_it_leaves_no_swing(kind, frequency):
    mode = Mode(frequency, 0.03)
    shaper = Shaper.of(ShaperKind.EI, mode)
    left, unshaped = [], []
    for start, end in random_ends(5):
        motion = plan_move(WORKSPACE, LIMITS, start, end, kind=kind, shaper=shaper)
        left.append(left_after(MACHINE, motion, mode))
        plain = plan_move(WORKSPACE, LIMITS, start, end, kind=kind)
        unshaped.append(left_after(MACHINE, plain, mode))
    assert np.sqrt(np.mean(np.square(left))) < 0.06 * np.sqrt(np.mean(np.square(unshaped)))


def test_it_comes_to_rest_one_shaper_later():
    motion = shaped(PLAN)
    assert motion.duration == pytest.approx(PLAN.duration + SHAPER.duration)
    final = motion.at(motion.duration)
    assert MACHINE.forward(final.heights) == pytest.approx(END, abs=1e-9)
    assert max(map(abs, (*final.velocities, *final.accelerations))) < 1e-9
    assert MACHINE.forward(motion.at(-1.0).heights) == pytest.approx(START, abs=1e-12)


def test_paths_are_shaped_too():
    plan = time_path(random_path(5, most=4), WORKSPACE, LIMITS)
    motion = shaped(plan)
    use = at_once(motion.limit_use(LIMITS)).use
    times = np.linspace(0.0, motion.duration, 20000)
    sampled = motion.sample(times)
    jerks = np.diff(sampled.accelerations, axis=0) / np.diff(times)[:, np.newaxis]
    reached = [np.abs(x).max(axis=0) for x in (sampled.velocities, sampled.accelerations, jerks)]
    parts = np.array(reached) / LIMITS.table
    assert (parts <= use + 1e-6).all()
    assert parts.max() > 0.9 * use.max()


def test_a_path_that_needs_more_than_five_attempts_is_planned():
    shaper = Shaper.of(ShaperKind.MZV, Mode(10.0501, 0.03))
    x, y, z = 0.028738, 0.064713, 0.156787
    points = ((x, y, z + 0.1), (x, y, z), (x, y - 0.1, z))
    motion = time_path(PlatformPath.through(points, 5e-4), WORKSPACE, LIMITS, shaper)
    motion.check_limits(LIMITS)


def test_what_was_driven_before_belongs_to_it():
    """A plan that is replaced by its own rest changes nothing."""
    whole = shaped(PLAN)
    past = 0.4 * PLAN.duration
    parts = (DrivenPart(-past, PLAN, 0.0), DrivenPart(0.0, PLAN, past))
    left = ShapedTrajectory(MACHINE, SHAPER, parts)
    assert left.duration == pytest.approx(whole.duration - past)
    times = np.linspace(0.0, left.duration, 300)
    for found, expected in zip(left.sample(times)[1:], whole.sample(times + past)[1:]):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)
    assert (
        at_once(left.limit_use(LIMITS)).use.max()
        <= at_once(whole.limit_use(LIMITS)).use.max() + 1e-3
    )


def test_a_limit_that_is_exceeded_is_named():
    motion = shaped(PLAN)
    less = type(LIMITS)(LIMITS.velocity, tuple(0.5 * a for a in LIMITS.acceleration), LIMITS.jerk)
    with pytest.raises(SliderLimitError, match="acceleration"):
        motion.check_limits(less)
    assert not motion.keeps_limits(less)


def test_limits_are_checked_in_pieces():
    motion = shaped(PLAN)
    slowed = SlowedPlan(MACHINE, motion, 0.2 * motion.duration, 0.5)
    more = LIMITS.times(2.0, 4.0, 8.0)
    for each in (motion, slowed, SequencePlan([motion]), SequencePlan([slowed, slowed])):
        assert sum(1 for _ in checked(each, more)) > 2


def test_a_piece_works_on_the_cells_of_one_plan(monkeypatch):
    back = plan_move(WORKSPACE, LIMITS, END, START)
    parts = (DrivenPart(0.0, PLAN, 0.0), DrivenPart(0.5 * PLAN.duration, back, 0.0))
    motion, cells = ShapedTrajectory(MACHINE, SHAPER, parts), []
    series = CubicPlan.mixed_series

    def noted(plan, machine, times, half):
        cells[-1].append(len(times))
        return series(plan, machine, times, half)

    monkeypatch.setattr(CubicPlan, "mixed_series", noted)
    looking, cells = motion.limit_use(LIMITS.times(9.0, 9.0, 9.0)), [[]]
    for _ in looking:
        cells.append([])
    assert max(map(len, cells)) > 0
    assert all(sum(piece[:-1]) < 60 for piece in cells), cells


def test_travel_that_is_left_is_found_without_a_second_look(monkeypatch):
    motion = shaped(PLAN)
    begin, rest = (np.array(motion.at(time).heights) for time in (0.0, motion.duration))
    ends = np.maximum(begin, rest)
    slider = int((rest - begin).argmax())
    ends[slider] = 0.5 * (begin + rest)[slider]
    region = Workspace(MACHINE, replace(WORKSPACE.limits, upper_heights=tuple(ends.tolist())))
    at_once(motion.limit_use(LIMITS, region=region))
    monkeypatch.delattr(ShapedTrajectory, "limit_use")
    with pytest.raises(SliderTravelError):
        motion.check_inside(region, LIMITS)


@each_kind
def test_a_slow_motion_is_proved_with_little_more_work_than_a_fast_one(kind, monkeypatch):
    path_check, parts, samples, work = Workspace.path_check, [], [], []

    def noted(region, state, duration, acceleration):
        parts.append((duration, acceleration))
        return path_check(
            region, lambda time: samples.append(time) or state(time), duration, acceleration
        )

    for scale in (1.0, 1e-2, 1e-4):
        slow = LIMITS.with_velocity_scaled(scale)
        motion = plan_move(WORKSPACE, slow, START, END, kind=kind, shaper=SHAPER)
        pieces = sum(1 for _ in motion.limit_use(slow))
        with monkeypatch.context() as patch:
            patch.setattr(Workspace, "path_check", noted)
            parts.clear()
            samples.clear()
            motion.check_inside(WORKSPACE, slow)
        # Besides both ends of each part.
        work.append((pieces, len(parts), len(samples) - 2 * len(parts)))
        # Together they are all of it, or of a line its begin, and know the accelerations there.
        begin = 0.0
        for duration, acceleration in parts:
            sampled = motion.sample(begin + np.linspace(0.0, duration, 100))
            assert np.linalg.norm(sampled.accelerations, axis=1).max() <= acceleration + 1e-9
            begin += duration
        whole = motion.duration if kind is MotionKind.SLIDER else SHAPER.duration
        assert begin == pytest.approx(whole)
    assert (np.max(work[1:], axis=0) <= (4 * work[0][0], 20, 200)).all(), work


def test_a_motion_that_is_over_keeps_all_limits():
    motion = shaped(PLAN)
    assert at_once(motion.limit_use(LIMITS, since=motion.duration)).use.max() == 0.0


def test_knots_that_fall_together_but_for_rounding_are_one():
    jerks = [[(0.01, 50.0), (0.02, -50.0), (0.01, 50.0)]] * 3
    plan = CubicPlan(SliderState((0.6, 0.6, 0.6), AT_REST, AT_REST), jerks)
    times = (0.0, 0.01 * (1.0 + 1e-15), 0.02 * (1.0 - 1e-15))
    motion = shaped(plan, Shaper(times, (0.25, 0.5, 0.25)))
    expected = [0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06]
    assert len(motion.knots()) == len(expected)
    np.testing.assert_allclose(motion.knots(), expected, atol=1e-12)
    sampled = motion.sample(np.linspace(0.0, motion.duration, 5000))
    use = at_once(motion.limit_use(LIMITS)).use
    reached = np.abs(sampled.accelerations).max(axis=0) / LIMITS.acceleration
    assert (reached <= use[1] + 1e-12).all()
    assert (use[1] <= 1.02 * reached).all()


def test_velocities_in_cells_are_bounded_closely():
    rng = np.random.default_rng(4)
    count = 20_000
    values = rng.normal(size=(6, 1, count)) * 10.0 ** rng.uniform(-4.0, 2.0, (6, 1, count))
    half = 10.0 ** rng.uniform(-2.0, 0.5, count)
    values[5] = 0.0
    bound = largest_of(Series(values, np.zeros_like(values)), half)[0, 0]
    times = np.linspace(-1.0, 1.0, 401)[:, np.newaxis] * half
    _, c1, c2, c3, c4, _ = values[:, 0]
    seen = np.abs(c1 + times * (2.0 * c2 + times * (3.0 * c3 + times * 4.0 * c4))).max(axis=0)
    assert (seen <= bound * (1.0 + 1e-12)).all()
    assert np.median(seen / bound) > 0.99
    # A braking that begins in the cell, at full speed: nothing is added.
    braking = np.zeros((6, 1, 1))
    h = 1e-3
    braking[1:4, 0, 0] = 1.0 - 10.0 * h * h, -10.0 * h, -10.0 / 3.0
    bound = largest_of(Series(braking, np.zeros_like(braking)), np.array([h]))[0, 0, 0]
    assert bound == pytest.approx(1.0, abs=1e-12)
