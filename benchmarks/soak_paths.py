"""Soak of paths: random lines and arcs, planned to their ends; each judged in two ways.

Paths of 2 to 40 segments with tolerances of 0.05 to 10 mm, and stops among them. The distance from
the path as programmed is found without its formulas; velocity, acceleration and jerk of the sliders
are judged by the bounds of the certificate and by differences at 1 kHz.

Run it as ``python -m benchmarks.soak_paths --count 10000``; it exits with 1 if a path breaks a
limit or its tolerance, or is not driven to its end.

With ``--programs`` the paths are those of programs of our own writer in its five dialects, read and
driven by a controller, each with a speed override that changes at random; judged is besides in
which cycle each output is told.

With ``--shaped`` each path is driven with a shaper of its own, for one mode or two; judged is the
shaped motion.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from typing import NamedTuple

import numpy as np

from benchmarks.bench_paths import differences_of, drive
from benchmarks.judge import LIMITS, WIDE
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
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.programs import Dialect
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace

# So large are paths [m]: most of them then are inside the workspace.
SIZE = 0.06
SAMPLES = 4000
REPORT = 200
STEP = 1e-3  # s
MACHINE = TriGlide(DEFAULT_GEOMETRY)


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
    """What was found of shaped paths.

    Attributes:
        distance: largest one from the path as programmed, in parts of the tolerance.
        uses: velocity, acceleration and jerk by bounds, in parts of the limits. Shape (3,).
        differences: the same by differences at 1 kHz. Shape (3,).
        end: largest distance from the end of the path [m].
    """

    distance: float
    uses: FloatArray
    differences: FloatArray
    end: float

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


def random_shaper(rng: np.random.Generator) -> Shaper:
    """Return a shaper of any kind for one mode or two."""
    kind = rng.choice(np.array(ShaperKind))
    modes = [
        Mode(float(rng.uniform(8.0, 60.0)), float(rng.uniform(0.0, 0.15)))
        for _ in range(rng.integers(1, 3))
    ]
    return Shaper.of(kind, *modes)


def soak_shaped(count: int, seed: int) -> int:
    """Plan so many shaped paths and print what was found; return whether something is wrong."""
    rng = np.random.default_rng(seed)
    workspace = Workspace(MACHINE, WIDE)
    found = Judged(0.0, np.zeros(3), np.zeros(3), 0.0)
    refused: Counter[str] = Counter()
    driven = 0
    begin = time.monotonic()
    while driven < count:
        path, pieces = random_path(rng, count=int(rng.integers(2, 13)), size=SIZE)
        shaper = random_shaper(rng)
        try:
            motion = time_path(path, workspace, LIMITS, shaper)
        except KinematicsError as error:
            refused[type(error).__name__] += 1
            continue
        driven += 1
        found = found.joined(Judged.of(motion, path, pieces))
        if driven % REPORT == 0:
            print(f"    {driven} paths, {time.monotonic() - begin:.0f} s", flush=True)
    print(f"{driven} paths driven with a shaper; refused: {dict(refused)}")
    print(f"largest distance from the path as programmed {found.distance:.6f} of the tolerance")
    print(f"largest velocity, acceleration, jerk by bounds {found.uses} of the limits")
    print(f"largest velocity, acceleration, jerk by differences {found.differences} of the limits")
    print(f"largest distance from the end {found.end:.3g} m")
    within = are_within(found.differences)
    within = within and bool((found.uses <= 1.0 + RELATIVE_ROUNDING).all())
    return 0 if within and found.distance <= 1.0 and found.end < ROUNDING else 1


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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=500, help="number of paths that are driven")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shaped", action="store_true", help="with a shaper")
    parser.add_argument("--programs", action="store_true", help="paths of random programs")
    options = parser.parse_args()
    if options.programs:
        return soak_programs(options.count, options.seed)
    if options.shaped:
        return soak_shaped(options.count, options.seed)
    rng = np.random.default_rng(options.seed)
    workspace = Workspace(TriGlide(DEFAULT_GEOMETRY), WIDE)
    driven = outside = unplanned = windows = broken = 0
    distance = 0.0
    uses, differences = np.zeros(3), np.zeros(3)
    begin = time.monotonic()
    while driven < options.count:
        path, pieces = random_path(rng, size=SIZE)
        try:
            at_once(check_place(path.driven, workspace))
        except PathPlaceError:
            outside += 1
            continue
        driven += 1
        distance = max(distance, largest_distance(path, pieces))
        try:
            motion = drive(path)
        except MotionError as error:
            unplanned += 1
            print(f"    path {driven}: {error}", flush=True)
            continue
        windows, broken = windows + motion.windows, broken + motion.broken
        uses = np.maximum(uses, motion.uses)
        differences = np.maximum(differences, differences_of(path, motion))
        if driven % REPORT == 0:
            print(f"    {driven} paths, {time.monotonic() - begin:.0f} s", flush=True)
    print(f"{driven} paths driven, {unplanned} without a plan; {outside} left the workspace")
    print(f"largest distance from the path as programmed {distance:.6f} of the tolerance")
    print(f"largest velocity, acceleration, jerk by bounds {uses} of the limits")
    print(f"largest velocity, acceleration, jerk by differences {differences} of the limits")
    print(f"windows that could not be continued: {broken} of {windows}")
    # By rounding, a plan may be as if it were driven faster by this part, and the jerk by its cube.
    allowed = (1.0 + RELATIVE_ROUNDING) ** np.array((1.0, 2.0, 3.0))
    within = are_within(differences) and (uses <= allowed).all()
    return 0 if within and distance <= 1.0 and not unplanned else 1


if __name__ == "__main__":
    sys.exit(main())
