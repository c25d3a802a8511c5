"""What a duty cycle asks of the motors of a machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.motion import (
    PlatformPath,
    SampledPlan,
    SliderLimits,
    Trajectory,
    time_path,
)
from tri_glide_kinematics.sizing.fields import Cells
from tri_glide_kinematics.sizing.sizing import Sizing
from tri_glide_kinematics.sizing.wish import Volume, heights_of, level_box
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace

# The usual cycle of pick and place: up, across, down, and back [m].
LIFT, STROKE = 0.025, 0.305

# A stroke stays inside this part of a volume, and a corner inside this part of its lift.
PART_OF_VOLUME = 0.98
PART_OF_LIFT = 0.4

# Forces are looked at so often, and they are nowhere much larger between [s].
STEP = 5e-4

# Limits are lowered until the platform keeps its acceleration, up to this part; by the part that it
# is too large, to this power.
ENOUGH = 1.001
LOWERING = 1.5

Cycle = Callable[[Workspace, SliderLimits], Trajectory]


class DutyLoad(NamedTuple):
    """What a cycle asks of the three motors.

    Attributes:
        duration: of the cycle [s].
        limits: with which it is driven; with these the platform keeps the wanted acceleration.
        peak_force: Shape (3,) [N].
        continuous_force: root of the mean square. Shape (3,) [N].
        peak_speed: Shape (3,) [m/s].
        peak_power: largest force times speed at one instant. Shape (3,) [W].
        mean_power: mean of what the motor gives or takes. Shape (3,) [W].
    """

    duration: float
    limits: SliderLimits
    peak_force: FloatArray
    continuous_force: FloatArray
    peak_speed: FloatArray
    peak_power: FloatArray
    mean_power: FloatArray


def pick_and_place(volume: Volume, speed: float) -> PlatformPath:
    """Return the path of 25 mm up, 305 mm along x, 25 mm down, and back, low in a volume.

    In a smaller volume the strokes are as long as it allows.

    Args:
        volume: in which it is.
        speed: largest one of the platform [m/s].
    """
    lower, upper = level_box(volume)
    bottom, top = heights_of(volume)
    middle = 0.5 * (lower + upper)
    half = 0.5 * min(STROKE, PART_OF_VOLUME * float(upper[0] - lower[0]))
    low = bottom + (1.0 - PART_OF_VOLUME) * (top - bottom)
    high = low + min(LIFT, PART_OF_VOLUME * (top - bottom))
    (left, right), y = (middle[0] - half, middle[0] + half), middle[1]
    there = [(left, y, low), (left, y, high), (right, y, high), (right, y, low)]
    tolerance = PART_OF_LIFT * (high - low)
    path = PlatformPath.start(there[0])
    for place, width in zip((*there[1:], *there[2::-1]), (1.0, 1.0, 0.0, 1.0, 1.0, 0.0)):
        path = path.line_to(place, width * tolerance, speed)
    return path


def duty_load(sizing: Sizing, cycle: Cycle | None = None) -> DutyLoad:
    """Return what a cycle asks of the motors of a machine.

    Args:
        sizing: the machine.
        cycle: returns the motion for a workspace and limits; pick and place without one.

    Raises:
        KinematicsError: if the machine cannot do it.
    """
    workspace = Workspace(sizing.machine, sizing.workspace_limits())
    wish = sizing.wish
    if cycle is None:
        path = pick_and_place(wish.volume, wish.speed)

        def cycle(workspace: Workspace, limits: SliderLimits) -> Trajectory:
            return time_path(path, workspace, limits)

    limits = sizing.slider_limits()
    while True:
        trajectory = cycle(workspace, limits)
        count = max(2, int(np.ceil(trajectory.duration / STEP)) + 1)
        motion = trajectory.sample(np.linspace(0.0, trajectory.duration, count))
        largest = _largest_acceleration(sizing, motion)
        if largest <= ENOUGH * wish.acceleration:
            break
        # More than in proportion: with lower limits the platform uses more of them in corners.
        lower = (wish.acceleration / largest) ** LOWERING
        limits = limits.times(1.0, lower, lower)
    forces = SliderForces(sizing.machine, sizing.masses).forces_batch(
        motion.heights, motion.velocities, motion.accelerations
    )
    powers = np.abs(forces * motion.velocities)
    return DutyLoad(
        trajectory.duration,
        limits,
        np.abs(forces).max(axis=0),
        np.sqrt(np.square(forces).mean(axis=0)),
        np.abs(motion.velocities).max(axis=0),
        powers.max(axis=0),
        powers.mean(axis=0),
    )


def _largest_acceleration(sizing: Sizing, motion: SampledPlan) -> float:
    """Return the largest acceleration of the platform in a motion of the sliders [m/s^2]."""
    places = sizing.machine.forward_batch(motion.heights)
    cells = Cells.of(sizing.machine.geometry, places)
    rates = np.einsum("ijn,nj->in", cells.inverse, motion.velocities)
    # Row j of the Jacobian changes as the platform moves, and so accelerates slider j by itself.
    turned = np.einsum("jcdn,cn,dn->jn", cells.slopes, rates[:2], rates[:2])
    second = np.einsum("ijn,jn->in", cells.inverse, motion.accelerations.T - turned)
    return float(np.sqrt(np.square(second).sum(axis=0)).max())
