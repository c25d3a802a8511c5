"""The facts of the machine that the parameters of the running ``ik_node`` tell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from tri_glide_kinematics.control import in_teach_mode
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.settings import (
    IK_NODE,
    Values,
    limits_of,
    machine_of,
    motion_limits_of,
    shaper_of,
    true_travel_of,
    workspace_limits_of,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Parameters of ik_node that the panel asks for.
NAMES = tuple(parameter.name for parameter in IK_NODE)


class Bounds(NamedTuple):
    """What bounds the motion of a machine, and may be changed while it runs.

    Attributes:
        limits: of its sliders, scaled, with what bounds all motion besides.
        shaper: None without one.
    """

    limits: SliderLimits
    shaper: Shaping | None


@dataclass(frozen=True, eq=False)
class MachineFacts:
    """A machine as its ``ik_node`` knows it.

    Attributes:
        values: of its parameters.
        is_teaching: whether the teach mode is switched on.
    """

    values: Values
    is_teaching: bool = False

    @cached_property
    def machine(self) -> TriGlide:
        """Its kinematics."""
        return machine_of(self.values)

    @cached_property
    def workspace(self) -> Workspace:
        """Where it may be."""
        return Workspace(self.machine, workspace_limits_of(self.values))

    @cached_property
    def limits(self) -> SliderLimits:
        """Of its sliders, before they are scaled."""
        return limits_of(self.values)

    @cached_property
    def bounds(self) -> Bounds:
        """What the proof of a program depends on, besides the workspace."""
        limits = motion_limits_of(self.values, self.machine)
        if self.is_teaching:
            limits = in_teach_mode(limits, self.machine)
        return Bounds(limits.with_velocity_scaled(self.speed_scale), shaper_of(self.values))

    @property
    def travel(self) -> tuple[Vector3, Vector3]:
        """True heights of the lower and of the upper ends, each of shape (3,) [m]."""
        return true_travel_of(self.values)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the sliders."""
        return tuple(self.values["joint_names"])

    @property
    def base_frame(self) -> str:
        """Frame of all places."""
        return str(self.values["base_frame"])

    @property
    def speed_scale(self) -> float:
        """Factor by which the velocity limits are reduced."""
        return float(self.values["speed_scale"])

    def with_changes(self, changes: Values) -> MachineFacts:
        """Return the facts after some parameters have changed."""
        return replace(self, values={**self.values, **changes})

    def with_teach_mode(self, on: bool) -> MachineFacts:
        """Return the facts after the teach mode was switched ``on`` or off."""
        return replace(self, is_teaching=on)

    def is_same_machine(self, other: MachineFacts) -> bool:
        """Tell whether the other one looks alike."""
        return all(
            self.values[name] == other.values[name] for name in NAMES if name not in LIVE_NAMES
        )


LIVE_NAMES = frozenset(parameter.name for parameter in IK_NODE if parameter.live)
