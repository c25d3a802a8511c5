"""How long it takes to read programs of very many lines and to prove them, and how much memory.

Run it as ``python -m benchmarks.long_programs 200000 1000000``; each count of lines is a process of
its own for each kind of program. Times are of the processor.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import count as count_up
from itertools import islice
from pathlib import Path

import numpy as np

from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.programs import Dialect, ProgramSettings, check_program, load_program
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
WORKSPACE = Workspace(
    TriGlide(DEFAULT_GEOMETRY), WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 10.0)
)
START = (0.05, 0.0, 0.3)


def cut(count: int, feed: int) -> Iterator[str]:
    """Yield a smooth course of lines of 0.1 mm, as a CAM program has them."""
    yield f"G21 G90 G64 P0.02\nG1 F{feed}\n"
    angles = np.arange(1, count - 2) * 1e-4 / 0.05
    for a in angles.tolist():
        x, y, z = 50.0 * np.cos(a), 40.0 * np.sin(1.3 * a), 300.0 + 20.0 * np.sin(0.7 * a)
        yield f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}\n"
    yield "M2\n"


def slices(count: int) -> Iterator[str]:
    """Yield rows of lines with extrusion, as a slicer has them."""
    yield "M104 S200\nG21\nG90\nM83\nG1 X-30 Y-30 Z300 F6000\n"
    for number in range(count - 6):
        x, y = 1.5 * (number % 41) - 30.0, 0.4 * (number // 41 % 150) - 30.0
        x = -x if number // 41 % 2 else x
        z = 280.0 + 0.2 * (number // 6150 % 200)
        words = f" Z{z:.3f} F{1800 + 600 * (number % 7)}" if number % 6150 == 0 else ""
        yield f"G1 X{x:.3f} Y{y:.3f}{words} E{0.05 + 0.001 * (number % 7):.5f}\n"
    yield "M84 X Y E\n"


def layers(count: int) -> Iterator[str]:
    """Yield layers of outlines, wide rows and short moves that reverse, as a slicer mixes them."""
    yield from islice(_layers(), count - 1)
    yield "M107\n"


def _layers() -> Iterator[str]:
    yield "G21 G90\n"
    for layer in count_up():
        for radius in (28.0, 27.6, 8.0):
            yield f"G0 F9000 X{radius} Y0 Z{280.0 + 0.2 * (layer % 200):.3f}\n"
            steps = int(2.0 * np.pi * radius / 0.6)
            angles = 2.0 * np.pi / steps * np.arange(1, steps + 1)
            waves = radius + 0.3 * np.sin(9.0 * angles)
            for x, y in zip(waves * np.cos(angles), waves * np.sin(angles)):
                yield f"G1 F1800 X{x:.3f} Y{y:.3f} E{0.02 * layer:.5f}\n"
        for rows, width, step in ((70, 20.0, 0.4), (120, 0.8, 0.3)):
            left, y = -25.0 + 15.0 * (0.618 * layer % 1.0), -15.0 + 15.0 * (0.755 * layer % 1.0)
            yield f"G0 F9000 X{left:.3f} Y{y:.3f}\n"
            for row in range(rows):
                x, y = left + (width if row % 2 == 0 else 0.0), y + step
                yield f"G1 F3000 X{x:.3f} Y{y - step:.3f} E{0.02 * layer:.5f}\n"
                yield f"G1 F3000 X{x:.3f} Y{y:.3f} E{0.02 * layer:.5f}\n"


PROGRAMS = {
    "cut at 20 mm/s": (Dialect.NIST, lambda count: cut(count, 1200)),
    "cut at 100 mm/s": (Dialect.NIST, lambda count: cut(count, 6000)),
    "cut as fast as may be": (Dialect.NIST, lambda count: cut(count, 60000)),
    "slices": (Dialect.MARLIN, slices),
    "layers": (Dialect.MARLIN, layers),
}


def memory() -> float:
    """Return the most memory that this process has had [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def measure(name: str, count: int) -> None:
    """Print the row of one program."""
    dialect, lines = PROGRAMS[name]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "program.ngc"
        with file.open("w") as output:
            output.writelines(lines(count))
        before = time.process_time()
        program = load_program(file, ProgramSettings(dialect, START))
    read, most_read = time.process_time() - before, memory()
    before = time.process_time()
    told = check_program(program, WORKSPACE, LIMITS)
    checked = time.process_time() - before
    print(
        f"| {name} | {program.lines:,} | {read:.1f} s | {most_read:.0f} MB | {checked:.1f} s | "
        f"{memory():.0f} MB | {told.duration:.0f} s |",
        flush=True,
    )


def main() -> None:
    """Measure each program in a process of its own."""
    if sys.argv[1] in PROGRAMS:
        measure(sys.argv[1], int(sys.argv[2]))
        return
    print("| program | lines | read | memory | check | memory | it lasts |")
    print("|---" * 7 + "|")
    for count in sys.argv[1:]:
        for name in PROGRAMS:
            command = [sys.executable, "-m", "benchmarks.long_programs", name, count]
            subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
