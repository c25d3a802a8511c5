"""Dynamics: the forces that the sliders have to exert, and the motion that forces give."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.dynamics.identification import ANY_ARMS as ANY_ARMS
    from tri_glide_kinematics.dynamics.identification import COUNTERWEIGHTS as COUNTERWEIGHTS
    from tri_glide_kinematics.dynamics.identification import NO_COUNTERWEIGHTS as NO_COUNTERWEIGHTS
    from tri_glide_kinematics.dynamics.identification import UNIFORM_ARMS as UNIFORM_ARMS
    from tri_glide_kinematics.dynamics.identification import Estimate as Estimate
    from tri_glide_kinematics.dynamics.identification import Identified as Identified
    from tri_glide_kinematics.dynamics.identification import (
        NotIdentifiedError as NotIdentifiedError,
    )
    from tri_glide_kinematics.dynamics.identification import (
        TooFewSamplesError as TooFewSamplesError,
    )
    from tri_glide_kinematics.dynamics.identification import identify as identify
    from tri_glide_kinematics.dynamics.identification import regressor as regressor
    from tri_glide_kinematics.dynamics.masses import MIDDLE as MIDDLE
    from tri_glide_kinematics.dynamics.masses import STANDARD_GRAVITY as STANDARD_GRAVITY
    from tri_glide_kinematics.dynamics.masses import Arm as Arm
    from tri_glide_kinematics.dynamics.masses import Constants as Constants
    from tri_glide_kinematics.dynamics.masses import Masses as Masses
    from tri_glide_kinematics.dynamics.masses import PayloadOffCentreError as PayloadOffCentreError
    from tri_glide_kinematics.dynamics.slider_forces import Energy as Energy
    from tri_glide_kinematics.dynamics.slider_forces import PathForces as PathForces
    from tri_glide_kinematics.dynamics.slider_forces import SliderForces as SliderForces

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
