"""Soak of the F-mechanism: every position counted a second way, without rounding.

Run it as ``python -m benchmarks.soak_mechanisms --count 100 --seed 1``; it exits with 1 if a
position is lost, does not close, or differs between one crank angle and a batch. Base and platform
are up to 1,000 times as large as the rods; crank angles are random, and beside a fold.
"""

from __future__ import annotations

import math
import sys
from collections import Counter

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.references.f_mechanism_count import count_positions
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism

RATIOS = (1.0, 2.0, 5.0, 12.0, 20.0, 40.0, 100.0, 300.0, 1000.0)
ANGLES = 20  # random crank angles of each mechanism
BESIDE = (1e-6, 1e-7, 1e-8, 1e-9)  # rad, from the fold of each mechanism
CLOSED = 1e-12  # largest residual, relative to the size


def random_mechanism(rng: np.random.Generator, ratio: float) -> FMechanism:
    """Return rods of about 1 m, and base and platform larger by ``ratio`` that nearly fit."""
    base = ratio * rng.uniform(-1.0, 1.0, (3, 2))
    shape = base if ratio > 3.0 else np.zeros((3, 2))
    turn = rng.uniform(-math.pi, math.pi)
    cosine, sine = math.cos(turn), math.sin(turn)
    platform = (shape + rng.uniform(-1.0, 1.0, (3, 2))) @ [[cosine, sine], [-sine, cosine]]
    return FMechanism(
        base,
        rng.uniform(0.1, 0.8, 3).tolist(),
        rng.uniform(0.5, 2.0, 3).tolist(),
        platform,
        float(rng.uniform(-math.pi, math.pi)),
        float(rng.uniform(-math.pi, math.pi)),
        counter_rotating=bool(rng.integers(2)),
    )


def fold_of(mechanism: FMechanism, angles: list[float], counts: list[int]) -> float | None:
    """Return the last crank angle before the first fold between ``angles``, if there is one."""
    for low, high, before, after in zip(angles, angles[1:], counts, counts[1:]):
        if before != after:
            while low < (middle := 0.5 * (low + high)) < high:
                if count_positions(mechanism.linkage, middle) == before:
                    low = middle
                else:
                    high = middle
            return low
    return None


def judge(mechanism: FMechanism, angles: list[float], counts: list[int]) -> Counter[str]:
    """Count what is wrong at some crank angles, at each of which ``counts`` positions exist."""
    found: Counter[str] = Counter(angles=len(angles), positions=sum(counts))
    batch = mechanism.poses_batch(angles)
    allowed = CLOSED * mechanism.size
    for row, (angle, count) in enumerate(zip(angles, counts)):
        poses = mechanism.poses(angle)
        found["lost"] += max(count - len(poses), 0)
        found["invented"] += max(len(poses) - count, 0)
        found["open"] += sum(not pose.residual <= allowed for pose in poses)
        found["open"] += sum(not residual <= allowed for residual in batch.residual[row, :count])
        found["different"] += int(batch.counts[row]) != len(poses)
    return found


def main() -> int:
    """Solve for random mechanisms of every ratio, and print what was found for each."""
    options = numbers(__doc__, count=(100, "mechanisms of each ratio"), seed=(1, "of these"))
    rng = np.random.default_rng(options.seed)
    failed = False
    for ratio in RATIOS:
        found: Counter[str] = Counter()
        for _ in range(options.count):
            mechanism = random_mechanism(rng, ratio)
            angles = sorted(rng.uniform(0.0, math.tau, ANGLES).tolist())
            counts = [count_positions(mechanism.linkage, angle) for angle in angles]
            found += judge(mechanism, angles, counts)
            fold = fold_of(mechanism, angles, counts)
            beside = (
                [] if fold is None else [fold + sign * each for each in BESIDE for sign in (-1, 1)]
            )
            found += judge(
                mechanism, beside, [count_positions(mechanism.linkage, angle) for angle in beside]
            )
        wrong = {name: found[name] for name in ("lost", "invented", "open", "different")}
        failed |= any(wrong.values())
        told = ", ".join(f"{number} {name}" for name, number in wrong.items())
        print(
            f"ratio {ratio:g}: {found['positions']} positions at {found['angles']} crank angles, "
            f"{told}",
            flush=True,
        )
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
