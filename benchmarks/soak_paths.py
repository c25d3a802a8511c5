"""Soak of paths: random lines and arcs, planned to their ends; each judged in two ways.

Paths of 2 to 40 segments with tolerances of 0.05 to 10 mm, and stops among them. The distance from
the path as programmed is found without its formulas; velocity, acceleration and jerk of the sliders
are judged by the bounds of the certificate and by differences at 1 kHz.

Run it as ``python -m benchmarks.soak_paths --count 10000``; it exits with 1 if a path breaks a
limit or its tolerance, or is not driven to its end.

With ``--programs`` the paths are those of programs of our own writer in its dialects, read and
driven by a controller, each with a speed override that changes at random; judged is besides in
which cycle each output is told.

With ``--shaped`` each path is driven with a shaper of its own, for one mode or two; judged is the
shaped motion.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.bench_paths import differences_of, drive
from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, MACHINE
from benchmarks.linear_moves import WORKSPACE
from benchmarks.soak import random_shaper
from testing.driven_programs import DrivenProgram, drive_program
from testing.path_samples import ROUNDING, Piece, distances, largest_part, random_path
from testing.program_writer import written_program
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import Trajectory, time_path
from tri_glide_kinematics.motion.errors import MotionError
from tri_glide_kinematics.motion.limit_use import (
    LIMIT_TOLERANCE,
    CommandStream,
    LimitUse,
    are_within,
)
from tri_glide_kinematics.motion.limits import RELATIVE_ROUNDING
from tri_glide_kinematics.motion.path import PathPlaceError, PlatformPath, check_place
from tri_glide_kinematics.motion.shaped import ShapedTrajectory
from tri_glide_kinematics.programs import Dialect
from tri_glide_kinematics.vectors import FloatArray

# So large are paths [m]: most of them then are inside the workspace.
SIZE = 0.06
SAMPLES = 4000
REPORT = 200
STEP = 1e-3  # s
WITHOUT_PLAN = "without a plan"


def largest_distance(path: PlatformPath, pieces: list[Piece]) -> float:
    """Return the largest distance of a path as driven from ``pieces``, in parts of the tolerance.

    Between two joints that are rounded, or stops, the larger of their tolerances holds.
    """
    driven = path.driven
    ways = np.unique(np.concatenate((np.linspace(0.0, driven.length, SAMPLES), driven.breaks)))
    places = driven.derivatives(ways, 0)[0]
    away = np.min([distances(places, piece) for piece in pieces], axis=0)
    marks = np.concatenate((driven.rounded.ways, driven.stops))
    order = np.argsort(marks, kind="stable")
    known = np.append(driven.rounded.tolerances, np.zeros(len(driven.stops)))[order]
    following = np.clip(np.searchsorted(marks[order], ways), 1, len(marks) - 1)
    allowed = np.maximum(np.maximum(known[following - 1], known[following]), ROUNDING)
    return float((away / allowed).max())


class Judged(NamedTuple):
    """What was found of paths.

    Attributes:
        distance: largest one from the path as programmed, in parts of the tolerance.
        uses: velocity, acceleration and jerk by bounds, in parts of the limits. Shape (3,).
        differences: the same by differences at 1 kHz. Shape (3,).
        end: largest distance from the end of the path [m].
    """

    distance: float = 0.0
    uses: FloatArray = np.zeros(3)
    differences: FloatArray = np.zeros(3)
    end: float = 0.0

    @classmethod
    def of(cls, motion: Trajectory, path: PlatformPath, pieces: list[Piece]) -> Judged:
        """Judge a shaped ``motion`` along a path."""
        assert isinstance(motion, ShapedTrajectory)
        heights = motion.sample(np.arange(0.0, motion.duration + STEP, STEP)).heights
        places = MACHINE.forward_batch(heights)
        use = LimitUse.of(CommandStream.from_heights(heights, STEP), LIMITS)
        return cls(
            largest_part(path, pieces, places),
            at_once(motion.limit_use(LIMITS)).use.max(axis=1),
            np.asarray(use.largest).reshape(3, -1).max(axis=1),
            float(np.linalg.norm(places[-1] - path.end)),
        )

    def joined(self, other: Judged) -> Judged:
        """Return the larger of both."""
        return Judged(
            max(self.distance, other.distance),
            np.maximum(self.uses, other.uses),
            np.maximum(self.differences, other.differences),
            max(self.end, other.end),
        )


# Drives a path at random; says why it does not if it is refused.
DriveOne = Callable[[np.random.Generator], Judged | str]


def soak(one: DriveOne, count: int, seed: int) -> int:
    """Drive so many paths and print what was found; return whether something is wrong."""
    rng, begin = np.random.default_rng(seed), time.monotonic()
    found, driven = Judged(), 0
    refused: Counter[str] = Counter()
    while driven < count:
        judged = one(rng)
        if isinstance(judged, str):
            refused[judged] += 1
            continue
        driven += 1
        found = found.joined(judged)
        if driven % REPORT == 0:
            print(f"    {driven} paths, {time.monotonic() - begin:.0f} s", flush=True)
    print(f"{driven} paths driven; refused: {dict(refused)}")
    print(f"largest distance from the path as programmed {found.distance:.6f} of the tolerance")
    print(f"largest velocity, acceleration, jerk by bounds {found.uses} of the limits")
    print(f"largest velocity, acceleration, jerk by differences {found.differences} of the limits")
    print(f"largest distance from the end {found.end:.3g} m")
    # By rounding, a plan may be as if it were driven faster by this part, and the jerk by its cube.
    allowed = (1.0 + RELATIVE_ROUNDING) ** np.array((1.0, 2.0, 3.0))
    within = are_within(found.differences) and bool((found.uses <= allowed).all())
    within = within and found.distance <= 1.0 and found.end < ROUNDING
    return 0 if within and not refused[WITHOUT_PLAN] else 1


def drive_plain(rng: np.random.Generator) -> Judged | str:
    """Drive a path without a shaper."""
    path, pieces = random_path(rng, size=SIZE)
    try:
        at_once(check_place(path.driven, WORKSPACE))
    except PathPlaceError as error:
        return type(error).__name__
    try:
        motion = drive(path)
    except MotionError as error:
        print(f"    a path without a plan: {error}", flush=True)
        return WITHOUT_PLAN
    distance = largest_distance(path, pieces)
    return Judged(distance, motion.uses, differences_of(path, motion))


def drive_shaped(rng: np.random.Generator) -> Judged | str:
    """Drive a path with a shaper of its own."""
    path, pieces = random_path(rng, count=int(rng.integers(2, 13)), size=SIZE)
    shaper = None
    while shaper is None:
        shaper = random_shaper(rng)
    try:
        motion = time_path(path, WORKSPACE, LIMITS, shaper)
    except KinematicsError as error:
        return type(error).__name__
    return Judged.of(motion, path, pieces)


def soak_programs(count: int, seed: int) -> int:
    """Drive so many programs and print what was found; return whether something is wrong."""
    found = DrivenProgram()
    begin = time.monotonic()
    for number in range(count):
        rng = np.random.default_rng((seed, number))
        dialect = list(Dialect)[number % len(Dialect)]
        found.add(drive_program(written_program(rng, dialect), rng))
        if (number + 1) % REPORT == 0:
            print(f"    {number + 1} programs, {time.monotonic() - begin:.0f} s", flush=True)
    print(f"{count} programs, {found.runs} paths driven in {found.cycles} cycles")
    print(f"{found.refused} paths left the workspace")
    print(f"{found.outputs} outputs, {found.missing} paths on which they were not all told")
    print(f"outputs are told {found.farthest} cycles beside their place at most")
    print(f"largest distance from the path as programmed {found.distance:.6f} of the tolerance")
    print(f"largest velocity, acceleration, jerk by differences {found.use:.6f} of the limits")
    within = found.use <= 1.0 + LIMIT_TOLERANCE and found.distance <= 1.0
    return 0 if within and not found.missing and found.farthest <= 1 else 1


def main() -> int:
    """Drive random paths and print what was found."""
    options = numbers(
        __doc__,
        count=(500, "number of paths that are driven"),
        seed=(1, "of these"),
        shaped=(False, "with a shaper"),
        programs=(False, "paths of random programs"),
    )
    if options.programs:
        return soak_programs(options.count, options.seed)
    return soak(drive_shaped if options.shaped else drive_plain, options.count, options.seed)


if __name__ == "__main__":
    sys.exit(main())
