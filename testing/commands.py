"""Commands of a machine with the default parameters, and whether they keep its limits."""

import numpy as np
from numpy.typing import ArrayLike

from testing.machine import RATE, Machine
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray

PERIOD = 1.0 / RATE  # s
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
TRAVEL = (0.3, 0.9)  # m
KINEMATICS = TriGlide(DEFAULT_GEOMETRY)
PAUSE = 200_000_000  # ns


def stream_of(machine: Machine, first: int = 0, period: float = PERIOD) -> CommandStream:
    """Return the commands of a machine, one each ``period`` [s], from number ``first`` on."""
    heights = [machine.heights(message) for message in machine.commands[first:]]
    return CommandStream.from_heights(heights, period)


def assert_within_limits(machine: Machine, first: int = 0, *, speed_scale: float = 1.0) -> None:
    """Check all commands from number ``first`` on, none of which begins anew."""
    check(stream_of(machine, first), LIMITS.with_velocity_scaled(speed_scale))


def assert_stretches_within_limits(machine: Machine) -> None:
    """Check every stretch of commands of ik_node.

    A new one may begin elsewhere, at rest: after rest, if the machine was disabled or in a fault
    and moved meanwhile, or after a pause, if ik_node was killed.
    """
    commands = machine.commands
    heights = np.array([machine.heights(message) for message in commands])
    velocities = np.array([message.velocity for message in commands])
    times = np.array([machine.client.time_of(message) for message in commands])
    assert TRAVEL[0] <= heights.min() <= heights.max() <= TRAVEL[1]
    moved = np.diff(heights, axis=0).any(axis=1)
    resting = (velocities == 0.0).all(axis=1)
    paused = np.diff(times) > PAUSE
    begins = np.concatenate(([True], resting[1:] & (paused | (moved & resting[:-1]))))
    check(CommandStream.from_heights(heights, PERIOD), LIMITS, begins, times)


def check(
    stream: CommandStream,
    limits: SliderLimits,
    begins: ArrayLike | None = None,
    times: FloatArray | None = None,
) -> None:
    """Fail, and show the commands around the worst one, if a limit is broken.

    Args:
        stream: of commands.
        limits: that it has to keep.
        begins: which rows begin anew; none by default. Shape (n,).
        times: of the commands, if they are known. Shape (n,).
    """
    use = LimitUse.of(stream, limits, begins)
    worst = int(use.parts.max(axis=(1, 2)).argmax())
    around = slice(max(worst - 3, 0), worst + 3)
    shown = (stream.times if times is None else times)[around], stream.heights[around]
    assert use.is_within, f"{'; '.join(use.violations())} of {len(stream.heights)}: {shown}"
