"""The picture of a motion names what is marked, and its labels do not cover each other."""

from itertools import combinations

import numpy as np

from tri_glide_kinematics.figures import Mark, Span, file_figure, motion_figure
from tri_glide_kinematics.motion.limit_use import CommandStream
from tri_glide_kinematics.motion.limits import SliderLimits

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


def test_a_file_has_two_views_and_four_courses_with_their_limits():
    count = 20_000
    times = np.linspace(0.0, 10.0, count)
    heights = 0.6 + np.stack([0.1 * np.sin(times + phase) for phase in (0.0, 1.0, 2.0)], axis=1)
    stream = CommandStream.from_heights(heights, 5e-4)
    path = np.column_stack((0.05 * np.cos(times), 0.05 * np.sin(times), 0.3 + 0.001 * times))
    travel = ((0.3,) * 3, (0.9,) * 3)
    rests = [Span("rest", 2.0, 3.0), Span("rest", 5.0, 6.0)]
    figure = file_figure(stream, path, LIMITS, travel, rests, "part.nc")
    figure.draw_without_rendering()
    above, side, *courses = figure.axes
    assert (above.get_ylabel(), side.get_ylabel()) == ("y [mm]", "z [mm]")
    np.testing.assert_allclose(above.lines[0].get_xydata()[[0, -1], 0], 50.0 * np.cos([0.0, 10.0]))
    assert [axes.get_ylabel().split()[0] for axes in courses] == [
        "height",
        "velocity",
        "acceleration",
        "jerk",
    ]
    assert [text.get_text() for text in courses[0].texts] == ["rest", "rest"]
    for axes, values in zip(courses, (heights, stream.velocities)):
        # Fewer points are drawn, and the lowest and the highest are among them.
        drawn = axes.lines[1].get_ydata()
        assert len(drawn) < count
        assert (drawn.min(), drawn.max()) == (values[:, 1].min(), values[:, 1].max())
        assert (np.diff(axes.lines[1].get_xdata()) > 0.0).all()
