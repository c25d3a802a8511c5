"""Exactly one target for each SYNC, on the way of the stream, whenever its setpoints arrive."""

import functools
import random
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from controller_rig import HOME, LIMITS, engine

from tri_glide_kinematics.checks import NotFiniteError
from tri_glide_kinematics.drives import Playout, Setpoint, SetpointRefusedError
from tri_glide_kinematics.motion import MotionPhase

PERIOD = 0.002  # of the stream [s]
BRAKE = (10.0, 10.0, 10.0)
REST = 60
PLACES = ((0.1, 0.0, 0.25), (-0.1, 0.05, 0.35), (0.05, -0.1, 0.15), (0.0, 0.0, 0.45))
# A wall clock, as a float of seconds: too coarse for a microsecond.
EPOCH = 1.7954e9
with np.load(Path(__file__).with_name("arrivals.npz")) as recorded:
    # Of the real ik_node in motion: arrival less nominal time [s]. The quiet ones came
    # with realtime_priority, as the computer was not; the loaded ones beside two processes of the
    # same priority that only calculate, in stretches without a stall of more than 45 ms.
    QUIET, LOADED = 1e-6 * recorded["quiet"], 1e-6 * recorded["loaded"]
    # What came at once is rounded to the microsecond.
    NOMINAL = PERIOD * np.arange(LOADED.shape[1])
    LOADED = np.maximum.accumulate(LOADED + NOMINAL, axis=1) - NOMINAL


@functools.cache
def stream(count=6000, seed=0):
    """Return heights and velocities of moves, from rest to rest; some of them are redirected."""
    chance, moving = random.Random(seed), engine()
    moving.start(HOME)
    states = [moving.state] * REST
    while len(states) < count or moving.phase is not MotionPhase.IDLE:
        is_early = len(states) < count
        if is_early and (moving.phase is MotionPhase.IDLE or chance.random() < 0.002):
            moving.move_to(chance.choice(PLACES))
        states.append(moving.step(PERIOD))
    return [(state.heights, state.velocities) for state in states]


def circle(count, acceleration=3.9, frequency=0.9):
    """Return heights and velocities of a gentle motion that never ends."""
    omega = 2.0 * np.pi * frequency
    times = PERIOD * np.arange(count - REST)
    rising = np.minimum(times, 1.0)
    angle = omega * (0.5 * rising**2 + times - rising)
    amplitude = acceleration / omega**2
    shares = np.array([1.0, 0.5, -0.2])
    heights = HOME[0] + np.outer(amplitude * (1.0 - np.cos(angle)), shares)
    velocities = np.outer(amplitude * omega * rising * np.sin(angle), shares)
    moving = list(zip(map(tuple, heights.tolist()), map(tuple, velocities.tolist())))
    return [(HOME, (0.0, 0.0, 0.0))] * REST + moving


@dataclass
class Played:
    """What the drives got for a stream."""

    playout: Playout
    heights: list = field(default_factory=list)
    velocities: list = field(default_factory=list)
    delays: list = field(default_factory=list)
    refused: list = field(default_factory=list)

    def sync(self, now):
        target = self.playout.next(now)
        if target is not None:
            self.heights.append(target[0])
            self.velocities.append(target[1])
            self.delays.append(self.playout.delay)

    @property
    def accelerations(self):
        return np.abs(np.diff(self.heights, 2, axis=0)).max() / self.playout._period**2

    def check_steps(self):
        """No target is repeated or skipped: a step is the way of one period at its velocity."""
        steps, speeds = np.diff(self.heights, axis=0), np.array(self.velocities)
        period = self.playout._period
        mean = 0.5 * period * (speeds[1:] + speeds[:-1])
        assert np.abs(steps - mean).max() < 1.6 * 10.0 * period**2
        moves = np.abs(speeds).max(axis=1) > 0.0
        assert (np.abs(steps).max(axis=1)[moves[1:] & moves[:-1]] > 0.0).all()


def play(setpoints, delays, delay, period=PERIOD, lost=(), after=0.3):
    """Return what is played of setpoints that arrive with ``delays`` behind their nominal times."""
    played = Played(Playout(delay, period, BRAKE))
    events = [
        (count * PERIOD + late, count)
        for count, late in enumerate(delays[: len(setpoints)])
        if count not in lost
    ]
    events.sort(key=lambda event: (round(event[0], 7), event[1]))
    now, place = events[0][0] + 0.0003, 0
    while now < events[-1][0] + after:
        while place < len(events) and events[place][0] <= now:
            arrival, count = events[place]
            try:
                played.playout.put(Setpoint(EPOCH + count * PERIOD, *setpoints[count]), arrival)
            except SetpointRefusedError:
                played.refused.append(count)
            place += 1
        played.sync(now)
        now += period
    return played


def commanded(setpoints):
    return np.abs(np.diff([heights for heights, _ in setpoints], 2, axis=0)).max() / PERIOD**2


def off_the_way(played, setpoints):
    """Return how far targets are from the way of all setpoints, drawn finely [m]."""
    way = np.array([heights for heights, _ in setpoints])
    speeds = np.array([velocities for _, velocities in setpoints])
    places = []
    for u in np.arange(0.0, 1.0, 0.25):
        ahead, behind = u * PERIOD, (1.0 - u) * PERIOD
        cubic = (1.0 - u) * (way[:-1] + ahead * speeds[:-1]) + u * (way[1:] - behind * speeds[1:])
        places.append(cubic)
    places = np.concatenate(places)
    found = []
    for height in np.array(played.heights)[::-7]:
        distance = np.abs(places - height).max(axis=1)
        found.append(distance.min())
    return np.array(found)


@pytest.mark.parametrize("delay", [0.006, 0.010])
@pytest.mark.parametrize("period", [0.002, 0.001, 0.005])
def test_quiet_arrivals_are_hardly_felt_10_ms_behind_the_stream(delay, period):
    setpoints = stream(len(QUIET))[: len(QUIET)]
    played = play(setpoints, QUIET, delay, period, after=0.0)
    assert not played.refused and not played.playout.has_run_dry
    assert played.accelerations <= 1.3 * commanded(setpoints)
    assert np.ptp(played.delays) < 0.003
    played.check_steps()


@pytest.mark.parametrize("number", range(len(LOADED)))
def test_a_loaded_computer_is_made_good_60_ms_behind_the_stream(number):
    begin = 450 * number
    setpoints = stream(12_000)
    while any(setpoints[begin][1]):
        begin += 1
    setpoints = setpoints[begin : begin + LOADED.shape[1]]
    played = play(setpoints, LOADED[number], 0.060, after=0.0)
    assert not played.refused
    # That the computer was late would be felt: setpoints came up to so much later.
    assert np.diff(LOADED[number]).max() > 0.008
    assert played.accelerations <= 1.6 * commanded(setpoints)
    played.check_steps()
    gentle = circle(len(setpoints))
    assert play(gentle, LOADED[number], 0.060, after=0.0).accelerations <= 1.6 * 3.9


def farthest_off():
    """Return how far a braking can leave the way of the stream, whatever the slider [m].

    All sliders brake within the time t = max v/b. They go along the tangent by v s, with s up to
    t/2. There, the way of the stream has left its tangent by no more than a s^2/2 = a t^2/8. The
    rate may be somewhat above 1 (FASTEST), which counts four times.
    """
    time = 1.02**2 * max(v / b for v, b in zip(LIMITS.velocity, BRAKE))
    return max(LIMITS.acceleration) * time * time / 8.0


def random_delays(chance, count):
    """Return delays of arrivals: jitter, bunches and stalls after which all comes later."""
    behind, delays = 0.0, []
    while len(delays) < count:
        if chance.random() < 0.01:
            stall = chance.expovariate(1.0 / 0.01)
            behind += stall * chance.choice((0.0, 1.0))
            bunch = int(stall / PERIOD) + 1
            delays += [behind + stall - PERIOD * each for each in range(bunch)]
        else:
            delays.append(behind + chance.expovariate(1.0 / 0.0003))
    return delays


@pytest.mark.parametrize("seed", range(8))
def test_whatever_comes_targets_keep_the_limits_and_the_way(seed):
    chance = random.Random(seed)
    setpoints = stream(1500, seed)
    delay, period = chance.choice((0.006, 0.01, 0.03, 0.06)), chance.choice((0.001, 0.002, 0.004))
    delays = random_delays(chance, len(setpoints))
    lost = {count for count in range(REST, len(setpoints)) if chance.random() < 0.01}
    played = play(setpoints, delays, delay, period, lost)
    assert played.accelerations <= 1.6 * 10.0
    played.check_steps()
    off = off_the_way(played, setpoints).max()
    if played.playout.has_run_dry:
        assert played.playout.rests
        assert off <= farthest_off()
    else:
        # A cubic over lost setpoints, and the coarse drawing of the way.
        assert off < 0.0005
        np.testing.assert_allclose(played.heights[-1], setpoints[-1][0], atol=1e-12)


@pytest.mark.parametrize("period", [0.001, 0.002, 0.0047])
def test_each_setpoint_is_played_one_delay_after_it_came(period):
    way = [((0.6, 0.6, 0.6), (0.0, 0.0, 0.0))] * 5
    way += [((0.6 + t * t, 0.6, 0.6), (2.0 * t, 0.0, 0.0)) for t in PERIOD * np.arange(1.0, 200.0)]
    played = Played(Playout(0.012, period, BRAKE))
    now, count = 0.0001, 0
    while count < len(way):
        while count < len(way) and count * PERIOD <= now:
            played.playout.put(Setpoint(EPOCH + count * PERIOD, *way[count]), count * PERIOD)
            count += 1
        played.sync(now)
        then = now - played.playout.delay - 4 * PERIOD
        assert played.heights[-1][0] == pytest.approx(0.6 + max(then, 0.0) ** 2, abs=1e-7)
        assert played.playout.delay == pytest.approx(0.012, abs=2e-4)
        now += period


@pytest.mark.parametrize("stall_at", (300, 700, 1100))
def test_a_stall_lets_all_sliders_brake_in_the_same_time_and_late_setpoints_change_nothing(
    stall_at,
):
    setpoints = stream(2500)
    delays = [0.0005 + (0.5 if count > stall_at else 0.0) for count in range(len(setpoints))]
    played = play(setpoints, delays, 0.02)
    speeds = np.abs(played.velocities)
    if not any(setpoints[stall_at][1]):
        return
    assert played.playout.has_run_dry and played.playout.rests
    assert min(played.refused) == stall_at + 1 and max(played.refused) == len(setpoints) - 1
    assert played.accelerations <= 16.0
    played.check_steps()
    ends = [np.flatnonzero(speeds[:, i])[-1] for i in range(3) if speeds[-600:, i].max() > 0]
    assert len(set(ends)) <= 1
    assert off_the_way(played, setpoints).max() <= farthest_off()
    # Enabled anew, a stream begins at rest, wherever that is.
    played.playout.restart()
    place = (0.7, 0.65, 0.6)
    played.playout.put(Setpoint(EPOCH, place, (0.0, 0.0, 0.0)), 100.0)
    assert played.playout.next(100.001) == (place, (0.0, 0.0, 0.0))


def resting(playout, heights=HOME, count=20, stamp=EPOCH, now=10.0):
    """Feed rest, and return when the next one is due."""
    for number in range(count):
        playout.put(Setpoint(stamp + number * PERIOD, heights, (0.0, 0.0, 0.0)), now)
        playout.next(now)
        now += PERIOD
    return now


def test_at_rest_stamps_may_be_set_and_a_silence_changes_nothing():
    playout = Playout(0.01, PERIOD, BRAKE)
    now = resting(playout)
    for stamp in (EPOCH + 3600.0, EPOCH - 3600.0, EPOCH + 0.5):
        for _ in range(250):
            assert playout.next(now) == (HOME, (0.0, 0.0, 0.0))
            now += PERIOD
        now = resting(playout, stamp=stamp, now=now)
    assert playout.rests and not playout.has_run_dry
    # From rest, the way begins one delay after the first setpoint of it.
    ahead = (0.6001, 0.6, 0.6)
    playout.put(Setpoint(stamp + 20 * PERIOD, ahead, (0.1, 0.0, 0.0)), now)
    rests = [playout.next(now + count * PERIOD)[0] == HOME for count in range(1, 7)]
    assert rests == [True] * 5 + [False]


def test_where_the_stream_begins_a_little_off_the_sliders_glide_there():
    played = Played(Playout(0.01, PERIOD, BRAKE))
    now = resting(played.playout)
    near = (0.6005, 0.5998, 0.6)
    for number in range(60):
        stamp = EPOCH + 7.0 + number * PERIOD
        played.playout.put(Setpoint(stamp, near, (0.0, 0.0, 0.0)), now)
        played.sync(now)
        now += PERIOD
    assert played.heights[-1] == near and played.playout.rests
    assert played.accelerations <= 5.0 + 1e-6
    with pytest.raises(SetpointRefusedError, match=r"jump at rest of 0\.0015"):
        played.playout.put(Setpoint(EPOCH + 8.0, (0.602, 0.5998, 0.6), (0.0, 0.0, 0.0)), now)


@pytest.mark.parametrize(
    ("setpoint", "error", "text"),
    [
        (Setpoint(EPOCH + 0.04, (float("nan"), 0.6, 0.6), (0.0, 0.0, 0.0)), NotFiniteError, "nan"),
        (Setpoint(EPOCH + 0.04, HOME, (0.0, float("inf"), 0.0)), NotFiniteError, "inf"),
        (Setpoint(float("nan"), HOME, (0.0, 0.0, 0.0)), NotFiniteError, "nan"),
        (Setpoint(EPOCH + 0.03, HOME, (0.1, 0.0, 0.0)), SetpointRefusedError, "comes -0.008 s"),
        (Setpoint(EPOCH + 0.34, HOME, (0.1, 0.0, 0.0)), SetpointRefusedError, "comes 0.302 s"),
    ],
)
def test_what_cannot_follow_is_refused_with_the_number(setpoint, error, text):
    playout = Playout(0.01, PERIOD, BRAKE)
    now = resting(playout)
    with pytest.raises(error, match=text):
        playout.put(setpoint, now)
    assert playout.next(now) == (HOME, (0.0, 0.0, 0.0))


def test_a_stream_that_begins_in_motion_is_refused():
    with pytest.raises(SetpointRefusedError, match="first setpoint must be at rest"):
        Playout(0.01, PERIOD, BRAKE).put(Setpoint(0.0, HOME, (0.1, 0.0, 0.0)), 0.0)
