"""Nodes as processes, with all that they have written."""

import itertools
import os
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from testing import waiting
from tri_glide_kinematics.ros.starting import (
    NodeProcesses,
    Process,
    default_parameter_file,
    executable,
)

# So many characters of what a node has written are shown if something goes wrong with it.
LAST_WORDS = 2000
TIMEOUT = waiting.TIMEOUT
NAP = 0.05  # s, between two looks at all processes
ROOT = Path(__file__).resolve().parents[1]


class RunningNode:
    """One node as a process.

    Attributes:
        exit_codes: with which it may end, in the end.
    """

    def __init__(self, name: str, namespace: str, process: Process, log: Path | None) -> None:
        """Watch the ``process`` of a node; without a ``log`` its output goes where ours goes."""
        self.name = name
        self.namespace = namespace
        self.process = process
        self.exit_codes: tuple[int, ...] = (0, -signal.SIGKILL)
        self._log = log
        self._forgotten = 0

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self.process.pid

    @property
    def output(self) -> str:
        """What it has written since ``forget_output``, or since it was started."""
        return self.written[self._forgotten :]

    def forget_output(self) -> None:
        """Forget what it has written so far."""
        self._forgotten = len(self.written)

    @property
    def written(self) -> str:
        """All that it has written so far."""
        return self._log.read_text(errors="replace") if self._log else ""

    @property
    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self.process.poll() is None

    @contextmanager
    def standing_still(self) -> Iterator[None]:
        """Let the process do nothing meanwhile; what is sent to it waits."""
        self.process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self.process.send_signal(signal.SIGCONT)

    def signal(self, number: int) -> int:
        """Send a signal and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(TIMEOUT)


class Launcher:
    """Starts nodes, those of this project with the parameter file of the README."""

    def __init__(
        self,
        namespace: str = "/",
        folder: Path | None = None,
        processes: type[NodeProcesses] = NodeProcesses,
    ) -> None:
        """Start nodes in ``namespace``, with one log each in ``folder`` if there is one."""
        self._processes = processes({"PYTHONPATH": python_path()})
        self._folder = folder
        self._namespace = namespace
        self._count = itertools.count()
        self.started: list[RunningNode] = []

    def start(
        self,
        name: str,
        parameters: Mapping[str, Any] | None = None,
        *,
        namespace: str | None = None,
        arguments: Sequence[str] = (),
        prefix: Sequence[str] = (),
    ) -> RunningNode:
        """Start the installed executable ``name``; parameters are written as in YAML."""
        command = [*prefix, str(executable(name))]
        words = [*_with_parameters(parameters or {}), *arguments]
        return self._started(name, namespace, command, words)

    def start_module(
        self,
        module: str,
        module_arguments: Sequence[str],
        name: str,
        parameters: Mapping[str, Any] | None = None,
        *,
        namespace: str | None = None,
        arguments: Sequence[str] = (),
    ) -> RunningNode:
        """Start a Python module, which is the node ``name``; bare without ``parameters``."""
        command = [sys.executable, "-m", module, *module_arguments]
        words = [*arguments, *(_with_parameters(parameters) if parameters else ())]
        return self._started(name, namespace, command, words)

    def stop(self) -> None:
        """End all nodes that still run."""
        self._processes.stop()

    def _started(
        self, name: str, namespace: str | None, command: list[str], ros_arguments: list[str]
    ) -> RunningNode:
        namespace = namespace or self._namespace
        log = self._folder / f"{name}_{next(self._count)}.log" if self._folder else None
        command += ["--ros-args", "-r", f"__ns:={namespace}", *ros_arguments]
        process = self._processes.start_command(command, log)
        self.started.append(RunningNode(name, namespace, process, log))
        return self.started[-1]


@contextmanager
def launched(
    folder: Path, namespace: str, processes: type[NodeProcesses] = NodeProcesses
) -> Iterator[Launcher]:
    """Start nodes; afterwards none of them has ended by an error of its own, and all are gone."""
    launcher = Launcher(namespace, folder, processes)
    try:
        yield launcher
    except BaseException:
        for node in launcher.started:
            state = "runs" if node.is_running else f"has ended: {node.process.returncode}"
            print(f"{node.name} {state}\n{node.written[-LAST_WORDS:]}")
        raise
    finally:
        launcher.stop()
    for node in launcher.started:
        assert "Traceback" not in node.written, f"{node.name}:\n{node.written}"
        assert node.process.returncode in node.exit_codes, f"{node.name}:\n{node.written}"


def python_path() -> str:
    """Return where processes find modules: this folder is only for those that are not installed.

    Where it comes first, a node is made of the sources in it, which are compiled at each start.
    """
    paths = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    return os.pathsep.join([*(path for path in paths if Path(path).resolve() != ROOT), str(ROOT)])


def _with_parameters(parameters: Mapping[str, Any]) -> list[str]:
    command = ["--params-file", str(default_parameter_file())]
    for key, value in parameters.items():
        command += ["-p", f"{key}:={_as_yaml(value)}"]
    return command


def _as_yaml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_as_yaml, value)) + "]"
    return str(value)


def processes_in(namespace: str) -> dict[int, list[str]]:
    """Return the words that started each process of a ``namespace``, by its number.

    The graph of ROS does not tell whether a node has ended: on a busy computer one in a hundred
    remains in the graph of another process, whichever way it ends (docs/middleware.md).
    """
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_text(errors="replace").split("\0")
        except OSError:  # it has ended meanwhile
            continue
        if f"__ns:={namespace}" in words:
            found[int(folder.name)] = words
    return found


def wait_for_end_of_processes_in(namespace: str) -> None:
    """Wait until ``processes_in`` a namespace have ended.

    Raises:
        TimeoutError: if one of them remains.
    """
    waiting.wait_until(
        lambda: not processes_in(namespace), f"the end of all nodes in {namespace}", NAP
    )
