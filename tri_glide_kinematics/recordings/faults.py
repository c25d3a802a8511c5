"""The last seconds before each fault of a machine, in files that ``load_recording`` reads."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from struct import Struct
from threading import Thread

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import file_of_machine, write_file
from tri_glide_kinematics.interruptible import blocks
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.recordings.setpoint_files import COLUMNS, MEASURED, TABLE_ENDING
from tri_glide_kinematics.vectors import FloatArray, Vector3

# What is kept of the time before a fault, and at most of the ramp down behind it [s].
BEFORE, RAMP = 10.0, 2.0
KEPT = 5  # files of a machine

HEADS = (*COLUMNS[:7], *MEASURED)
ROW = Struct(f"{len(HEADS)}d")
# So many rows are made a text before the cycle may go on: a third of a millisecond, about.
ROWS = 50
PAUSE = 0.001  # s


def fault_folder(namespace: str = "") -> Path:
    """Return the folder with the recordings of faults of the machine in a ``namespace``.

    Raises:
        NoHomeError: if the user has no home.
    """
    return file_of_machine("faults", namespace)


def fault_recordings(folder: Path) -> list[Path]:
    """Return the recordings in a ``folder``, the newest first: their names tell the time."""
    return sorted(folder.glob(f"*{TABLE_ENDING}"), reverse=True)


class FaultRecorder:
    """Keeps the last setpoints and measured heights, and writes them after each fault.

    A file has the ramp down, too: it is written when the setpoints rest, by a thread.
    """

    def __init__(
        self,
        namespace: str,
        period: float,
        height_offsets: Vector3,
        clock: Callable[[], datetime],
        tell: Callable[[str], object],
        warn: Callable[[str], object],
    ) -> None:
        """Have no setpoint yet.

        Args:
            namespace: of the machine.
            period: time from one setpoint to the next [s].
            height_offsets: true heights less those that the drives are told. Shape (3,) [m].
            clock: tells the time of the day.
            tell: gets a line about each file.
            warn: gets why there is none.
        """
        self._namespace = namespace
        self._offsets = height_offsets
        self._clock, self._tell, self._warn = clock, tell, warn
        self._size = round((BEFORE + RAMP) / period) * ROW.size
        self._rows, self._count = bytearray(self._size), 0
        self._in_fault = False
        self._due: tuple[float, str] | None = None

    def add(self, now: float, setpoint: SliderState, measured: Vector3 | None) -> None:
        """Keep the setpoint of a cycle, and the latest heights that were measured [m]."""
        place = self._count * ROW.size % self._size
        self._count += 1
        heights, velocities = setpoint.heights, setpoint.velocities
        ROW.pack_into(self._rows, place, now, *heights, *velocities, *(measured or heights))

    def look(self, now: float, fault: str | None, *, leads: bool) -> None:
        """Begin to write after a fault, once the setpoints rest.

        Args:
            now: as for ``add`` [s].
            fault: its reason; None without one.
            leads: whether there are setpoints.
        """
        if fault is not None and not self._in_fault:
            self._due = now + RAMP, f"{self._clock():%Y-%m-%d %H:%M:%S}, {fault}"
        self._in_fault = fault is not None
        if self._due is None or (leads and self._in_fault and now < self._due[0]):
            return
        (until, remark), self._due = self._due, None
        # No copy: a large one would take the time of a cycle.
        rows, count = self._rows, self._count
        self._rows, self._count = bytearray(self._size), 0
        writing = (rows, count, until - RAMP, remark)
        Thread(target=self._write, args=writing, name="recording of a fault").start()

    def _write(self, data: bytearray, count: int, fault_at: float, remark: str) -> None:
        rows: FloatArray = np.frombuffer(data).reshape(-1, len(HEADS))
        order = np.arange(max(count - len(rows), 0), count) % len(rows)
        start = rows[order[0], 0]
        offsets = np.array((start, *self._offsets, 0.0, 0.0, 0.0, *self._offsets))
        remark = f"# fault at {fault_at - start:.3f} s: {' '.join(remark.split())}"
        lines = [remark, ",".join(f"{head} [{unit}]" for head, unit in HEADS)]
        for some in blocks(len(order), ROWS):
            part = rows[order[some]] - offsets
            lines += (",".join(map(repr, row)) for row in part.tolist())
            time.sleep(PAUSE)
        name = f"fault_{self._clock():%Y-%m-%d_%H-%M-%S.%f}{TABLE_ENDING}"
        try:
            folder = fault_folder(self._namespace)
            folder.mkdir(parents=True, exist_ok=True)
            write_file(folder / name, "\n".join(lines) + "\n")
            for old in fault_recordings(folder)[KEPT:]:
                old.unlink(missing_ok=True)
        except (OSError, KinematicsError) as error:
            self._warn(f"the fault is not recorded: {error}")
        else:
            self._tell(f"the seconds before the fault are recorded in {folder / name}")
