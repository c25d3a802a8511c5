"""The output of the demonstration: its progress, and the table that judges it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tri_glide_kinematics.demo.leg import Leg
from tri_glide_kinematics.motion.limit_use import TOLERANCES, CommandStream, LimitUse
from tri_glide_kinematics.motion.trajectory import QUANTITIES, SliderLimits
from tri_glide_kinematics.vectors import Vector3


def say(text: str) -> None:
    """Print one line of progress at once."""
    print(f"demo: {text}", flush=True)


def in_millimetres(vector: Vector3) -> str:
    """Return a vector [m] as text [mm]."""
    return "(" + ", ".join(f"{1000.0 * value:7.2f}" for value in vector) + ")"


def is_good(leg: Leg, use: LimitUse, tolerance: float) -> bool:
    """Return whether a target was reached and a path kept to ``tolerance`` [m], and all limits."""
    is_there = leg.error < tolerance and leg.deviation < leg.tolerance + tolerance
    return is_there and use.part(leg.first, leg.end).is_within


def table(legs: Sequence[Leg], use: LimitUse, stream: CommandStream, limits: SliderLimits) -> str:
    """Return one line for each leg: target, measured position, and what is nearest to a limit."""
    heads = "".join(f" {f'{quantity} [{unit}]':>21}" for quantity, unit in QUANTITIES)
    start = f"{'':5} {'target [mm]':27} {'reached [mm]':27} {'error':>9} {'time':>7}"
    return "\n".join([start + heads, *(_line(leg, use, stream, limits) for leg in legs)])


def _line(leg: Leg, use: LimitUse, stream: CommandStream, limits: SliderLimits) -> str:
    target = in_millimetres(leg.target) if leg.target else "(by twist)"
    line = f"{leg.name:5} {target:27} {in_millimetres(leg.reached):27}"
    line += f" {1e6 * leg.error:6.1f} µm" if leg.target else f" {'':9}"
    line += f" {leg.duration:5.2f} s"
    part = use.part(leg.first, leg.end)
    derivatives = (stream.velocities, stream.accelerations, stream.jerks)
    for index, derivative in enumerate(derivatives):
        slider = int(part.parts[:, index].max(axis=0).argmax())
        largest = float(np.abs(derivative[leg.first : leg.end, slider]).max())
        limit = limits.table[index, slider]
        kept = part.largest[index] <= 1.0 + TOLERANCES[index]
        line += f" {largest:9.3f} {'<' if kept else '>'} {limit:7.2f}  "
    return line
