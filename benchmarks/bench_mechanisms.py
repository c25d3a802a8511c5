"""The planar mechanisms: four-bar sweeps and all positions of an F-mechanism."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness import Figure, Missing, Work, compare, pinned_to_one_core
from benchmarks.machine import ROOT
from benchmarks.references import f_mechanism_sextic, four_bar_numpy, four_bar_pylinkage
from tri_glide_kinematics.mechanisms import load_mechanism
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism, FMechanismPose
from tri_glide_kinematics.mechanisms.four_bar import FourBar

LENGTHS = (2.0, 7.0, 9.0, 6.0)  # crank, coupler, rocker, ground [m]
CRANK_VELOCITY = 10.0  # rad/s

NUMPY_SWEEP = "plain numpy"
ROOTS = "numpy.roots, sextic given"
ROOTS_IN_A_ROUND = 200


def figures() -> Iterator[Figure | Missing]:
    """Measure one row after the other."""
    with pinned_to_one_core():
        yield from _four_bar()
        yield from _f_mechanism()


def crank_angles(count: int) -> NDArray[np.float64]:
    """Return one turn in equal steps. Shape (count,) [rad]."""
    return np.linspace(0.0, math.tau, count, endpoint=False)


def example_2() -> FMechanism:
    """Return the second example of source 001, the one with a branch that turns fully."""
    mechanism = load_mechanism(ROOT / "config" / "f_mechanism_example_2.yaml").mechanism
    assert isinstance(mechanism, FMechanism)
    return mechanism


def full_turn_pose(mechanism: FMechanism) -> FMechanismPose:
    """Return the position at crank angle zero whose branch turns fully."""
    return next(pose for pose in mechanism.poses(0.0) if mechanism.trace(0.0, pose).turns_fully)


def _four_bar() -> Iterator[Figure | Missing]:
    linkage = FourBar(*LENGTHS)
    angles = crank_angles(360)
    what = "four-bar sweep, 360 angles"
    try:
        simulate, arguments = four_bar_pylinkage.sweep_of(LENGTHS, 360)
    except ModuleNotFoundError as error:
        yield Missing(what, f"{error.name} is not installed")
    else:
        yield compare(
            what,
            "pylinkage, compiled, one branch, position only",
            Work(linkage.sweep, angles, CRANK_VELOCITY),
            Work(simulate, *arguments),
            goal=1.0,
        )
    many = crank_angles(1_000_000)
    yield compare(
        "four-bar sweep, 1,000,000 angles, per angle",
        NUMPY_SWEEP,
        Work(linkage.sweep, many, CRANK_VELOCITY, items=len(many)),
        Work(four_bar_numpy.sweep, LENGTHS, many, CRANK_VELOCITY, items=len(many)),
        goal=0.5,
        rounds=11,
    )


def _f_mechanism() -> Iterator[Figure]:
    mechanism = example_2()
    many = crank_angles(100_000)
    some = many[:: len(many) // ROOTS_IN_A_ROUND]
    sextics = f_mechanism_sextic.sextics(mechanism.linkage, some)
    roots = Work(f_mechanism_sextic.roots_in_a_loop, sextics, items=len(sextics))
    yield compare(
        "F-mechanism, all positions and velocities, 100,000 angles, per angle",
        ROOTS,
        Work(mechanism.poses_batch, many, items=len(many)),
        roots,
        goal=0.15,
        rounds=11,
    )
    yield compare(
        "F-mechanism, one angle, one call",
        ROOTS,
        Work(lambda: [mechanism.poses(angle) for angle in some], items=len(some)),
        roots,
        goal=3.0,
    )
    angles = crank_angles(360)
    yield compare(
        "F-mechanism, the branch that turns fully followed, 360 points",
        "360 calls of FMechanism.poses",
        Work(mechanism.trace, 0.0, full_turn_pose(mechanism)),
        Work(lambda: [mechanism.poses(angle) for angle in angles]),
        goal=1.0,
        rounds=11,
    )
