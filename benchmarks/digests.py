"""Digests of what the motion does, to the last bit: whether a change of the code has changed it.

The soaks of motion and controller, cycles of pick and place, and some random paths are run with
fixed seeds. Of all setpoints, all texts of refusals and all states that a controller tells a digest
is made. So that the last bits do not depend on the processor, OpenBLAS, numpy and the C library are
told to use no vector units.

Run it as ``python -m benchmarks.digests``, before and after; ``--write`` keeps the digests of a
short run in ``test/digests.json``, with which a test compares its own.
"""

import hashlib
import json
import os
import platform
import subprocess
import sys
from dataclasses import dataclass, field
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.clock import Clock, ClockType

from benchmarks import soak_controller, soak_motion, soak_picks
from benchmarks.bench_paths import drive
from benchmarks.command_line import numbers
from benchmarks.judge import COARSE, SCENARIOS, Findings
from benchmarks.machine import processor
from testing.path_samples import random_path
from tri_glide_kinematics.control import ControllerStatus, MotionProgress, line_of
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionPhase
from tri_glide_kinematics.motion.engine import Station
from tri_glide_kinematics.reason_log import RefusalLog
from tri_glide_kinematics.ros.outputs.machine_state import machine_state
from tri_glide_kinematics.vectors import FloatArray

KEPT = Path(__file__).parents[1] / "test" / "digests.json"
STEPS = 1000  # of each scenario, of those that are kept
PATHS = 6
PICKS = 8  # machines, with a cycle each
LIBRARIES = ("numpy", "scipy", "ruckig")
RUN_AGAIN = "DIGESTS_WITHOUT_VECTOR_UNITS"


def environment() -> dict[str, str]:
    """Return what the last bits may depend on besides the code."""
    return {
        "python": ".".join(platform.python_version_tuple()[:2]),
        "processor": processor(),
        "C library": " ".join(platform.libc_ver()),
        **{name: version(name) for name in LIBRARIES},
    }


@dataclass
class Recorder(Findings):
    """Findings of a soak that makes digests of what happens.

    Attributes:
        setpoints: digest of all heights.
        texts: digest of all refusals and all states that were told.
    """

    setpoints: Any = field(default_factory=hashlib.sha256)
    texts: Any = field(default_factory=hashlib.sha256)

    def refused(self, error: KinematicsError) -> None:
        """Note that a command was refused."""
        super().refused(error)
        self.texts.update(f"{type(error).__name__}: {error}\n".encode())

    def drove(self, heights: FloatArray) -> None:
        """Note setpoints [m]. Shape (n, 3)."""
        super().drove(heights)
        self.setpoints.update(np.ascontiguousarray(heights).tobytes())

    def told(self, status: ControllerStatus) -> None:
        """Note what a controller has told."""
        refused = RefusalLog(_no_line, lines_per_second=1)
        # Where the setpoints are is in their digest.
        message = machine_state(status, MotionProgress(), refused, "", "base", _CLOCK)
        message.header.stamp.sec = message.header.stamp.nanosec = 0
        self.texts.update(f"{line_of(status)}\n{message}\n".encode())

    def digests(self) -> dict[str, str]:
        """Return the digests."""
        return {"setpoints": self.setpoints.hexdigest(), "texts": self.texts.hexdigest()}


def _no_line(_text: str) -> None:
    """Log nothing."""


_CLOCK = Clock(clock_type=ClockType.STEADY_TIME)


def pick(picker: soak_picks.Picker) -> dict[str, str]:
    """Return the digest of a cycle of pick and place, and how it ended."""
    engine, asked, heights = picker.engine, picker.asked(), []
    stations = [asked.part.stop(engine.elapsed, asked.dwell), Station(engine.platform[0])]
    height = max(station.position[2] for station in stations) + 0.03
    text = ""
    try:
        engine.transfer(stations, height, lifts=False)
    except KinematicsError as error:
        text = str(error)
    while engine.preparing or engine.phase is not MotionPhase.IDLE:
        picker.work()
        heights.append(engine.step(picker.dt).heights)
        if len(heights) % 20 == 0:
            engine.renew(0, asked.part.stop(engine.elapsed, asked.dwell))
        progress = engine.transfer_progress
        if progress is not None and progress.gives_up is not None:
            text = str(progress.gives_up)
    setpoints = hashlib.sha256(np.array(heights).tobytes()).hexdigest()
    return {"setpoints": setpoints, "text": text or str(engine.take_refusal())}


def digests(steps: int, paths: int, picks: int) -> dict[str, dict[str, str]]:
    """Return the digests of what is driven.

    Args:
        steps: of each scenario.
        paths: how many are planned.
        picks: how many machines pick and place.
    """
    found: dict[str, dict[str, str]] = {}
    for number, scenario in enumerate((*SCENARIOS, *COARSE)):
        recorder = Recorder()
        soak_motion.soak(scenario, steps, number, recorder)
        found[f"engine {scenario}"] = recorder.digests()
    for number, scenario in enumerate(SCENARIOS):
        recorder = Recorder()
        soak_controller.soak(scenario, steps, number, recorder)
        found[f"controller {scenario}"] = recorder.digests()
    rng = np.random.default_rng(1)
    for number in range(paths):
        path, _ = random_path(rng, size=0.06)
        places = path.driven.derivatives(np.linspace(0.0, path.driven.length, 500), 3)
        motion = drive(path).motion
        found[f"path {number}"] = {
            "path": hashlib.sha256(np.array(places).tobytes()).hexdigest(),
            "motion": hashlib.sha256(b"".join(each.tobytes() for each in motion)).hexdigest(),
        }
    for number, picker in islice(soak_picks.machines(1, 0), picks):
        found[f"pick {number}"] = pick(picker)
    return found


def without_vector_units(arguments: list[str]) -> subprocess.CompletedProcess[str]:
    """Run this module as a process of its own, on a processor of the plainest kind."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    features = " ".join(name for name in __cpu_dispatch__ if __cpu_features__[name])
    settings = {
        RUN_AGAIN: "1",
        "OPENBLAS_CORETYPE": "Prescott",
        "OPENBLAS_NUM_THREADS": "1",
        "NPY_DISABLE_CPU_FEATURES": features,
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA",
    }
    return subprocess.run(
        [sys.executable, "-m", "benchmarks.digests", *arguments],
        env={**os.environ, **settings},
        cwd=KEPT.parents[1],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )


def main() -> int:
    """Print digests, or keep them."""
    options = numbers(
        __doc__,
        steps=(STEPS, "setpoints of each scenario"),
        paths=(PATHS, "how many"),
        picks=(PICKS, "machines that pick and place"),
        write=(False, f"keep them in test/{KEPT.name}"),
    )
    if RUN_AGAIN in os.environ:
        found = digests(options.steps, options.paths, options.picks)
        json.dump(found, sys.stdout, indent=1)
        return 0
    numbers_of = {name: getattr(options, name) for name in ("steps", "paths", "picks")}
    given = [f"--{name}={number}" for name, number in numbers_of.items()]
    text = without_vector_units(given).stdout
    if options.write:
        kept = {"environment": environment(), "digests": json.loads(text)}
        KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    else:
        print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
