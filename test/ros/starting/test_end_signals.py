"""A signal that ends a process is not lost, whenever it comes."""

import os
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

from testing.client import TIMEOUT
from tri_glide_kinematics.ros.starting import EndSignals, raise_at_signals

BOTH = (signal.SIGINT, signal.SIGTERM)
ALL = (*BOTH, signal.SIGHUP)


@pytest.fixture
def signals():
    before = {number: signal.getsignal(number) for number in ALL}
    yield EndSignals()
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", ALL)
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
            assert child.wait(TIMEOUT) == 0
        finally:
            child.kill()


def test_a_closed_terminal_counts_once_however_often_it_is_told(signals):
    signals.call(lambda: None)
    for _ in range(3):
        os.kill(os.getpid(), signal.SIGHUP)
    assert signals.came == [signal.SIGHUP]


def test_a_process_that_ignores_a_closed_terminal_from_its_start_goes_on():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    numbers = {number: signal.getsignal(number) for number in BOTH}
    try:
        signals = EndSignals()
        os.kill(os.getpid(), signal.SIGHUP)
        assert signals.came == []
        raise_at_signals()
        os.kill(os.getpid(), signal.SIGHUP)
    finally:
        for number, handler in {**numbers, signal.SIGHUP: before}.items():
            signal.signal(number, handler)


def test_none_disturbs_the_end(signals):
    signals.ignore()
    for number in ALL:
        os.kill(os.getpid(), number)
    assert signals.came == []


def test_what_is_written_after_a_closed_terminal_goes_nowhere_if_nobody_reads_it():
    text = f"""
import os, signal
from {EndSignals.__module__} import EndSignals
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup ignores it for all that it starts
signals = EndSignals()
signals.call(lambda: None)
print("ready", flush=True)
while not signals.came:
    signal.sigtimedwait((), 0.01)
print("nobody reads this", flush=True)
os.write(2, b"the end")
"""
    with subprocess.Popen(
        (sys.executable, "-c", text), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout.readline() == "ready\n"
        child.stdout.close()
        child.send_signal(signal.SIGHUP)
        # What somebody reads still gets there.
        assert child.stderr.read() == "the end"
        assert child.wait(TIMEOUT) == 0


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_after_a_hang_up_what_is_written_does_not_fail(stream):
    code = (
        "import os, signal, sys\n"
        "from tri_glide_kinematics.ros.starting.run import at_hang_up\n"
        "at_hang_up(input)\n"
        "os.kill(os.getpid(), signal.SIGHUP)\n"
        f"print('to nobody', file=sys.{stream}, flush=True)\n"
        "sys.exit(7)\n"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdin=subprocess.PIPE, **{stream: subprocess.PIPE}) as process:
        getattr(process, stream).close()
        process.communicate(b"\n")
        assert process.returncode == 7
