"""The kinematics of the tri-glide: one pose, and a million of them."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness import Figure, Missing, Work, compare, pinned_to_one_core
from benchmarks.references import tri_glide_c, tri_glide_floats
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry, batch

GEOMETRY = TriGlideGeometry.symmetric(base_radius=0.25, platform_radius=0.05, arm_length=0.40)
POSITION = (0.031, -0.042, 0.27)
VELOCITY = (0.11, 0.07, -0.05)
COUNT = 1_000_000

FLOATS = "plain floats, no checks"
C_LOOP = "C loop, -O2"


def positions(count: int) -> NDArray[np.float64]:
    """Return reachable places. Shape (count, 3) [m]."""
    return np.random.default_rng(5).uniform((-0.1, -0.1, 0.2), (0.1, 0.1, 0.4), (count, 3))


def figures() -> Iterator[Figure | Missing]:
    """Measure one row after the other."""
    machine = TriGlide(GEOMETRY)
    with pinned_to_one_core():
        yield from _single(machine)
        try:
            tri_glide_c.library()
        except OSError as error:
            yield Missing("inverse_batch and forward_batch, per pose", f"no C compiler: {error}")
        else:
            yield from _batch(machine)


def _single(machine: TriGlide) -> Iterator[Figure]:
    inverse = tri_glide_floats.inverse_velocity_of(GEOMETRY)
    forward = tri_glide_floats.forward_velocity_of(GEOMETRY)
    heights, rates = machine.inverse_velocity(POSITION, VELOCITY)
    for ours, plain, given in (
        (machine.inverse_velocity, inverse, (POSITION, VELOCITY)),
        (machine.forward_velocity, forward, (heights, rates)),
    ):
        what = f"TriGlide.{ours.__name__}, one call"
        yield compare(what, FLOATS, Work(ours, *given), Work(plain, *given), goal=1.6)


def _batch(machine: TriGlide) -> Iterator[Figure | Missing]:
    places = positions(COUNT)
    heights = np.ascontiguousarray(machine.inverse_batch(places))
    compiled = TriGlide(GEOMETRY, compiled=True)
    for direction, given, reference in (
        ("inverse", places, tri_glide_c.inverse_batch_of(GEOMETRY)),
        ("forward", heights, tri_glide_c.forward_batch_of(GEOMETRY)),
    ):
        what = f"TriGlide.{direction}_batch, 1,000,000 poses, per pose"
        loop = Work(reference, given, items=COUNT)
        if batch.numba_is_installed():
            yield compare(
                f"{what}, compiled=True",
                C_LOOP,
                Work(getattr(compiled, f"{direction}_batch"), given, items=COUNT),
                loop,
                goal=1.5,
            )
        else:
            yield Missing(f"{what}, compiled=True", "numba is not installed")
        yield compare(
            f"{what}, by numpy alone",
            C_LOOP,
            Work(getattr(machine, f"{direction}_batch"), given, items=COUNT),
            loop,
            goal=1.5,
        )
