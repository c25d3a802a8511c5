"""The mechanisms tab: four-bar linkages and F-mechanisms that a person changes and turns."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.mechanisms.tab import NONE as NONE
    from tri_glide_kinematics.panel.mechanisms.tab import MechanismsTab as MechanismsTab

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
