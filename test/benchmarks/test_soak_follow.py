"""Targets of the soak that once led the platform far past their end."""

import itertools

import numpy as np
import pytest

from benchmarks.soak_follow import driven, random_case


@pytest.mark.parametrize(
    ("kind", "seed", "number", "lag"),
    [
        ("plain", 2, 33, 1.5),
        ("force limits", 2, 40, 1.5),
        # A sudden turn; a start with a run-up.
        ("force limits", 11, 20, 3.5),
        ("force limits", 11, 22, 1.5),
        # Steps that were made for where the target went before.
        ("shaper", 11, 7, 3.5),
        ("speed limit", 11, 20, 1.5),
        # Steps that were made for what a target did before, twice in a row.
        ("speed limit", 31, 9, 1.5),
    ],
)
def test_a_platform_goes_hardly_farther_past_an_end_than_a_plain_follower(kind, seed, number, lag):
    rng = np.random.default_rng((seed, *kind.encode()))
    cases = (random_case(kind, rng) for _ in itertools.count())
    beyond = driven(next(itertools.islice(cases, number, None)))
    assert beyond.ratio <= 1.0
    # It was followed: the target does not move for longer than the platform needs.
    assert beyond.lag < lag * beyond.plain_lag
