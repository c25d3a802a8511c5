"""The mechanisms tab on a real page server."""

from __future__ import annotations

import itertools
import math
import time
from concurrent.futures import Executor, Future

import numpy as np
import pytest
from mechanisms_rig import CONFIG, Rig

from tri_glide_kinematics.panel.mechanisms.show import Show
from tri_glide_kinematics.panel.mechanisms.tab import NONE, example_files, shown_of, view_of
from tri_glide_kinematics.settings import IK_NODE


@pytest.fixture(scope="module")
def rig(server):
    return Rig(server)


@pytest.mark.parametrize("size", [(956, 720), (316, 480), (360, 640), (800, 800)])
def test_the_machine_and_the_drawing_are_in_view(size):
    width, height = size
    fov = math.radians(75.0)
    (x, y, z), look_at = view_of(fov, width / height)
    assert look_at == (x, 0.0, z)
    lower, upper = (
        next(each.default for each in IK_NODE if each.name == name)
        for name in ("lower_heights", "upper_heights")
    )
    # Towers of the machine, and the corners of the drawing.
    corners = [(side, z) for side in (-0.3, 0.3) for z in (min(lower), max(upper))]
    corners += [(side, z) for side in (0.55, 1.25) for z in (0.1, 0.8)]
    for across, up in corners:
        tangent = math.tan(0.5 * fov) * -y
        assert abs(across - x) < tangent * width / height
        assert abs(up - z) < tangent


def segment_lengths(lines):
    return np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)


def test_all_positions_are_drawn_and_the_followed_one_by_itself(rig):
    rig.choose("f_mechanism_example_2")
    rig.turn(146.0)
    rig.wait_for(lambda: "of 4" in rig.tab.words.content, "four positions")
    # Three legs of two links and three sides each.
    assert rig.points("followed").shape == (9, 2, 3)
    assert rig.points("others").shape == (27, 2, 3)
    # To one scale.
    lengths = segment_lengths(rig.points("followed"))[:6]
    assert lengths / lengths[0] * 0.019 == pytest.approx(
        [0.019, 0.014, 0.016, 0.035, 0.034, 0.054], rel=1e-4
    )
    assert np.ptp(rig.points("path_2")[:, 0], axis=0).max() <= 0.85


def test_the_followed_position_turns_on_its_branch(rig):
    rig.choose("f_mechanism_example_2")
    rig.turn(140.0)
    rig.wait_for(lambda: "of 4" in rig.tab.words.content, "four positions")
    assert "The cranks turn fully" in rig.tab.words.content
    assert not rig.is_visible("marks")
    rig.tab.follow_next()
    rig.tab.follow_next()
    rig.wait_for(lambda: "Position 2 of 4" in rig.tab.words.content, "the second position")
    rig.wait_for(lambda: rig.is_visible("marks"), "turning points")
    words = rig.tab.words.content
    assert "The cranks turn back at" in words
    assert "169.6°" in words and "135°" in words
    assert len(rig.points("marks")) == 4
    # Beyond its turning points the branch has no position; others have.
    rig.turn(172.0)
    rig.wait_for(lambda: "does not come to" in rig.tab.words.content, "the end of the branch")
    assert not rig.is_visible("followed")
    assert rig.is_visible("others")
    rig.turn(150.0)
    rig.wait_for(lambda: rig.is_visible("followed"), "the branch again")
    tips = rig.points("tips")
    way = np.linalg.norm(rig.points("path_0")[:, 0] - tips[0], axis=1)
    assert way.min() < 0.01


LATER = itertools.count(60.0, 60.0)  # s


def played(rig, speed, seconds):
    """Let the crank turn by itself in a time to come; return where the slider stood [deg]."""
    rig.tab.speed.value = speed
    rig.tab.plays.value = True
    seen = []
    for now in time.monotonic() + next(LATER) + np.arange(0.0, seconds, 0.06):
        rig.tab.step(now)
        seen.append(rig.tab.crank.value)
    return seen


def test_playing_goes_through_turning_points_and_back(rig):
    rig.choose("four_bar_sheet")
    seen = played(rig, 180.0, 3.0)
    assert 29.0 <= min(seen) < 35.0 and 114.0 < max(seen) <= 120.0
    # The slider shows the angle and is not to be dragged meanwhile.
    assert rig.tab.crank.disabled
    assert "crossed" in rig.tab.words.content
    rig.tab.plays.value = False
    rig.wait_for(lambda: not rig.tab.crank.disabled, "the slider")


def test_a_length_changes_the_drawing_and_comes_back_to_that_of_the_file(rig):
    rig.choose("four_bar_textbook")
    before = rig.points("followed")
    path = rig.points("path_0")
    assert "Crank-rocker" in rig.tab.words.content
    rig.tab.sliders[0].value = 22.5
    rig.wait_for(
        lambda: (
            len(rig.points("path_0")) != len(path) or not np.allclose(rig.points("path_0"), path)
        ),
        "another coupler curve",
    )
    lengths = segment_lengths(rig.points("followed"))
    assert lengths[0] / lengths[2] == pytest.approx(22.5 / 70.0, rel=1e-4)
    rig.tab.reset()
    rig.wait_for(
        lambda: (
            rig.points("followed").shape == before.shape
            and np.allclose(rig.points("followed"), before, atol=1e-6)
        ),
        "the drawing of the file",
    )


def test_what_cannot_be_assembled_is_said_in_words_and_the_last_drawing_goes(rig):
    rig.choose("four_bar_textbook")
    rig.tab.sliders[2].value = 220.0
    rig.wait_for(lambda: "rocker = 0.22 m must be shorter" in rig.tab.words.content, "the reason")
    assert not rig.is_visible("followed")
    rig.tab.reset()
    rig.wait_for(lambda: rig.is_visible("followed"), "the linkage")
    assert "must be" not in rig.tab.words.content


def test_beyond_a_limit_the_reason_is_told_and_the_branch_stays(rig):
    rig.choose("four_bar_sheet")
    rig.turn(0.0)
    rig.wait_for(lambda: "crank_angle = 0 rad is beyond" in rig.tab.words.content, "the reason")
    assert not rig.is_visible("followed") and not rig.is_visible("others")
    assert rig.is_visible("path_0") and rig.is_visible("marks")
    rig.turn(60.0)
    rig.wait_for(lambda: rig.is_visible("followed"), "the linkage")
    assert "crossed" in rig.tab.words.content


def test_none_takes_everything_away(rig):
    rig.choose("four_bar_textbook")
    rig.tab.choice.value = NONE
    rig.wait_for(lambda: not rig.tab.drawing.root.visible, "an empty scene")
    assert rig.tab.words.content == ""
    assert rig.tab.sliders == []


class LateWorker(Executor):
    """Does what it is asked for when somebody says so."""

    def __init__(self):
        self.asked = []

    def submit(self, work, *arguments):
        self.asked.append((Future(), work, arguments))
        return self.asked[-1][0]

    def finish(self):
        future, work, arguments = self.asked[-1]
        future.set_result(work(*arguments))


def test_of_many_branches_that_are_wanted_the_newest_is_traced_behind_the_first():
    shown, worker = shown_of(example_files(CONFIG)["four_bar_textbook"]), LateWorker()
    show = Show(shown, worker)
    values = [item.value for item in shown.dimensions]
    for part in (1.0, 1.01, 1.02, 1.03):
        show.change([part * values[0], *values[1:]])
        assert show.step(), "positions are there at once"
    assert [arguments[0][0] for *_, arguments in worker.asked] == [values[0]]
    for _ in range(2):
        worker.finish()
        show.step()
    assert [arguments[0][0] for *_, arguments in worker.asked] == [values[0], 1.03 * values[0]]
    assert show.branch is not None


def test_the_crank_turns_with_the_speed_that_is_asked_for(rig):
    rig.choose("four_bar_textbook")
    turns = np.unwrap(np.radians(played(rig, 90.0, 4.0)))
    assert math.degrees(turns[-1] - turns[0]) == pytest.approx(4.0 * 90.0, rel=0.05)
