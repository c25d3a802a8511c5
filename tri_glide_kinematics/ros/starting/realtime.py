"""Asks the system for what keeps a cycle punctual: a priority, memory that stays, a core."""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tri_glide_kinematics.settings import Values

if TYPE_CHECKING:
    from rclpy.node import Node

# Of prctl [ns].
SET_TIMER_SLACK = 29
# Of mlockall: all that the process has, and all that it will get.
CURRENT_AND_FUTURE = 3

LIMITS = "/etc/security/limits.conf"
PRIORITY_REMEDY = f"allow it by 'rtprio' in {LIMITS}, or give the process CAP_SYS_NICE"
MEMORY_REMEDY = f"allow it by 'memlock unlimited' in {LIMITS}, or give the process CAP_IPC_LOCK"


def ask_of_system(node: Node) -> None:
    """Ask for what the parameters of ``node`` name, and warn of what the system refuses."""
    wake_in_time()
    names = ("realtime_priority", "lock_memory", "cpu_core")
    refused = refusals({name: node.get_parameter(name).value for name in names})
    if refused:
        settings = "; ".join(refused)
        node.get_logger().warning(f"the system refused, and the node runs without: {settings}")


def wake_in_time() -> None:
    """End each sleep of this thread within 1 us of its time.

    By default the system may take 50 more, so as to save energy. Every process may ask for this.
    """
    with suppress(AttributeError):
        ctypes.CDLL(None).prctl(SET_TIMER_SLACK, ctypes.c_ulong(1000))


def refusals(values: Values) -> list[str]:
    """Ask for what ``values`` name.

    Args:
        values: ``realtime_priority`` (0 for none), ``lock_memory`` and ``cpu_core`` (-1 for any).

    Returns:
        For each that the system refuses: why, and what can be done.
    """
    priority, core = values["realtime_priority"], values["cpu_core"]
    asked: list[tuple[bool, str, Callable[[], None], str]] = [
        (
            priority > 0,
            f"realtime_priority {priority}",
            lambda: set_priority(priority),
            PRIORITY_REMEDY,
        ),
        (values["lock_memory"], "lock_memory", lock_memory, MEMORY_REMEDY),
        (core >= 0, f"cpu_core {core}", lambda: set_core(core), f"it may use {_cores()}"),
    ]
    reasons = []
    for is_wanted, what, ask, remedy in asked:
        try:
            if is_wanted:
                ask()
        except OSError as error:
            reasons.append(f"{what} ({error.strerror}: {remedy})")
        except AttributeError:
            reasons.append(f"{what} (only Linux has it)")
    return reasons


def set_priority(priority: int) -> None:
    """Run this thread by SCHED_FIFO, and all other threads of the process one level below it.

    Raises:
        OSError: if the system refuses it.
    """
    # Those of the middleware must not wait behind other processes, and the cycle not behind them.
    below = os.sched_param(max(priority - 1, 1))
    # This thread first: if the system refuses that, nothing is changed.
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    own = threading.get_native_id()
    for thread in _threads():
        if thread != own:
            with suppress(ProcessLookupError):
                os.sched_setscheduler(thread, os.SCHED_FIFO, below)


def lock_memory() -> None:
    """Keep all memory of this process from being swapped out.

    Raises:
        OSError: if the system refuses it.
    """
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(CURRENT_AND_FUTURE) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def set_core(core: int) -> None:
    """Keep all threads of this process on one core.

    Raises:
        OSError: if there is no such core, or the process must not use it.
    """
    for thread in _threads():
        with suppress(ProcessLookupError):
            os.sched_setaffinity(thread, {core})


def _threads() -> list[int]:
    """Return the threads of this process, of which one may end at any time."""
    return [int(task.name) for task in Path("/proc/self/task").iterdir()]


def _cores() -> str:
    try:
        cores = sorted(os.sched_getaffinity(0))
    except AttributeError:
        return "any core"
    return f"core {', '.join(map(str, cores))}" if cores else "no core"
