"""The demonstration of shapers measures how a platform comes to rest, and judges it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tri_glide_kinematics.demo import running
from tri_glide_kinematics.demo.calm_demo import PERIOD, Swing, is_calm, swing_figure, table
from tri_glide_kinematics.demo.client import DemoError
from tri_glide_kinematics.demo.running import save_page

REST, MOVING, FADING = 20, 100, 3000
SIZE, DECAY = 1e-3, 3.0  # m of swing, 1/s


def led():
    """Return setpoints that move by 0.1 m along x, between rests. Shape (n, 3) [m]."""
    x = np.concatenate((np.zeros(REST), 0.1 * np.arange(1, MOVING + 1) / MOVING, [0.1] * FADING))
    return np.column_stack((x, np.zeros(len(x)), np.full(len(x), 0.3)))


def swung(size=SIZE):
    """Return where a platform is that swings by a size [m] along y once it is there."""
    places = led()
    times = PERIOD * np.arange(FADING)
    places[-FADING:, 1] = size * np.exp(-DECAY * times) * np.cos(math.tau * 15.0 * times)
    return places


def swing(shaper="none", size=SIZE, motion="move"):
    return Swing.of(motion, shaper, led(), swung(size))


def test_what_is_left_and_when_it_is_gone():
    found = swing()
    assert found.arrival == pytest.approx(PERIOD * (MOVING - 1))
    assert found.left == pytest.approx(SIZE, rel=0.02)
    # The swing has faded to 50 µm.
    gone = found.arrival + math.log(SIZE / 50e-6) / DECAY
    assert found.settled == pytest.approx(gone, abs=1.0 / 15.0)
    assert swing(size=0.0).settled <= found.arrival


def test_the_time_may_count_from_later_on():
    late = Swing.of("stop", "none", led(), swung(), since=REST + 40)
    assert late.arrival == pytest.approx(PERIOD * (MOVING - 40), abs=2 * PERIOD)
    assert late.left == pytest.approx(SIZE, rel=0.02)
    assert swing().settled - late.settled == pytest.approx(40 * PERIOD, abs=2 * PERIOD)


def test_a_machine_that_rests_tells_nothing():
    with pytest.raises(DemoError, match="did not move"):
        Swing.of("move", "none", led()[:REST], led()[:REST])


@pytest.mark.parametrize(("size", "good"), [(5e-5, True), (9e-5, True), (2e-4, False)])
def test_a_shaper_has_to_take_the_swing_away(size, good):
    swings = [swing(), swing("ei", size)]
    assert is_calm(swings) is good
    late = replace(swings[1], times=swings[1].times + 5.0)
    assert not is_calm([swings[0], late])


def test_each_motion_is_judged_by_itself():
    others = [swing(), swing("ei", 1e-5), swing("none", 3e-3, "path")]
    # The same would be too much behind the move, which swings less without a shaper.
    assert is_calm([*others, swing("ei", 2e-4, "path")])
    assert not is_calm([*others, swing("ei", 4e-4, "path")])


def test_table_and_picture(tmp_path, monkeypatch):
    cases = [(shaper, motion) for shaper in ("none", "ei") for motion in ("move", "path")]
    swings = [swing(shaper, 1e-5, motion) for shaper, motion in cases]
    lines = table(swings).splitlines()
    rows = [["move", "none"], ["move", "ei"], ["path", "none"], ["path", "ei"]]
    assert [line.split()[:2] for line in lines[1:]] == rows
    monkeypatch.setattr(running, "save_figure", lambda figure, file, _: file.touch())
    assert save_page(tmp_path / "new", "calm", swing_figure(swings, 5e-5)).exists()
