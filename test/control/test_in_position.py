from __future__ import annotations

import math

import pytest
from controller_rig import IN_POSITION

from tri_glide_kinematics.control import Arrival, InPosition

START = 7.0


def judged(distances: dict[float, float], at: float) -> Arrival:
    """Return the arrival after distances [m] that came in at times after the start [s]."""
    position = InPosition(IN_POSITION, START)
    for time, distance in distances.items():
        position.measured(distance, START + time)
    return position.arrival(START + at)


@pytest.mark.parametrize(
    ("distances", "at", "expected"),
    [
        ({}, 0.4, Arrival.SETTLING),
        ({0.0: 0.0}, 0.01, Arrival.SETTLING),
        ({0.0: 0.0, 0.015: 0.0005}, 0.021, Arrival.REACHED),
        ({0.0: 0.0, 0.015: 0.0006, 0.016: 0.0}, 0.021, Arrival.SETTLING),
        ({0.0: 0.002}, 0.49, Arrival.SETTLING),
        ({0.0: 0.002}, 0.51, Arrival.NOT_REACHED),
        ({0.0: 0.006}, 0.51, Arrival.TOO_FAR),
        ({0.0: math.inf}, 0.51, Arrival.TOO_FAR),
        # It has just come there: it gets the time to settle.
        ({0.0: 0.006, 0.505: 0.0001}, 0.51, Arrival.SETTLING),
        ({0.0: 0.006, 0.505: 0.0001}, 0.53, Arrival.REACHED),
        ({0.0: 0.002, 2.0: 0.0001}, 2.1, Arrival.REACHED),
        # Without a measurement there is nothing to say; silence is a fault of its own.
        ({}, 9.0, Arrival.SETTLING),
    ],
)
def test_arrival(distances, at, expected):
    assert judged(distances, at) is expected
