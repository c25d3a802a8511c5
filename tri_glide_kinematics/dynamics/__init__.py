"""Dynamics: the forces that the sliders have to exert, and the motion that forces give."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.dynamics.masses import MIDDLE as MIDDLE
    from tri_glide_kinematics.dynamics.masses import STANDARD_GRAVITY as STANDARD_GRAVITY
    from tri_glide_kinematics.dynamics.masses import Arm as Arm
    from tri_glide_kinematics.dynamics.masses import Masses as Masses
    from tri_glide_kinematics.dynamics.masses import PayloadOffCentreError as PayloadOffCentreError
    from tri_glide_kinematics.dynamics.slider_forces import Energy as Energy
    from tri_glide_kinematics.dynamics.slider_forces import PathForces as PathForces
    from tri_glide_kinematics.dynamics.slider_forces import SliderForces as SliderForces

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
