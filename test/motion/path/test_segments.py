"""Lines and arcs as programmed."""

import math
from itertools import pairwise

import numpy as np
import pytest

from testing.path_samples import part_of, random_path, unit
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import NoArcError, PlatformPath, ShortSegmentError
from tri_glide_kinematics.motion.path.segments import arc_about, arc_through, joined, line


def along(segment, start, way):
    """Return the point at a way [m] from the start, by the module's formula."""
    angle = segment.curvature * way
    if angle == 0.0:
        return np.array(start) + way * np.array(segment.tangent)
    ahead = math.sin(angle) * np.array(segment.tangent)
    aside = (1.0 - math.cos(angle)) * np.array(segment.normal)
    return np.array(start) + (ahead + aside) / segment.curvature


def test_an_arc_goes_through_its_points():
    rng = np.random.default_rng(1)
    for _ in range(100):
        centre, axis, radius = rng.normal(size=3), unit(rng), 10.0 ** rng.uniform(-3.0, 1.0)
        first = np.cross(axis, unit(rng))
        first /= np.linalg.norm(first)
        second = np.cross(axis, first)
        angle = rng.uniform(0.01, 2.0 * math.pi - 0.01)
        part = rng.uniform(0.1, 0.9)

        turns = np.array(((0.0,), (part * angle,), (angle,)))
        points = centre + radius * (np.cos(turns) * first + np.sin(turns) * second)
        start, via, end = map(tuple, points.tolist())
        arc = arc_through(0, start, via, end, 0.0)
        size = radius + 1.0
        assert arc.length == pytest.approx(radius * angle, abs=1e-9 * size)
        assert arc.curvature == pytest.approx(1.0 / radius, rel=1e-6)
        for fraction, point in ((part, via), (1.0, end)):
            place = along(arc, start, arc.length * fraction)
            assert place == pytest.approx(np.array(point), abs=1e-8 * size)
        for vectors in ((arc.tangent, arc.normal), (arc.end_tangent, arc.end_normal)):
            assert np.array(vectors) @ np.array(vectors).T == pytest.approx(np.eye(2), abs=1e-12)
        inwards = (centre - np.array(end)) / radius
        assert np.array(arc.end_normal) == pytest.approx(inwards, abs=1e-6)


@pytest.mark.parametrize("turns", [0.25, -0.25, 1.0, -3.0, 12.5])
@pytest.mark.parametrize("rise", [0.0, 0.01, -0.02, 3.0])
def test_an_arc_and_a_helix_are_the_mathematical_ones(turns, rise):
    rng = np.random.default_rng(3)
    for _ in range(5):
        axis, middle, radius = unit(rng), rng.uniform(-0.1, 0.1, 3), rng.uniform(0.001, 0.1)
        out = np.cross(axis, unit(rng))
        out /= np.linalg.norm(out)
        beside = np.cross(axis, out)
        start = middle + radius * out + rng.uniform(-1.0, 1.0) * axis
        angle = 2.0 * math.pi * turns
        path = PlatformPath.start(start).arc_about(middle, 5.0 * axis, angle, rise=rise)

        assert path.segments.is_helical == (rise != 0.0)
        assert path.length == pytest.approx(math.hypot(radius * angle, rise), rel=1e-12)
        parts = np.linspace(0.0, 1.0, 200)
        turned = angle * parts[:, np.newaxis]
        expected = start + parts[:, np.newaxis] * rise * axis
        expected += radius * ((np.cos(turned) - 1.0) * out + np.sin(turned) * beside)
        found = path.position(parts * path.length)
        assert np.linalg.norm(found - expected, axis=1).max() < 1e-12
        assert path.end == pytest.approx(expected[-1], abs=1e-12)
        along = (
            angle * radius * (np.cos(turned) * beside - np.sin(turned) * out) + rise * axis
        ) / (path.length)
        assert path.tangent(parts * path.length) == pytest.approx(along, abs=1e-12)


def test_a_full_circle_ends_where_it_begins():
    start = (0.1, 0.2, 0.3)
    arc = arc_about(0, start, (0.0, 0.2, 0.3), (0.0, 1.0, 0.0), 2.0 * math.pi, 0.0)
    assert math.dist(arc.end, start) < 1e-15


@pytest.mark.parametrize(
    ("via", "end", "number"),
    [
        ((0.05, 0.0, 0.0), (0.1, 0.0, 0.0), "inf m"),
        ((0.2, 0.0, 0.0), (0.1, 0.0, 0.0), "inf m"),
        ((0.05, 1e-7, 0.0), (0.1, 0.0, 0.0), "12500 m"),
    ],
)
def test_no_arc_through_points_on_a_line(via, end, number):
    with pytest.raises(NoArcError, match=rf"segment 3 is no arc: .*{number}.*at most 1000 m"):
        arc_through(2, (0.0, 0.0, 0.0), via, end, 0.0)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: arc_through(0, *((0, 0, 0), (0, 0, 0), (1, 0, 0)), 0.0), "segment 1 ends where"),
        (lambda: arc_through(0, *((0, 0, 0), (1, 0, 0), (1, 0, 0)), 0.0), "segment 1 ends where"),
        (lambda: arc_through(0, *((0, 0, 0), (1, 0, 0), (0, 0, 0)), 0.0), "segment 1 ends where"),
        (lambda: arc_about(0, (0, 0, 0), (1, 0, 0), (0, 0, 1), 0.0, 0.0), "0 m long"),
        (lambda: line(7, (0, 0, 0), (0, 0, 5e-10), 0.0), "segment 8 .* 5e-10 m long, at least 1e"),
    ],
)
def test_nothing_without_length(make, text):
    with pytest.raises(ShortSegmentError, match=text):
        make()


@pytest.mark.parametrize(
    ("centre", "axis", "angle", "text"),
    [
        ((1, 0, 0), (0, 0, 0), 1.0, "length of its axis = 0"),
        ((0, 0, 7), (0, 0, 1), 1.0, "begins on its axis, its radius = 0 m"),
        ((5000, 0, 0), (0, 0, 1), 1.0, "radius = 5000 m must be at most 1000 m"),
    ],
)
def test_no_arc_about_nothing(centre, axis, angle, text):
    with pytest.raises(NoArcError, match=text):
        arc_about(0, (0.0, 0.0, 0.0), centre, axis, angle, 0.0)


def test_reversed_segments_are_the_same_backwards():
    path = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0), 1e-3, 0.2)
    path = path.arc_to((0.1, 0.05, 0.02), (0, 0.1, 0), 2e-3).line_to((0, 0.2, 0), 3e-3, 0.1)
    helix = PlatformPath.start((0, 0, 0)).arc_about((0.1, 0, 0), (0, 0, 1), 8.0, rise=0.05)
    ways = np.linspace(0.0, helix.length, 50)
    back = helix.reversed().position(helix.length - ways)
    assert back == pytest.approx(helix.position(ways), abs=1e-15)
    forwards, backwards = path.segments, path.segments.reversed()
    assert backwards.points.tolist() == forwards.points[::-1].tolist()
    assert backwards.tolerances.tolist() == [2e-3, 1e-3, 3e-3]
    assert backwards.speeds.tolist() == [0.1, math.inf, 0.2]
    assert backwards.tangents[1] == pytest.approx(-forwards.end_tangents[1])
    twice = backwards.reversed()
    for name in ("points", "lengths", "tangents", "normals", "tolerances", "end_normals", "rises"):
        assert (getattr(twice, name) == getattr(forwards, name)).all()


@pytest.mark.parametrize(("arcs", "helices"), [(0.0, 0.0), (0.4, 0.0), (0.4, 0.3)])
def test_parts_joined_are_the_whole(arcs, helices):
    whole = random_path(np.random.default_rng(2), 30, arcs, helices=helices)[0].segments
    parts = [part_of(whole, *ends) for ends in pairwise((0, 1, 20, 30))]
    for found in (joined(iter(parts)), joined(parts[::-1], backwards=True), joined([whole])):
        made = at_once(found)
        for name in whole.__dataclass_fields__:
            assert (getattr(made, name) == getattr(whole, name)).all()
    assert whole.is_curved == (arcs > 0.0)
    assert whole.is_helical == (helices > 0.0)
    # Between two parts others may have their turn.
    assert len(list(joined(parts))) == len(parts)
