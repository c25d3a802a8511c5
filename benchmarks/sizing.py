"""The machines that ``size`` finds, compared with a global search, on wishes at random.

``python -m benchmarks.sizing`` takes about ten minutes. The global search is differential evolution
with 100,000 machines for each wish. It tries each machine at sampled places only, so it may be
better than what can be proved.
"""

from __future__ import annotations

import math
import time

import numpy as np
from scipy.optimize import differential_evolution

from benchmarks.command_line import numbers
from tri_glide_kinematics.sizing import (
    Box,
    Demand,
    ImpossibleWishError,
    Objective,
    Sizing,
    Wish,
    field_bounds,
    needs,
    size,
    some_places,
)
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Cylinder

POPULATION = 100
GENERATIONS = 1000


def random_wish(rng: np.random.Generator) -> Wish:
    """Return a wish, most of which are possible."""
    extent = float(10.0 ** rng.uniform(-1.3, -0.2))
    height = extent * float(rng.uniform(0.2, 2.0))
    volume: Cylinder | Box
    kind = int(rng.integers(3))
    if kind == 0:
        volume = Cylinder(0.0, 0.0, extent, 0.0, height)
    elif kind == 1:
        width = extent * float(rng.uniform(0.3, 1.0))
        volume = Box((-extent, -width, 0.1), (extent, width, 0.1 + height))
    else:
        volume = Box((0.1 * extent, 0.0, 0.0), (0.8 * extent, 0.9 * extent, height))

    def perhaps(low: float, high: float) -> float | None:
        return float(rng.uniform(low, high)) if rng.random() < 0.5 else None

    return Wish(
        volume,
        speed=float(rng.uniform(0.2, 2.0)),
        acceleration=float(rng.uniform(2.0, 40.0)),
        payload=float(rng.uniform(0.0, 2.0)),
        arm_density=float(rng.uniform(0.1, 3.0)),
        platform_radius=extent * float(rng.uniform(0.2, 0.6)),
        platform_resolution=perhaps(1.4e-5, 4e-5),
        largest_force=perhaps(60.0, 300.0),
        largest_column_height=perhaps(2.0 * extent + height, 6.0 * extent + height),
        max_condition_number=float(rng.uniform(2.0, 8.0)),
        least_arm_angle=math.radians(float(rng.uniform(10.0, 30.0))),
        orientation=float(rng.uniform(0.0, 2.0)),
    )


def globally_least(wish: Wish, objective: Objective, seed: int) -> float:
    """Return the least objective that differential evolution finds."""
    places = some_places(wish.volume)
    places = np.unique(np.concatenate((places, 0.75 * (places - places[-1]) + places[-1])), axis=0)
    extent = float(np.hypot(*places.T).max())

    def merit(machines: FloatArray) -> FloatArray:
        differences, lengths = machines
        count, number = len(places), len(lengths)
        with np.errstate(all="ignore"):
            tried = field_bounds(
                wish,
                np.repeat(differences, count),
                np.repeat(lengths, count),
                np.tile(places, (number, 1)),
                0.0,
            )
            found = needs(wish, differences, lengths, tried.reshape(3, number, count).max(axis=2))
            worst = np.nan_to_num(found.worst, posinf=1e6)
            return np.where(worst <= 1.0, found.of(objective), 1e9 * (1.0 + worst))

    result = differential_evolution(
        merit,
        [(0.05 * extent, 10.0 * extent), (0.05 * extent, 30.0 * extent)],
        popsize=POPULATION // 2,
        maxiter=GENERATIONS - 1,
        tol=0.0,
        atol=0.0,
        polish=False,
        seed=seed,
        vectorized=True,
        updating="deferred",
    )
    return float(result.fun)


def main() -> None:
    """Compare them and print a table."""
    options = numbers(__doc__, count=(30, "possible wishes"))
    rng = np.random.default_rng(20)
    possible, impossible, seed = 0, 0, 0
    above: list[float] = []
    times: list[float] = []
    while possible < options.count:
        wish = random_wish(rng)
        objective = tuple(Objective)[seed % 2]
        seed += 1
        start = time.process_time()
        sizing: Sizing | None = None
        stops: tuple[Demand, ...] = ()
        try:
            sizing = size(wish, objective)
        except ImpossibleWishError as error:
            stops = tuple(stop.demand for stop in error.stops)
            size(error.nearest, objective)
        times.append(time.process_time() - start)
        least = globally_least(wish, objective, seed)
        if sizing is None:
            impossible += 1
            verdict = "impossible" if least >= 1e9 else "POSSIBLE AFTER ALL"
            names = ", ".join(stop.value for stop in stops)
            print(f"{seed:3} {verdict}: {names}; {times[-1]:.2f} s", flush=True)
            continue
        possible += 1
        found = sizing.needs.of(objective)[0]
        above.append(found / least - 1.0)
        tight = ", ".join(demand.value for demand in sizing.tight)
        print(
            f"{seed:3} {objective.value:6} {found:.6g}, {100.0 * above[-1]:+.3f} % of {least:.6g}, "
            f"{times[-1]:.2f} s; {tight}",
            flush=True,
        )
    print(
        f"{possible} wishes: at most {100.0 * max(above):+.3f} %; {impossible} impossible; "
        f"at most {max(times):.2f} s"
    )


if __name__ == "__main__":
    main()
