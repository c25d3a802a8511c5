"""A computation that is interrupted gives what it gives at once."""

import numpy as np
import pytest

from tri_glide_kinematics import interruptible
from tri_glide_kinematics.interruptible import (
    Interruptible,
    Kept,
    accumulated,
    any_of,
    at_once,
    columns_of,
    concatenated,
    indices_of,
    picked,
    sorting,
)


def summing(numbers) -> Interruptible[int]:
    total = 0
    for number in numbers:
        yield
        if number < 0:
            raise ValueError(f"{number} is negative")
        total += number
    return total


@pytest.mark.parametrize("count", [0, 1, 99, 100, 101, 1234])
@pytest.mark.parametrize("kinds", [3, 1000])
def test_arrays_in_pieces_are_those_of_numpy(monkeypatch, count, kinds):
    monkeypatch.setattr(interruptible, "ROWS", 100)
    monkeypatch.setattr(interruptible, "WORKED_ROWS", 100)
    source = np.random.default_rng(count)
    values = source.integers(0, kinds, count).astype(float)
    rows, indices = source.random((count, 3)), source.integers(0, max(count, 1), count)
    parts = np.array_split(rows, 7)
    np.testing.assert_array_equal(at_once(concatenated(parts)), rows)
    np.testing.assert_array_equal(at_once(picked(rows, indices)), rows[indices])
    for bounds in (np.zeros(0), np.array([1.0]), np.sort(source.choice(1000, 50)).astype(float)):
        found = at_once(sorting(values, bounds))
        np.testing.assert_array_equal(found, np.argsort(values, kind="stable"))
    assert sum(1 for _ in concatenated([rows])) == count // 100
    signs = rows[:, 0] - 0.5
    np.testing.assert_array_equal(at_once(accumulated(np.add, signs)), np.cumsum(signs))
    backwards = at_once(accumulated(np.minimum, signs[::-1]))
    np.testing.assert_array_equal(backwards, np.minimum.accumulate(signs[::-1]))
    for bound in (-1.0, 0.0, 0.499, 1.0):
        above = signs > bound
        np.testing.assert_array_equal(at_once(indices_of(above)), np.flatnonzero(above))
        assert at_once(any_of(np.logical_and, above, above)) == above.any()


@pytest.mark.parametrize("count", [0, 1, 99, 100, 101, 1234])
def test_columns_made_block_by_block_are_those_made_at_once(monkeypatch, count):
    monkeypatch.setattr(interruptible, "WORKED_ROWS", 100)
    values = np.random.default_rng(count).random((count, 3))

    def around(some):
        """Return what depends on two rows behind, then zeros, then what begins with zeros."""
        rows = values[some]
        late = np.where(np.arange(count)[some] < 250, 0.0, rows[:, 0])
        return np.append(rows[2:], rows[-2:], axis=0), np.zeros(len(rows)), late

    expected = around(slice(0, count))
    for spare_zeros, rows in ((False, None), (True, None), (False, 7)):
        made = columns_of(count, around, margin=2, spare_zeros=spare_zeros, rows=rows)
        found = at_once(made)
        for column, whole in zip(found, expected):
            np.testing.assert_array_equal(column, whole)
            assert column.dtype == whole.dtype
        assert found[1].flags.writeable != (spare_zeros and count > 100)


class Numbers:
    """Numbers whose sum is worked out once."""

    def __init__(self, numbers):
        self.numbers = numbers
        self.worked_out = 0

    @Kept
    def total(self) -> Interruptible[int]:
        """Sum of the numbers."""
        self.worked_out += 1
        return summing(self.numbers)


def test_what_is_kept_is_worked_out_once_at_once_or_in_pieces():
    first, second = Numbers([1, 2, 3]), Numbers([4, 5])
    assert not Numbers.total.is_kept(first)
    assert first.total == first.total == 6
    assert Numbers.total.is_kept(first) and not Numbers.total.is_kept(second)
    assert at_once(Numbers.total.in_pieces(first)) == 6
    assert len(list(Numbers.total.in_pieces(first))) == 0
    assert len(list(Numbers.total.in_pieces(second))) == 2
    assert second.total == 9
    assert first.worked_out == second.worked_out == 1
    assert Numbers.total.__doc__ == "Sum of the numbers."


def test_what_cannot_be_worked_out_is_not_kept():
    numbers = Numbers([1, -2])
    for _ in range(2):
        with pytest.raises(ValueError, match="-2 is negative"):
            _ = numbers.total
    assert not Numbers.total.is_kept(numbers)
