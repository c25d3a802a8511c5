"""A path out of flat arrays is the path that the same calls make, however it is cut into pieces."""

import math
import random

import numpy as np
import pytest

from testing.calls import most_calls_of_a_piece
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import FlatPath, PlatformPath, SegmentKind, polyline_from

START = (0.0, 0.0, 0.25)
LINE, ARC_THROUGH, ARC_ABOUT, HELIX_ABOUT = SegmentKind


def flat(kinds, numbers, tolerances=(), speeds=(), default=0.001):
    return FlatPath.of(kinds, numbers, tolerances, speeds, default)


def path_of(*arguments, **named):
    return at_once(flat(*arguments, **named).path_from(START))


def assert_same(first, second):
    for name in first.segments.__dataclass_fields__:
        np.testing.assert_allclose(
            getattr(first.segments, name), getattr(second.segments, name), atol=1e-15
        )


@pytest.mark.parametrize("lines", [1, 5, 40])
def test_it_is_the_path_of_the_same_calls(lines):
    source = random.Random(lines)
    kinds, numbers, tolerances, speeds = [], [], [], []
    path = PlatformPath.start(START)

    def point():
        return [source.uniform(-0.05, 0.05) for _ in range(3)]

    for number in range(120):
        tolerances.append(source.choice((0.0, 0.001, 0.002)))
        speeds.append(source.choice((0.0, 0.1)))
        bounds = tolerances[-1], speeds[-1] or None
        if number % (lines + 2) < lines:
            kinds.append(LINE)
            numbers += (end := point())
            path = path.line_to(end, *bounds)
        elif number % 2:
            kinds.append(ARC_THROUGH)
            numbers += (via := point()) + (end := point())
            path = path.arc_to(via, end, *bounds)
        else:
            centre, axis, angle = point(), point(), source.uniform(0.1, 7.0)
            rise = source.choice((0.0, 0.03))
            kinds.append(HELIX_ABOUT if rise else ARC_ABOUT)
            numbers += [*centre, *axis, angle, rise] if rise else [*centre, *axis, angle]
            path = path.arc_about(centre, axis, angle, *bounds, rise)
    assert_same(path_of(kinds, numbers, tolerances, speeds), path)


def test_one_tolerance_and_speed_stand_for_all_and_none_for_the_default():
    points = [0.01, 0.0, 0.25, 0.01, 0.02, 0.25]
    assert path_of([LINE] * 2, points).segments.tolerances.tolist() == [0.001] * 2
    assert path_of([LINE] * 2, points).segments.speeds.tolist() == [math.inf] * 2
    path = path_of([LINE] * 2, points, [0.002], [0.3])
    assert path.segments.tolerances.tolist() == [0.002] * 2
    assert path.segments.speeds.tolist() == [0.3] * 2


NAN, INF = math.nan, math.inf
BAD = {
    "empty": ([], [], (), (), "the path has 0 segments, at least 1"),
    "unknown": ([0, 7], [0.0] * 6, (), (), "segment 2 has kind 7, at most 3"),
    "too few": ([0, 1], [0.0] * 8, (), (), r"numbers has shape \(8,\).*\(9,\) for the kinds"),
    "too many": ([0], [0.0] * 4, (), (), r"numbers has shape \(4,\)"),
    "nan": ([0, 0], [0.0, 0.1, 0.2, 0.0, NAN, 0.0], (), (), "number 2 of segment 2 = nan"),
    "inf": ([0], [0.0, 0.0, INF], (), (), "number 3 of segment 1 = inf"),
    "huge": ([0], [0.0, 101.0, 0.0], (), (), "number 2 of segment 1 = 101.*at most 100"),
    "huge angle": ([2], [0.0] * 6 + [1e6], (), (), "number 7 of segment 1 = 1000000 must be"),
    "negative tolerance": ([0], [0.0] * 3, (-1.0,), (), r"tolerances\[0\] = -1 m"),
    "nan tolerance": ([0], [0.0] * 3, (NAN,), (), r"tolerances\[0\] = nan"),
    "tolerances": ([0] * 3, [0.0] * 9, (0.0, 0.0), (), r"tolerances has shape \(2,\)"),
    "too slow": ([0], [0.0] * 3, (), (1e-9,), r"speeds\[0\] = 1e-09 m/s"),
    "negative speed": ([0], [0.0] * 3, (), (-1.0,), r"speeds\[0\] = -1 m/s"),
    "infinite speed": ([0], [0.0] * 3, (), (INF,), r"speeds\[0\] = inf"),
    "repeated": ([0, 0], [0.0, 0.0, 0.3] * 2, (), (), "segment 2 ends where it begins"),
    "many repeated": ([0] * 40, [0.0, 0.0, 0.3] * 40, (), (), "segment 2 ends where it begins"),
    "no arc": ([1], [0.0, 0.0, 0.3, 0.0, 0.0, 0.4], (), (), "segment 1 is no arc"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_path_is_refused_with_the_place(name):
    *arguments, text = BAD[name]
    with pytest.raises(KinematicsError, match=text):
        path_of(*arguments)


@pytest.mark.parametrize("kind", [LINE, ARC_ABOUT])
def test_ten_thousand_segments_are_made_in_short_pieces(kind):
    if kind is LINE:
        angles = np.linspace(0.1, 60.0, 10_000)
        points = np.stack((np.cos(angles), np.sin(angles), angles / 60.0), axis=1)
        numbers = (0.05 * points).ravel()
    else:
        numbers = np.tile([0.01, 0.0, 0.25, 0.0, 0.0, 1.0, 0.1], 10_000)
    segments = flat(np.full(10_000, kind), numbers)
    made, calls = most_calls_of_a_piece(segments.path_from(START))
    assert made.count == 10_000
    assert calls < 6000


def test_a_polyline_begins_where_the_platform_is_and_repeated_points_count_once():
    points = np.array([START, START, (0.01, 0.0, 0.25), (0.01, 0.0, 0.25), (0.01, 0.02, 0.25)])
    path = at_once(polyline_from(START, points, 0.001))
    expected = PlatformPath.through([START, (0.01, 0.0, 0.25), (0.01, 0.02, 0.25)], 0.001)
    assert_same(path, expected)
    with pytest.raises(KinematicsError, match="all its points are where it begins"):
        at_once(polyline_from(START, points[:2], 0.001))
    # As the one who has given the points counts them.
    with pytest.raises(KinematicsError, match=r"points\[5\]\[2\] = nan"):
        at_once(polyline_from(START, np.array([*points, (0.0, 0.0, NAN)]), 0.001))
    with pytest.raises(KinematicsError, match=r"start\[2\] = nan"):
        at_once(polyline_from((0.0, 0.0, NAN), points, 0.001))


def test_a_first_point_beside_the_start_is_the_start():
    x, y, z = START
    path = path_of([0, 0], [x + 1e-7, y, z, 0.1, 0.0, 0.3], (1e-3,), ())
    assert path.count == 1
    assert path.end == (0.1, 0.0, 0.3)
