"""From where a machine can be led."""

from __future__ import annotations

import math

import pytest

from tri_glide_kinematics.control import (
    TRAVEL_TOLERANCE,
    Cause,
    CommandRefusedError,
    Reason,
    StartingPlace,
    SupervisionBounds,
    Supervisor,
)
from tri_glide_kinematics.errors import Refusal

LOWER, UPPER = (0.3, 0.3, 0.3), (0.9, 0.9, 0.9)
TIMEOUT, NOW = 0.2, 10.0


def place(heights=(0.6, 0.5, 0.4)):
    """A place after ``heights`` were measured ``NOW``."""
    supervisor = Supervisor(SupervisionBounds(TIMEOUT, 0.02, 0.05, (1.0,) * 3), ("a", "b", "c"))
    supervisor.measured(heights, None, NOW)
    start = StartingPlace(supervisor, (LOWER, UPPER))
    start.measured(heights)
    return start


def test_it_is_where_the_machine_was_measured_last():
    assert place().checked(NOW + TIMEOUT) == (0.6, 0.5, 0.4)


def test_an_old_measurement_is_none():
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        place().checked(NOW + 1.01 * TIMEOUT)


@pytest.mark.parametrize("height", [math.nan, math.inf])
def test_what_is_not_finite_is_no_place(height):
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        place((0.6, height, 0.6)).checked(NOW)


def test_an_obstacle_keeps_the_machine_from_being_led_until_it_is_gone():
    start = place()
    start.obstacle = Reason(Cause.OTHER_PUBLISHER, "somebody else leads")
    with pytest.raises(CommandRefusedError, match="somebody else leads") as caught:
        start.checked(NOW)
    assert caught.value.refusal is Refusal.OTHER_PUBLISHER
    start.obstacle = None
    start.checked(NOW)


@pytest.mark.parametrize("slider", range(3))
@pytest.mark.parametrize(("end", "sign"), [(0.3, -1.0), (0.9, 1.0)])
def test_only_a_little_beyond_the_travel_is_allowed(slider, end, sign):
    def at(excess):
        heights = [0.6, 0.6, 0.6]
        heights[slider] = end + sign * excess
        return place(tuple(heights))

    at(0.9 * TRAVEL_TOLERANCE).checked(NOW)
    with pytest.raises(CommandRefusedError, match=rf"slider {slider + 1} .* outside its travel"):
        at(1.1 * TRAVEL_TOLERANCE).checked(NOW)
