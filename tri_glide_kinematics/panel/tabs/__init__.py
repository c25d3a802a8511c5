"""The tabs of the page."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.tabs.curves import Curves as Curves
    from tri_glide_kinematics.panel.tabs.curves import SwingTab as SwingTab
    from tri_glide_kinematics.panel.tabs.drive_tab import DriveTab as DriveTab
    from tri_glide_kinematics.panel.tabs.live_view import LiveView as LiveView
    from tri_glide_kinematics.panel.tabs.manual_controls import ManualControls as ManualControls
    from tri_glide_kinematics.panel.tabs.points_tab import Point as Point
    from tri_glide_kinematics.panel.tabs.points_tab import PointsTab as PointsTab
    from tri_glide_kinematics.panel.tabs.program_tab import SHOW_PERIOD as SHOW_PERIOD
    from tri_glide_kinematics.panel.tabs.program_tab import ProgramTab as ProgramTab
    from tri_glide_kinematics.panel.tabs.runs import Runs as Runs

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
