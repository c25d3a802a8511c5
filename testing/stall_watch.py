"""A process that only sleeps, before all others on one processor: it is late if that stands still.

Run it as ``python stall_watch.py PROCESSOR``. Until it is ended it writes a line for each time when
it was late: when it was to wake up, and how much later it did [s], by the monotonic clock. Where it
may not go before all others, it ends at once.
"""

import os
import sys
import time

PERIOD = 0.001  # s
LATE = 0.001  # s

os.sched_setaffinity(0, {int(sys.argv[1])})
try:
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(90))
except PermissionError:
    sys.exit()
print("watching", flush=True)
while True:
    due = time.monotonic() + PERIOD
    time.sleep(PERIOD)
    late = time.monotonic() - due
    if late > LATE:
        print(due, late, flush=True)
