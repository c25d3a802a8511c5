"""For how long the processors stood still: times that a host gave to others, for instance.

No process of ours can answer then, whatever its priority is.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import IO

WATCH = Path(__file__).with_name("stall_watch.py")


class Stalls:
    """Watches all processors while its context lasts; needs the right to real-time priority."""

    def __init__(self) -> None:
        """Watch nothing yet."""
        self._stack = ExitStack()
        self._outputs: list[IO[str]] = []

    @property
    def are_watching(self) -> bool:
        """Whether all processors are watched by now."""
        return all(os.fstat(output.fileno()).st_size > 0 for output in self._outputs)

    def longest(self, begin: float, end: float) -> float:
        """Return for how long a processor stood still between two instants [s].

        It is that of all processors which stood still for longest. Less than 1 ms at a time is not
        noticed, and nothing is where processes may not ask for real-time priority.

        Args:
            begin: by the monotonic clock [s].
            end: by the monotonic clock [s].
        """
        return max(
            (
                sum(_common(stall, (begin, end)) for stall in _read(output))
                for output in self._outputs
            ),
            default=0.0,
        )

    def __enter__(self) -> Stalls:
        """Start a process for each processor."""
        with ExitStack() as stack:
            for processor in os.sched_getaffinity(0):
                output = stack.enter_context(tempfile.TemporaryFile("w+"))
                command = [sys.executable, str(WATCH), str(processor)]
                process = stack.enter_context(subprocess.Popen(command, stdout=output))
                stack.callback(process.kill)
                self._outputs.append(output)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """End the processes."""
        self._stack.close()
        self._outputs.clear()


def _read(output: IO[str]) -> list[tuple[float, float]]:
    """Return the begins and ends of what was written so far."""
    # Not by seeking: the process writes where this file is at.
    size = os.fstat(output.fileno()).st_size
    lines = os.pread(output.fileno(), size, 0).decode().splitlines()
    stalls = []
    for line in lines[1:]:
        due, late = map(float, line.split())
        stalls.append((due, due + late))
    return stalls


def _common(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Return the length of what two spans of time have in common."""
    return max(min(first[1], second[1]) - max(first[0], second[0]), 0.0)
