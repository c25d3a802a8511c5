"""Runs a node, from its entry point to an end without a traceback.

Nothing of ROS is imported before the first line of an entry point has run, so that Ctrl-C ends the
process at once while modules are still being loaded, and a missing module gets one clear line.
"""

from __future__ import annotations

import ctypes
import gc
import os
import select
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.node import Node

    from tri_glide_kinematics.ros.loop import Cycle
    from tri_glide_kinematics.settings import Values

# Asks the system for what keeps a cycle punctual: a priority, memory that stays, a core.

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


def at_hang_up(act: Callable[[], object]) -> None:
    """Do something at the first SIGHUP, unless the process ignores it from its start (``nohup``).

    A closed terminal may send it more than once, which is no impatience.
    """

    def handle(*_: object) -> None:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        # To write where nobody reads any more would fail.
        outputs = select.poll()
        for descriptor in (1, 2):
            outputs.register(descriptor, 0)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for broken in outputs.poll(0):
            os.dup2(nowhere, broken[0])
        act()

    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, handle)


def raise_at_signals() -> None:
    """Let each signal that ends this process raise an exception: it ends its own ones first."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    at_hang_up(lambda: os.kill(os.getpid(), signal.SIGTERM))


class EndSignals:
    """Handles SIGINT, SIGTERM and SIGHUP for a process, from its making on.

    Handlers of rclpy that are replaced while a node gets ready lose a signal that comes then. This
    one stays; those of rclpy are not installed at all, or later, and then call this one, too. While
    there is nothing to stop yet, a second signal ends the process at once.

    Attributes:
        came: numbers of those that have come, the first one first.
    """

    def __init__(self) -> None:
        """Handle them from now on."""
        self.came: list[int] = []
        self._stop: Callable[[], None] | None = None
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._handle)
        at_hang_up(lambda: self._handle(signal.SIGHUP, None))

    def ignore(self) -> None:
        """Let none of them disturb the end of the process."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)

    def call(self, stop: Callable[[], None]) -> None:
        """Let each of them call ``stop``, at once if one has come."""
        self._stop = stop
        if self.came:
            stop()

    def _handle(self, number: int, _: object) -> None:
        self.came.append(number)
        if self._stop is not None:
            self._stop()
        elif len(self.came) > 1:
            os._exit(0)


# The package that pip is to install where a module is missing, and another way to get it. The
# Python of Ubuntu lets pip install into an environment only.
ENVIRONMENT = "python3 -m venv --system-site-packages ~/venv && . ~/venv/bin/activate && "
FROM_PIP = {"numpy": "numpy", "ruckig": "ruckig", "viser": "viser==1.1.1"}
INSTEAD = {"ruckig": "build the package tri_glide_ruckig of the same repository, or "}


# Environment variables that numpy reads when it is first imported.
NUMPY_SETTINGS = {
    # Matrices are small here. A second thread of OpenBLAS only takes time: 40 ms at the start.
    "OPENBLAS_NUM_THREADS": "1",
    # The first use of a huge page may take 5 ms: more than two cycles.
    "NUMPY_MADVISE_HUGEPAGE": "0",
}


class FatalError(Exception):
    """An error in a node's own cycle: it cannot go on.

    It is no ``KinematicsError``, or who answers those would catch it.
    """


def run(module: str, class_name: str) -> int:
    """Run a node until SIGINT, SIGTERM or SIGHUP.

    The node has the last part of the name of its ``module`` for a name, and is made without
    arguments. The exit code is 0 after a signal, 1 if the node could not start or go on.
    """
    # Until they are handled below, all signals just end the process.
    signal.signal(signal.SIGINT, lambda *_: os._exit(0))
    for name, value in NUMPY_SETTINGS.items():
        os.environ.setdefault(name, value)
    # While a node starts, nothing becomes garbage.
    gc.disable()
    try:
        code = import_module(module)
        node_class = getattr(code, class_name)
    except ModuleNotFoundError as error:
        return _fail(_missing(error.name or str(error)))
    except ImportError as error:
        return _fail(str(error).splitlines()[0])
    import rclpy
    from rclpy.exceptions import ParameterException
    from rclpy.signals import SignalHandlerOptions

    from tri_glide_kinematics.errors import KinematicsError
    from tri_glide_kinematics.ros.cdr import read_within_bytes
    from tri_glide_kinematics.ros.starting.transport import choose_transport
    from tri_glide_kinematics.settings import (
        NODES,
        check_arguments,
        help_text,
        help_wanted,
        in_words,
        sources_of,
    )

    name = module.rpartition(".")[2]
    arguments = sys.argv[1:]
    if help_wanted(arguments):
        print(help_text(name, code.__doc__ or "", NODES.get(name, ())))
        return 0
    try:
        check_arguments(name, arguments)
        sources_of(arguments)
        transport = choose_transport()
    except KinematicsError as error:
        return _fail(f"{name}: {error}")
    signals = EndSignals()
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        return _fail(f"{name}: {in_words(error, arguments)}")
    try:
        instance = node_class()
    except Exception as error:
        shut_down()
        if isinstance(error, (KinematicsError, ParameterException)):
            return _fail(f"{name}: {error}")
        raise
    read_within_bytes(instance)
    if transport.can_stall:
        instance.get_logger().warning(transport.text)
    else:
        instance.get_logger().info(transport.text)
    try:
        _spin(instance, instance.cycle, signals)
    except FatalError as error:
        instance.get_logger().fatal(str(error))
        return 1
    finally:
        signals.ignore()
        shut_down()
    return 0


def shut_down() -> None:
    """End the use of rclpy, unless a signal does the same at this very moment."""
    from rclpy.utilities import try_shutdown

    with suppress(RuntimeError):
        try_shutdown()


def _spin(node: Node, cycle: Cycle, signals: EndSignals) -> None:
    """Work until a signal comes.

    rclpy's own services raise on some contents (a parameter of an unknown type, for instance).
    That is the sender's mistake and must not stop a machine, so it is logged and survived.
    """
    from tri_glide_kinematics.ros.loop import CycleLoop, ErrorLog

    errors = ErrorLog(node)

    def survive(error: Exception) -> None:
        if isinstance(error, FatalError):
            raise error
        errors.add(error)

    # Numbers that nobody sends need no priority.
    if node.has_parameter("realtime_priority"):
        ask_of_system(node)
    loop = CycleLoop(node, cycle, survive)
    # It is never asleep for long, and may still send something at its end.
    signals.call(loop.stop)
    # Objects made so far stay. The collector of garbage need not look at them again and again,
    # which takes longer than a fast cycle.
    gc.freeze()
    gc.enable()
    try:
        loop.spin()
    finally:
        gc.unfreeze()
        # Left to the end of the interpreter, what it holds may be gone before it, which Python 3.10
        # reports with a traceback.
        loop.close()


def _missing(module: str) -> str:
    if module not in FROM_PIP:
        return f"the Python module {module!r} is missing: is ROS 2 sourced?"
    command = f"python3 -m pip install {FROM_PIP[module]}"
    if sys.prefix == sys.base_prefix:
        command = ENVIRONMENT + command
    return f"the Python module {module!r} is missing: {INSTEAD.get(module, '')}{command}"


def _fail(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return 1
