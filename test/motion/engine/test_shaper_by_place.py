"""An engine whose machine has other modes in other places: each motion gets a shaper that fits."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    KINDS,
    LIMITS,
    MACHINE,
    WORKSPACE,
    RecordedEngine,
    assert_rests_at,
    distance_from_polyline,
    each_kind,
    each_mode,
    engine,
    limit_use,
    place,
    run,
    run_to_rest,
    speeds,
    stormed,
    within,
)
from soak import combined, corners, some

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    MotionKind,
    MotionPhase,
    PlatformPath,
    SliderLimits,
    Trajectory,
    plan_move,
    time_path,
)
from tri_glide_kinematics.motion.engine import HeldMotion
from tri_glide_kinematics.motion.engine.held_motion import PlanHolder
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperByPlace, ShaperKind, Shaping
from tri_glide_kinematics.simulation import PlatformMode, SimulatedSwing, SwingModel
from tri_glide_kinematics.vectors import Vector3

LEFT, NEAR, MIDDLE, RIGHT = ((x, 0.0, 0.27) for x in (-0.09, -0.07, 0.0, 0.09))


def by_place(*frequencies: float) -> ShaperByPlace:
    """Return what chooses shapers, for frequencies [Hz] at some places along x."""
    places = [(x, 0.0, 0.27) for x in np.linspace(-0.1, 0.1, len(frequencies)).tolist()]
    modes = [(Mode(frequency, 0.03),) for frequency in frequencies]
    return ShaperByPlace(ShaperKind.EI, tuple(places), tuple(modes))


BY_PLACE = by_place(9.0, 15.0, 21.0)


ALL = math.inf


def resting(
    kind: MotionKind = MotionKind.LINEAR, at: Vector3 = LEFT, **options: bool
) -> RecordedEngine:
    """Return an engine that rests, with shapers by place in force."""
    moving = engine(kind, heights=MACHINE.inverse(at), **options, shaper=BY_PLACE)
    assert not moving.shaper_pending
    return moving


def begun(kind: MotionKind = MotionKind.LINEAR, **options: bool) -> RecordedEngine:
    """Return an engine on its way to ``NEAR``, with a shaper that does for that only."""
    moving = resting(kind, **options)
    moving.move_to(NEAR)
    run(moving, 0.09, ALL)
    return moving


@each_kind
def test_from_rest_each_move_has_the_shaper_of_its_way(kind):
    moving, shapers = resting(kind), []
    for target in (NEAR, RIGHT, (0.07, 0.0, 0.27)):
        moving.move_to(target)
        shapers.append(moving.shaper)
        run_to_rest(moving)
        assert_rests_at(moving, target)
        # It stays as it is until the next motion is known.
        assert moving.shaper is shapers[-1]
    near, across, back = shapers
    assert (len(near.times), len(across.times), len(back.times)) == (3, 4, 3)
    assert near.duration == pytest.approx(1.0 / 9.6, rel=0.1)
    assert back.duration == pytest.approx(1.0 / 20.0, rel=0.1)


@each_kind
def test_a_move_of_its_own_has_the_same_shaper(kind):
    moving = resting(kind)
    moving.move_to(RIGHT)
    move = plan_move(WORKSPACE, LIMITS, LEFT, RIGHT, kind=kind, shaper=BY_PLACE)
    assert move.shaper == moving.shaper
    calm = plan_move(WORKSPACE, LIMITS, LEFT, NEAR, kind=kind, shaper=BY_PLACE)
    assert calm.shaper.duration < move.shaper.duration


@each_kind
@each_mode
def test_where_the_present_shaper_does_not_do_the_machine_rests_first(kind, in_pieces):
    moving = begun(kind, in_pieces=in_pieces)
    first = moving.shaper
    moving.move_to(RIGHT)
    moving.work(lambda: True)
    run(moving, 0.03, ALL)
    assert moving.shaper_pending
    while moving.shaper is first:
        assert moving.phase is MotionPhase.MOVING
        run(moving, DT, ALL)
    rest = len(moving.states)
    run_to_rest(moving)
    assert_rests_at(moving, RIGHT)
    assert len(moving.shaper.times) == 4
    assert not moving.shaper_pending
    # There it rested, as nothing is left in a shaper when another one takes its place.
    speed = speeds(moving.heights_since())
    assert speed[rest - 5 : rest].max() < 1e-3
    assert speed[:rest].max() > 0.05


@each_kind
def test_where_it_does_the_machine_goes_on_at_once(kind):
    moving = resting(kind)
    moving.move_to(RIGHT)
    run(moving, 0.15)
    first = moving.shaper
    moving.move_to((0.0, 0.05, 0.3))
    assert not moving.shaper_pending
    run_to_rest(moving)
    assert moving.shaper is first
    assert_rests_at(moving, (0.0, 0.05, 0.3))
    assert speeds(moving.heights_since())[50:-75].min() > 0.01


@each_kind
def test_a_command_just_before_the_shaper_is_empty_waits_for_that(kind):
    moving = resting(kind)
    moving.move_to(NEAR)
    while moving.time_to_rest > 0.03:
        moving.step(DT)
    moving.move_to(RIGHT)
    assert moving.shaper_pending
    assert moving.phase is MotionPhase.MOVING
    run_to_rest(moving)
    assert_rests_at(moving, RIGHT)


@each_kind
def test_a_stop_while_another_shaper_waits_is_a_stop(kind):
    moving = begun(kind)
    moving.move_to(RIGHT)
    run(moving, 0.01)
    moving.stop()
    # It may be anything, as nothing moves when it comes in force.
    moving.set_speed_scale(0.01)
    run_to_rest(moving)
    assert moving.kept_limits
    assert moving.speed_scale == 0.01
    assert place(moving)[0] < NEAR[0] + 0.02
    assert not moving.limits_pending
    assert moving.remaining == 0.0


@each_kind
def test_limits_may_be_lowered_while_another_shaper_waits(kind):
    moving = begun(kind)
    first = moving.shaper
    moving.move_to(RIGHT)
    lower = SliderLimits.uniform(0.3, 4.0, 80.0)
    moving.set_limits(lower)
    assert moving.limits_pending
    while moving.limits_pending:
        assert moving.shaper is first
        moving.step(DT)
    rest = run_to_rest(moving)
    assert within(rest, lower)
    assert limit_use(rest, lower).largest.max() > 0.5
    assert_rests_at(moving, RIGHT)
    assert len(moving.shaper.times) == 4


def test_the_newest_target_counts_while_another_shaper_waits():
    moving = begun()
    moving.move_to(RIGHT)
    run(moving, 0.01)
    moving.move_to(MIDDLE)
    run_to_rest(moving)
    assert_rests_at(moving, MIDDLE)


def test_a_refused_command_changes_nothing():
    moving = begun()
    with pytest.raises(KinematicsError):
        moving.move_to((0.0, 0.0, 3.0))
    assert not moving.shaper_pending
    run_to_rest(moving)
    assert_rests_at(moving, NEAR)


def test_a_jog_may_lead_anywhere_so_it_never_waits_for_a_shaper():
    moving = resting(at=MIDDLE)
    for velocity in ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (-0.1, 0.0, 0.05)):
        moving.jog(velocity)
        assert moving.shaper == BY_PLACE.covering(None)
        run(moving, 0.3)
        assert moving.phase is MotionPhase.JOGGING
    shaper = moving.shaper
    moving.stop()
    run_to_rest(moving)
    assert moving.shaper is shaper
    assert moving.kept_limits


def test_other_modes_are_in_force_from_the_next_rest_on():
    moving = begun()
    first = moving.shaper
    moving.set_shaper(by_place(20.0, 20.0))
    assert moving.shaper_pending
    run_to_rest(moving)
    assert moving.shaper is first
    moving.move_to(LEFT)
    assert not moving.shaper_pending
    assert moving.shaper == Shaper.of(ShaperKind.EI, Mode(20.0, 0.03))


def through(*places: Vector3) -> PlatformPath:
    return PlatformPath.through(places, tolerance=0.003)


# A path that stays on the left, one that goes to the right, and one behind the first.
ON_LEFT = (LEFT, NEAR, (-0.07, 0.03, 0.27))
ACROSS = (NEAR, (0.0, 0.05, 0.27), RIGHT)
BEHIND = (ON_LEFT[-1], (0.0, 0.05, 0.27), RIGHT)


@each_mode
def test_a_path_has_one_shaper_for_all_of_it(in_pieces):
    durations = []
    for places in (ON_LEFT, ACROSS):
        path = through(*places)
        moving = resting(at=places[0], in_pieces=in_pieces)
        moving.follow(path)
        moving.work(lambda: True)
        run(moving, 2 * DT, ALL)
        shaper = moving.shaper
        assert shaper is not None
        durations.append(shaper.duration)
        while moving.phase is not MotionPhase.IDLE:
            run(moving, DT, ALL)
            assert moving.shaper == shaper
        assert_rests_at(moving, places[-1])
        motion = time_path(path, WORKSPACE, LIMITS, BY_PLACE)
        expected = Shaper.of(ShaperKind.EI, Mode(10.2, 0.03)) if places is ON_LEFT else shaper
        assert motion.shaper.duration == pytest.approx(expected.duration, rel=0.02)
    assert len(shaper.times) == 4
    assert durations[0] == pytest.approx(1.0 / 10.2, rel=0.02)


@each_mode
def test_a_path_in_mid_motion_begins_with_its_own_shaper(in_pieces):
    moving = begun(in_pieces=in_pieces)
    moving.follow(through(*ACROSS))
    run_to_rest(moving)
    assert_rests_at(moving, RIGHT)
    assert moving.shaper == BY_PLACE.covering(held_of(moving).path.heights.driven.places())


@corners("in_pieces, seconds", (False, True), (0.06, 0.2, 0.46))
def test_a_path_that_gets_longer_waits_for_a_shaper_and_goes_on_where_it_was(in_pieces, seconds):
    moving = resting(in_pieces=in_pieces)
    moving.follow(through(*ON_LEFT))
    run(moving, seconds, ALL)
    moving.extend(through(*BEHIND))
    moving.work(lambda: True)
    run_to_rest(moving, pieces=ALL)
    assert_rests_at(moving, RIGHT)
    assert len(moving.shaper.times) == 5
    # It has never gone back, nor left the path.
    places = moving.places_since()
    whole = [*ON_LEFT, *BEHIND[1:]]
    assert distance_from_polyline(places, np.array(whole)).max() < 0.003 + 1e-6
    for corner in whole:
        assert np.linalg.norm(places - corner, axis=1).min() < 0.0035


def test_the_places_of_a_path_are_all_of_it():
    moving = resting(at=MIDDLE)
    moving.set_shaper(None)
    path = PlatformPath.through([LEFT, RIGHT, (0.0, 0.08, 0.3)])
    moving.follow(path)
    held = held_of(moving)
    places = held.places(MACHINE)
    assert places is not None
    for corner in (MIDDLE, LEFT, RIGHT, (0.0, 0.08, 0.3)):
        assert np.linalg.norm(places - corner, axis=1).min() < 0.006
    back_and_forth = PlatformPath.through([LEFT, RIGHT] * 60)
    moving.follow(back_and_forth)
    assert held_of(moving).places(MACHINE) is None


def held_of(moving: RecordedEngine) -> HeldMotion:
    """Return what an engine holds."""
    holder: PlanHolder = moving._holder
    return holder.held


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "in_pieces", "command"), combined(KINDS, (False, True), ("track", "jog"))
)
def test_tracking_in_mid_motion_begins_with_a_shaper_for_wherever_it_leads(
    kind, in_pieces, command
):
    moving = begun(kind, in_pieces=in_pieces)
    shapers = [moving.shaper] * len(moving.states)
    for step in range(400):
        if step % 10 == 0 and command == "track":
            moving.track((-0.05 + 2e-4 * step, 0.0, 0.27), (0.1, 0.0, 0.0))
        elif step % 10 == 0:
            moving.jog((0.1, 0.0, 0.0) if step < 200 else (0.0, 0.1, 0.0))
        shapers.append(moving.shaper)
        run(moving, DT, ALL)
    assert moving.shaper == BY_PLACE.covering(None)
    changes = [step for step, pair in enumerate(itertools.pairwise(shapers)) if pair[0] != pair[1]]
    assert len(changes) == 1
    # It changed at rest, and then the motion went on.
    speed = speeds(moving.heights_since())
    assert speed[changes[0] - 3 : changes[0]].max() < 1e-3
    assert speed[changes[0] + 150 :].min() > 0.02
    if command == "track":
        assert moving.tracking_distance < 0.02
    moving.stop()
    run_to_rest(moving)
    assert moving.kept_limits


@each_kind
@pytest.mark.slow
@pytest.mark.parametrize("in_pieces", some((True, False), 1))
def test_whatever_is_commanded_the_limits_hold(kind, in_pieces):
    moving = resting(kind, in_pieces=in_pieces)
    others: list[Shaping | None] = [BY_PLACE, BY_PLACE, by_place(30.0, 12.0), None]
    shapers = stormed(moving, 1.6, 2, others)
    assert moving.kept_limits
    assert sum(a is not b for a, b in itertools.pairwise(shapers)) > 2


class TrueModes(SwingModel):
    """A machine whose mode differs by 40 % up and down from the middle of its workspace."""

    def frequencies(self, position: Vector3) -> list[float]:
        """Return the frequency along each axis [Hz]."""
        return [15.0 + 60.0 * position[0]] * len(self.modes)


TRUE = TrueModes(tuple(PlatformMode(axis, (15.0,), 0.03) for axis in range(3)))

# Where ring-downs have found them: in the middle, and in the corners.
MEASURED_AT = (
    (0.0, 0.0, 0.29),
    *((x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.22, 0.36)),
)
MEASURED = ShaperByPlace(
    ShaperKind.EI,
    MEASURED_AT,
    tuple((Mode(TRUE.frequencies(place)[0], 0.03),) for place in MEASURED_AT),
)


def swing_behind(motion: Trajectory) -> float:
    """Return how far the simulated machine swings after a motion has come to rest [m]."""
    times = np.arange(0.0, motion.duration + 0.2, DT)
    places = MACHINE.forward_batch(motion.sample(times).heights).tolist()
    swing, end = SimulatedSwing(tuple(places[0]), TRUE), places[-1]
    states = [swing.step((x, y, z), DT).position for x, y, z in places[1:]]
    return max(
        math.dist(state, end) for state, time in zip(states, times[1:]) if time > motion.duration
    )


def left_behind(kind: MotionKind, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what moves between random places leave, as part of their unshaped swings.

    Returns:
        Root mean squares of a fixed shaper for the middle and of one by place, and the part of the
        moves behind which more than a tenth of the swing is left. Shapes (2,).
    """
    rng = np.random.default_rng(12)
    shapers = None, Shaper.of(ShaperKind.EI, Mode(15.0, 0.03)), MEASURED
    rows = []
    for _ in range(count):
        start, end = rng.uniform((-0.1, -0.1, 0.22), (0.1, 0.1, 0.36), (2, 3)).tolist()
        rows.append(
            [
                swing_behind(plan_move(WORKSPACE, LIMITS, start, end, kind=kind, shaper=shaper))
                for shaper in shapers
            ]
        )
    swings = np.array(rows)
    sizes = np.sqrt(np.mean(swings**2, axis=0))
    return sizes[1:] / sizes[0], np.mean(swings[:, 1:] > 0.1 * swings[:, :1], axis=0)


@each_kind
def test_a_mode_that_differs_by_40_percent_is_calm_and_with_a_fixed_shaper_it_is_not(kind):
    (_, left), (fixed_fails, fails) = left_behind(kind, 14)
    assert left <= 0.1
    assert fixed_fails > 0.25
    assert fails < 0.5 * fixed_fails
