"""How wide roundings are: nothing hangs on rounding errors, and bounds hold."""

import time
from dataclasses import replace

import numpy as np
import pytest
from strategies import nudged

from testing.path_samples import random_path
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import DrivenPath, PlatformPath
from tri_glide_kinematics.motion.path.corners import enveloped, joints_of, widths_of
from tri_glide_kinematics.motion.path.corners.rounding import deviation_bounds
from tri_glide_kinematics.motion.path.corners.widths import CONVEX_BEND, LARGEST_BEND, Weights

ANGLES = 0.005 * np.arange(600)
CIRCLE = 0.02 * np.column_stack((np.cos(ANGLES), np.sin(ANGLES), 0.0 * ANGLES))
# Shapes with many equal numbers, where two roundings just touch, or one ends on another's joint.
SHAPES = {
    "square": [(0, 0, 0), (0.04, 0, 0), (0.04, 0.04, 0), (0, 0.04, 0), (0, 0, 0)],
    "steps": [(0.012 * ((k + 1) // 2), 0.012 * (k // 2), 0) for k in range(30)],
    "fine steps": [(1e-4 * ((k + 1) // 2), 1e-4 * (k // 2), 0) for k in range(300)],
    "zigzag": [(0.01 * k, 0.01 * (k % 2), 0) for k in range(60)],
    "hairpins": [(0.05 * ((k + 1) // 2 % 2), 0.001 * (k // 2), 0) for k in range(12)],
    "circle": CIRCLE,
    "circle in micrometres": np.round(CIRCLE, 6),
}


@pytest.mark.parametrize("tolerance", [5e-5, 1e-3, 2e-3, 1e-2])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_last_bits_of_the_points_decide_nothing(shape, tolerance):
    rng = np.random.default_rng(1)
    driven = PlatformPath.through(SHAPES[shape], tolerance).driven
    ways = np.linspace(0.0, driven.length, 700)
    places = driven.derivatives(ways, 0)[0]
    assert len(driven.stops) == 2
    assert driven.deviation_bound <= tolerance
    for _ in range(1):
        other = PlatformPath.through(nudged(rng, SHAPES[shape]), tolerance).driven
        assert other.derivatives(ways, 0)[0] == pytest.approx(places, abs=1e-11)


def test_the_bound_at_joints_is_that_of_the_sum():
    rng = np.random.default_rng(2)
    for _ in range(40):
        path, _ = random_path(rng)
        joints, _ = at_once(joints_of(path.segments))
        if not len(joints.ways):
            continue
        widths = at_once(enveloped(joints.ways, rng.uniform(0.001, 0.05, len(joints.ways))))
        weights = Weights(joints.turns, CONVEX_BEND * joints.bends)
        found = at_once(deviation_bounds(joints.ways, weights, widths))
        for way, value in zip(joints.ways, found):
            rest = np.maximum(1.0 - np.abs(way - joints.ways) / widths, 0.0)
            terms = weights.turns * widths / 6.0 * rest**3 + weights.bends * widths**2 * rest
            assert value == pytest.approx(terms.sum(), rel=1e-12)


def test_two_widths_differ_by_no_more_than_the_ways():
    rng = np.random.default_rng(3)
    for _ in range(50):
        ways = np.sort(rng.uniform(0.0, 1.0, 200))
        wanted = 10.0 ** rng.uniform(-4.0, 0.0, 200)
        widths = at_once(enveloped(ways, wanted))
        apart = np.abs(ways[:, np.newaxis] - ways)
        assert widths == pytest.approx((wanted + apart).min(axis=1), abs=1e-15)


def test_widths_reach_over_no_stop_and_keep_all_tolerances():
    rng = np.random.default_rng(4)
    for _ in range(40):
        path, _ = random_path(rng)
        joints, stops = at_once(joints_of(path.segments))
        widths = at_once(widths_of(joints))
        assert (widths.half_widths > 0.0).all()
        assert (widths.deviations <= joints.tolerances).all()
        for way, width in zip(joints.ways, widths.half_widths):
            assert width <= np.abs(stops - way).min() * (1.0 + 1e-12)


def test_the_constants_of_the_bounds():
    # |E| / w^2 over x / w, and its convex bound.
    part = np.linspace(0.0, 1.0, 100_001)
    bend = part * (1.0 - part) ** 3 / 12.0
    assert bend.max() == pytest.approx(LARGEST_BEND, rel=1e-9)
    assert (bend <= CONVEX_BEND * (1.0 - part) + 1e-18).all()
    assert (CONVEX_BEND * (1.0 - part) - bend).min() == pytest.approx(0.0, abs=1e-9)


def test_no_piece_of_work_grows_with_the_number_of_joints():
    """Ten times the joints take ten times as many pieces, not pieces ten times as long."""
    longest = []
    for count in (10_000, 100_000):
        angles = np.linspace(0.0, 300.0, count)
        points = 0.02 * np.column_stack((np.cos(angles), np.sin(angles), 0.1 * angles))
        segments = PlatformPath.through(points, tolerance=1e-4).segments
        runs = []
        for _ in range(3):
            times = []
            rounding = DrivenPath.of(replace(segments))
            begin = time.thread_time()
            for _ in rounding:
                times.append(time.thread_time() - begin)
                begin = time.thread_time()
            runs.append(times)
        # What another process or a collection of garbage holds up is another piece in each run.
        longest.append(np.min(runs, axis=0).max())
    assert longest[1] < 4.0 * longest[0]
