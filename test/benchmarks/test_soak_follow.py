"""Targets of the soak that once led the platform far past their end."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from benchmarks.soak_follow import driven, random_case


@pytest.mark.parametrize(
    ("kind", "seed", "number"),
    [
        ("plain", 2, 33),
        ("force limits", 2, 40),
        # A sudden turn and a start with a run-up, a step that was for where the target went before.
        ("force limits", 11, 20),
        ("force limits", 11, 22),
        ("shaper", 11, 7),
        ("speed limit", 11, 20),
    ],
)
def test_a_platform_goes_hardly_farther_past_an_end_than_a_plain_follower(kind, seed, number):
    rng = np.random.default_rng((seed, *kind.encode()))
    cases = (random_case(kind, rng) for _ in itertools.count())
    case = next(itertools.islice(cases, number, None))
    beyond = driven(case)
    assert beyond.ratio <= 1.0
    # It was followed: the target does not move for longer than the platform needs.
    assert beyond.lag < 1.5 * beyond.plain_lag + 0.05 * case.stroke
