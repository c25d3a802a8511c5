"""Tests at random: short with fixed seeds in ``make test``, long with others in ``make soak``."""

from __future__ import annotations

import os

# How many times as long, and what is added to each seed.
LONGER = int(os.environ.get("SOAK", "1"))
SEED = int(os.environ.get("SOAK_SEED", "0"))


def many(count: int) -> int:
    """Return how many samples to take: ``count`` in a short run."""
    return count * LONGER


def seed(number: int) -> int:
    """Return the seed to take: ``number`` in a short run."""
    return number + SEED
