"""The order of parts: as many as possible, whatever the belt does."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pytest

from tri_glide_kinematics.picking import CycleTimes, PickOrder
from tri_glide_kinematics.vectors import combined, dot

FORWARDS = (1.0, 0.0, 0.0)
PLACE = (0.0, 0.2, 0.0)
FIRST, LAST = -0.12, 0.12
SPEED = 0.1


def cycle(position, velocity):
    assert FIRST - 1e-9 <= position[0] <= LAST + 1e-9, "beyond the window there may be no cycle"
    half = 0.25 + 0.58 * math.sqrt(math.dist(position, PLACE))
    return CycleTimes(half, half + 0.1)


ORDER = PickOrder(FORWARDS, (FIRST, LAST), cycle)


def chosen(parts, velocity=SPEED, order=ORDER, now=5.0, free_at=5.0, belt=2.0):
    """Return what is chosen; parts are given by where they are in the frame of the machine now."""
    on_belt = [combined(1.0, position, -belt, order.direction) for position in parts]
    return order.choose(dict(enumerate(on_belt)), (belt, velocity), now, free_at)


def placed(parts, velocity):
    """Return how many are placed if each is taken as chosen."""
    parts, now, count = dict(enumerate(parts)), 0.0, 0
    while pick := ORDER.choose(parts, (velocity * now, velocity), now, now).pick:
        del parts[pick.part]
        now = pick.grip_at + cycle(pick.position, velocity).rest
        count += 1
    return count


def placed_in(parts, velocity):
    """Return how many of the parts are placed in this order, if those that are gone are left out.

    Times are looked for in small steps, as no other part of this file does.
    """
    now, count = 0.0, 0
    for x, y, _ in parts:
        grips = np.arange(max(now, (FIRST - x) / velocity), (LAST - x) / velocity, 0.002)
        halves = 0.25 + 0.58 * np.sqrt(np.hypot(x + velocity * grips, y - PLACE[1]))
        fits = np.flatnonzero(now + halves <= grips)
        if len(fits):
            now = grips[fits[0]] + halves[fits[0]] + 0.1
            count += 1
    return count


def test_nearly_as_many_are_placed_as_in_the_best_of_all_orders():
    rng = np.random.default_rng(53)
    ours = best = 0
    for _ in range(25):
        velocity = rng.choice((0.1, 0.3))
        starts = rng.uniform(-0.5, 0.0, 5)
        parts = [(x, y, 0.0) for x, y in zip(starts.tolist(), rng.uniform(-0.1, 0.1, 5).tolist())]
        ours += placed(parts, velocity)
        best += max(placed_in(some, velocity) for some in permutations(parts))
    assert 0.97 * best <= ours <= best + 1


def test_the_part_that_leaves_first_is_left_where_two_others_can_be_placed_instead():
    parts = [(-0.02, -0.1, 0.0), (-0.02, 0.1, 0.0), (-0.03, 0.1, 0.0)]
    assert chosen(parts[:1]).pick.part == 0
    assert (
        max(placed_in(order, SPEED) for order in permutations(parts) if order[0] == parts[0]) == 1
    )
    assert chosen(parts).pick.part == 1
    assert placed(parts, SPEED) == 2


@pytest.mark.parametrize("velocity", [SPEED, -SPEED])
def test_a_grip_is_where_the_part_is_then_and_as_soon_as_can_be(velocity):
    start = (-0.02, 0.03, -0.4)
    pick, _ = chosen([start], velocity, free_at=5.3)
    assert pick.position == pytest.approx(
        combined(1.0, start, velocity * (pick.grip_at - 5.0), FORWARDS), abs=1e-4
    )
    assert pick.leave_at == pytest.approx(5.3, abs=1e-9)
    assert chosen([start], velocity, free_at=1.0).pick.leave_at == pytest.approx(5.0, abs=1e-9)
    assert pick.grip_at - pick.leave_at == pytest.approx(cycle(pick.position, velocity).reach)


def test_who_waits_for_a_part_leaves_in_time_to_meet_it_where_it_comes_into_the_window():
    pick, passed = chosen([(-0.5, 0.0, 0.0)])
    assert pick.position[0] == pytest.approx(FIRST) and passed == ()
    assert pick.grip_at == pytest.approx(5.0 + (FIRST + 0.5) / SPEED)
    assert pick.leave_at == pytest.approx(pick.grip_at - cycle(pick.position, SPEED).reach)


def test_a_part_is_passed_on_when_it_has_left_and_left_alone_while_it_only_cannot_be_reached():
    gone = [(0.11, 0.0, 0.0)] * 30
    assert chosen([*gone, (0.13, 0.0, 0.0)]) == (None, (30,))
    assert chosen([*gone, (0.0, 0.0, 0.0)]).pick.part == 30


@pytest.mark.parametrize("velocity", [0.0, -0.0, 5e-324, -1e-9, 1e-7])
def test_at_a_belt_at_rest_the_first_in_its_way_is_taken_and_none_is_passed_on(velocity):
    parts = [(-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), (-0.3, 0.0, 0.0), (0.13, 0.0, 0.0)]
    pick, passed = chosen(parts, velocity)
    assert pick.part == 1 and passed == () and pick.leave_at == 5.0
    assert chosen(parts[2:], velocity) == (None, ())


def test_at_a_belt_that_runs_backwards_the_other_end_counts_and_parts_may_come_back():
    parts = [(0.08, 0.0, 0.0), (-0.03, 0.0, 0.0), (0.3, 0.0, 0.0), (-0.5, 0.0, 0.0)]
    pick, passed = chosen(parts, -SPEED)
    assert pick.part == 1 and passed == ()
    assert chosen(parts[2:3], -SPEED).pick.position[0] == pytest.approx(LAST)
    assert chosen([(-1.2, 0.0, 0.0)], -SPEED) == (None, (0,))


def test_a_belt_that_is_not_parallel_to_an_axis_is_no_other_belt():
    turned, side = (0.6, -0.8, 0.0), (0.8, 0.6, 0.0)

    def cycle_there(position, velocity):
        return cycle((dot(position, turned), dot(position, side), 0.0), velocity)

    order = PickOrder(turned, (FIRST, LAST), cycle_there)
    picks = []
    for each, across in ((ORDER, (0.0, 1.0, 0.0)), (order, side)):
        parts = [combined(x, each.direction, y, across) for x, y in ((-0.2, 0.05), (0.0, -0.05))]
        picks.append(chosen(parts, order=each).pick)
    assert picks[0].part == picks[1].part
    assert picks[0].grip_at == pytest.approx(picks[1].grip_at, abs=1e-9)
