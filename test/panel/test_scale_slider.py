"""A slider for a factor sends the newest value, when the one before is answered."""

from __future__ import annotations

import pytest
from panel_rig import FACTS

from tri_glide_kinematics.panel.operator_requests import ScaleSlider

pytestmark = pytest.mark.nodes

NAME, LABEL = "path_speed_scale", "Override [%]"
HELD = FACTS.with_changes({NAME: 0.4})


class Link:
    """Takes parameters, and answers when it is told to."""

    def __init__(self):
        self.is_there = True
        self.sent = []
        self.answer = None

    def set_parameters(self, what, values, then):
        assert what == "override"
        if self.is_there:
            self.sent.append(values[NAME])
            self.answer = then
        return self.is_there


@pytest.fixture
def link(rig):
    link = rig.requests.link = Link()
    return link


@pytest.fixture
def slider(rig, link):
    return ScaleSlider(rig.requests, "Override", 200, NAME)


def shown(rig, slider):
    """Return what the slider shows of a machine that has 40 %."""
    slider.show(HELD)
    return rig.handle(LABEL).value


def test_the_newest_value_is_sent_when_the_one_before_is_answered(rig, link, slider):
    for percent in (50, 60, 70):
        rig.press(LABEL, percent)
    assert link.sent == [0.5]
    # The newest may hold, though one before was refused.
    link.answer(False)
    assert link.sent == pytest.approx([0.5, 0.7])
    # What the machine tells meanwhile may be older.
    assert shown(rig, slider) == 70
    link.answer(True)
    assert shown(rig, slider) == 40
    rig.press(LABEL, 80)
    assert link.sent == pytest.approx([0.5, 0.7, 0.8])
    link.answer(False)
    assert shown(rig, slider) == 40


def test_a_value_that_nobody_takes_is_shown_no_more_and_holds_up_no_other(rig, link, slider):
    link.is_there = False
    rig.press(LABEL, 50)
    assert shown(rig, slider) == 40
    link.is_there = True
    rig.press(LABEL, 60)
    assert link.sent == [0.6]
