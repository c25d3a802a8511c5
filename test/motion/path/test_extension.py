"""Paths with more behind them: as before up to a place, and all tolerances hold."""

from itertools import pairwise

import numpy as np
import pytest
from soak import some

from testing.calls import calls
from testing.path_samples import (
    Piece,
    agree_until,
    dense_ways,
    distances,
    part_of,
    random_path,
    sides_of_breaks,
)
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import ApartError, DrivenPath, PlatformPath


def check_as_before(before, after, place):
    ways = dense_ways(before)
    ways = ways[ways < place - 1e-12]
    for old, new in zip(before.derivatives(ways, 2), after.derivatives(ways, 2)):
        assert new == pytest.approx(old, abs=1e-11 * (1.0 + np.abs(old).max(initial=0.0)))
    assert agree_until(before, after) >= min(place, before.length) - 1e-9


def check_tolerances(driven, pieces):
    joints = driven.rounded
    assert (driven.widths.deviations <= joints.tolerances * (1.0 + 1e-12)).all()
    for places, allowed in (
        (dense_ways(driven), driven.deviation_bound),
        (joints.ways, joints.tolerances),
    ):
        points = driven.derivatives(places, 0)[0]
        away = np.min([distances(points, piece) for piece in pieces], axis=0)
        assert (away <= allowed + 1e-12).all()


def check_continuity(driven):
    left, right, scale = sides_of_breaks(driven)
    assert left[0] == pytest.approx(right[0], abs=1e-12)
    assert left[1] == pytest.approx(right[1], abs=1e-10)
    assert left[2] == pytest.approx(right[2], abs=1e-10 * scale)


@pytest.mark.slow
@pytest.mark.parametrize("seed", some(range(24), 5))
def test_up_to_the_place_it_stays_as_it_was(seed):
    rng = np.random.default_rng(seed)
    whole, pieces = random_path(rng, 24, stops=0.05)
    cuts = np.sort(rng.choice(np.arange(1, 24), 3, replace=False)).tolist()
    chunks = [part_of(whole.segments, *ends) for ends in pairwise([0, *cuts, 24])]
    driven, place = at_once(DrivenPath.of(chunks[0])), 0.0
    for chunk in chunks[1:]:
        place = rng.uniform(place, driven.length)
        after = at_once(driven.extended(chunk, place))
        check_as_before(driven, after, place)
        check_tolerances(after, pieces[: len(after.segments)])
        check_continuity(after)
        driven = after
    assert driven.length == pytest.approx(whole.segments.joints[-1], abs=1e-12)


@pytest.mark.parametrize("ahead", [1e-4, 3e-3, 0.02])
@pytest.mark.parametrize("noise", [0.0, 2e-6])
def test_dense_points_in_chunks_are_driven_without_a_stop(ahead, noise):
    rng = np.random.default_rng(1)
    angles = 0.005 * np.arange(201)
    points = 0.02 * np.column_stack((np.cos(angles), np.sin(angles), 0.1 * angles))
    points += noise * rng.normal(size=points.shape)
    tolerance = 5e-5
    driven = PlatformPath.through(points[:51], tolerance).driven
    pieces = [Piece(start, end, tolerance) for start, end in pairwise(points)]
    for first in range(50, 200, 50):
        more = PlatformPath.through(points[first : first + 51], tolerance).segments
        place = driven.length - ahead
        after = at_once(driven.extended(more, place))
        check_as_before(driven, after, place)
        driven = after
    assert len(driven.segments) == 200
    assert len(driven.stops) == 2
    assert driven.deviation_bound <= tolerance * (1.0 + 1e-12)
    check_continuity(driven)
    points = driven.derivatives(dense_ways(driven, 1000), 0)[0]
    away = np.min([distances(points, piece) for piece in pieces], axis=0)
    assert away.max() <= tolerance


def test_with_enough_room_it_is_driven_as_if_it_had_been_whole():
    points = [(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0), (0, 0, 0), (0.1, 0, 0.1)]
    whole = PlatformPath.through(points, 1e-3).driven
    more = PlatformPath.through(points[3:], 1e-3).segments
    longer = at_once(PlatformPath.through(points[:4], 1e-3).driven.extended(more, 0.2))
    ways = dense_ways(whole)
    found, expected = longer.derivatives(ways, 2), whole.derivatives(ways, 2)
    assert found == pytest.approx(expected, abs=1e-9)
    assert longer.arc_length.total == pytest.approx(whole.arc_length.total, abs=1e-12)


@pytest.mark.parametrize("room", [0.0, 0.9e-6, 1.1e-6, 1e-4])
def test_without_room_it_stops_where_it_ended(room):
    driven = PlatformPath.through([(0, 0, 0), (0.05, 0, 0), (0.1, 0, 0)], 1e-3).driven
    corner = PlatformPath.start((0.1, 0, 0)).line_to((0.1, 0.1, 0)).segments
    longer = at_once(driven.extended(corner, 0.1 - room))
    check_as_before(driven, longer, 0.1 - room)
    assert len(longer.stops) == (3 if room < 1e-6 else 2)
    # More behind it moves no stop that there is.
    back = PlatformPath.start((0.1, 0.1, 0)).line_to((0, 0, 0)).segments
    assert len(at_once(longer.extended(back, 0.1)).stops) == len(longer.stops) + 1
    straight = PlatformPath.start((0.1, 0, 0)).line_to((0.2, 0, 0)).segments
    assert len(at_once(driven.extended(straight, 0.1 - room)).stops) == 2


def test_without_tolerance_it_stops_where_it_ended():
    driven = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0)).driven
    more = PlatformPath.start((0.1, 0, 0)).line_to((0.1, 0.1, 0)).segments
    assert at_once(driven.extended(more, 0.0)).stops == pytest.approx((0.0, 0.1, 0.2))


def test_a_rounding_that_is_kept_up_to_the_end_makes_no_stop():
    # The window of the corner reaches to both ends.
    for end in ((0.01, 0.01, 0), (0.02, 0.001, 0)):
        path = PlatformPath.start((0, 0, 0)).line_to((0.01, 0, 0), 0.01).line_to(end, 0.01)
        driven = path.driven
        assert driven.widths.half_widths[0] == pytest.approx(driven.length - 0.01, rel=0.1)
        more = PlatformPath.start(end).line_to((0.0, 0.03, 0.01)).segments
        place = 0.9 * driven.length
        longer = at_once(driven.extended(more, place))
        check_as_before(driven, longer, place)
        assert len(longer.stops) == 2
        assert longer.widths.half_widths[1] > 1e-4


def test_what_begins_elsewhere_is_refused():
    driven = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0)).driven
    more = PlatformPath.start((0.1, 1e-6, 0)).line_to((0.1, 0.1, 0)).segments
    with pytest.raises(ApartError, match=r"at most"):
        at_once(driven.extended(more, 0.0))


def test_behind_ten_thousand_points_no_call_is_made_for_each_of_them():
    angles = np.linspace(0.0, 50.0, 10_001)
    points = 0.02 * np.column_stack((np.cos(angles), np.sin(angles), angles / 20.0))
    driven = PlatformPath.through(points[:-50], 1e-4).driven
    more = PlatformPath.through(points[-51:], 1e-4).segments
    made = []
    work = calls(lambda: made.append(at_once(driven.extended(more, driven.length - 0.02))))
    (longer,) = made
    assert len(longer.segments) == 10_000 and len(longer.stops) == 2
    assert work.total() < len(longer.segments)
