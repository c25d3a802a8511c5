"""Soak of paths: random lines and arcs, planned to their ends; each judged in two ways.

Paths of 2 to 40 segments with tolerances of 0.05 to 10 mm, and stops among them. The distance from
the path as programmed is found without its formulas; velocity, acceleration and jerk of the sliders
are judged by the bounds of the certificate and by differences at 1 kHz.

Run it as ``python -m benchmarks.soak_paths --count 10000``; it exits with 1 if a path breaks a
limit or its tolerance, or is not driven to its end.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from benchmarks.bench_paths import differences_of, drive
from benchmarks.judge import WIDE
from testing.path_samples import ROUNDING, Piece, distances, random_path
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.limit_use import TOLERANCES
from tri_glide_kinematics.motion.path import PathPlaceError, PlatformPath, check_place
from tri_glide_kinematics.motion.trajectory import RELATIVE_ROUNDING, MotionError
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace

# So large are paths [m]: most of them then are inside the workspace.
SIZE = 0.06
SAMPLES = 4000
REPORT = 200


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


def main() -> int:
    """Drive random paths and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=500, help="number of paths that are driven")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
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
    within = (differences <= 1.0 + np.array(TOLERANCES)).all() and (uses <= allowed).all()
    return 0 if within and distance <= 1.0 and not unplanned else 1


if __name__ == "__main__":
    sys.exit(main())
