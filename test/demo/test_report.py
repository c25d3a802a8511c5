"""The demonstration's table tells a good run from one that missed a target or broke a limit."""

import numpy as np
import pytest

from tri_glide_kinematics.demo.command import Leg, is_good, lost_before, table
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse
from tri_glide_kinematics.motion.limits import SliderLimits

LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
PERIOD, COUNT = 0.01, 40
TARGET = (0.0, 0.0, 0.3)


def stream(speed):
    """All sliders at one speed [m/s]."""
    heights = 0.6 + speed * PERIOD * np.arange(COUNT)
    return CommandStream.from_heights(np.tile(heights[:, np.newaxis], 3), PERIOD)


@pytest.mark.parametrize(
    ("reached", "speed", "good"),
    [(TARGET, 0.5, True), ((0.0, 0.0, 0.301), 0.5, False), (TARGET, 1.01, False)],
)
def test_a_leg_is_good_if_its_target_is_reached_inside_the_limits(reached, speed, good):
    use = LimitUse.of(stream(speed), LIMITS)
    leg = Leg("A", TARGET, reached, 1.0, 0, COUNT)
    assert is_good(leg, use, tolerance=1e-4) is good
    line = table([leg], use, LIMITS).splitlines()[1]
    assert line.startswith("A ")
    assert (">" in line) == (speed > 1.0)


@pytest.mark.parametrize(("deviation", "good"), [(0.00105, True), (0.00115, False)])
def test_a_leg_along_a_path_is_good_if_that_was_kept(deviation, good):
    use = LimitUse.of(stream(0.5), LIMITS)
    leg = Leg("path", TARGET, TARGET, 1.0, 0, COUNT, deviation, tolerance=0.001)
    assert is_good(leg, use, tolerance=1e-4) is good


def test_a_jog_has_no_target_to_miss():
    use = LimitUse.of(stream(0.5), LIMITS)
    leg = Leg("jog", None, TARGET, 1.0, 0, COUNT)
    assert is_good(leg, use, tolerance=1e-4)
    assert "(by twist)" in table([leg], use, LIMITS)


@pytest.mark.parametrize("row", [1, 3, COUNT // 2])
def test_commands_that_were_lost_are_seen_and_not_judged(row):
    """The whole jerk from rest on, then one acceleration."""
    times = 0.001 * np.arange(COUNT)
    jerked = np.minimum(times, 0.005)
    after = times - jerked
    speeds = 100.0 * jerked**2 + after
    heights = 0.6 + 100.0 * jerked**3 / 3.0 + 0.0025 * after + after**2 / 2.0
    rows = np.delete(np.column_stack([heights, speeds]), row, axis=0)
    commands = CommandStream.from_heights(np.tile(rows[:, :1], 3), 0.001)
    lost = lost_before(commands, np.tile(rows[:, 1:], 3), 200.0, 0.001)
    assert np.flatnonzero(lost).tolist() == [row]
    limits = SliderLimits.uniform(1.0, 10.0, 201.0)
    assert not LimitUse.of(commands, limits).is_within
    assert LimitUse.of(commands, limits, lost).is_within
