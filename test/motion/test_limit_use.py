import math

import numpy as np
import pytest

from tri_glide_kinematics.errors import WrongShapeError
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse, are_within
from tri_glide_kinematics.motion.limits import QUANTITIES, SliderLimits

PERIOD = 0.001
LIMITS = SliderLimits((1.0, 0.5, 2.0), (10.0, 5.0, 20.0), (200.0, 100.0, 400.0))


def stream_of(height: np.ndarray) -> CommandStream:
    """All sliders go the same way."""
    return CommandStream.from_heights(np.repeat(height[:, np.newaxis], 3, axis=1), PERIOD)


def polynomial(order: int, derivative: float, count: int = 80) -> np.ndarray:
    """Heights whose derivative of this order is constant."""
    return 0.5 + derivative * (PERIOD * np.arange(count)) ** order / math.factorial(order)


def only(order: int, limits: SliderLimits, count: int) -> np.ndarray:
    """The limits of one derivative; the others are so wide that nothing reaches them."""
    table = np.full((count, 3, 3), 1e9)
    table[:, order - 1] = limits.table[order - 1]
    return table


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("size", [-1.002, -1.0, 1.0, 1.002])
def test_each_derivative_is_a_part_of_its_own_limit(order, size):
    bound = LIMITS.table[order - 1, 1]  # the smallest
    stream = stream_of(polynomial(order, size * bound))
    use = LimitUse.of(stream, only(order, LIMITS, 80))
    expected = abs(size) * bound / LIMITS.table[order - 1]
    np.testing.assert_allclose(
        use.parts[order:, order - 1], np.tile(expected, (80 - order, 1)), 1e-4
    )
    assert use.largest[order - 1] == pytest.approx(abs(size), rel=1e-4)
    assert use.is_within is (abs(size) == 1.0)
    assert are_within(use.largest) is use.is_within
    if use.is_within:
        assert use.violations() == []
    else:
        (text,) = use.violations(1000)
        assert text.startswith(f"{QUANTITIES[order - 1][0]} of slider 2 is 1.00")
        assert int(text.split()[-1]) >= 1000 + order


def test_a_step_is_forgiven_where_a_row_begins_anew_and_nowhere_else():
    height = np.repeat((0.5, 0.6), 4)
    begins = np.arange(8) == 4
    assert LimitUse.of(stream_of(height), LIMITS, begins).is_within
    for other in (None, begins[::-1], np.arange(8) == 5):
        use = LimitUse.of(stream_of(height), LIMITS, other)
        assert not use.is_within
        assert len(use.violations()) >= 1
    # Afterwards everything is judged again.
    assert not LimitUse.of(stream_of(np.r_[height, 0.7]), LIMITS, np.r_[begins, False]).is_within


def test_a_limit_counts_in_the_steps_that_it_holds_for():
    """At a change a difference over several steps may be as large as the wider limit allows."""
    jerk = 100.0
    stream = stream_of(polynomial(3, jerk, 20))
    limits = np.full((20, 3, 3), 1e9)
    limits[:10, 2] = jerk
    limits[10:, 2] = jerk / 2.0
    parts = LimitUse.of(stream, limits).parts[:, 2, 0]
    np.testing.assert_allclose(parts, np.repeat((0.0, 1.0, 2.0), (3, 9, 8)), rtol=1e-4)


def test_a_part_has_the_differences_of_the_whole():
    use = LimitUse.of(stream_of(np.linspace(0.0, 1.0, 30) ** 3), LIMITS)
    np.testing.assert_array_equal(use.part(10, 14).parts, use.parts[10:14])
    assert use.part(4, 4).largest.tolist() == [0.0, 0.0, 0.0]
    assert use.part(4, 4).is_within


def test_what_is_not_finite_is_outside():
    heights = np.full((9, 3), 0.5)
    heights[4, 1] = math.nan
    use = LimitUse.of(CommandStream.from_heights(heights, PERIOD), LIMITS)
    assert not use.is_within
    assert all("slider 2 is nan" in text for text in use.violations())
    assert len(use.violations()) == 3


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_rows_are_within(count):
    use = LimitUse.of(stream_of(np.full(count, 0.5)), LIMITS)
    assert use.parts.shape == (count, 3, 3)
    assert use.is_within


def test_other_shapes_are_refused():
    stream = stream_of(np.full(5, 0.5))
    with pytest.raises(
        WrongShapeError, match=r"limits has shape \(4, 3, 3\), expected \(5, 3, 3\)"
    ):
        LimitUse.of(stream, np.ones((4, 3, 3)))
    with pytest.raises(WrongShapeError, match=r"begins has shape \(4,\), expected \(5"):
        LimitUse.of(stream, LIMITS, np.zeros(4))
