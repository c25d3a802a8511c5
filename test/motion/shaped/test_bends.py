"""How much a mean of places on a path cuts its bends, and how slow the platform has to be there."""

import numpy as np
import pytest
from soak import some

from testing.path_samples import random_path
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import DrivenPath, ShapedCorners
from tri_glide_kinematics.motion.shaped.bends import Bends
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind

SHAPER = Shaper.of(ShaperKind.EI, Mode(15.0, 0.03))
AMPLITUDES = np.array(SHAPER.amplitudes)

# No corner is so slow that it is a stop.
ROUNDED = ShapedCorners(part=0.3, rate=1.0, slowest=0.0, passing=1.0)


def sampled(seed: int) -> tuple[DrivenPath, Bends, np.random.Generator]:
    """Return a path at random that leaves something to a shaper, and all of its bends."""
    chance = np.random.default_rng(seed)
    path, _ = random_path(chance, count=int(chance.integers(2, 12)), stops=0.15)
    driven = at_once(DrivenPath.of(path.segments, ROUNDED))
    return driven, Bends(driven, slice(0, len(driven.segment))), chance


def cut_of(driven: DrivenPath, ways: np.ndarray) -> np.ndarray:
    """Return the distances of means of places from the place of the mean. Shape (n,) [m]."""
    places = driven.derivatives(ways.ravel(), 0)[0].reshape(*ways.shape, 3)
    means = np.einsum("k,kni->ni", AMPLITUDES, places)
    return np.linalg.norm(means - driven.derivatives(AMPLITUDES @ ways, 0)[0], axis=1)


def bound_of(bends: Bends, ways: np.ndarray) -> np.ndarray:
    """Return the bound of the same. Shape (n,) [m]."""
    return AMPLITUDES @ bends.turned(ways)[0] - bends.turned(AMPLITUDES @ ways)[0]


@pytest.mark.parametrize("seed", range(20))
def test_no_mean_is_farther_from_the_path_than_its_bound(seed):
    driven, bends, chance = sampled(seed)
    first = chance.uniform(0.0, driven.length, 2000)
    spread = np.outer(10.0 ** chance.uniform(-4.0, -0.5, 2000), (0.0, 1.0, 1.0)).T
    ways = np.clip(first - spread * chance.uniform(0.0, 1.0, (3, 2000)), 0.0, driven.length)
    cut, bound = cut_of(driven, ways), bound_of(bends, ways)
    assert (cut <= bound + 1e-12).all()
    # It is no empty promise: somewhere it is nearly reached.
    assert (cut / np.maximum(bound, 1e-9)).max() > 0.7


@pytest.mark.parametrize("seed", range(10))
def test_slopes_are_those_of_differences(seed):
    _, bends, chance = sampled(seed)
    ways = chance.uniform(bends.breaks[0], bends.breaks[-1], 300)
    step = 1e-7
    difference = (bends.turned(ways + step)[0] - bends.turned(ways - step)[0]) / (2.0 * step)
    slope = bends.turned(ways)[1]
    near = np.abs(bends.breaks[:, np.newaxis] - ways).min(axis=0) < 2.0 * step
    scale = 1.0 + np.abs(bends.turned(bends.breaks)[0]).max() * 1e-16 / step
    np.testing.assert_allclose(difference[~near], slope[~near], atol=1e-6 * scale)
    assert (bends.turned_before(ways) == slope).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", some(range(20), 10))
def test_at_the_speeds_that_are_allowed_no_more_is_cut_than_allowed(seed):
    """A steady motion from stop to stop at these speeds, whatever else would bound them."""
    driven, _, _ = sampled(seed)
    begin, end = driven.stops[:2]
    spans = slice(0, int(np.searchsorted(driven.breaks, end)))
    bends = Bends(driven, spans)
    steps = at_once(bends.speeds(SHAPER, 1.0, 1.0))
    ways = np.linspace(begin, end, 20_001)
    rates = driven.rates(driven.spans_of(ways), ways)
    speeds = np.minimum(steps.at(ways, rates, 0.0), 5.0) / rates
    times = np.append(0.0, np.cumsum(np.diff(ways) / np.minimum(speeds[1:], speeds[:-1])))
    when = np.arange(0.0, times[-1] + SHAPER.duration, 2e-4)
    copies = np.interp(np.subtract.outer(when, SHAPER.times).T, times, ways)
    mean = AMPLITUDES @ copies
    ratio = cut_of(driven, copies) / bends.at(mean)
    assert ratio.max() <= 1.0
    if driven.sharpness_on(spans).max() > 1.0:
        assert np.isfinite(steps.bends).any()


def test_speeds_that_are_asked_for_hold_beside_the_segment_too():
    chance = np.random.default_rng(5)
    path, _ = random_path(chance, count=3, arcs=0.0, stops=0.0)
    slow = path.line_to(np.add(path.end, (0.02, 0.0, 0.0)), 1e-3, 0.05).line_to(
        np.add(path.end, (0.06, 0.0, 0.0)), 1e-3
    )
    driven = at_once(DrivenPath.of(slow.segments, ROUNDED))
    steps = at_once(Bends(driven, slice(0, len(driven.segment))).speeds(SHAPER, 0.5, 1.0))
    begin, end = driven.joints[3:5]
    behind, ahead = 0.025 * (SHAPER.duration - SHAPER.delay), 0.025 * SHAPER.delay
    ways = np.array(
        (begin - 1.01 * behind, begin - 0.99 * behind, end + 0.99 * ahead, end + 1.01 * ahead)
    )
    step = np.searchsorted(steps.edges, ways, "right")
    assert steps.asked[step].tolist() == [np.inf, 0.025, 0.025, np.inf]
