"""Tests at random: short with fixed seeds in ``make test``, long with others in ``make soak``."""

import os
from collections.abc import Callable, Iterable, Sequence
from itertools import product
from typing import Any, TypeVar

import pytest

Case = TypeVar("Case")
Test = TypeVar("Test", bound=Callable[..., Any])

# How many times as long, and what is added to each seed.
LONGER = int(os.environ.get("SOAK", "1"))
SEED = int(os.environ.get("SOAK_SEED", "0"))


def many(count: int) -> int:
    """Return how many samples to take: ``count`` in a short run."""
    return count * LONGER


def seed(number: int) -> int:
    """Return the seed to take: ``number`` in a short run."""
    return number + SEED


def some(cases: Sequence[Case], count: int) -> list[Case]:
    """Return the cases to take: the first ``count`` in a short run, else all.

    The test is marked as slow, as ``make soak`` runs those.
    """
    return list(cases if LONGER > 1 else cases[:count])


def combined(*factors: Sequence[Any]) -> list[tuple[Any, ...]]:
    """Return combinations of one value of each factor: every second one in a short run, else all.

    Of three factors with two values each, half has every pair of values of two of them. The test is
    marked as slow.
    """
    choices = product(*(enumerate(values) for values in factors))
    return [
        tuple(value for _, value in choice)
        for choice in choices
        if LONGER > 1 or sum(index for index, _ in choice) % 2 == 0
    ]


def corners(names: str, *choices: Iterable[Any]) -> Callable[[Test], Test]:
    """Let a test take combinations such that each choice occurs, and in a long run all.

    It is marked as slow, as ``make soak`` runs those.

    Args:
        names: of the arguments of the test.
        choices: for each of them.
    """
    values = [list(each) for each in choices]
    taken = list(product(*values))
    if LONGER == 1:
        count = max(map(len, values))
        taken = [tuple(each[number % len(each)] for each in values) for number in range(count)]

    def mark(test: Test) -> Test:
        return pytest.mark.slow(pytest.mark.parametrize(names, taken)(test))

    return mark
