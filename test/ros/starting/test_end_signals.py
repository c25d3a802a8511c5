"""A signal that ends a process is not lost, whenever it comes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

from testing.client import TIMEOUT
from tri_glide_kinematics.ros.starting import EndSignals

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


def test_a_second_one_ends_a_process_that_has_nothing_to_stop_yet():
    text = f"""
import time
from {EndSignals.__module__} import EndSignals
EndSignals()
print("ready", flush=True)
time.sleep(60)
"""
    with subprocess.Popen((sys.executable, "-c", text), stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "ready\n"
        for _ in range(2):
            child.send_signal(signal.SIGTERM)
            # Two that come together are one.
            with suppress(subprocess.TimeoutExpired):
                child.wait(1.0)
        try:
            assert child.wait(TIMEOUT) == -signal.SIGTERM
        finally:
            child.kill()
