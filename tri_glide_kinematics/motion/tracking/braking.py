"""How three sliders come to rest: each as soon as it can, or all together."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.tracking.slider_way import SliderWay
from tri_glide_kinematics.motion.tracking.velocity_phases import Phase, to_zero

# A slider that is slower than the others brakes more gently, but not by more than this.
GENTLEST = 0.05

Braking = tuple[Phase, Phase, Phase]


def braking_alone(ways: Sequence[SliderWay], limits: SliderLimits) -> list[Braking]:
    """Return the shortest way to rest of each slider, after the step that it does.

    Args:
        ways: of the sliders in the step.
        limits: of the sliders.
    """
    return [
        to_zero(way.velocity, way.acceleration, -most, most, jerk)
        for way, most, jerk in zip(ways, limits.acceleration, limits.jerk)
    ]


def braking_together(ways: Sequence[SliderWay], limits: SliderLimits) -> list[Braking]:
    """Return ways to rest on which the velocities keep their proportions, or nearly.

    So the platform goes on in its direction, where sliders that stop one after the other would
    make it turn aside. A slider has the part of its limits that its velocity is of the largest.

    Args:
        ways: of the sliders in the step.
        limits: of the sliders.
    """
    hardest = sharpest = inf
    for way, most, jerk in zip(ways, limits.acceleration, limits.jerk):
        speed = abs(way.velocity)
        if speed > 0.0:
            hardest, sharpest = min(hardest, most / speed), min(sharpest, jerk / speed)
    if hardest == inf:
        return braking_alone(ways, limits)
    together = []
    for way, most, jerk in zip(ways, limits.acceleration, limits.jerk):
        speed = abs(way.velocity)
        gentle = max(min(hardest * speed, most), GENTLEST * most, abs(way.acceleration))
        smooth = max(min(sharpest * speed, jerk), GENTLEST * jerk)
        together.append(to_zero(way.velocity, way.acceleration, -gentle, gentle, smooth))
    return together
