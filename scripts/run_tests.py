"""All tests: those with nodes, beside them those without nodes, and last those that measure time.

Nodes wait for much of their time. The tests without nodes get what they leave: processes that Linux
calls idle run only while no other one wants to. Where it has no such processes, or the computer has
other work to do, for which they would wait, they come first.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

PYTEST = (sys.executable, "-m", "pytest")
# Tests that start nodes, at the same time: with three, nodes miss their cycles on two cores.
NODE_TESTS = os.environ.get("NODE_TESTS", "2")
WITHOUT_NODES = ("-n", "auto", "-m", "not nodes and not alone", "--ignore=test/integration")
WITH_NODES = ("-n", NODE_TESTS, "--dist", "loadfile", "--no-loadscope-reorder")
WITH_NODES += ("-m", "nodes and not alone", "test/integration")
ALONE = ("-m", "alone")
# A computer is quiet if the processors are idle for this part of so long [s].
QUIET, WATCHED = 0.7, 1.0


def files_with(mark: str) -> list[str]:
    """Return the test files in which a mark stands: each run collects only what it runs."""
    files = sorted(Path("test").rglob("test_*.py"))
    return [str(file) for file in files if f"mark.{mark}" in file.read_text(encoding="utf-8")]


def idle_time() -> float:
    """Return for how long all processors together have been idle [s]."""
    return float(Path("/proc/uptime").read_text(encoding="ascii").split()[1])


def is_quiet() -> bool:
    """Tell whether the processors have little to do."""
    before = idle_time()
    time.sleep(WATCHED)
    return idle_time() - before > QUIET * WATCHED * (os.cpu_count() or 1)


def be_idle() -> None:
    """Let this process, and all that it starts, run only while no other process wants to."""
    # Each session has a share of its own, whatever its processes are: it gets the smallest one.
    with suppress(OSError):
        Path("/proc/self/autogroup").write_text("19", encoding="ascii")
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def run(arguments: Sequence[str]) -> bool:
    """Run tests, and return whether they have passed."""
    tests = subprocess.Popen([*PYTEST, *arguments])
    try:
        return tests.wait() == 0
    except KeyboardInterrupt:
        # They have heard it, too, and end what they have started.
        tests.wait()
        raise


def run_beside(with_nodes: Sequence[str]) -> bool:
    """Run those without nodes beside those with nodes; return whether all have passed."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        beside = subprocess.Popen(
            [*PYTEST, *WITHOUT_NODES],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            preexec_fn=be_idle,
        )
        try:
            passed = run(with_nodes)
            print("\nTests without nodes, which ran beside these", flush=True)
            passed = beside.wait() == 0 and passed
            output.seek(0)
            print(output.read(), flush=True)
        finally:
            if beside.poll() is None:
                os.killpg(beside.pid, signal.SIGTERM)
    return passed


def main() -> int:
    """Run all tests, and return the exit code."""
    others = [file for file in files_with("nodes") if not file.startswith("test/integration")]
    with_nodes = [*WITH_NODES, *others]
    if hasattr(os, "SCHED_IDLE") and is_quiet():
        passed = run_beside(with_nodes)
    else:
        passed = run(WITHOUT_NODES) and run(with_nodes)
    return 0 if run([*ALONE, *files_with("alone")]) and passed else 1


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        sys.exit(main())
    sys.exit(128 + signal.SIGINT)
