"""Places of a volume, and the largest force that a machine needs there.

The worst directions are exact: a force is linear in the acceleration of the platform and a
quadratic form of its velocity.
"""

import math

import numpy as np

from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.sizing import Box, Sizing, Wish, heights_of, some_places
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Cylinder, Workspace

PLACES = 1000
# Around the worst place others are tried, each time in a smaller part of the volume.
ROUNDS = (0.1, 0.01, 0.001)
# Places are this part inside the edge, which rounding may put outside.
INSIDE = 1e-9
# Velocities whose squares tell a quadratic form, as pairs of axes.
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


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


def random_places(wish: Wish, rng: np.random.Generator, count: int = PLACES) -> FloatArray:
    """Return places of the volume, at its edge, its ends and inside. Shape (n, 3) [m]."""
    edge = some_places(wish.volume)
    center = edge[-1]
    inside = edge[rng.integers(len(edge), size=count)] - center
    level = center + (1.0 - INSIDE) * np.concatenate((edge - center, inside))
    level[len(edge) :] = center + rng.random((count, 1)) ** 0.5 * inside
    low, high = heights_of(wish.volume)
    part = rng.choice((INSIDE, 0.5, 1.0 - INSIDE), len(level))
    return np.column_stack((level, low + part * (high - low)))


def largest_forces(sizing: Sizing, places: FloatArray) -> FloatArray:
    """Return the largest force at each place, for all velocities and accelerations. (n,) [N]."""
    machine, wish = sizing.machine, sizing.wish
    forces = SliderForces(machine, sizing.masses)
    heights = machine.inverse_batch(places)
    rises = heights - places[:, 2:]
    jacobians = np.array([machine.jacobian(place) for place in places.tolist()])

    def needed(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
        rates = jacobians @ velocity
        squares = velocity[0] ** 2 + velocity[1] ** 2 + np.square(rates - velocity[2])
        return forces.forces_batch(heights, rates, jacobians @ acceleration - squares / rises)

    none, axes = np.zeros(3), np.eye(3)
    still = needed(none, none)
    pulls = np.stack([needed(none, axis) - still for axis in axes], axis=-1)
    forms = np.zeros((*still.shape, 3, 3))
    for one, other in PAIRS:
        velocity = axes[one] if one == other else axes[one] + axes[other]
        value = needed(velocity, none) - still
        if one != other:
            value = 0.5 * (value - forms[..., one, one] - forms[..., other, other])
        forms[..., one, other] = forms[..., other, one] = value
    extremes = wish.speed**2 * np.linalg.eigvalsh(forms)[..., (0, -1)]
    most = np.abs(still[..., np.newaxis] + extremes).max(axis=-1)
    found: FloatArray = (most + wish.acceleration * np.linalg.norm(pulls, axis=-1)).max(axis=-1)
    return found


def part_of_force(sizing: Sizing, rng: np.random.Generator) -> float:
    """Return the largest force that is found, over the one that is proved."""
    wish = sizing.wish
    places = random_places(wish, rng)
    found = largest_forces(sizing, places)
    extent = np.ptp(places[:, :2], axis=0)
    for part in ROUNDS:
        around = places[found.argmax()] + np.zeros((PLACES // 5, 3))
        around[:, :2] += part * extent * rng.uniform(-1.0, 1.0, (len(around), 2))
        around = around[[_is_inside(wish, place) for place in around]]
        places, found = (
            np.concatenate((places, around)),
            np.concatenate((found, largest_forces(sizing, around))),
        )
    return float(found.max()) / sizing.force


def refused(sizing: Sizing, rng: np.random.Generator) -> list[str]:
    """Return why places of the volume are refused."""
    workspace = Workspace(sizing.machine, sizing.workspace_limits())
    texts = []
    for place in random_places(sizing.wish, rng).tolist():
        try:
            workspace.check_position(place)
        except KinematicsError as error:
            texts.append(str(error))
    return texts


def _is_inside(wish: Wish, place: FloatArray) -> bool:
    volume = wish.volume
    if isinstance(volume, Box):
        return bool((place >= volume.lower).all() and (place <= volume.upper).all())
    away = np.hypot(place[0] - volume.center_x, place[1] - volume.center_y)
    return bool(away <= volume.radius)


def slider_motion(machine, place, velocity, acceleration):
    """Velocities and accelerations of the sliders for motions of the platform. Shapes (..., 3)."""
    jacobian = np.array(machine.jacobian(place))
    rates = velocity @ jacobian.T
    squares = np.square(velocity[..., :2]).sum(axis=-1, keepdims=True)
    squares = squares + np.square(rates - velocity[..., 2:])
    return rates, acceleration @ jacobian.T - squares / (
        np.array(machine.inverse(place)) - place[2]
    )
