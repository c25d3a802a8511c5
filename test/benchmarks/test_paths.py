"""The time of a square with rounded corners, as the benchmark of paths tells it."""

from itertools import pairwise

from benchmarks.bench_paths import SQUARE_TOLERANCE, square_time


def test_a_square_takes_three_quarters_of_the_time_with_stops():
    assert square_time(SQUARE_TOLERANCE) <= 0.75 * square_time(0.0)


def test_a_larger_tolerance_is_faster():
    times = [
        square_time(1e-3 * tolerance) for tolerance in (0.05, 0.1, 0.3, 0.5, 0.8, 1.0, 1.3, 2, 3)
    ]
    assert all(later < earlier for earlier, later in pairwise(times))
