"""From where a machine can be led, and how that ends."""

import math

import pytest
from controller_rig import HOME, LIMITS, LOWER, MACHINE, MEASURED_TIMEOUT, UPPER, Rig, supervisor

from tri_glide_kinematics.control import (
    TRAVEL_TOLERANCE,
    WAITING,
    CommandRefusedError,
    StartingPlace,
)
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion import CannotHoldError, ForceLimits

NOW = 10.0


def place(heights=(0.6, 0.5, 0.4)):
    """A place after ``heights`` were measured ``NOW``."""
    supervised = supervisor()
    supervised.measured(heights, None, NOW)
    start = StartingPlace(supervised, (LOWER, UPPER))
    start.measured(heights)
    return start


def test_it_is_where_the_machine_was_measured_last():
    assert place().checked(NOW + MEASURED_TIMEOUT) == (0.6, 0.5, 0.4)


@pytest.mark.parametrize(
    ("height", "age"), [(0.6, 1.01 * MEASURED_TIMEOUT), (math.nan, 0.0), (math.inf, 0.0)]
)
def test_what_is_old_or_not_finite_is_no_place(height, age):
    with pytest.raises(CommandRefusedError, match="no measured slider heights"):
        place((0.6, height, 0.6)).checked(NOW + age)


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


def test_it_waits_where_force_limits_cannot_hold_the_weight():
    rig = Rig()
    forces = SliderForces(MACHINE, Masses.uniform(1.0, 0.1, 1.0))
    rig.engine.set_limits(LIMITS.with_added(ForceLimits(forces, (10.0,) * 3, (50.0,) * 3)))
    with pytest.raises(CannotHoldError, match=r"force_limit_up\[\d\] = 10 N cannot hold"):
        rig.controller.measured(HOME, rig.now)
    assert not rig.controller.leads and rig.controller.state is WAITING
    rig.engine.set_limits(LIMITS)
    rig.cycle()
    assert rig.controller.leads
