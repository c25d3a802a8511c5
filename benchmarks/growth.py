"""How everything grows: measured, printed and drawn into ``docs/images/``."""

from __future__ import annotations

import sys

from benchmarks import growth_batches, growth_nodes, growth_plots
from benchmarks.machine import ROOT
from benchmarks.table import aligned, in_seconds

FOLDER = ROOT / "docs" / "images"


def run() -> None:
    """Measure batches, services and machines."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    batches = []
    lines: list[tuple[str, ...]] = [("batch function", "items", "time per item", "peak memory")]
    for growth in growth_batches.batches():
        _say(growth.name)
        batches.append(growth)
        for size, taken, peak in zip(growth.sizes, growth.times, growth.peaks):
            lines.append((growth.name, f"{size:,}", in_seconds(taken), f"{peak:.1f} MB"))
    print(f"\n{aligned(lines)}", flush=True)
    growth_plots.save_batches(FOLDER / "performance_batches.png", batches)

    services = []
    lines = [("service", "steps", "time of a call")]
    for service in growth_nodes.services():
        _say(service.name)
        services.append(service)
        for steps, taken in zip(service.steps, service.times):
            lines.append((service.name, f"{steps:,}" if steps else "-", in_seconds(taken)))
    print(f"\n{aligned(lines)}", flush=True)
    growth_plots.save_services(FOLDER / "performance_services.png", services)

    machines = []
    lines = [("machines", "cycles per second", "late cycles")]
    for load in growth_nodes.machines():
        _say(f"{load.machines} machines")
        machines.append(load)
        late = [100.0 * count / rate for count, rate in zip(load.late, load.rates)]
        lines.append(
            (
                str(load.machines),
                " ".join(f"{rate:.0f}" for rate in load.rates),
                " ".join(f"{part:.1f} %" for part in late),
            )
        )
    print(f"\n{aligned(lines)}", flush=True)
    growth_plots.save_machines(FOLDER / "performance_machines.png", machines)


def _say(text: str) -> None:
    """Print one line of progress."""
    print(f"growth: {text}", file=sys.stderr, flush=True)
