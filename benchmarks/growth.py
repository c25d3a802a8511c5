"""How everything grows: measured, printed and drawn into ``docs/images/``."""

import math
import sys
import time
import tracemalloc
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from std_srvs.srv import Trigger

from benchmarks.bench_cycle import TARGETS
from benchmarks.bench_mechanisms import CRANK_VELOCITY, LENGTHS, crank_angles, example_2
from benchmarks.bench_services import TRACES, mean_time
from benchmarks.bench_tri_glide import GEOMETRY, positions
from benchmarks.harness import Missing, NoAnswerError, Work, attempt, pinned_to_one_core
from benchmarks.machine import ROOT
from benchmarks.ros_session import pose_at, session
from benchmarks.table import in_seconds, print_lines
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.tri_glide import TriGlide

FOLDER = ROOT / "docs" / "images"

SIZES = [10**power for power in range(8)]
LEAST_TIME = 0.02  # s: shorter calls are repeated
LONG_TIME = 2.0  # s: longer ones are measured once
REPEATS = 3
MEGABYTE = 1e6


class Growth(NamedTuple):
    """One curve: what a call took for each size.

    Attributes:
        name: of the function, or of the service.
        sizes: items in the call, or steps of the trace.
        times: per item, or of the call of a service [s].
        peaks: of what the call of a function allocates [MB].
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
    taken = time.process_time() - begin
    peak = tracemalloc.get_traced_memory()[1] / MEGABYTE
    tracemalloc.stop()
    if taken < LONG_TIME:
        work = Work(function, argument)
        calls = work.calls_within(LEAST_TIME)
        taken = float(np.median([work.seconds_per_item(calls) for _ in range(REPEATS)]))
    return peak, taken


def available_memory() -> float:
    """Return the memory that could be used now [MB]."""
    for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
        if line.startswith("MemAvailable:"):
            return int(line.split()[1]) * 1024 / MEGABYTE
    return math.inf


STEPS = [10**power for power in range(1, 6)]  # no request may ask for more
MACHINES = 8  # at most
MACHINE_TIME = 5.0  # s of motion that are judged
TARGET_PERIOD = 0.5  # s
LATE = "late cycles in the last second"
RATE = "loop rate [1/s]"


class MachineLoad(NamedTuple):
    """What ``ik_node`` says of its loop while several machines move on this computer.

    Attributes:
        machines: number of them.
        late: late cycles of each machine [%].
        rates: cycles per second of each machine.
    """

    machines: int
    late: list[float]
    rates: list[float]


def services() -> Iterator[Growth | Missing]:
    """Measure an empty call, which has no steps, and both traces."""
    curves: dict[str, Callable[[], Growth]] = {"empty call": _empty_call}
    curves.update({name: partial(_trace, name) for name in TRACES})
    for name, measure in curves.items():
        yield attempt(name, measure)


def _empty_call() -> Growth:
    with session() as running:
        running.start_bare("server", "/bare")
        empty = running.node.create_client(Trigger, "/bare/server/trigger")
        running.spin_until(empty.service_is_ready, "the bare server")
        mean_time(running, empty, Trigger.Request(), 50)
        return Growth("empty call", [0], [mean_time(running, empty, Trigger.Request(), 200)], [])


def _trace(name: str) -> Growth:
    kind, request_of = TRACES[name]
    growth = Growth(name, [], [], [])
    with session() as running:
        running.start_node("mechanism_node", "/ours")
        client = running.node.create_client(kind, f"/ours/mechanism_node/{name}")
        running.spin_until(client.service_is_ready, name)
        mean_time(running, client, request_of(STEPS[0]), 5)
        for steps in STEPS:
            calls = max(1, min(50, 50_000 // steps))
            growth.sizes.append(steps)
            growth.times.append(mean_time(running, client, request_of(steps), calls))
    return growth


def machines() -> Iterator[MachineLoad | Missing]:
    """Move machines, up to so many, if they start, each with its nodes in its namespace.

    More than a computer can start end the curve; one machine it has to start.
    """
    for count in range(1, MACHINES + 1):
        with session() as running:
            reports: dict[str, list[tuple[float, float]]] = defaultdict(list)

            def on_diagnostics(message: DiagnosticArray) -> None:
                for status in message.status:
                    values = {entry.key: entry.value for entry in status.values}
                    if LATE in values:
                        report = (float(values[LATE]), float(values[RATE]))
                        reports[status.name].append(report)  # noqa: B023

            running.node.create_subscription(DiagnosticArray, "/diagnostics", on_diagnostics, 100)
            publishers = []
            for number in range(count):
                for node in ("simulator_node", "ik_node", "fk_node"):
                    running.start_node(node, f"/machine_{number}")
                topic = f"/machine_{number}/target_pose"
                publishers.append(running.node.create_publisher(PoseStamped, topic, 10))
            try:
                running.spin_until(
                    lambda: len(reports) == count,  # noqa: B023
                    "diagnostics of each machine",
                )
            except NoAnswerError as error:
                yield Missing(f"{count} machines", str(error), is_failure=count == 1)
                return
            running.spin_for(3.0)
            reports.clear()
            for index in range(int(MACHINE_TIME / TARGET_PERIOD)):
                message = pose_at(TARGETS[index % len(TARGETS)])
                for publisher in publishers:
                    publisher.publish(message)
                running.spin_for(TARGET_PERIOD)
            means = [np.mean(values, axis=0) for _, values in sorted(reports.items())]
        late = [100.0 * float(missed / rate) for missed, rate in means]
        yield MachineLoad(count, late, [float(rate) for _, rate in means])


# Names of what grows, sizes, and what is told of these.
Curves = Iterable[tuple[str, list[int], list[float]]]


def _draw(axes: Axes, curves: Curves, **words: str) -> None:
    """Draw curves over their sizes; one without a size is a level line."""
    for name, sizes, values in curves:
        if sizes == [0]:
            axes.axhline(values[0], color="gray", linestyle="--", label=name)
        else:
            axes.loglog(sizes, values, marker="o", markersize=4, label=name)
    axes.set(**words)
    axes.legend(fontsize="small")


def _save(figure: Figure, name: str) -> None:
    for axes in figure.axes:
        axes.grid(alpha=0.3)
    figure.savefig(FOLDER / f"performance_{name}.png", dpi=110)


def save_batches(growths: Sequence[Growth]) -> None:
    """Draw time and memory over the size of a batch."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    times, peaks = figure.subplots(1, 2)
    size = "items in one call"
    of_times = ((each.name, each.sizes, each.times) for each in growths)
    _draw(times, of_times, xlabel=size, ylabel="time per item [s]", title="Time")
    of_peaks = ((each.name, each.sizes, each.peaks) for each in growths)
    most = "allocated at most [MB]"
    _draw(peaks, of_peaks, xlabel=size, ylabel=most, title="Peak memory of a call")
    _save(figure, "batches")


def save_services(growths: Sequence[Growth]) -> None:
    """Draw the time of a call over the steps of the trace."""
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    times = ((each.name, each.sizes, each.times) for each in growths)
    words = {"xlabel": "steps of the trace", "ylabel": "time of a call [s]", "title": "Services"}
    _draw(figure.subplots(), times, **words)
    _save(figure, "services")


def save_machines(loads: Sequence[MachineLoad]) -> None:
    """Draw the rate that each machine reaches, and its late cycles, over their number."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    rates, late = figure.subplots(1, 2)
    for load in loads:
        x = [load.machines] * len(load.rates)
        rates.plot(x, load.rates, "o", color="C0", markersize=4)
        late.plot(x, load.late, "o", color="C1", markersize=4)
    rates.set(ylabel="cycles per second", title="Rate of each ik_node", ylim=(0.0, None))
    late.set(ylabel="late cycles [%]", title="Late cycles of each ik_node", ylim=(0.0, None))
    for axes in (rates, late):
        axes.set_xlabel("machines, three nodes each")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _save(figure, "machines")


def lines_of(found: Growth | MachineLoad) -> Iterator[tuple[str, ...]]:
    """Yield what is printed of one curve, or of so many machines."""
    if isinstance(found, MachineLoad):
        rates = " ".join(f"{rate:.0f}" for rate in found.rates)
        yield str(found.machines), rates, " ".join(f"{part:.1f} %" for part in found.late)
        return
    for number, (size, taken) in enumerate(zip(found.sizes, found.times)):
        peak = [f"{found.peaks[number]:.1f} MB"] if found.peaks else []
        yield found.name, f"{size:,}" if size else "-", in_seconds(taken), *peak


def run() -> bool:
    """Measure batches, services and machines; return whether all nodes answered."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    failed = False
    parts: Sequence[tuple[tuple[str, ...], Iterator[Any], Callable[[list[Any]], None]]] = (
        (("batch function", "items", "time per item", "peak memory"), batches(), save_batches),
        (("service", "steps", "time of a call"), services(), save_services),
        (
            ("machines, three processes each", "cycles per second", "late cycles"),
            machines(),
            save_machines,
        ),
    )
    for head, measured, save in parts:
        found, lines = [], [head]
        for each in measured:
            if isinstance(each, Missing):
                _say(f"no answer: {each.what}: {each.reason}")
                failed = failed or each.is_failure
            else:
                found.append(each)
                lines += lines_of(each)
                _say(lines[-1][0])
        print_lines(lines)
        if found:
            save(found)
    return not failed


def _say(text: str) -> None:
    """Print one line of progress."""
    print(f"growth: {text}", file=sys.stderr, flush=True)
