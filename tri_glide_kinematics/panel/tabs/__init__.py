"""The tabs of the page."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.tabs.drive_tab import DriveTab as DriveTab
    from tri_glide_kinematics.panel.tabs.live_view import Drag as Drag
    from tri_glide_kinematics.panel.tabs.live_view import LiveView as LiveView
    from tri_glide_kinematics.panel.tabs.live_view import edge_distance as edge_distance
    from tri_glide_kinematics.panel.tabs.live_view import edge_row as edge_row
    from tri_glide_kinematics.panel.tabs.live_view import numbers_table as numbers_table
    from tri_glide_kinematics.panel.tabs.live_view import pose_of as pose_of
    from tri_glide_kinematics.panel.tabs.points_tab import Point as Point
    from tri_glide_kinematics.panel.tabs.points_tab import PointsFileError as PointsFileError
    from tri_glide_kinematics.panel.tabs.points_tab import PointsTab as PointsTab
    from tri_glide_kinematics.panel.tabs.points_tab import load_points as load_points
    from tri_glide_kinematics.panel.tabs.points_tab import save_points as save_points
    from tri_glide_kinematics.panel.tabs.program_tab import ProgramTab as ProgramTab
    from tri_glide_kinematics.panel.tabs.swing_tab import Shaping as Shaping
    from tri_glide_kinematics.panel.tabs.swing_tab import SwingTab as SwingTab

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
