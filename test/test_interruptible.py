"""A computation that is interrupted gives what it gives at once."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.interruptible import Interruptible, at_once


def summing(numbers) -> Interruptible[int]:
    total = 0
    for number in numbers:
        yield
        if number < 0:
            raise ValueError(f"{number} is negative")
        total += number
    return total


def test_at_once_returns_the_result():
    assert at_once(summing([1, 2, 3])) == 6
    assert at_once(summing([])) == 0


def test_at_once_raises_its_errors():
    with pytest.raises(ValueError, match="-2 is negative"):
        at_once(summing([1, -2, 3]))
