"""Machines, poses and workspaces that several tests use, at random and for hypothesis."""

import math
from collections.abc import Callable, Iterable

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from soak import many

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

DEFAULT_LIMITS = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 10.0)

# A busy computer may be slow in all that it does.
reproducible = settings(
    derandomize=True,
    deadline=None,
    max_examples=many(60),
    suppress_health_check=[HealthCheck.too_slow],
)


@st.composite
def symmetric_geometries(draw: st.DrawFn) -> TriGlideGeometry:
    """Arms from barely longer than the radii's difference to ten times as long."""
    difference = draw(st.floats(0.02, 2.0))
    platform_radius = draw(st.floats(0.0, 1.0))
    outwards = draw(st.booleans())
    return TriGlideGeometry.symmetric(
        platform_radius + difference if outwards else platform_radius,
        platform_radius if outwards else platform_radius + difference,
        difference * draw(st.floats(1.1, 10.0)),
        draw(st.floats(-math.pi, math.pi)),
    )


@st.composite
def unequal_geometries(draw: st.DrawFn) -> TriGlideGeometry:
    """Three unequal arms on anchors at angles of 60 degrees at least, in either order of turn."""
    size = draw(st.floats(0.02, 2.0))
    turn = draw(st.floats(-math.pi, math.pi))
    first = draw(st.floats(1.05, 2.6))
    second = draw(st.floats(1.05, 2.6))
    angles = [turn, turn + first, turn + first + second]
    if draw(st.booleans()):
        angles.reverse()
    anchors = [
        (r * math.cos(angle), r * math.sin(angle))
        for angle, r in zip(angles, draw(st.tuples(*[st.floats(0.5 * size, size)] * 3)))
    ]
    lengths = draw(st.tuples(*[st.floats(1.2 * size, 4.0 * size)] * 3))
    return TriGlideGeometry(anchors, lengths)


geometries = st.one_of(symmetric_geometries(), unequal_geometries())


def random_geometry(rng: np.random.Generator, symmetric: bool) -> TriGlideGeometry:
    """A machine of about half a metre, turned at random; unequal ones differ by tens of percent."""
    if symmetric:
        base, platform, excess = rng.uniform((0.2, 0.03, 1.3), (0.4, 0.1, 3.0))
        return TriGlideGeometry.symmetric(
            base, platform, (base - platform) * excess, rng.uniform(-math.pi, math.pi)
        )
    angles = rng.uniform(-math.pi, math.pi) + np.array([0.0, 2.1, 4.2]) + rng.uniform(-0.4, 0.4, 3)
    angles = angles[:: rng.choice([1, -1])]
    radii = rng.uniform(0.15, 0.3, (3, 1))
    anchors = radii * np.column_stack((np.cos(angles), np.sin(angles)))
    return TriGlideGeometry(anchors, rng.uniform(0.4, 0.7, 3))


def random_positions(
    machine: TriGlide, rng: np.random.Generator, count: int, max_condition: float = math.inf
) -> FloatArray:
    """Positions within reach, evenly spread over the plane. Shape (count, 3) [m]."""
    anchors = np.array(machine.geometry.anchors)
    lengths = np.array(machine.geometry.arm_lengths)[:, None]
    lower, upper = (anchors - lengths).max(axis=0), (anchors + lengths).min(axis=0)
    size = float(lengths.max())
    found = np.empty((0, 3))
    while len(found) < count:
        plane = rng.uniform(lower, upper, (2 * count, 2))
        places = np.column_stack((plane, rng.uniform(-size, size, 2 * count)))
        # Where there is no solution the number is NaN, which is not below either.
        condition = machine.condition_number_batch(places)
        found = np.concatenate((found, places[condition < max_condition]))
    return found[:count]


def accepts(check: Callable[..., object], *arguments: object) -> bool:
    """Return whether a check raises no error; one that it raises has a text."""
    try:
        check(*arguments)
    except KinematicsError as error:
        assert str(error)
        return False
    return True


def random_motion(
    machine: TriGlide, rng: np.random.Generator, count: int, max_condition: float = 20.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Heights, velocities and accelerations of the sliders. Each of shape (count, 3)."""
    positions = random_positions(machine, rng, count, max_condition)
    return (
        machine.inverse_batch(positions),
        rng.normal(size=(count, 3)),
        20.0 * rng.normal(size=(count, 3)),
    )


def is_inside(workspace: Workspace, position: Iterable[float]) -> bool:
    """Return whether the platform may be at a ``position`` [m]."""
    return accepts(workspace.check_position, position)


def nudged(rng: np.random.Generator, values: ArrayLike) -> NDArray[np.float64]:
    """The same numbers with other last bits, as another processor might have them.

    Each is changed by up to four units of the last place of the largest, so that zeros change too.
    """
    array = np.asarray(values, dtype=np.float64)
    unit = float(np.spacing(np.abs(array).max(initial=0.0)))
    return np.asarray(array + unit * rng.integers(-4, 5, array.shape))
