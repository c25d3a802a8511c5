"""How times and memory of the batch functions grow with the size of the batch."""

from __future__ import annotations

import math
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.bench_mechanisms import CRANK_VELOCITY, LENGTHS, crank_angles, example_2
from benchmarks.bench_tri_glide import GEOMETRY, positions
from benchmarks.harness import pinned_to_one_core
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.tri_glide import TriGlide

SIZES = [10**power for power in range(8)]
LEAST_TIME = 0.05  # s: shorter calls are repeated
LONG_TIME = 2.0  # s: longer ones are not
MOST_CALLS = 1000
MEGABYTE = 1e6


class Growth(NamedTuple):
    """One curve: what a call took for each size.

    Attributes:
        name: of the function.
        sizes: items in the call.
        times: per item [s].
        peaks: of what a call allocates [MB].
    """

    name: str
    sizes: list[int]
    times: list[float]
    peaks: list[float]


def batches() -> Iterator[Growth]:
    """Measure the batch functions, one after the other."""
    machine, linkage, mechanism = TriGlide(GEOMETRY), FourBar(*LENGTHS), example_2()

    def heights(count: int) -> NDArray[np.float64]:
        return machine.inverse_batch(positions(count))

    functions: Sequence[tuple[str, Callable[..., object], Callable[[int], object]]] = (
        ("TriGlide.inverse_batch", machine.inverse_batch, positions),
        ("TriGlide.forward_batch", machine.forward_batch, heights),
        ("FourBar.sweep", lambda angles: linkage.sweep(angles, CRANK_VELOCITY), crank_angles),
        ("FMechanism.poses_batch", mechanism.poses_batch, crank_angles),
    )
    with pinned_to_one_core():
        for name, function, argument_of in functions:
            growth = Growth(name, [], [], [])
            for size in SIZES:
                if growth.peaks and 12.0 * growth.peaks[-1] > available_memory():
                    break
                peak, taken = _measured(function, argument_of(size))
                growth.sizes.append(size)
                growth.times.append(taken / size)
                growth.peaks.append(peak)
            yield growth


def _measured(function: Callable[..., object], argument: object) -> tuple[float, float]:
    """Return the peak of what a call allocates [MB], and its processor time [s]."""
    tracemalloc.start()
    begin = time.process_time()
    function(argument)
    times = [time.process_time() - begin]
    peak = tracemalloc.get_traced_memory()[1] / MEGABYTE
    tracemalloc.stop()
    if times[0] < LONG_TIME:
        times.clear()
        while len(times) < 3 or (sum(times) < LEAST_TIME and len(times) < MOST_CALLS):
            begin = time.process_time()
            function(argument)
            times.append(time.process_time() - begin)
    return peak, float(np.median(times))


def available_memory() -> float:
    """Return the memory that could be used now [MB]."""
    for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
        if line.startswith("MemAvailable:"):
            return int(line.split()[1]) * 1024 / MEGABYTE
    return math.inf
