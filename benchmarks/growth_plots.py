"""The pictures of how things grow."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from benchmarks.growth_batches import Growth
from benchmarks.growth_nodes import MachineLoad, ServiceGrowth


def save_batches(path: Path, growths: Sequence[Growth]) -> None:
    """Draw time and memory over the size of a batch."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    times, peaks = figure.subplots(1, 2)
    for growth in growths:
        times.loglog(growth.sizes, growth.times, marker="o", markersize=4, label=growth.name)
        seen = [(size, peak) for size, peak in zip(growth.sizes, growth.peaks)]
        peaks.loglog(*zip(*seen), marker="o", markersize=4, label=growth.name)
    times.set(xlabel="items in one call", ylabel="time per item [s]", title="Time")
    peaks.set(
        xlabel="items in one call",
        ylabel="allocated at most [MB]",
        title="Peak memory of a call",
    )
    for axes in (times, peaks):
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small")
    figure.savefig(path, dpi=110)


def save_services(path: Path, growths: Sequence[ServiceGrowth]) -> None:
    """Draw the time of a call over the steps of the trace."""
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for growth in growths:
        if growth.steps == [0]:
            axes.axhline(growth.times[0], color="gray", linestyle="--", label=growth.name)
        else:
            axes.loglog(growth.steps, growth.times, marker="o", markersize=4, label=growth.name)
    axes.set(xlabel="steps of the trace", ylabel="time of a call [s]", title="Services")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(path, dpi=110)


def save_machines(path: Path, loads: Sequence[MachineLoad]) -> None:
    """Draw the rate that each machine reaches, and its late cycles, over their number."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    rates, late = figure.subplots(1, 2)
    for load in loads:
        x = [load.machines] * len(load.rates)
        rates.plot(x, load.rates, "o", color="C0", markersize=4)
        percent = [100.0 * count / rate for count, rate in zip(load.late, load.rates)]
        late.plot(x, percent, "o", color="C1", markersize=4)
    rates.set(ylabel="cycles per second", title="Rate of each ik_node", ylim=(0.0, None))
    late.set(ylabel="late cycles [%]", title="Late cycles of each ik_node", ylim=(0.0, None))
    for axes in (rates, late):
        axes.set_xlabel("machines, three nodes each")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
