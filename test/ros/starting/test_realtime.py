"""What a node asks of the system, in processes of its own: such a wish cannot be taken back."""

import json
import os
import subprocess
import sys

import pytest

ASK = """
import json, os, resource, sys, threading
from tri_glide_kinematics.ros.starting.run import refusals

values, is_poor = json.loads(sys.argv[1]), json.loads(sys.argv[2])
if is_poor:
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0))
    if os.getuid() == 0:
        os.setuid(65534)
threading.Thread(target=threading.Event().wait, daemon=True).start()
texts = refusals(values)
threads = [int(name) for name in os.listdir("/proc/self/task")]
cores = [sorted(os.sched_getaffinity(thread)) for thread in threads]
kinds = [os.sched_getscheduler(thread) for thread in threads]
with open("/proc/self/status") as status:
    locked = next(int(line.split()[1]) for line in status if line.startswith("VmLck"))
print(json.dumps([texts, cores, kinds, locked]), flush=True)
os._exit(0)
"""
NOTHING = {"realtime_priority": 0, "lock_memory": False, "cpu_core": -1}
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the system has none of this")


def ask(is_poor=False, **values):
    """Return the refusals, and the cores and policies of all threads, and the locked memory."""
    done = subprocess.run(
        [sys.executable, "-c", ASK, json.dumps({**NOTHING, **values}), json.dumps(is_poor)],
        capture_output=True,
        text=True,
        check=True,
        timeout=60.0,
    )
    return json.loads(done.stdout)


def test_by_default_nothing_is_asked_for():
    allowed = sorted(os.sched_getaffinity(0))
    texts, cores, kinds, locked = ask()
    assert texts == []
    assert all(each == allowed for each in cores)
    assert set(kinds) == {os.sched_getscheduler(0)}
    assert locked == 0


def test_all_threads_stay_on_the_core():
    core = max(os.sched_getaffinity(0))
    texts, cores, *_ = ask(cpu_core=core)
    assert texts == []
    assert len(cores) > 1
    assert all(each == [core] for each in cores)


def test_a_core_that_is_not_there_is_told_with_those_that_are():
    ((text,), *_) = ask(cpu_core=4095)
    allowed = ", ".join(map(str, sorted(os.sched_getaffinity(0))))
    assert text == f"cpu_core 4095 (Invalid argument: it may use core {allowed})"


def test_what_the_system_refuses_is_told_with_what_to_do():
    texts, _, kinds, locked = ask(is_poor=True, realtime_priority=80, lock_memory=True)
    priority, memory = texts
    assert priority.startswith("realtime_priority 80 (Operation not permitted: ")
    assert "rtprio" in priority
    assert "CAP_SYS_NICE" in priority
    assert memory.startswith("lock_memory (")
    assert "memlock" in memory
    assert "CAP_IPC_LOCK" in memory
    assert set(kinds) == {os.SCHED_OTHER}
    assert locked == 0


def test_what_is_allowed_is_given():
    texts, _, kinds, locked = ask(realtime_priority=2, lock_memory=True)
    refused = {text.split()[0] for text in texts}
    assert ("realtime_priority" in refused) != (set(kinds) == {os.SCHED_FIFO})
    assert ("lock_memory" in refused) != (locked > 0)


def test_a_thread_wakes_within_a_microsecond_of_its_time():
    get_slack = 30
    program = (
        "import ctypes; from tri_glide_kinematics.ros.starting import run; "
        "run.wake_in_time(); "
        f"print(ctypes.CDLL(None).prctl({get_slack}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60.0
    )
    assert int(done.stdout) == 1000
