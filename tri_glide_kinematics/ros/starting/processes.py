"""Nodes of this package as processes: started from the installed executables, ended for certain."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import PARAMETERS

PACKAGE = "tri_glide_kinematics"
SET_SIGNAL_OF_PARENTS_END = 1  # of prctl
STOP_TIMEOUT = 5.0  # s, until a process that ignores SIGINT is killed


def executable(name: str) -> Path:
    """Return the path of an installed executable of this package."""
    return Path(get_package_prefix(PACKAGE), "lib", PACKAGE, name)


def default_parameter_file() -> Path:
    """Return the installed ``config/tri_glide.yaml``."""
    return Path(get_package_share_directory(PACKAGE), "config", PARAMETERS)


class LaunchError(KinematicsError):
    """Something that a launch is to use is not there; the text names it."""


def check_launch(files: Iterable[str], packages: Iterable[str]) -> None:
    """Check, before a launch starts anything, that what it is to use is there.

    ROS itself only warns of a parameter file that is not there, and starts a node without it.

    Args:
        files: named by the arguments of the launch.
        packages: of ROS, whose nodes it starts.

    Raises:
        LaunchError: if a file or a package is missing.
    """
    for file in files:
        if not Path(file).is_file():
            raise LaunchError(f"there is no file {file!r}: nothing is started")
    for package in packages:
        try:
            get_package_prefix(package)
        except PackageNotFoundError as error:
            raise LaunchError(f"{package} is not installed: nothing is started") from error


def ending(code: int) -> str:
    """Return in words how a process has ended, by its exit ``code`` as subprocess has it."""
    if code >= 0:
        return f"exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"killed by signal {-code}"
    # Nobody else does so unasked.
    why = ", as the system does when memory is short" if -code == signal.SIGKILL else ""
    return f"killed by {name} (signal {-code}){why}"


class Process(Protocol):
    """The used part of a ``subprocess.Popen``; tests put forks in its place."""

    pid: int
    args: Any
    returncode: int | None

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end, for at most ``timeout`` seconds, and return the exit code."""

    def send_signal(self, number: int, /) -> None:
        """Send a signal, unless it has ended."""

    def kill(self) -> None:
        """Kill it, unless it has ended."""


class NodeProcesses:
    """Processes of nodes; leaving the context ends those that still run."""

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        """Start processes with ``environment`` on top of this process's own."""
        self._environment = {**os.environ, **(environment or {})}
        self._processes: list[Process] = []

    def start(
        self,
        name: str,
        ros_arguments: Sequence[str] = (),
        log: Path | None = None,
        prefix: Sequence[str] = (),
    ) -> Process:
        """Start the node ``name``.

        Args:
            name: of the executable.
            ros_arguments: what follows ``--ros-args``.
            log: file to which its output is appended; without it, it goes where ours goes.
            prefix: command that starts it, ``ip netns exec NAME`` for instance.

        Raises:
            FileNotFoundError: if the executable is not installed.
        """
        command = [*prefix, str(executable(name)), "--ros-args", *ros_arguments]
        return self.start_command(command, log)

    def start_command(self, command: Sequence[str], log: Path | None = None) -> Process:
        """Start a node by its whole ``command``; ``log`` as for ``start``."""
        with ExitStack() as stack:
            output = stack.enter_context(log.open("ab")) if log else None
            # In a session of its own a node is spared the Ctrl-C of our terminal: ``stop`` ends it.
            process = subprocess.Popen(
                command,
                env=self._environment,
                stdout=output,
                stderr=subprocess.STDOUT if log else None,
                start_new_session=True,
                # However we end, it does not go on alone.
                preexec_fn=lambda: ctypes.CDLL(None).prctl(
                    SET_SIGNAL_OF_PARENTS_END, signal.SIGTERM
                ),
            )
        self._processes.append(process)
        return process

    def stop(self) -> None:
        """End all processes: politely first, then for certain, however impatient the user is."""
        try:
            for process in self._processes:
                if process.poll() is None:
                    process.send_signal(signal.SIGINT)
            for process in self._processes:
                process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            pass
        finally:
            for process in self._processes:
                process.kill()
                process.wait()
            self._processes.clear()

    def __enter__(self) -> NodeProcesses:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End all processes."""
        self.stop()
