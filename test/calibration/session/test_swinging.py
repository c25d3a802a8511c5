"""Decisions of a search for modes, fed by hand."""

import math
from dataclasses import replace

import pytest

from tri_glide_kinematics.calibration.ringdown import Quantity
from tri_glide_kinematics.calibration.session import (
    STOPS,
    MachineView,
    SwingPhase,
    SwingSearch,
    SwingSettings,
    swing_moves,
)
from tri_glide_kinematics.control import FAULT, IDLE, WAS_STOPPED, Cause
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

WORKSPACE = Workspace(
    TriGlide(DEFAULT_GEOMETRY), WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
)
PLACE = (0.0, 0.0, 0.3)
RESTING = MachineView(IDLE, Cause.TARGET_REACHED, "the target is reached", 3)
SENSOR = ("/imu", Quantity.ACCELERATION, ("x", "y", "z"))
PERIOD = 0.002
# Stamps are by another clock than that of the computer.
AHEAD = 5e4
STILL = (0.0, 0.0, 0.0)
SHORT = SwingSettings(duration=0.3)


class Rig:
    """A search, the machine that it leads, and a clock."""

    def __init__(self, settings=SHORT):
        self.now = 100.0
        moves = swing_moves(WORKSPACE, PLACE, settings)
        self.search = SwingSearch(moves, settings.duration, SENSOR, self.now, RESTING.stops)
        self.state = SliderState(WORKSPACE.machine.inverse(PLACE), STILL, STILL)
        self.machine = RESTING
        self.driven = []
        self.hears = self.feels = True
        self.arrives_after = 0.1
        self._arrival = math.inf
        self._goal = None

    def cycle(self):
        self.now += PERIOD
        if self._goal is not None and self.now >= self._arrival:
            self.state = SliderState(self._goal.heights, STILL, STILL)
            self._goal, self._arrival = None, math.inf
            self.search.goal_ended(has_arrived=True, text="")
        if self.hears:
            self.search.setpoints(self.state, self.now, self.now)
        if self.feels:
            self.search.sample(
                (math.sin(50.0 * self.now), 0.0, 9.8), self.now + AHEAD, self.now, self.now
            )
        move = self.search.step(self.machine, self.now)
        if move is not None:
            self.driven.append(move)
            self._goal, self._arrival = move, self.now + self.arrives_after
            self.state = self.state._replace(velocities=(0.1, 0.0, 0.0))
        return self.search

    def run(self, until, limit=60.0):
        end = self.now + limit
        while not until(self.search):
            assert self.now < end
            self.cycle()
        return self.search

    def to(self, phase):
        return self.run(lambda search: search.phase is phase)


def rig_at(phase, settings=SHORT):
    """Return a rig whose search is in a ``phase``."""
    rig = Rig(settings)
    rig.to(phase)
    return rig


def test_each_direction_is_driven_out_and_back_with_a_recording_behind_each_move():
    rig = Rig()
    search = rig.to(SwingPhase.ENDED)
    assert search.failure is None
    assert len(search.recordings) == 3 * len(STOPS) == len(rig.driven)
    assert [move.target for move in rig.driven[:3]] == [
        pytest.approx((0.02, 0.0, 0.3)),
        pytest.approx((0.008, 0.0, 0.3)),
        pytest.approx(PLACE),
    ]
    assert rig.driven[-1].target == pytest.approx(PLACE)
    for recording in search.recordings:
        assert recording.quantity is Quantity.ACCELERATION
        assert recording.times[-1] - recording.times[0] == pytest.approx(0.3, abs=3 * PERIOD)


def test_a_recording_begins_when_the_setpoints_rest_and_has_the_stamps_of_the_sensor():
    rig = rig_at(SwingPhase.RECORDING)
    rested = rig.now
    search = rig.run(lambda search: search.recordings)
    first = search.recordings[0].times[0] - AHEAD
    assert rested < first < rested + 0.03


def test_a_place_is_gone_to_without_a_recording():
    settings = SwingSettings(((0.0, 0.0, 2.0),), 0.01, 0.3, (0.02, 0.01, 0.28))
    rig = Rig(settings)
    search = rig.to(SwingPhase.ENDED)
    assert rig.driven[0].target == (0.02, 0.01, 0.28)
    assert rig.driven[1].target == pytest.approx((0.02, 0.01, 0.29))
    assert len(rig.driven) == 4
    assert len(search.recordings) == 3


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (SwingSettings(length=0.5), r"outside the workspace at \(0\.\d+, 0, 0\.3\) m: .* breaks"),
        (SwingSettings(place=(0.5, 0.0, 0.3)), r"outside|reach"),
        (SwingSettings(((0.0, 0.0, 1.0),), 0.4), "upper end of slider travel of arm 1, 0.9 m"),
        (SwingSettings(((0.0, 0.0, -1.0),), 0.4), "lower end of slider travel of arm 1, 0.3 m"),
    ],
)
def test_no_way_leaves_the_workspace(settings, words):
    with pytest.raises(KinematicsError, match=words):
        swing_moves(WORKSPACE, PLACE, settings)


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"directions": ()}, "number of directions = 0 must be 1 to 9"),
        ({"directions": ((0.0, 0.0, 0.0),)}, r"directions\[0\] = 0 must be greater than 0"),
        ({"directions": ((math.nan, 0.0, 0.0),)}, r"directions\[0\]\[0\]"),
        ({"length": 1e-4}, "length = 0.0001 m must be from 0.001 to 0.5"),
        ({"length": math.inf}, "length"),
        ({"duration": 61.0}, "duration = 61 s must be from 0.2 to 60"),
        ({"place": (0.0, math.nan, 0.0)}, r"place\[1\]"),
    ],
)
def test_numbers_have_bounds(numbers, words):
    with pytest.raises(KinematicsError, match=words):
        SwingSettings(**numbers)


def test_nothing_moves_before_setpoints_are_heard():
    rig = Rig()
    rig.hears = False
    search = rig.to(SwingPhase.ENDED)
    assert not rig.driven
    assert "no setpoints on motion_state in 3 s: ik_node is idle" in search.failure


def test_samples_without_ascending_stamps_are_none():
    rig = Rig()
    rig.feels = False
    for _ in range(20):
        rig.search.sample(STILL, AHEAD, rig.now, rig.now)
    search = rig.to(SwingPhase.ENDED)
    assert search.failure.startswith("1 samples")


@pytest.mark.parametrize("phase", [SwingPhase.MOVING, SwingPhase.RECORDING])
@pytest.mark.parametrize(
    ("quiet", "words"),
    [
        ("hears", "ik_node has told nothing on motion_state for 1 s"),
        ("feels", "no sample has come"),
    ],
)
def test_silence_ends_a_search(phase, quiet, words):
    rig = Rig(SwingSettings(duration=5.0))
    rig.arrives_after = 3.0
    rig.to(phase)
    setattr(rig, quiet, False)
    count = len(rig.driven)
    search = rig.to(SwingPhase.ENDED)
    assert words in search.failure
    assert len(rig.driven) == count


def test_samples_that_are_missing_now_and_then_end_nothing():
    rig = rig_at(SwingPhase.RECORDING)
    for index in range(100):
        rig.feels = index % 10 != 0
        rig.cycle()
    rig.search.sample((math.nan, 0.0, 0.0), rig.now + AHEAD + 1e-4, rig.now, rig.now)
    assert rig.to(SwingPhase.ENDED).failure is None


@pytest.mark.parametrize("phase", [SwingPhase.LISTENING, SwingPhase.MOVING, SwingPhase.RECORDING])
def test_a_stop_of_ik_node_ends_the_search_where_nothing_moves_too(phase):
    rig = rig_at(phase)
    count = len(rig.driven)
    rig.machine = replace(RESTING, stops=4)
    assert rig.cycle().failure == WAS_STOPPED
    assert len(rig.driven) == count


@pytest.mark.parametrize("phase", [SwingPhase.MOVING, SwingPhase.RECORDING])
def test_setpoints_that_end_are_told(phase):
    rig = rig_at(phase)
    rig.machine = MachineView(FAULT, Cause.MEASUREMENT_JUMP, "a jump")
    rig.state = None
    assert rig.cycle().failure == "ik_node leads the machine no more"


def test_who_was_held_up_does_not_go_on():
    rig = rig_at(SwingPhase.RECORDING)
    rig.now += 2.0
    assert "this node was held up for 2" in rig.cycle().failure


def test_a_goal_that_never_ends_is_given_up():
    rig = Rig()
    rig.arrives_after = math.inf
    search = rig.run(lambda search: search.phase is SwingPhase.ENDED, 200.0)
    assert search.failure.startswith("the move has not ended after 120")


def test_too_few_samples_are_told():
    rig = rig_at(SwingPhase.RECORDING, SwingSettings(duration=0.5))
    rig.feels = False
    for _ in range(300):
        rig.cycle()
    rig.feels = True
    search = rig.to(SwingPhase.ENDED)
    assert search.failure == "0 samples have come on /imu in 0.5 s, at least 10 are needed"


def test_the_first_reason_for_an_end_stays():
    rig = rig_at(SwingPhase.MOVING)
    rig.search.end("calibration_node ends")
    rig.search.goal_ended(has_arrived=False, text="cancelled")
    assert rig.cycle().failure == "calibration_node ends"
