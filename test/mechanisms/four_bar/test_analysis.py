import itertools
import math

import numpy as np
import pytest
from soak import many

from tri_glide_kinematics.mechanisms.four_bar import Branch, DeadCentreKind, FourBar, GrashofClass

ANGLES = np.linspace(-math.pi, math.pi, 20_001)


def random_lengths(rng, count, least, most):
    """Return lengths of linkages that can be assembled, less than ``count``. Shape (n, 4)."""
    lengths = rng.uniform(least, most, (many(count), 4))
    return lengths[2.0 * lengths.max(axis=1) <= 0.98 * lengths.sum(axis=1)]


def turns_fully(angles):
    """Whether a link's angle goes round: by brute force, over one turn of the curve."""
    return bool(abs(np.unwrap(angles)[-1] - np.unwrap(angles)[0]) > 6.0)


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [
        ((2.0, 5.0, 2.0, 5.0), GrashofClass.PARALLELOGRAM),
        ((5.0, 2.0, 5.0, 2.0), GrashofClass.PARALLELOGRAM),
        ((2.0, 2.0, 5.0, 5.0), GrashofClass.KITE),
        ((5.0, 5.0, 2.0, 2.0), GrashofClass.KITE),
        ((2.0, 5.0, 5.0, 2.0), GrashofClass.KITE),
        ((3.0, 3.0, 3.0, 3.0), GrashofClass.RHOMBUS),
        ((1.0, 4.0, 2.0, 5.0), GrashofClass.CHANGE_POINT),
        ((3.0, 2.0, 4.0, 5.0), GrashofClass.CHANGE_POINT),
        ((0.1, 0.3, 0.1, 0.1 + 0.2), GrashofClass.PARALLELOGRAM),
    ],
)
def test_grashof_class_of_change_points(lengths, expected):
    assert FourBar(*lengths).grashof_class is expected
    assert FourBar(*(0.37 * length for length in lengths)).grashof_class is expected


def test_the_tolerance_decides_what_is_a_change_point():
    lengths = (2.0, 5.0, 2.0, 5.0 * (1.0 + 1e-6))
    assert FourBar(*lengths).grashof_class is GrashofClass.TRIPLE_ROCKER
    assert FourBar(*lengths, tolerance=0.99e-6).grashof_class is GrashofClass.TRIPLE_ROCKER
    assert FourBar(*lengths, tolerance=1.01e-6).grashof_class is GrashofClass.PARALLELOGRAM


def test_grashof_class_agrees_with_what_the_links_do():
    full = {
        GrashofClass.CRANK_ROCKER: (True, False, False),
        GrashofClass.ROCKER_CRANK: (False, False, True),
        GrashofClass.DOUBLE_CRANK: (True, True, True),
        GrashofClass.DOUBLE_ROCKER: (False, True, False),
        GrashofClass.TRIPLE_ROCKER: (False, False, False),
    }
    rng = np.random.default_rng(4)
    seen = set()
    for lengths in random_lengths(rng, 150, 0.3, 3.0):
        linkage = FourBar(*lengths)
        seen.add(linkage.grashof_class)
        crank, coupler, rocker = full[linkage.grashof_class]
        assert linkage.crank_turns_fully is crank
        if crank:
            branch = linkage.sweep(ANGLES).open
            assert turns_fully(branch.rocker_angles) is rocker
            assert turns_fully(branch.coupler_angles) is coupler
        # Seen from the other side the rocker is the crank.
        assert FourBar(*lengths[[2, 1, 0, 3]]).crank_turns_fully is rocker
    assert seen == set(full)


def test_crank_ranges_are_where_the_diagonal_fits():
    rng = np.random.default_rng(9)
    counts = set()
    for lengths in random_lengths(rng, 150, 0.3, 3.0):
        a, b, c, d = lengths
        linkage = FourBar(*lengths)
        diagonal = np.abs(d - a * np.exp(1j * ANGLES))
        exists = (diagonal <= b + c) & (diagonal >= abs(b - c))
        ends = np.array(linkage.crank_ranges)
        counts.add((len(ends), linkage.crank_turns_fully))
        inside = np.zeros(ANGLES.shape, dtype=bool)
        for (low, high), turn in itertools.product(ends, (-math.tau, 0.0, math.tau)):
            inside |= (ANGLES + turn >= low) & (ANGLES + turn <= high)
        assert np.array_equal(inside, exists)
        # At an end the diagonal is one of its two bounds.
        if not linkage.crank_turns_fully:
            diagonal = np.abs(d - a * np.exp(1j * ends))
            gap = np.minimum(np.abs(diagonal - b - c), np.abs(diagonal - abs(b - c)))
            assert gap.max() < 1e-14 * lengths.max() * 10.0
    assert counts == {(1, True), (1, False), (2, False)}


def test_transmission_extremes_are_those_of_a_sweep():
    rng = np.random.default_rng(10)
    for lengths in random_lengths(rng, 50, 0.5, 2.0):
        linkage = FourBar(*lengths, ground_angle=-0.8)
        extremes = linkage.transmission_extremes
        angles = linkage.sweep(ANGLES).open.transmission_angles
        # Near a limit the angle leaves its bound with the root of the crank angle.
        slack = 1e-6 if linkage.crank_turns_fully else 0.2
        assert extremes.smallest <= np.nanmin(angles) + 1e-12
        assert extremes.largest >= np.nanmax(angles) - 1e-12
        assert extremes.smallest == pytest.approx(np.nanmin(angles), abs=slack)
        assert extremes.largest == pytest.approx(np.nanmax(angles), abs=slack)
        assert extremes.worst == min(extremes.smallest, math.pi - extremes.largest)
        for at, value in (
            (extremes.smallest_at, extremes.smallest),
            (extremes.largest_at, extremes.largest),
        ):
            for pose in linkage.solve(at):
                assert pose.transmission_angle == pytest.approx(value, abs=1e-6)


@pytest.mark.parametrize(
    "lengths",
    [
        (2.0, 7.0, 9.0, 6.0),
        (7.0, 9.0, 2.0, 6.0),
        (7.0, 6.0, 8.0, 2.0),
        (6.0, 2.0, 7.0, 8.0),
        (6.0, 4.0, 5.0, 8.0),
        (5.0, 2.0, 6.0, 4.0),
        (2.0, 5.0, 2.0, 5.0),
        (1.0, 4.0, 2.0, 5.0),
        (3.0, 2.0, 4.0, 5.0),
        (2.0, 2.0, 5.0, 5.0),
    ],
)
def test_dead_centres_have_two_links_in_line(lengths):
    linkage = FourBar(*lengths, ground_angle=0.6)
    centres = linkage.dead_centres
    assert len({(centre.kind, round(centre.crank_angle, 9)) for centre in centres}) == len(centres)
    for centre in centres:
        poses = linkage.solve(centre.crank_angle, 1.0)
        if centre.branch is not None:
            poses = [pose for pose in poses if pose.branch is centre.branch]
        assert poses
        if not math.isnan(centre.rocker_angle):
            rockers = np.array([pose.rocker_angle for pose in poses])
            assert np.abs(np.exp(1j * rockers) - np.exp(1j * centre.rocker_angle)).min() < 1e-6
        for pose in poses:
            if centre.branch is None:
                assert math.sin(pose.transmission_angle) < 1e-6
            if centre.kind in (
                DeadCentreKind.CRANK_COUPLER_STRETCHED,
                DeadCentreKind.CRANK_COUPLER_FOLDED,
            ):
                if centre.branch is not None:
                    between = math.cos(pose.coupler_angle - pose.crank_angle)
                    stretched = centre.kind is DeadCentreKind.CRANK_COUPLER_STRETCHED
                    assert between == pytest.approx(1.0 if stretched else -1.0, abs=1e-12)
                    assert pose.rocker_velocity == pytest.approx(0.0, abs=1e-12)
            else:
                between = math.cos(pose.rocker_angle - pose.coupler_angle)
                stretched = centre.kind is DeadCentreKind.COUPLER_ROCKER_STRETCHED
                assert between == pytest.approx(-1.0 if stretched else 1.0, abs=1e-12)


def test_a_kite_leaves_the_rocker_free_where_its_joints_meet():
    centres = FourBar(2.0, 5.0, 5.0, 2.0).dead_centres
    (meeting,) = (c for c in centres if c.kind is DeadCentreKind.COUPLER_ROCKER_FOLDED)
    assert meeting.crank_angle == 0.0
    assert math.isnan(meeting.rocker_angle)


def test_no_dead_centre_is_missed():
    """Sign changes of the rocker's velocity in a dense sweep, against the list."""
    rng = np.random.default_rng(12)
    compared = 0
    for lengths in random_lengths(rng, 50, 0.5, 2.0):
        linkage = FourBar(*lengths)
        sweep = linkage.sweep(ANGLES, 1.0)
        for branch in Branch:
            rate = sweep.branch(branch).rocker_velocities
            changes = (rate[1:] * rate[:-1] <= 0.0) & (np.abs(rate[1:] - rate[:-1]) < 1.0)
            found = np.sort(ANGLES[:-1][changes])
            listed = np.sort([c.crank_angle for c in linkage.dead_centres if c.branch is branch])
            assert found == pytest.approx(listed, abs=2e-3)
            compared += len(listed)
    assert compared > 50
