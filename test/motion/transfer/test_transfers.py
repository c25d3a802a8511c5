"""Transfers: what they promise of place, limits and depth, whatever the places do."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from motion_machine import (
    LIMITS,
    MACHINE,
    SHAPER,
    WORKSPACE,
    RecordedEngine,
    assert_rests_at,
    each_mode,
    engine,
    more,
    run,
    run_to_rest,
)
from strategies import DEFAULT_LIMITS

from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import (
    CommandStream,
    ForceLimits,
    LimitUse,
    MotionPhase,
    PlatformSpeedLimit,
    SliderLimits,
)
from tri_glide_kinematics.motion.shaped import LimitBounds
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.transfer import (
    Renewal,
    Station,
    TransferError,
    TransferPlan,
    TransferPlanner,
    Ways,
)
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Where it begins and ends, where the part is, how high the platform goes [m], and the dwell [s].
HOME, PART = (0.0, -0.1, 0.25), (0.0, 0.1, 0.25)
HEIGHT, DWELL = 0.275, 0.05
UNEQUAL = TriGlide(
    TriGlideGeometry(((0.01, 0.21), (-0.18, -0.09), (0.165, -0.11)), (0.4, 0.42, 0.385))
)
UNEQUAL_LIMITS = SliderLimits((1.0, 0.8, 0.9), (10.0, 12.0, 8.0), (200.0, 150.0, 300.0))
FORCES = ForceLimits(SliderForces(MACHINE, Masses.uniform(1.0, 0.1, 1.0)), (30.0,) * 3, (20.0,) * 3)

# How a place moves: by the time [s].
Belt = Callable[[float], MovingTarget]


def even(velocity: Vector3, part: Vector3 = PART) -> Belt:
    """Return a place that moves evenly, and comes by ``part`` after 0.6 s."""
    return MovingTarget(part, velocity).after(-0.6).after


def changing(speed: float, acceleration: float, begin: float, duration: float) -> Belt:
    """Return a place along x that changes its speed."""
    before = MovingTarget((-0.12, *PART[1:]), (speed, 0.0, 0.0))
    change = before.after(begin)._replace(acceleration=(acceleration, 0.0, 0.0))
    after = change.after(duration)._replace(acceleration=(0.0, 0.0, 0.0))

    def belt(time: float) -> MovingTarget:
        if time < begin:
            return before.after(time)
        past = time - begin
        return change.after(past) if past < duration else after.after(past - duration)

    return belt


def station(place: MovingTarget) -> Station:
    return Station(place.position, DWELL, place.velocity, place.acceleration)


def plan(
    belt: Belt, limits: SliderLimits = LIMITS, workspace: Workspace = WORKSPACE
) -> TransferPlan:
    """Return the plan of a cycle."""
    stations = [station(belt(0.0)), Station(HOME, DWELL)]
    planner = TransferPlanner(workspace, HEIGHT, 0.005)
    return at_once(planner.planned(HOME, stations, 0.0, limits, lifts=False))


def use_of(found: TransferPlan, limits: SliderLimits) -> LimitUse:
    """Return how much of the limits differences use in steps of 0.1 ms."""
    heights = found.sample(np.arange(0.0, found.duration, 1e-4)).heights
    return LimitUse.of(CommandStream.from_heights(heights, 1e-4), limits)


class Told(NamedTuple):
    """What was told after one step: how far the place is off [m], and when it is reached [s]."""

    place: Vector3
    off: float
    arrival: float
    gives_up: KinematicsError | None


def picked(
    moving: RecordedEngine,
    belt: Belt,
    seen: Belt | None = None,
    stop_at: float = math.inf,
) -> list[Told]:
    """Return what is told in a cycle until it rests; each 20 ms the place is ``seen`` anew."""
    begun = last = moving.elapsed
    stations = [station(belt(0.0)), Station(HOME, DWELL)]
    moving.transfer(stations, HEIGHT, lifts=False)
    told = []
    while moving.preparing or moving.phase is not MotionPhase.IDLE:
        moving.work(more(30))
        moving.step(moving.period)
        now, progress, place = moving.elapsed - begun, moving.transfer_progress, moving.platform[0]
        arrival = progress.arrivals[0] if progress and not moving.preparing_goal else math.inf
        off = math.dist(place, belt(now).position)
        told.append(Told(place, off, arrival, progress.gives_up if progress else None))
        if now >= stop_at:
            moving.stop()
        elif moving.elapsed - last >= 0.02:
            last = moving.elapsed
            moving.renew(0, station((seen or belt)(now)))
        assert now < 6.0
    return told


def gripped(told: list[Told]) -> list[float]:
    """Return how far the platform was from the place, from the arrival through the dwell [m]."""
    return [each.off for each in told if -DWELL <= each.arrival <= 1e-9]


def at_home(**options) -> RecordedEngine:
    return engine(heights=MACHINE.inverse(HOME), **options)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(st.floats(0.0, 6.28), st.floats(-0.2, 0.2), st.floats(0.05, 0.5))
def test_it_is_on_the_place_from_the_arrival_through_the_dwell(angle, tilt, speed):
    level = speed * math.cos(tilt)
    velocity = level * math.cos(angle), level * math.sin(angle), speed * math.sin(tilt)
    belt = even(velocity, (0.0, 0.06, 0.25))
    try:
        found = plan(belt)
    except KinematicsError:
        assume(False)
    for past in np.linspace(0.0, DWELL - 1e-9, 7).tolist():
        time = found.arrival(0) + past
        place = found.platform_at(MACHINE, time)
        assert place[:3] == pytest.approx(belt(time).position, abs=1e-9)
        assert place[3:6] == pytest.approx(velocity, abs=1e-9)
    assert use_of(found, LIMITS).is_within


@pytest.mark.parametrize(
    ("limits", "machine"),
    [
        (UNEQUAL_LIMITS, MACHINE),
        (LIMITS, UNEQUAL),
        (LIMITS.with_added(FORCES), MACHINE),
        (LIMITS.with_added(PlatformSpeedLimit(MACHINE, 0.5)), MACHINE),
    ],
    ids=["unequal limits", "unequal arms", "forces", "platform speed"],
)
def test_limits_are_kept(limits, machine):
    found = plan(even((0.2, 0.0, 0.0)), limits, Workspace(machine, DEFAULT_LIMITS))
    assert use_of(found, limits).is_within
    sampled = found.sample(np.arange(0.0, found.duration, 1e-3))
    for bound in limits.added:
        if isinstance(bound, ForceLimits):
            forces = bound.forces.forces_batch(*sampled[1:])
            assert (forces <= bound.up).all() and (forces >= -np.array(bound.down)).all()
        else:
            places = machine.forward_batch(sampled.heights)
            speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / 1e-3
            assert speeds.max() <= bound.platform_speed * (1.0 + 1e-6)


@each_mode
@pytest.mark.parametrize("period", [0.001, 0.004])
def test_a_shaped_platform_is_driven_on_the_place(in_pieces, period):
    moving = at_home(in_pieces=in_pieces, period=period)
    moving.set_shaper(SHAPER)
    told = picked(moving, even((0.2, 0.05, 0.0)))
    assert len(gripped(told)) >= DWELL / period - 1
    assert max(gripped(told)) < 1e-6
    assert_rests_at(moving, HOME, 1e-6)


def least_height(
    places: np.ndarray, *stations: np.ndarray | Vector3, beside: float = 0.05
) -> float:
    """Return how high the platform is at least, beside all ``stations`` [m]."""
    level = [np.hypot(*(places - station)[:, :2].T) > beside for station in stations]
    chosen = np.logical_and.reduce(level)
    assert chosen.sum() > 20
    return float(places[chosen, 2].min())


@pytest.mark.parametrize("tilt", [-0.15, 0.1])
@pytest.mark.parametrize(("speed", "angle"), [(0.15, 0.0), (0.4, 0.3), (0.4, 2.8)])
def test_on_a_sloping_belt_it_is_no_lower_than_its_height_between_stations(tilt, speed, angle):
    """A frame that begins below where it is told made it cruise 2.8 mm too low."""
    level = speed * math.cos(tilt)
    velocity = level * math.cos(angle), level * math.sin(angle), speed * math.sin(tilt)
    belt = even(velocity)
    found = plan(belt)
    times = np.arange(0.0, found.duration, 1e-3)
    places = MACHINE.forward_batch(found.sample(times).heights)
    parts = np.array([belt(time).position for time in times])
    coming = times < found.arrival(0)
    assert least_height(places[coming], parts[coming], HOME) >= HEIGHT - 1.5e-5
    leaves = found.arrival(0) + DWELL
    going = times > leaves
    assert least_height(places[going], belt(leaves).position, HOME, beside=0.08) >= HEIGHT - 1.5e-5


def test_a_place_that_sinks_is_left_up_to_the_height():
    velocity = (0.3, 0.0, -0.06)
    planner = TransferPlanner(WORKSPACE, HEIGHT, 0.005)
    found = at_once(planner.planned(HOME, [station(even(velocity)(0.0))], 0.0, LIMITS))
    assert found.end[2] >= HEIGHT - 1.5e-5


@pytest.mark.parametrize("acceleration", [-0.5, -0.05, 0.05, 0.5, 1.5])
@pytest.mark.parametrize("slope", [-0.15, 0.15])
def test_a_renewal_on_a_slope_keeps_the_height_or_is_given_up(acceleration, slope):
    """The place is met elsewhere, and so lower on the slope than it was planned for."""
    level, moving = changing(0.25, acceleration, 0.3, 0.25), at_home(period=0.002)

    def belt(time: float) -> MovingTarget:
        return MovingTarget(*((x, y, z + slope * x) for x, y, z in level(time)[:3]))

    told = picked(moving, belt)
    coming = [row for row, each in enumerate(told) if 0.0 < each.arrival < math.inf]
    places = np.array([told[row].place for row in coming])
    parts = np.array([belt(moving.period * (row + 1)).position for row in coming])
    assert least_height(places, parts, HOME) >= HEIGHT - 1.5e-5
    if told[-1].gives_up is not None:
        assert told[-1].place[2] >= HEIGHT - 1.5e-5
    assert moving.kept_limits


LIARS = {
    "stops": changing(0.25, -250.0, 0.5, 0.001),
    "turns": changing(0.25, -5.0, 0.45, 0.1),
    "jumps": lambda time: even((0.2, 0.0, 0.0), (0.1 * (time > 0.5), *PART[1:]))(time),
    "sinks": lambda time: even((0.2, 0.0, 0.0), (*PART[:2], 0.25 - 0.002 * (time > 0.4)))(time),
    "digs": lambda time: even((0.2, 0.0, -0.1 * (time > 0.4)))(time),
}


@each_mode
@pytest.mark.parametrize("seen", LIARS.values(), ids=LIARS)
def test_it_is_never_below_the_stop_whatever_renewals_say(seen, in_pieces):
    moving = at_home(in_pieces=in_pieces)
    told = picked(moving, LIARS["stops"] if seen is LIARS["stops"] else even((0.2, 0.0, 0.0)), seen)
    assert min(each.place[2] for each in told) >= 0.25 - 1e-6
    assert moving.kept_limits


@pytest.mark.parametrize("shaper", [None, SHAPER], ids=["", "shaped"])
@pytest.mark.parametrize("when", [0.2, 0.4, 0.5, 0.52, 0.54, 0.56, 0.58, 0.6, 0.64, 0.68, 1.0, 1.1])
def test_a_stop_in_any_phase_leads_no_deeper(when, shaper):
    moving = at_home()
    moving.set_shaper(shaper)
    told = picked(moving, even((0.3, 0.0, 0.0)), stop_at=when)
    assert min(each.place[2] for each in told) >= 0.25 - 1e-6
    assert moving.kept_limits
    assert len(told) * moving.period < when + 0.32


@each_mode
@pytest.mark.parametrize("acceleration", [-0.2, 0.2])
def test_a_place_that_changes_its_speed_is_met(acceleration, in_pieces):
    moving = at_home(in_pieces=in_pieces)
    told = picked(moving, changing(0.2, acceleration, 0.2, 0.9))
    assert max(gripped(told)) < 1e-3
    assert_rests_at(moving, HOME, 1e-6)


@each_mode
def test_what_cannot_be_met_is_given_up_at_the_height(in_pieces):
    moving = at_home(in_pieces=in_pieces)
    told = picked(moving, LIARS["stops"])
    assert not gripped(told[-1:])
    assert str(told[-1].gives_up).startswith("the place is missed by ")
    assert ", more than 0.2 mm" in str(told[-1].gives_up)
    assert told[-1].place[2] == pytest.approx(HEIGHT, abs=1e-6)
    assert moving.kept_limits


@pytest.mark.parametrize(
    ("stations", "how", "text"),
    [
        ([], {}, "a transfer needs a station"),
        ([Station(PART, -0.1)], {}, "dwell = -0.1 s must be at least 0 s"),
        ([Station((0.0, math.nan, 0.2))], {}, "position"),
        ([Station((0.0, 0.1, 0.2), velocity=(0.0, 0.0))], {}, "velocity"),
        ([Station(PART)], {"tolerance": -0.001}, "tolerance = -0.001 m must be at least 0 m"),
        ([Station((0.0, 0.3, 0.25), 0.0, (0.1, 0.0, 0.0))], {}, "0.395 m"),
    ],
)
def test_bad_input_is_refused_with_number_and_bound(stations, how, text):
    moving = at_home()
    with pytest.raises(KinematicsError, match=text.replace(".", r"\.")):
        moving.transfer(stations, HEIGHT, **how)
    assert_rests_at(moving, HOME)


@pytest.mark.parametrize("part", [0.98, 0.4])
def test_lower_limits_are_kept_or_the_transfer_is_given_up(part):
    moving = at_home()
    belt = even((0.2, 0.0, 0.0))
    moving.transfer([station(belt(0.0)), Station(HOME, DWELL)], HEIGHT, lifts=False)
    for _ in range(150):
        moving.step(moving.period)
    first = len(moving.states)
    moving.set_limits(LIMITS.with_table(part * LIMITS.table))
    run_to_rest(moving)
    refusal = moving.take_refusal()
    if refusal is None:
        assert_rests_at(moving, HOME, 1e-6)
    else:
        assert "new limits" in str(refusal)
        assert moving.platform[0][2] == pytest.approx(HEIGHT, abs=1e-6)
    assert moving.kept_limits
    assert moving.places_since(first)[:, 2].min() >= 0.25 - 1e-6
    assert not moving.limits_pending


@each_mode
def test_one_that_is_planned_ahead_begins_at_the_rest_of_the_motion_before(in_pieces):
    moving = at_home(in_pieces=in_pieces)
    moving.move_to((0.05, -0.1, 0.3))
    while moving.preparing:
        moving.work(more(10))
    past = -moving.time_to_rest
    belt = even((0.1, 0.0, 0.0))
    moving.transfer([station(belt(0.0)), Station(HOME)], 0.32, lifts=False)
    while moving.transfer_progress is None:
        moving.work(more(100))
        moving.step(moving.period)
        past += moving.period
        assert past < 0.5
    found = moving._execution.holder.held.plan
    assert found.arrival(0) - moving.transfer_progress.arrivals[0] == pytest.approx(past, abs=1e-9)
    assert 0.0 < past < 2.0 * moving.period
    run_to_rest(moving)
    assert_rests_at(moving, HOME, 1e-6)


@each_mode
def test_a_place_where_the_platform_is_already_is_reached(in_pieces):
    moving = at_home(in_pieces=in_pieces)
    moving.transfer([Station(HOME, DWELL), Station(HOME, DWELL)], HEIGHT, lifts=False)
    run_to_rest(moving)
    assert_rests_at(moving, HOME, 1e-6)
    assert moving.elapsed > 2.0 * DWELL
    assert math.dist(max(moving.places_since(0), key=lambda place: place[2]), HOME) < 1e-4


def test_without_the_proof_limits_would_be_exceeded(monkeypatch):
    kept = []
    for _ in range(2):
        moving = at_home()
        picked(moving, even((0.2, 0.0, 0.0)), LIARS["turns"])
        kept.append(moving.kept_limits)
        monkeypatch.setattr(LimitBounds, "keeps_limits", True)
    assert kept == [True, False]


def test_legs_that_do_not_join_are_refused():
    first, second, *_ = plan(even((0.2, 0.0, 0.0))).legs
    other, *_ = plan(even((0.1, 0.0, 0.0))).legs
    TransferPlan((first, second))
    with pytest.raises(TransferError, match=r"legs do not join: .* at most 1e-06"):
        TransferPlan((other, second))


def test_between_places_that_rest_there_is_nothing_to_give_up():
    moving = at_home()
    moving.transfer([Station(PART), Station(HOME)], HEIGHT, lifts=False)
    run(moving, 0.2)
    assert not moving.give_up(TransferError("why"))
    run_to_rest(moving)
    assert_rests_at(moving, HOME)


def test_a_dwell_at_rest_is_waited_for_once():
    stations = [station(even((0.2, 0.0, 0.0))(0.0)), Station(HOME, 0.3)]
    planner = TransferPlanner(WORKSPACE, HEIGHT, 0.005)
    found = at_once(planner.planned(HOME, stations, 0.0, LIMITS, lifts=False))
    assert found.duration - found.arrival(1) == pytest.approx(0.3, abs=1e-9)


@each_mode
def test_it_does_not_begin_in_a_motion_that_has_no_end(in_pieces):
    moving = at_home(in_pieces=in_pieces)
    for _ in range(20):
        moving.track((0.0, 0.05, 0.3), (0.1, 0.0, 0.0))
        run(moving, 0.01)
    with pytest.raises(TransferError, match="begins at rest"):
        moving.transfer([Station(PART)], HEIGHT)
    assert moving.phase is MotionPhase.TRACKING


def test_a_plan_that_is_ready_too_late_is_made_again_for_where_the_place_is_then():
    """It met the place one step late."""
    moving = at_home(in_pieces=True)
    belt, begun, off = even((0.1, 0.0, 0.0)), moving.elapsed, []
    moving.transfer([station(belt(0.0)), Station(HOME, DWELL)], HEIGHT, lifts=False)
    run(moving, 0.3, pieces=0)
    while moving.preparing or moving.phase is not MotionPhase.IDLE:
        run(moving, moving.period)
        progress = moving.transfer_progress
        if progress is not None and -DWELL <= progress.arrivals[0] <= 1e-9:
            off.append(math.dist(moving.platform[0], belt(moving.elapsed - begun).position))
    assert off and max(off) < 1e-6
    assert_rests_at(moving, HOME, 1e-6)


def test_changes_without_end_keep_the_platform_at_the_place_for_a_tenth_of_a_second_at_most():
    """Each change let it stay for longer once more: 1.5 s in all."""

    def shaking(time: float) -> MovingTarget:
        turns, past = divmod(time, 0.03)
        off, sign = (0.01 * past, 1.0) if turns % 2.0 == 0.0 else (0.01 * (0.03 - past), -1.0)
        return MovingTarget((0.05 * time + off - 0.12, 0.1, 0.25), (0.05 + 0.01 * sign, 0.0, 0.0))

    found, ways = plan(shaking), Ways(WORKSPACE, HEIGHT, 0.005)
    first, begun, now, latest = found.arrival(0), 0.0, 0.0, 0.0
    while found.gives_up is None and now < begun + found.arrival(0):
        now += 0.01
        told = station(shaking(now))._replace(outputs=((0.01, True),))
        renewed = at_once(Renewal(ways, found, now - begun, LIMITS).to(told, 0.0, 1e-3))
        if renewed is not None:
            found, begun = renewed, now
        if found.gives_up is None:
            latest = max(latest, begun + found.arrival(0))
    assert 0.05 < latest - first < 0.1 + 1e-9


@pytest.mark.parametrize("before", [0.09, 0.13])
def test_at_the_arrival_it_is_as_near_to_the_place_as_is_asked_or_goes_up(before):
    """Where it met a place at the end of a long dwell only, outputs were told 1.6 mm beside it."""
    belt, allowed = even((0.1, 0.0, 0.0)), 1e-3
    planner, ways = TransferPlanner(WORKSPACE, HEIGHT, 0.005), Ways(WORKSPACE, HEIGHT, 0.005)
    stations = [station(belt(0.0))._replace(dwell=0.2), Station(HOME)]
    found = at_once(planner.planned(HOME, stations, 0.0, LIMITS, lifts=False))
    now = found.arrival(0) - before
    changed = belt(now)._replace(acceleration=(0.8, 0.0, 0.0))
    told = station(changed)._replace(dwell=0.2, outputs=((0.0, True),))
    renewed = at_once(Renewal(ways, found, now, LIMITS).to(told, 0.0, allowed))
    arrival = renewed.arrival(0)
    if renewed.gives_up is None:
        place = MACHINE.forward(renewed.at(arrival).heights)
        assert math.dist(place, changed.after(arrival).position) <= allowed
