"""How everything grows: measured, printed and drawn into ``docs/images/``."""

from __future__ import annotations

import sys

from benchmarks import growth_batches, growth_nodes, growth_plots
from benchmarks.harness import Missing
from benchmarks.machine import ROOT
from benchmarks.table import in_seconds, print_lines

FOLDER = ROOT / "docs" / "images"


def run() -> bool:
    """Measure batches, services and machines; return whether all nodes answered."""
    missing: list[Missing] = []
    FOLDER.mkdir(parents=True, exist_ok=True)
    batches = []
    lines: list[tuple[str, ...]] = [("batch function", "items", "time per item", "peak memory")]
    for growth in growth_batches.batches():
        _say(growth.name)
        batches.append(growth)
        for size, taken, peak in zip(growth.sizes, growth.times, growth.peaks):
            lines.append((growth.name, f"{size:,}", in_seconds(taken), f"{peak:.1f} MB"))
    print_lines(lines)
    growth_plots.save_batches(FOLDER / "performance_batches.png", batches)

    services = []
    lines = [("service", "steps", "time of a call")]
    for service in growth_nodes.services():
        if isinstance(service, Missing):
            missing.append(service)
            continue
        _say(service.name)
        services.append(service)
        for steps, taken in zip(service.steps, service.times):
            lines.append((service.name, f"{steps:,}" if steps else "-", in_seconds(taken)))
    print_lines(lines)
    if services:
        growth_plots.save_services(FOLDER / "performance_services.png", services)

    machines = _machines(missing, growth_nodes.MACHINES, one_process=False)
    _machines(missing, growth_nodes.MACHINES_IN_ONE_PROCESS, one_process=True)
    if machines:
        growth_plots.save_machines(FOLDER / "performance_machines.png", machines)
    for row in missing:
        _say(f"no answer: {row.what}: {row.reason}")
    return not any(row.is_failure for row in missing)


def _machines(
    missing: list[Missing], most: int, *, one_process: bool
) -> list[growth_nodes.MachineLoad]:
    """Measure and print how many machines run on this computer; return what was found."""
    found = []
    head = "machines, one process each" if one_process else "machines, three processes each"
    lines: list[tuple[str, ...]] = [(head, "cycles per second", "late cycles")]
    for load in growth_nodes.machines(most, one_process):
        if isinstance(load, Missing):
            missing.append(load)
            continue
        _say(f"{load.machines} {head}")
        found.append(load)
        late = [100.0 * count / rate for count, rate in zip(load.late, load.rates)]
        lines.append(
            (
                str(load.machines),
                " ".join(f"{rate:.0f}" for rate in load.rates),
                " ".join(f"{part:.1f} %" for part in late),
            )
        )
    print_lines(lines)
    return found


def _say(text: str) -> None:
    """Print one line of progress."""
    print(f"growth: {text}", file=sys.stderr, flush=True)
