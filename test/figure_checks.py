"""What tests ask of a figure."""

import numpy as np


def lines_labelled(axes, start):
    """Lines whose label begins with ``start``, in the order in which they were drawn."""
    return [line for line in axes.lines if line.get_label().startswith(start)]


def without_gaps(line):
    """Points of a line, shape (n, 2)."""
    points = line.get_xydata()
    return points[~np.isnan(points).any(axis=1)]


def edges(polygon):
    """Lengths of the edges of a closed polygon, shape (n + 1, 2)."""
    return np.hypot(*np.diff(polygon, axis=0).T)


def assert_equal_scales(figure):
    """Check that a unit is as long upwards as sideways in all axes, in pixels."""
    figure.draw_without_rendering()
    for axes in figure.axes:
        origin, right, up = axes.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
        np.testing.assert_allclose(np.hypot(*(right - origin)), np.hypot(*(up - origin)))
        low, high = axes.dataLim.get_points()
        (left, end), (bottom, top) = axes.get_xlim(), axes.get_ylim()
        assert left <= low[0] and high[0] <= end and bottom <= low[1] and high[1] <= top
