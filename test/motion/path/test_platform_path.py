"""Paths put together, and what is wrong with some."""

import math

import numpy as np
import pytest

from testing.calls import calls
from tri_glide_kinematics.errors import (
    NotANumberError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import (
    ApartError,
    EmptyPathError,
    NoArcError,
    PathError,
    PlatformPath,
    RepeatedPointError,
    ShortSegmentError,
)

START = PlatformPath.start((0.0, 0.0, 0.2))


def test_a_path_shows_what_it_is():
    path = START.line_to((0.1, 0, 0.2), 1e-3).line_to((0.1, 0.1, 0.2))
    assert repr(path) == "<PlatformPath, 2 segments, end (0.1, 0.1, 0.2) m>"
    assert repr(path.driven) == "<DrivenPath, 2 segments, 2 stops, within 1 mm>"


@pytest.mark.parametrize("way", [[[0.1]], np.zeros((2, 3)), [[0.1], [0.2, 0.3]], "nonsense"])
def test_ways_of_another_shape_are_refused(way):
    path = START.line_to((0.1, 0, 0.2))
    for ask in (path.position, path.tangent):
        with pytest.raises((WrongShapeError, NotANumberError), match="way"):
            ask(way)


def test_a_path_never_changes():
    first = START.line_to((0.1, 0, 0.2), 1e-3)
    left, right = first.line_to((0.1, 0.1, 0.2)), first.arc_to((0.12, -0.02, 0.2), (0.1, -0.1, 0.2))
    assert (START.count, first.count, left.count, right.count) == (0, 1, 2, 2)
    assert left.end == (0.1, 0.1, 0.2) and right.end == (0.1, -0.1, 0.2)
    assert len(first.driven.stops) == 2 and first.length == pytest.approx(0.1)
    assert len(left.driven.joints) == 3


def test_a_polyline_is_the_same_as_its_lines():
    points = np.random.default_rng(1).uniform(0.0, 0.2, (20, 3))
    path = PlatformPath.start(points[0])
    for point in points[1:]:
        path = path.line_to(point, 2e-3, 0.3)
    other = PlatformPath.through(points, 2e-3, 0.3)
    ways = np.linspace(0.0, path.driven.length, 500)
    assert other.driven.derivatives(ways) == pytest.approx(path.driven.derivatives(ways), abs=1e-6)
    assert other.position(other.length / 3) == pytest.approx(path.position(path.length / 3))
    assert other.segments.speeds.tolist() == [0.3] * 19
    mixed = PlatformPath.through(points[:9], 2e-3, 0.3)
    for point in points[9:]:
        mixed = mixed.line_to(point, 2e-3, 0.3)
    assert (mixed.segments.points == path.segments.points).all()


def test_a_polyline_does_not_follow_its_points_when_they_change():
    points = np.array([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.1, 0.0)])
    path = PlatformPath.through(points, 1e-3)
    points[:] = np.nan
    assert math.isfinite(path.length)


def test_joined_paths_meet():
    with pytest.raises(ApartError, match=r"0\.001 m from the end .* at most 1e-09 m") as caught:
        START.line_to((0.1, 0, 0.2)).then(
            PlatformPath.through([(0.1, 0, 0.201), (0.2, 0, 0.2)], 1e-3)
        )
    assert caught.value.distance == pytest.approx(1e-3)


def test_the_work_of_many_segments_is_linear():
    def work(count):
        angles = 0.005 * np.arange(count + 1)
        points = 0.02 * np.column_stack((np.cos(angles), np.sin(angles), 0.01 * angles))

        def make():
            path = PlatformPath.start(points[0])
            for point in points[1:].tolist():
                path = path.line_to(point, 1e-4)
            at_once(path.driven_in_pieces())
            assert path.driven is path.driven and len(path.segments) == count

        return calls(make).total()

    work(100)
    assert work(5_000) < 11.0 * work(500)


ORIGIN = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: PlatformPath.start((0, 0)), WrongShapeError, r"start has shape \(2,\)"),
        (lambda: PlatformPath.start((0, math.nan, 0)), NotFiniteError, r"start\[1\] = nan"),
        (lambda: PlatformPath.start((0, 0, 101)), OutOfBoundsError, r"start\[2\] = 101 .*100"),
        (lambda: START.driven, EmptyPathError, r"from \(0, 0, 0.2\) m has 0 segments, at least 1"),
        (lambda: START.reversed(), EmptyPathError, "0 segments"),
        (lambda: at_once(START.driven_in_pieces()), EmptyPathError, "0 segments"),
        (lambda: START.line_to((0, 0, 0.2)), ShortSegmentError, "segment 1 ends where it begins"),
        (lambda: START.line_to((1, math.inf, 0)), NotFiniteError, r"end of segment 1\[1\] = inf"),
        (lambda: START.line_to((1, 0, 0), -1e-3), OutOfBoundsError, "1 = -0.001 m must be at"),
        (lambda: START.line_to((1, 0, 0), math.nan), NotFiniteError, "tolerance of segment 1"),
        (lambda: START.line_to((1, 0, 0), 500.0), OutOfBoundsError, "tolerance of segment 1 = 500"),
        (lambda: START.line_to((1, 0, 0), speed=0), OutOfBoundsError, "1 = 0 m/s must be greater"),
        (lambda: START.line_to((1, 0, 0), speed=-1.0), OutOfBoundsError, "speed of segment 1 = -1"),
        (lambda: START.line_to((1, 0, 0), speed=math.inf), NotFiniteError, "speed of segment 1"),
        (lambda: START.arc_to((1, 0, 0.2), (2, 0, 0.2)), NoArcError, "1 is no arc: .* on one line"),
        (lambda: START.arc_to((0, 1, math.nan), (1, 0, 0)), NotFiniteError, "via of segment 1"),
        (lambda: START.arc_about((0, 0, 0), (0, 0, 1), 1.0), NoArcError, "begins on its axis"),
        (lambda: START.arc_about((1, 0, 0), (0, 0, 1), 1e9), OutOfBoundsError, "angle of segment"),
        (lambda: PlatformPath.through([]), WrongShapeError, "n at least 2"),
        (lambda: PlatformPath.through([(0, 0, 0)]), WrongShapeError, "n at least 2"),
        (lambda: PlatformPath.through([(0, 0), (1, 1)]), WrongShapeError, r"\(n, 3\)"),
        (lambda: PlatformPath.through([ORIGIN, (0, math.nan, 0)]), NotFiniteError, r"\[1\]\[1\] ="),
        (
            lambda: PlatformPath.through([ORIGIN, (0, 0, 200)]),
            OutOfBoundsError,
            r"\[1\]\[2\] = 200",
        ),
        (
            lambda: PlatformPath.through([(0, 0, 0), (1, 0, 0), (1, 0, 0), (2, 0, 0)]),
            RepeatedPointError,
            r"points\[1\] and points\[2\], the ends of segment 2, are the same, \(1, 0, 0\) m: 0 m",
        ),
    ],
)
def test_bad_input_is_named(make, error, text):
    with pytest.raises(error, match=text):
        make()


def test_errors_of_paths_are_one_family():
    for error in (ApartError, EmptyPathError, NoArcError, RepeatedPointError, ShortSegmentError):
        assert issubclass(error, PathError)
