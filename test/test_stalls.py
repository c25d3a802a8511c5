"""Whether the soak of goals notices that a processor stands still."""

import os
import subprocess
import sys
import time

import pytest

from testing.stalls import Stalls
from testing.waiting import wait_until

# Before the watching processes, on the last processor, for 30 ms.
BEFORE_ALL = """
import os, time
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(95))
end = time.monotonic() + 0.03
while time.monotonic() < end:
    pass
"""


def real_time_is_allowed() -> bool:
    """Return whether processes may go before all others here."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(95))
    except PermissionError:
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


@pytest.mark.skipif(not real_time_is_allowed(), reason="needs real-time priority")
def test_a_processor_that_stands_still_is_noticed():
    with Stalls() as stalls:
        wait_until(lambda: stalls.are_watching, "all watchers")
        begin = time.monotonic()
        subprocess.run([sys.executable, "-c", BEFORE_ALL], check=True)
        end = time.monotonic()
        stood_still = stalls.longest(begin, end)
    assert 0.025 < stood_still < end - begin
