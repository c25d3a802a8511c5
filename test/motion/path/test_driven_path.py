"""Laws of the path as driven, over paths at random."""

from itertools import pairwise

import numpy as np
import pytest
from soak import many

from testing.path_samples import agree_until, dense_ways, distances, random_path, sides_of_breaks
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import DrivenPath, PlatformPath, ShapedCorners
from tri_glide_kinematics.motion.path.corners import FARTHEST_SWING, SWING_REACH

# The last of ten have helices.
PATHS = [
    random_path(np.random.default_rng(seed), helices=0.5 if seed % 10 > 7 else 0.0)
    for seed in range(many(40))
]


@pytest.mark.parametrize("number", range(0, len(PATHS), 10))
def test_no_place_is_farther_from_the_programmed_path_than_the_tolerance(number):
    used = []
    for path, pieces in PATHS[number : number + 10]:
        driven = path.driven
        places = driven.derivatives(dense_ways(driven), 0)[0]
        away = np.min([distances(places, piece) for piece in pieces], axis=0)
        assert away.max() <= driven.deviation_bound + 1e-12
        # At each joint its own tolerance holds; between, the larger one of all.
        assert away.max() <= driven.tolerances[:-1].max(initial=0.0) + 1e-12
        joints = driven.rounded
        at_joints = driven.derivatives(joints.ways, 0)[0]
        away = np.min([distances(at_joints, piece) for piece in pieces], axis=0)
        assert (away <= joints.tolerances + 1e-12).all()
        used.extend(away / joints.tolerances)
    # A path that stayed on the programmed one would not be wrong, but of no use.
    assert np.median(used) > 0.2


def test_between_joints_the_larger_of_their_tolerances_holds():
    points = [(0, 0, 0), (0.05, 0, 0), (0.05, 0.05, 0), (0.1, 0.05, 0), (0.1, 0.1, 0.05)]
    path = PlatformPath.start(points[0])
    tolerances = [1e-4, 8e-3, 2e-4, 0.0]
    for point, tolerance in zip(points[1:], tolerances):
        path = path.line_to(point, tolerance)
    driven = path.driven
    ways = dense_ways(driven, 20_000)
    programmed = np.array(points)[driven.segment_of(ways)]
    programmed = (
        programmed
        + driven.segments.tangents[driven.segment_of(ways)]
        * ((ways - driven.joints[driven.segment_of(ways)])[:, np.newaxis])
    )
    apart = np.linalg.norm(driven.derivatives(ways, 0)[0] - programmed, axis=1)
    at_ends = np.array([0.0, *tolerances])
    allowed = np.maximum(at_ends[:-1], at_ends[1:])[driven.segment_of(ways)]
    # Of a corner that stands alone, the distance counts, not the one at the same way.
    assert (apart <= 1.42 * allowed + 1e-15).all()


def test_curvature_is_continuous_where_the_path_does_not_stop():
    for path, _ in PATHS:
        left, right, scale = sides_of_breaks(path.driven)
        assert left[0] == pytest.approx(right[0], abs=1e-13)
        assert left[1] == pytest.approx(right[1], abs=1e-11)
        assert left[2] == pytest.approx(right[2], abs=1e-11 * scale)


def test_derivatives_are_those_of_the_positions():
    rng = np.random.default_rng(3)
    for path, _ in PATHS[::4]:
        driven = path.driven
        lengths = np.diff(driven.breaks)
        pieces = np.flatnonzero(lengths > 1e-5)
        parts = rng.uniform(0.3, 0.7, len(pieces))
        ways = driven.breaks[pieces] + parts * lengths[pieces]
        step = 1e-3 * lengths[pieces]
        assert (driven.spans_of(ways) == pieces).all()
        values = driven.derivatives(ways, 5)
        above, below = driven.derivatives(ways + step, 5), driven.derivatives(ways - step, 5)
        for order in range(5):
            found = (above[order] - below[order]) / (2.0 * step[:, np.newaxis])
            scale = np.abs(values[order + 1 :]).max(axis=(0, 2)) * 1e-5
            scale += 1e-15 * np.abs(values[order]).max() / step
            assert (np.abs(found - values[order + 1]).max(axis=1) <= 10.0 * scale + 1e-9).all()


def test_the_way_driven_is_never_much_shorter():
    for path, _ in PATHS:
        driven = path.driven
        rates = np.linalg.norm(driven.derivatives(dense_ways(driven), 1)[1], axis=1)
        assert rates.min() > 0.15
        bounds = driven.bounds_on(slice(None))
        pieces = driven.spans_of(dense_ways(driven))
        assert (rates <= bounds.rates[pieces] + 1e-12).all()
        assert (rates >= bounds.least_rates[pieces] - 1e-12).all()
        bends, thirds = np.linalg.norm(driven.derivatives(dense_ways(driven))[2:], axis=2)
        assert (bends <= bounds.bends[pieces] * (1.0 + 1e-9) + 1e-9).all()
        assert (thirds <= bounds.thirds[pieces] * (1.0 + 1e-9) + 1e-9).all()


def test_a_reversed_path_is_driven_through_the_same_places():
    for path, _ in PATHS[::2]:
        driven, backwards = path.driven, path.reversed().driven
        ways = dense_ways(driven, 500)
        there = driven.derivatives(ways, 0)[0]
        back = backwards.derivatives(driven.length - ways, 0)[0]
        assert back == pytest.approx(there, abs=1e-12)
        assert backwards.stops == pytest.approx(driven.length - driven.stops[::-1], abs=1e-12)


def test_points_on_the_lines_of_a_polyline_change_nothing():
    rng = np.random.default_rng(5)
    for _ in range(10):
        points = np.cumsum(rng.normal(size=(12, 3)) * 0.03, axis=0)
        finer = [points[0]]
        for start, end in pairwise(points):
            parts = np.sort(rng.uniform(0.05, 0.95, rng.integers(0, 5)))
            finer.extend(start + part * (end - start) for part in parts)
            finer.append(end)
        tolerance = 10.0 ** rng.uniform(-4.3, -2.0)
        coarse = PlatformPath.through(points, tolerance).driven
        fine = PlatformPath.through(finer, tolerance).driven
        assert fine.length == pytest.approx(coarse.length, abs=1e-13)
        assert len(fine.stops) == len(coarse.stops)
        ways = dense_ways(coarse, 1000)
        # On which side of a stop a way lies is up to rounding.
        ways = ways[np.abs(ways[:, np.newaxis] - coarse.stops).min(axis=1) > 1e-9]
        there = coarse.derivatives(ways, 2)
        here = fine.derivatives(ways, 2)
        assert here[0] == pytest.approx(there[0], abs=1e-11)
        assert here[1] == pytest.approx(there[1], abs=1e-8)


def test_stops_are_where_a_corner_has_no_tolerance_or_turns_back():
    path = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0)).line_to((0.2, 0, 0), 1e-3)
    path = path.line_to((0.2, 0.1, 0), 1e-3).line_to((0.2, 0.0, 1e-3), 1e-3).line_to((0.2, 0, 0.1))
    stops = path.driven.stops
    # The joint at 0.1 m is smooth; the corner at 0.2 m is rounded; that at 0.3 m turns back.
    assert stops[:2] == pytest.approx((0.0, 0.3))
    assert len(stops) == 3 and stops[2] == path.driven.length
    sharp = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0)).line_to((0.1, 0.1, 0)).driven
    assert sharp.stops == pytest.approx((0.0, 0.1, 0.2))
    assert sharp.state(0.1)[3:6] == (0.0, 1.0, 0.0)
    assert sharp.deviation_bound == 0.0


def test_a_tangent_arc_without_tolerance_is_a_stop_and_with_one_is_not():
    def path(tolerance):
        first = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0), tolerance)
        return first.arc_about((0.1, 0.02, 0), (0, 0, 1), np.pi / 2).driven

    assert len(path(0.0).stops) == 3
    rounded = path(1e-4)
    assert len(rounded.stops) == 2
    ways = np.linspace(0.0, rounded.length, 2001)
    second = rounded.derivatives(ways, 2)[2]
    assert np.abs(np.diff(second, axis=0)).max() < 2.0
    assert rounded.widths.half_widths == pytest.approx(np.sqrt(1e-4 * 0.02 * 3072 / 27))


def test_an_arc_that_goes_on_as_the_same_circle_needs_no_rounding():
    path = PlatformPath.start((0.1, 0, 0)).arc_about((0, 0, 0), (0, 0, 1), 1.0)
    path = path.arc_about((0, 0, 0), (0, 0, 1), 7.0).arc_about((0, 0, 0), (0, 0, 1), 0.3)
    assert path.driven.stops == pytest.approx((0.0, 0.83))
    assert path.length == pytest.approx(0.83, abs=1e-12)


def test_one_corner_is_as_wide_as_its_tolerance_allows():
    for angle in (0.1, 0.5, 1.0, np.pi / 2, 2.0, 2.6):
        end = (0.5 + 0.5 * np.cos(angle), 0.5 * np.sin(angle), 0.0)
        path = PlatformPath.start((0, 0, 0)).line_to((0.5, 0, 0), 1e-3).line_to(end)
        driven = path.driven
        height = 1e-3 / np.sin(min(angle, np.pi / 2))
        reach = min(SWING_REACH * 0.5, FARTHEST_SWING * height)
        assert driven.widths.reaches[0] == pytest.approx(reach, rel=1e-6)
        middle = driven.state(0.5)
        assert abs(middle[1]) <= 1e-3


def test_dense_points_of_a_circle_are_driven_nearly_as_the_circle():
    angles = np.linspace(0.0, 4.0, 801)
    points = 0.02 * np.column_stack((np.cos(angles), np.sin(angles), np.zeros(801)))
    driven = PlatformPath.through(points, 5e-5).driven
    assert len(driven.stops) == 2
    ways = np.linspace(0.02, driven.length - 0.02, 5001)
    _, _, second, third = driven.derivatives(ways)
    assert np.linalg.norm(second, axis=1) == pytest.approx(50.0, rel=0.02)
    # Of the circle itself it would be 2500.
    assert np.linalg.norm(third, axis=1).max() < 5000.0


def test_speed_limits_are_those_of_the_segments():
    path = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0), speed=0.5)
    path = path.line_to((0.2, 0, 0)).line_to((0.3, 0, 0), speed=0.2)
    limits = path.driven.speed_limits([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3])
    assert limits[[0, 1, 3, 5, 6]].tolist() == [0.5, 0.5, np.inf, 0.2, 0.2]
    joints = path.driven.speed_limits(path.driven.joints)
    assert joints.tolist() == [0.5, 0.5, 0.2, 0.2]
    assert path.driven.segment_of(path.driven.joints).tolist() == [0, 1, 2, 2]


def test_a_longer_path_is_driven_the_same_far_from_where_it_was_extended():
    for number, (path, _) in enumerate(PATHS[:40]):
        other = PlatformPath.start(path.end).line_to(np.array(path.end) + 0.02)
        longer = path.then(other).driven
        until = agree_until(path.driven, longer)
        ways = np.linspace(0.0, until, 300)
        before = path.driven.derivatives(ways, 2)
        after = longer.derivatives(ways, 2)
        assert before[0] == pytest.approx(after[0], abs=1e-11), number
        assert agree_until(path.driven, path.driven) == path.driven.breaks[-1]
    square = PlatformPath.through([(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0)], 1e-3)
    more = square.then(PlatformPath.start(square.end).line_to((0, 0, 0)))
    # The corner where it ended has a rounding now, which reaches over 90 mm.
    assert agree_until(square.driven, more.driven) == pytest.approx(0.3 - 0.09)


@pytest.mark.parametrize("shaped", [None, ShapedCorners(0.3, rate=1.0, slowest=0.0, passing=1.0)])
def test_the_deviation_up_to_a_place_is_that_of_roundings_that_begin_before(shaped):
    path, _ = random_path(np.random.default_rng(4), count=40, stops=0.05)
    driven = at_once(DrivenPath.of(path.segments, shaped))
    begins = driven.rounded.ways - driven.widths.reaches
    for place in np.concatenate((np.linspace(0.0, driven.length, 200), driven.joints)).tolist():
        expected = driven.widths.deviations[begins < place].max(initial=0.0)
        if shaped is not None:
            segment = int(driven.segment_of(place))
            expected += (1.0 - shaped.part) * driven.tolerances[: segment + 1].max()
        assert driven.deviation_up_to(place) == pytest.approx(expected, abs=1e-15)
