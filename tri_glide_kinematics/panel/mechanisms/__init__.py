"""The mechanisms tab: four-bar linkages and F-mechanisms that a person changes and turns."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.mechanisms.questions import Track as Track
    from tri_glide_kinematics.panel.mechanisms.tab import NONE as NONE
    from tri_glide_kinematics.panel.mechanisms.tab import PALE as PALE
    from tri_glide_kinematics.panel.mechanisms.tab import MechanismsTab as MechanismsTab
    from tri_glide_kinematics.panel.mechanisms.tab import example_files as example_files
    from tri_glide_kinematics.panel.mechanisms.tab import fitted as fitted
    from tri_glide_kinematics.panel.mechanisms.tab import rgb as rgb
    from tri_glide_kinematics.panel.mechanisms.tab import shown_of as shown_of
    from tri_glide_kinematics.panel.mechanisms.tab import view_of as view_of

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
