"""A process that has imported all nodes, and forks whenever one of them is to be started.

Two thirds of the work of starting a node are imports, which are the same for all of them. A fork
runs the installed executable, as it is, from its first line to its last. It only leaves out the end
of the interpreter, as LTTng, a part of rcl, would end its threads there, which are not in a fork.

Run it as ``python -m testing.fork_server FILE_DESCRIPTOR``.
"""

import gc
import os
import runpy
import signal
import sys
from importlib import import_module
from importlib.util import find_spec
from multiprocessing.connection import Connection, wait
from threading import active_count
from traceback import print_exc
from typing import Any, NamedTuple, NoReturn

from tri_glide_kinematics.ros.starting import NUMPY_SETTINGS

MODULES = (
    "rclpy.executors",
    "tri_glide_kinematics.nodes.calibration_node",
    "tri_glide_kinematics.commands.drive",
    "tri_glide_kinematics.nodes.fk_node",
    "tri_glide_kinematics.nodes.ik_node",
    "tri_glide_kinematics.nodes.mechanism_node",
    "tri_glide_kinematics.nodes.pick_node",
    "tri_glide_kinematics.nodes.simulated_cell_node",
    "tri_glide_kinematics.nodes.simulator_node",
    "tri_glide_kinematics.settings.arguments",
    "tri_glide_kinematics.ros.starting.run",
    "tri_glide_kinematics.ros.starting.transport",
)
# Only where what they need is installed.
CAN = "tri_glide_kinematics.nodes.cia402_node"
PANEL = "tri_glide_kinematics.panel.panel_node"


class Job(NamedTuple):
    """What a fork is to do.

    Attributes:
        command: path of an executable written in Python, or the interpreter, ``-m`` and the name
            of a module; then its arguments.
        environment: all variables.
        log: file to which its output is appended; None for the output of the server.
    """

    command: tuple[str, ...]
    environment: dict[str, str]
    log: str | None


def load() -> None:
    """Import all that nodes need, and the libraries of those messages that every node uses."""
    # As the executables do, but always: a thread of OpenBLAS would not survive a fork.
    os.environ.update(NUMPY_SETTINGS)
    for needed, module in (("viser", PANEL), ("canopen", CAN)):
        if find_spec(needed):
            import_module(module)
    for module in MODULES:
        import_module(module)
    from rcl_interfaces.msg import Log, ParameterEvent
    from rclpy.type_support import check_for_type_support

    for kind in (Log, ParameterEvent):
        check_for_type_support(kind)
    # Those of LTTng, which sleep unless somebody traces, do not count.
    if active_count() > 1:
        raise RuntimeError(f"{active_count()} threads run: only one of them would be in a fork")
    gc.collect()
    gc.freeze()


def serve(connection: Connection) -> Job | None:
    """Fork once for each job that comes in, and tell the ends of the forks.

    What is sent for a start is a number, that of the process; for an end this number and the exit
    code as subprocess has it, -9 after SIGKILL.

    Returns:
        In a fork its job, in the server None, when nobody asks any more.
    """
    forks: dict[int, int] = {}
    while True:
        for ready in wait([connection, *forks]):
            try:
                if isinstance(ready, int):
                    pid, status = os.waitpid(forks.pop(ready), 0)
                    os.close(ready)
                    connection.send((pid, os.waitstatus_to_exitcode(status)))
                    continue
                job: Any = connection.recv()
                pid = os.fork()
                if pid:
                    forks[os.pidfd_open(pid)] = pid
                    connection.send(pid)
                    continue
            except (EOFError, OSError):
                # Nobody is there any more who would end them.
                for pid in forks.values():
                    os.kill(pid, signal.SIGKILL)
                return None
            connection.close()
            for other in forks:
                os.close(other)
            return Job(*job)


def run(job: Job) -> NoReturn:
    """Be the process that was asked for."""
    # In a session of its own, as all processes of nodes.
    os.setsid()
    os.environ.clear()
    os.environ.update(job.environment)
    if job.log is not None:
        log = os.open(job.log, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.close(log)
    is_module = job.command[1:2] == ("-m",)
    sys.argv = list(job.command[2 * is_module :])
    code = 1
    try:
        if is_module:
            runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
        else:
            runpy.run_path(sys.argv[0], run_name="__main__")
        code = 0
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:
        print_exc()
    # What is left of a node says goodbye to the others.
    gc.collect()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    # Nodes come from where they are installed, not from the folder in which this runs.
    if sys.path[0] == os.getcwd():
        del sys.path[0]
    load()
    todo = serve(Connection(int(sys.argv[1])))
    if todo is not None:
        run(todo)
