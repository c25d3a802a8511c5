"""How near the gripper truly is to the part when it has closed, in a cell in virtual time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.table import Row
from testing.pick_cell import LOW, Cell
from tri_glide_kinematics.picking import PartOutcome, SimulatedBelt, laid_parts

SPEEDS = (0.05, 0.1, 0.2, 0.3, 0.5)
DRIVES = (0.01, 0.06)
LATENCIES = (0.0, 0.15)

# To reach: at a constant speed, and while the belt changes its speed [mm].
STEADY, CHANGING = 0.2, 1.0

# Times from a change of speed to the grip that it would be without it [s].
BEFORE_THE_GRIP = np.arange(0.05, 0.26, 0.01)

# Parts of a run, and their distance in time: so each is picked [s].
COUNT, APART = 6, 1.6


def cell_of(
    speed: float,
    count: int = COUNT,
    changes: tuple[tuple[float, float, float], ...] = (),
    **how: Any,
) -> Cell:
    """Return a cell, run to its end, that picks from a belt at a ``speed`` [m/s]."""
    belt = SimulatedBelt((1.0, 0.0, 0.0), speed, changes)
    # A fast belt is looked at from farther away.
    view = (-0.45, -0.2) if speed < 0.25 else (-0.9, -0.5)
    spacing = max(speed, 0.06) * APART
    parts = laid_parts(belt, count, spacing, first=(view[0] - 0.05, 0.08, LOW))
    cell = Cell(belt, parts, view=view, first_way=0.6, **how)
    cell.picker.run()
    return cell.run_until(lambda cell: len(cell.outcomes) == count, 120.0)


def rows() -> Iterator[Row]:
    """Yield the rows of errors at the grip, and of the lowest place."""
    lowest = np.inf
    for speed in SPEEDS:
        errors, placed = [], 0
        for drive in DRIVES:
            for latency in LATENCIES:
                cell = cell_of(speed, drive_delay=drive, latency=latency)
                errors += cell.errors()
                placed += sum(e.part.outcome is PartOutcome.PLACED for e in cell.outcomes)
                lowest = min(lowest, cell.lowest)
        count = COUNT * len(DRIVES) * len(LATENCIES)
        what = f"error at the grip, {speed:g} m/s, drives 10 and 60 ms, camera 0 and 150 ms late"
        yield Row.at_most(
            f"{what} ({placed} of {count} placed)", 1e3 * max(errors), STEADY, unit=" mm"
        )
    for before, after in ((0.1, 0.3), (0.3, 0.1), (0.2, 0.0)):
        # The change begins at many phases of a cycle.
        errors = []
        for phase in np.linspace(0.0, 1.2, 13):
            changes = ((5.0 + float(phase), after, 0.2),)
            cell = cell_of(before, 4, changes, drive_delay=0.01)
            errors += cell.errors()
            lowest = min(lowest, cell.lowest)
        what = (
            f"error at the grip, {before:g} to {after:g} m/s at 0.2 m/s^2, largest of {len(errors)}"
        )
        yield Row.at_most(what, 1e3 * max(errors), CHANGING, unit=" mm")
    for drive in DRIVES:
        # The change begins so long before the grip: later ones cannot be answered any more.
        grip = cell_of(0.1, 1, drive_delay=drive).gripper.grips[0].time
        errors = []
        for before in BEFORE_THE_GRIP:
            cell = cell_of(0.1, 1, ((grip - float(before), 0.3, 0.2),), drive_delay=drive)
            errors += cell.errors()
            lowest = min(lowest, cell.lowest)
        first, last = BEFORE_THE_GRIP[[-1, 0]]
        what = (
            f"error at the grip, 0.2 m/s^2 from {first:g} to {last:g} s before it, "
            f"drives {1e3 * drive:g} ms late, largest of {len(errors)}"
        )
        yield Row.at_most(what, 1e3 * max(errors), CHANGING, unit=" mm")
    yield Row.at_most(
        "below the parts, in all of these", 1e3 * max(LOW - lowest, 0.0), 0.1, unit=" mm"
    )
