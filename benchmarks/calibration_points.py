"""Measurements that are proposed against others at random, by the volume of the ellipsoid."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.table import Row
from testing.wrong_machines import DISTANCE, NOMINAL, RADIUS, TOUCH, WRONG_BY, WrongMachine
from tri_glide_kinematics.calibration.fit import Touch, calibrate
from tri_glide_kinematics.vectors import FloatArray

GEOMETRY = NOMINAL.geometry
# Of each measurement one place, or two for a distance.
Places = Sequence[Sequence[Sequence[float]]]


def proposals(count: int, rng: np.random.Generator) -> Iterator[Row]:
    """Ten points that are proposed against ten at random, of the same kinds."""
    for name, kinds in (
        ("touches", {"touch": TOUCH}),
        ("touches and distances", {"touch": TOUCH, "distance": DISTANCE}),
    ):
        parts = []
        for _ in range(count):
            machine = WrongMachine.random(rng)
            touches = machine.touches(rng, random_places(4, rng))
            result = calibrate(GEOMETRY, touches, priors=WRONG_BY)
            chosen = [one.places for one in result.next_points(10, kinds=kinds)]
            ours = _volume(machine, touches, chosen, rng)
            random = [_random_ends(len(one), rng) for one in chosen]
            parts.append(ours / _volume(machine, touches, random, rng))
        yield Row(
            f"10 {name} proposed: volume by that of 10 at random, median (largest) of {count}",
            f"{np.median(parts):.2f} ({max(parts):.2f})",
            "0.5",
            float(np.median(parts)) <= 0.5,
        )


def _volume(
    machine: WrongMachine, touches: list[Touch], chosen: Places, rng: np.random.Generator
) -> float:
    """Return the volume of the ellipsoid, to a constant, after these are measured, too."""
    more = [machine.touch(one[0][0], one[0][1], rng) for one in chosen if len(one) == 1]
    distances = [machine.distance(one[0], one[1], rng) for one in chosen if len(one) == 2]
    result = calibrate(GEOMETRY, [*touches, *more], (), distances, WRONG_BY)
    return float(np.exp(0.5 * np.linalg.slogdet(result.covariance)[1]))


def random_places(count: int, rng: np.random.Generator) -> FloatArray:
    """Return places evenly spread over the disc. Shape (count, 2) [m]."""
    angles, radii = rng.uniform(0.0, 2.0 * np.pi, count), RADIUS * np.sqrt(rng.uniform(size=count))
    return np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))


def _random_ends(count: int, rng: np.random.Generator) -> list[list[float]]:
    """Return places of one measurement on the plate. Each of shape (3,) [m]."""
    return [[x, y, 0.0] for x, y in random_places(count, rng).tolist()]
