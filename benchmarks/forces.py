"""Forces of the sliders: their times, and masses and friction from noisy efforts.

``python -m benchmarks.forces`` prints the table; ``--count 20`` for a quick look. The comparison
with MuJoCo is in ``benchmarks/mujoco_forces.py``.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.bench_tri_glide import positions
from benchmarks.command_line import numbers
from benchmarks.harness import Work, pinned_to_one_core
from benchmarks.judge import LIMITS, MACHINE, WORKSPACE
from benchmarks.machine import description
from benchmarks.table import Row, print_rows
from tri_glide_kinematics.calibration import exciting_moves
from tri_glide_kinematics.dynamics import UNIFORM_ARMS, Masses, SliderForces, identify
from tri_glide_kinematics.motion import SliderLimits

FAST = SliderLimits.uniform(2.0, 40.0, 5000.0)
MASSES = {
    "carriages 1 kg, arms 0.2 kg, platform 0.6 kg": (1.0, 0.2, 0.6),
    "carriages 0.5 kg, arms 0.2 kg, platform 0.3 kg": (0.5, 0.2, 0.3),
    "carriages 1 kg, arms 0.5 kg, platform 0.6 kg": (1.0, 0.5, 0.6),
}
DURATION, STEP = 60.0, 0.002
NOISE = 0.02  # of the largest effort
ERROR = 2.0  # percent
INTERVAL = 1.96  # of 95 %, in standard deviations

CALLS, REPEATS = 20_000, 15
POSES = 1_000_000


def main() -> None:
    """Measure and print the table."""
    count = numbers(__doc__, count=(200, "recordings of each kind")).count
    print(description(), flush=True)
    print_rows("forces", rows(count))


def rows(count: int) -> Iterator[Row]:
    """Yield one row after the other."""
    with pinned_to_one_core():
        yield from _times()
    for limits, speed in ((LIMITS, "1 m/s, 10 m/s^2"), (FAST, "2 m/s, 40 m/s^2")):
        for name, masses in MASSES.items():
            yield from _identified(f"{name}, {speed}", masses, limits, count)


def _times() -> Iterator[Row]:
    forces = SliderForces(MACHINE, Masses.uniform(1.0, 0.2, 0.6, coulomb=5.0, viscous=10.0))
    rng = np.random.default_rng(1)
    heights = np.ascontiguousarray(MACHINE.inverse_batch(positions(POSES)))
    velocities, accelerations = rng.normal(size=(2, POSES, 3))
    motion = (heights, velocities, 10.0 * accelerations)
    pose, rates, second = (tuple(each[0].tolist()) for each in motion)

    one = 1e6 * _least(Work(forces.forces, pose, rates, second))
    yield Row.at_most("forces, one call", one, 5.0, ".2f", " us")
    driving = forces.forces(pose, rates, second)
    back = 1e6 * _least(Work(forces.accelerations, pose, rates, driving))
    yield Row("accelerations for forces, one call", f"{back:.2f} us")
    step = 1e6 * _least(Work(forces.step, pose, rates, driving, 0.001))
    yield Row("one step of a simulation", f"{step:.2f} us")
    batch = 1e9 * _least(Work(forces.forces_batch, *motion, items=POSES), calls=1)
    yield Row.at_most("forces_batch, 1,000,000 poses, per pose", batch, 80.0, ".0f", " ns")


def _least(work: Work, calls: int = CALLS) -> float:
    """Return the least processor time of an item [s]."""
    return min(work.seconds_per_item(calls) for _ in range(REPEATS))


def _identified(
    name: str, sizes: tuple[float, float, float], limits: SliderLimits, count: int
) -> Iterator[Row]:
    masses = Masses.uniform(*sizes, coulomb=5.0, viscous=10.0)
    true = dict(zip(UNIFORM_ARMS, (*masses.carriages, 0.0, 0.0, 0.0, masses.platform)))
    true.update(zip(UNIFORM_ARMS[7:], (sizes[1],) * 3 + masses.coulomb + masses.viscous))
    trajectory = exciting_moves(WORKSPACE, limits, DURATION).trajectory
    motion = trajectory.sample(np.arange(0.0, trajectory.duration, STEP))[1:]
    efforts = SliderForces(MACHINE, masses).forces_batch(*motion)
    size = NOISE * np.abs(efforts).max()
    rng = np.random.default_rng(7)
    errors: dict[str, list[float]] = {}
    inside = []
    for _ in range(count):
        found = identify(MACHINE, *motion, efforts + size * rng.normal(size=efforts.shape))
        for each in found.estimates:
            error = each.value - true[each.name]
            errors.setdefault(each.name, []).append(error / true[each.name])
            inside.append(abs(error) <= INTERVAL * each.deviation)
    spread = {name: float(np.sqrt(np.mean(np.square(each)))) for name, each in errors.items()}
    arms = max(size for name, size in spread.items() if name.startswith("arm"))
    others = max(size for name, size in spread.items() if not name.startswith("arm"))
    what = f"{name}: error of carriages, platform, friction (root mean square, largest)"
    yield Row.at_most(what, 100.0 * others, ERROR, ".2f", " %")
    yield Row.at_most(f"{name}: error of arms", 100.0 * arms, ERROR, ".2f", " %")
    part = float(np.mean(inside))
    yield Row.in_percent(
        f"{name}: values inside their 95 % interval",
        part,
        "95 %, but for the chance of so many",
        abs(part - 0.95) <= 3.0 * np.sqrt(0.95 * 0.05 / len(inside)),
    )


if __name__ == "__main__":
    main()
