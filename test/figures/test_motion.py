"""The picture of a motion names what is marked, and its labels do not cover each other."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from tri_glide_kinematics.figures import Mark, Span, motion_figure
from tri_glide_kinematics.motion.limit_use import CommandStream
from tri_glide_kinematics.motion.trajectory import SliderLimits

STYLE = {"marker": "o"}
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)


def test_labels_of_near_marks_stand_beside_each_other():
    turns = np.linspace(0.0, 6.0, 200)
    path = np.column_stack((0.05 * np.cos(turns), 0.05 * np.sin(turns), 0.3 - 0.01 * turns))
    marks = [Mark(name, path[row], STYLE) for name, row in (("E", 90), ("jog starts", 90))]
    marks.append(Mark("home", path[93], STYLE))
    stream = CommandStream.from_heights(np.full((50, 3), 0.6), 0.002)
    travel = ((0.3,) * 3, (0.9,) * 3)
    figure = motion_figure(stream, path, LIMITS, travel, marks, [Span("jog", 0.02, 0.06)])
    figure.draw_without_rendering()
    space = figure.axes[0]
    labels = {text.get_text(): text for text in space.texts}
    assert labels.keys() == {"E", "jog starts", "home"}
    boxes = [text.get_window_extent() for text in labels.values()]
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    assert [text.get_text() for text in figure.axes[1].texts] == ["jog"]
