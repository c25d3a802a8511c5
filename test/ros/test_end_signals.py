"""A signal that ends a process is not lost, whenever it comes."""

from __future__ import annotations

import os
import signal

import pytest

from tri_glide_kinematics.ros.end_signals import EndSignals

BOTH = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def signals():
    before = {number: signal.getsignal(number) for number in BOTH}
    yield EndSignals()
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", BOTH)
def test_one_that_comes_before_there_is_anything_to_stop_stops_it_then(signals, number):
    os.kill(os.getpid(), number)
    stops = []
    signals.call(lambda: stops.append("stop"))
    assert (signals.came, stops) == ([number], ["stop"])


def test_each_one_stops_and_is_counted(signals):
    stops = []
    signals.call(lambda: stops.append("stop"))
    assert not stops
    for number in BOTH:
        os.kill(os.getpid(), number)
    assert (signals.came, stops) == (list(BOTH), ["stop", "stop"])
