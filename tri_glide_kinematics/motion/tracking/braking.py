"""How three sliders come to rest: each as soon as it can, or all together."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.motion.tracking.slider_way import SliderWay
from tri_glide_kinematics.motion.tracking.velocity_phases import Phase, to_zero
from tri_glide_kinematics.motion.trajectory import SliderLimits

# A slider that is slower than the others brakes more gently, but not by more than this.
GENTLEST = 0.05

# Added to each part of the velocity, so that none is zero.
TINY = 1e-9

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
    v1, v2, v3 = [abs(way.velocity) for way in ways]
    fastest = max(v1, v2, v3)
    if fastest == 0.0:
        return braking_alone(ways, limits)
    parts = (v1 / fastest + TINY, v2 / fastest + TINY, v3 / fastest + TINY)
    # Limits of a slider that has all of the velocity.
    p1, p2, p3 = parts
    a1, a2, a3 = limits.acceleration
    j1, j2, j3 = limits.jerk
    hardest, sharpest = min(a1 / p1, a2 / p2, a3 / p3), min(j1 / p1, j2 / p2, j3 / p3)
    together = []
    for way, part, most, jerk in zip(ways, parts, limits.acceleration, limits.jerk):
        gentle = max(min(hardest * part, most), GENTLEST * most, abs(way.acceleration))
        smooth = max(min(sharpest * part, jerk), GENTLEST * jerk)
        together.append(to_zero(way.velocity, way.acceleration, -gentle, gentle, smooth))
    return together
