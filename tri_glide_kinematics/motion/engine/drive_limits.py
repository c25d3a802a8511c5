"""Limits of the sliders as they are used: scaled, and less of them where motion is shaped."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

import numpy as np

from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.motion.limits import SliderLimits, SliderState
from tri_glide_kinematics.motion.shaped import Planned
from tri_glide_kinematics.motion.shaping import Shaper

# Largest factor on the speeds that a path asks for.
LARGEST_PATH_SPEED_SCALE = 2.0

# Parts of velocities, accelerations and jerks that a shaper leaves to plans, as a rule; of added
# bounds, the part for velocities or accelerations.
LEFT_TO_PLANS = (1.0, 0.98, 0.95)


@dataclass(frozen=True)
class DriveLimits:
    """Limits of the sliders, how much of their velocities is used, and how motion is shaped.

    Attributes:
        sliders: limits before the scale.
        speed_scale: in (0, 1].
        path_speed_scale: factor of the platform speeds that paths ask for, in (0, 2]; it is no
            factor of any limit.
        rapid_scale: in (0, 1]; where a path asks for no speed, the platform has no more than this
            part of the largest velocity limit. 1 is for no such bound.
        shaper: of the platform's motion; None for none.
        planned: what plans keep so that what the shaper makes of them keeps the limits; None where
            that is the same.
    """

    sliders: SliderLimits
    speed_scale: float
    path_speed_scale: float = 1.0
    rapid_scale: float = 1.0
    shaper: Shaper | None = field(default=None, kw_only=True)
    planned: Planned | None = field(default=None, compare=False, kw_only=True)

    def __post_init__(self) -> None:
        """Check the scales.

        Raises:
            NotFiniteError: if one is NaN or infinite.
            OutOfBoundsError: if one is not in its interval.
        """
        largest = {
            "speed_scale": 1.0,
            "path_speed_scale": LARGEST_PATH_SPEED_SCALE,
            "rapid_scale": 1.0,
        }
        for name, bound in largest.items():
            scale = positive(name, getattr(self, name))
            if scale > bound:
                raise OutOfBoundsError(name, scale, f"at most {bound:g}")
            object.__setattr__(self, name, scale)

    @property
    def scales(self) -> tuple[float, float, float]:
        """All that can be set beside the limits: of speed, of path speed, and of rapids."""
        return self.speed_scale, self.path_speed_scale, self.rapid_scale

    @cached_property
    def scaled(self) -> SliderLimits:
        """Limits after the scale."""
        return self.sliders.with_velocity_scaled(self.speed_scale)

    @cached_property
    def effective(self) -> SliderLimits:
        """Limits that plans keep."""
        return self.planned.limits if self.planned is not None else self.scaled

    @property
    def of_path_speeds(self) -> float:
        """Factor of the platform speeds that paths ask for."""
        return self.speed_scale * self.path_speed_scale

    @cached_property
    def rapid(self) -> float:
        """Largest speed of the platform where a path asks for none [m/s]."""
        return inf if self.rapid_scale == 1.0 else self.rapid_scale * max(self.scaled.velocity)

    @cached_property
    def cut(self) -> float:
        """Part that plans let bends be cut by, of what the tolerances of a path leave."""
        return self.planned.cut if self.planned is not None else 1.0

    def leaving(
        self, planned: Planned | None = None, present: SliderState | None = None
    ) -> DriveLimits:
        """Return the same, with limits for plans that leave something to the shaper.

        Args:
            planned: what they keep; without it, what nearly always suffices.
            present: where they begin in motion: they leave no more than this state lets them.
        """
        if self.shaper is None:
            return self
        if planned is None:
            added = (each.times(LEFT_TO_PLANS[each.order - 1]) for each in self.scaled.added)
            planned = Planned(self.scaled.times(*LEFT_TO_PLANS).with_added(*added))
        if present is not None:
            planned = planned._replace(limits=_raised(planned.limits, present, self.scaled))
        return replace(self, planned=planned)

    @cached_property
    def held_back(self) -> float:
        """How long after the end of a plan the shaper still moves the platform [s]."""
        return self.shaper.duration if self.shaper is not None else 0.0


def stays_within(state: SliderState, limits: SliderLimits) -> bool:
    """Return whether the sliders can stay inside ``limits`` from this ``state`` on."""
    return all(
        abs(a) <= largest and abs(v) + (a * a / (2.0 * jerk) if a * v > 0.0 else 0.0) <= speed
        for v, a, speed, largest, jerk in zip(
            state.velocities,
            state.accelerations,
            limits.velocity,
            limits.acceleration,
            limits.jerk,
        )
    )


def _raised(lower: SliderLimits, state: SliderState, limits: SliderLimits) -> SliderLimits:
    """Return ``lower`` limits, raised as far as the sliders cannot stay inside them from a state.

    A braking cannot begin beyond the limits that it is planned for. They are raised to ``limits``
    at most.
    """
    velocities, accelerations = np.array(state.velocities), np.array(state.accelerations)
    gets_faster = velocities * accelerations > 0.0
    reached = np.abs(velocities) + gets_faster * accelerations**2 / (2.0 * lower.table[2])
    table = lower.table.copy()
    raised = np.maximum(table[:2], (reached, np.abs(accelerations)))
    table[:2] = np.minimum(raised, limits.table[:2])
    return limits.with_table(table).with_added(*(each.raised(state) for each in lower.added))
