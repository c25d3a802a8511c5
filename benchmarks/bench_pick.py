"""Picking from a belt: how many parts are placed, over a bound from above."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from benchmarks import pick_cycles, pick_grips
from benchmarks.table import Row, print_rows
from tri_glide_kinematics.picking import CycleTimes, PickOrder
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices, Vector3

# How long half a cycle takes [s]: at rest, over 305 mm, 0.57 s; on a belt somewhat longer.
AT_ONCE, OVER_305_MM = 0.25, 0.32
BELT_SPEEDS = (0.0, 0.1, 0.3)
LONGER = (1.0, 1.01, 1.09)
DWELL = 0.05  # s, at the part and at the place
PLACE = (0.0, 0.2)  # m
WINDOW = (-0.12, 0.12)  # m, along the belt
HALF_WIDTH = 0.1  # m, of the belt
SEEN_BEFORE = (0.3, 0.5)  # m before the window
SPACING = 0.03  # m, mean distance of the parts of a burst

PARTS = 200
BELTS = (0.1, 0.3)
PATTERNS = ("at random", "even", "in bursts")
FEEDS = {0.8: 0.99, 1.0: 0.95, 1.3: 0.92}  # and what is to be reached
SEEDS = range(4)

TIME_STEP = 0.004  # s, of the bound: it is the lower, the shorter this is
ROUNDS = 400


class Stream(NamedTuple):
    """Parts on a belt.

    Attributes:
        speed: of the belt [m/s].
        times: when they enter the window [s]. Shape (n,).
        sides: where they lie across the belt [m]. Shape (n,).
        seen: when they are seen first [s]. Shape (n,).
    """

    speed: float
    times: FloatArray
    sides: FloatArray
    seen: FloatArray


def half_cycle(ways: ArrayLike, sides: ArrayLike, speed: float) -> FloatArray:
    """Return the times between the place and grips on a belt [s], in the shape of both together."""
    distances = np.hypot(np.subtract(ways, PLACE[0]), np.subtract(sides, PLACE[1]))
    longer = np.interp(speed, BELT_SPEEDS, LONGER)
    return np.asarray(longer * (AT_ONCE + OVER_305_MM * np.sqrt(distances / 0.305)))


def mean_cycle(speed: float) -> float:
    """Return how long a cycle takes in the mean of all places of the window [s]."""
    ways, sides = np.meshgrid(np.linspace(*WINDOW, 49), np.linspace(-HALF_WIDTH, HALF_WIDTH, 41))
    return float(2.0 * np.mean(half_cycle(ways, sides, speed)) + 2.0 * DWELL)


def stream(pattern: str, feed: float, speed: float, seed: int, count: int = PARTS) -> Stream:
    """Return parts that come at a ``feed``: 1 is one in each mean cycle."""
    rng = np.random.default_rng(seed)
    between = mean_cycle(speed) / feed
    times: FloatArray
    if pattern == "at random":
        times = np.cumsum(rng.exponential(between, count))
    elif pattern == "even":
        times = between * np.arange(count, dtype=float)
    else:
        bursts = np.cumsum(rng.exponential(5.0 * between, (count + 4) // 5))
        within = rng.uniform(0.0, 5.0 * SPACING / speed, (len(bursts), 5))
        times = np.sort((bursts[:, None] + within).ravel()[:count])
    seen = times - rng.uniform(*SEEN_BEFORE, count) / speed
    return Stream(speed, times, rng.uniform(-HALF_WIDTH, HALF_WIDTH, count), seen)


def placed(parts: Stream) -> BoolArray:
    """Return which parts are placed by a machine that takes one after the other as chosen."""
    speed = parts.speed

    def cycle(position: Vector3, velocity: float) -> CycleTimes:
        half = float(half_cycle(position[0], position[1], velocity))
        return CycleTimes(half, half + 2.0 * DWELL)

    order = PickOrder((1.0, 0.0, 0.0), WINDOW, cycle)
    starts = WINDOW[0] - speed * parts.times
    waiting: dict[int, Vector3] = {}
    coming = np.argsort(-parts.seen).tolist()
    is_placed = np.zeros(len(coming), dtype=bool)
    now = next_seen = float(parts.seen.min())
    while True:
        while coming and next_seen <= now:
            part = coming.pop()
            waiting[part] = (float(starts[part]), float(parts.sides[part]), 0.0)
            next_seen = float(parts.seen[coming[-1]]) if coming else math.inf
        pick, passed = order.choose(waiting, (speed * now, speed), now, now)
        for number in passed:
            del waiting[number]
        if pick is not None and pick.leave_at <= next_seen:
            del waiting[pick.part]
            is_placed[pick.part] = True
            now = pick.grip_at + cycle(pick.position, speed).rest
        elif coming:
            now = next_seen
        else:
            return is_placed


def bound(parts: Stream, is_placed: BoolArray, step: float = TIME_STEP) -> int:
    """Return a number of parts that no choice exceeds, as it knows all parts before.

    A cycle that starts in one step of time and ends in another is an arc between the two, and what
    a machine does is a path of arcs and of waits. Beginning and end are rounded down alike, so
    cycles that follow each other still do, and as a later start never leads to an earlier end, the
    first start in a step stands for all. Parts are divided into groups whose cycles do not overlap:
    no more can be placed of all than of each group.
    """
    begins, ends, numbers = _arcs(parts, step)
    is_first = np.append(True, begins[1:] >= np.maximum.accumulate(ends)[:-1])
    total = 0
    for group in np.split(np.arange(len(begins)), np.flatnonzero(is_first)[1:]):
        members, which = np.unique(numbers[group], return_inverse=True)
        arcs = begins[group] - begins[group[0]], ends[group] - begins[group[0]], which
        total += _bound_of_group(*arcs, int(is_placed[members].sum()))
    return total


def _bound_of_group(begins: Indices, ends: Indices, numbers: Indices, reached: int) -> int:
    """Return a bound for the parts of one group; ``reached`` are placed, so it is no less.

    Each part has a price for being taken. The best path, by parts less prices, and all prices
    together are a bound, for all prices that are not negative (Lagrangian relaxation of "each part
    once"); they are moved to where it is least.
    """
    prices = np.zeros(int(numbers.max()) + 1)
    least = len(prices)
    for index in range(ROUNDS):
        value, taken = _best_path(begins, ends, numbers, 1.0 - prices)
        value += prices.sum()
        least = min(least, math.floor(value + 1e-9))
        change = np.where((prices > 0.0) | (taken > 1.0), taken - 1.0, 0.0)
        size = change @ change
        if least <= reached or size == 0.0:
            break
        pace = (value - reached) / size / (1.0 + index / 100.0)
        prices = np.maximum(prices + pace * change, 0.0)
    assert least >= reached, "more are placed than the bound allows"
    return least


def _arcs(parts: Stream, step: float) -> tuple[Indices, Indices, Indices]:
    """Return first and last step of the possible cycles and the parts, in the order of starts."""
    stay = (WINDOW[1] - WINDOW[0]) / parts.speed
    enters, sides = parts.times[:, None], parts.sides[:, None]
    earliest = enters - half_cycle(WINDOW[0], sides, parts.speed)
    latest = enters + stay - half_cycle(WINDOW[1], sides, parts.speed)
    columns = np.arange(math.ceil(np.max(latest - earliest) / step) + 2)
    begins = np.floor(earliest / step).astype(int) + columns
    starts = np.maximum(step * begins, earliest)
    grips = np.maximum(starts, enters)
    for _ in range(30):
        halves = half_cycle(WINDOW[0] + parts.speed * (grips - enters), sides, parts.speed)
        grips = starts + halves
    over = grips + halves + 2.0 * DWELL
    assert np.all(np.diff(over) >= 0.0), "a later start leads to an earlier end"
    numbers, columns = np.nonzero(grips <= enters + stay + 1e-6)
    order = np.argsort(begins[numbers, columns], kind="stable")
    numbers, columns = numbers[order], columns[order]
    least = int(begins.min())
    ends = np.floor(over / step).astype(int)
    return begins[numbers, columns] - least, ends[numbers, columns] - least, numbers


def _best_path(
    begins: Indices, ends: Indices, numbers: Indices, worths: FloatArray
) -> tuple[float, FloatArray]:
    """Return the largest sum of worths along a path, and how often each part is taken in it."""
    values = worths[numbers]
    last = int(ends.max())
    best = np.zeros(last + 1)
    through = np.full(last + 1, -1)
    shortest = int((ends - begins).min())
    for low in range((last // shortest) * shortest, -1, -shortest):
        high = min(low + shortest, last + 1)
        a, b = np.searchsorted(begins, (low, high))
        after = best[high] if high <= last else 0.0
        gains = values[a:b] + best[ends[a:b]]
        order = np.argsort(gains, kind="stable")
        at = begins[a:b][order]
        here = np.full(high - low, -math.inf)
        here[at - low] = gains[order]
        through[at] = a + order
        ahead = np.maximum.accumulate(np.append(here, after)[::-1])[::-1][:-1]
        through[low:high][here < ahead] = -1
        best[low:high] = ahead
    taken = np.zeros(len(worths))
    node = 0
    while node < last:
        arc = through[node]
        if arc >= 0:
            taken[numbers[arc]] += 1.0
            node = int(ends[arc])
        else:
            node += 1
    return float(best[0]), taken


def order_rows() -> Iterator[Row]:
    """Yield how many parts are placed, for all belts, patterns and feeds."""
    for speed, pattern, (feed, goal) in product(BELTS, PATTERNS, FEEDS.items()):
        sums = np.zeros(2, dtype=int)
        for seed in SEEDS:
            parts = stream(pattern, feed, speed, seed)
            is_placed = placed(parts)
            sums += np.array([is_placed.sum(), bound(parts, is_placed)])
        ratio = sums[0] / sums[1]
        what = f"parts placed, {speed:g} m/s, {pattern}, feed {feed:g}, over a bound from above"
        told = f"{ratio:.3f} ({sums[0]} of {len(SEEDS) * PARTS})"
        yield Row(what, told, f"{goal:g}", bool(ratio >= goal))


def rows() -> Iterator[Row]:
    """Yield one row of the table after the other."""
    yield from pick_cycles.rows()
    yield from pick_grips.rows()
    yield from order_rows()


def run() -> bool:
    """Measure and print the table; it is always complete."""
    return print_rows("picking from a belt", rows())
