"""The harness of the benchmarks: what it calls, how it counts, what it prints."""

from dataclasses import replace
from itertools import count

import pytest

from benchmarks.harness import Figure, Ratio, Work, compare, figure
from benchmarks.table import cells, in_seconds


def test_ratio_is_of_the_times_of_one_round():
    # Both get ten times slower in the middle: the ratio does not notice.
    ours = [2.0, 2.0, 20.0, 20.0, 2.0]
    reference = [1.0, 1.0, 10.0, 10.0, 1.0]
    ratio = Ratio.of(ours, reference)
    assert (ratio.low, ratio.median, ratio.high) == (2.0, 2.0, 2.0)


def test_spread_is_from_5_to_95_percent():
    ratio = Ratio.of([float(value) for value in range(101)], [1.0] * 101)
    assert ratio.median == pytest.approx(50.0)
    assert ratio.low == pytest.approx(5.0)
    assert ratio.high == pytest.approx(95.0)


@pytest.mark.parametrize(
    ("goal", "reached"), [(None, None), (2.0, True), (1.5, True), (1.4999, False)]
)
def test_a_goal_is_reached_by_the_median(goal, reached):
    row = figure("what", "reference", [3.0, 3.0, 300.0], [2.0, 2.0, 2.0], goal)
    assert row.is_reached is reached


@pytest.mark.parametrize(("more", "reached"), [(1.1e-6, True), (0.9e-6, False)])
def test_a_goal_may_be_a_difference(more, reached):
    row = replace(figure("what", "reference", [3e-6] * 3, [2e-6] * 3), more=more)
    assert row.is_reached is reached
    assert cells(row)[-2:] == (f"{in_seconds(more)} more", "yes" if reached else "NO")


def test_compare_alternates_and_calls_with_the_arguments(monkeypatch):
    # By this clock each measurement takes a second, however long a busy computer takes for it.
    monkeypatch.setattr("benchmarks.harness.process_time", count().__next__)
    calls = []

    def ours(*arguments):
        calls.append(arguments)

    row = compare(
        "what",
        "reference",
        Work(ours, 1, "a"),
        Work(ours, 2.0, items=2),
        goal=1.0,
        rounds=3,
        round_time=2.0,
    )
    assert isinstance(row, Figure)
    # Two calls in each round; the second side has two items in each of them.
    assert (row.ours, row.theirs, row.ratio.median) == (0.5, 0.25, 2.0)
    order = [arguments[0] for arguments in calls]
    assert set(calls) == {(1, "a"), (2.0,)}
    # One of each to see how many fit. Three rounds for warming up and three that count: each side
    # begins in turn.
    assert order == [1, 2.0] + 3 * [1, 1, 2.0, 2.0, 2.0, 2.0, 1, 1]


def test_times_are_per_item(monkeypatch):
    monkeypatch.setattr("benchmarks.harness.Timer.timeit", lambda _, calls: 6.0 * calls)
    assert Work(sum, range(4), items=3).seconds_per_item(5) == 2.0
    assert Work(sum, range(4)).calls_within(60.0) == 10
    assert Work(sum, range(4)).calls_within(0.1) == 1


@pytest.mark.parametrize(
    ("time", "text"),
    [
        (2.5, "2.5 s"),
        (1.0, "1 s"),
        (0.0123456, "12.3 ms"),
        (4.2e-6, "4.2 µs"),
        (1.5e-8, "15 ns"),
        (2e-10, "0.2 ns"),
    ],
)
def test_times_have_three_digits_and_a_unit(time, text):
    assert in_seconds(time) == text
