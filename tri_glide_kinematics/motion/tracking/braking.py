"""How three sliders come to rest: each as soon as it can, or all together."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.tracking.slider_way import SliderWay
from tri_glide_kinematics.motion.tracking.velocity_phases import Phase, to_zero

# A slider that is slower than the others brakes more gently, but not by more than this.
GENTLEST = 0.05

# A part of the velocity that is none.
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
    fastest = max(abs(way.velocity) for way in ways)
    if fastest == 0.0:
        return braking_alone(ways, limits)
    parts = [abs(way.velocity) / fastest for way in ways]
    # Limits of a slider that has all of the velocity.
    hardest = min(most / max(part, TINY) for part, most in zip(parts, limits.acceleration))
    sharpest = min(jerk / max(part, TINY) for part, jerk in zip(parts, limits.jerk))
    together = []
    for way, part, most, jerk in zip(ways, parts, limits.acceleration, limits.jerk):
        gentle = max(min(hardest * part, most), GENTLEST * most, abs(way.acceleration))
        smooth = max(min(sharpest * part, jerk), GENTLEST * jerk)
        together.append(to_zero(way.velocity, way.acceleration, -gentle, gentle, smooth))
    return together
