"""Settings: the tables of parameters, where values come from, and what is made of them."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.settings.arguments import PARAMETERS_OF_ALL as PARAMETERS_OF_ALL
    from tri_glide_kinematics.settings.arguments import check_arguments as check_arguments
    from tri_glide_kinematics.settings.arguments import check_names as check_names
    from tri_glide_kinematics.settings.arguments import check_sources as check_sources
    from tri_glide_kinematics.settings.arguments import file_values as file_values
    from tri_glide_kinematics.settings.arguments import help_text as help_text
    from tri_glide_kinematics.settings.arguments import help_wanted as help_wanted
    from tri_glide_kinematics.settings.arguments import in_words as in_words
    from tri_glide_kinematics.settings.arguments import is_for as is_for
    from tri_glide_kinematics.settings.arguments import sections_of as sections_of
    from tri_glide_kinematics.settings.arguments import sources_of as sources_of
    from tri_glide_kinematics.settings.picking import keep_taught as keep_taught
    from tri_glide_kinematics.settings.picking import picker_of as picker_of
    from tri_glide_kinematics.settings.picking import simulated_cell_of as simulated_cell_of
    from tri_glide_kinematics.settings.picking import taught_file_of as taught_file_of
    from tri_glide_kinematics.settings.picking import taught_in as taught_in
    from tri_glide_kinematics.settings.picking import taught_of as taught_of
    from tri_glide_kinematics.settings.picking import taught_values as taught_values
    from tri_glide_kinematics.settings.tables import CALIBRATION_NODE as CALIBRATION_NODE
    from tri_glide_kinematics.settings.tables import CIA402_NODE as CIA402_NODE
    from tri_glide_kinematics.settings.tables import FK_NODE as FK_NODE
    from tri_glide_kinematics.settings.tables import FORCE_LIMITS as FORCE_LIMITS
    from tri_glide_kinematics.settings.tables import IK_NODE as IK_NODE
    from tri_glide_kinematics.settings.tables import NO_SHAPER as NO_SHAPER
    from tri_glide_kinematics.settings.tables import NODES as NODES
    from tri_glide_kinematics.settings.tables import PANEL_NODE as PANEL_NODE
    from tri_glide_kinematics.settings.tables import PICK_NODE as PICK_NODE
    from tri_glide_kinematics.settings.tables import SIMULATED_CELL_NODE as SIMULATED_CELL_NODE
    from tri_glide_kinematics.settings.tables import SIMULATOR_NODE as SIMULATOR_NODE
    from tri_glide_kinematics.settings.tables import Parameter as Parameter
    from tri_glide_kinematics.settings.tables import ParameterError as ParameterError
    from tri_glide_kinematics.settings.tables import Values as Values
    from tri_glide_kinematics.settings.tables import change_text as change_text
    from tri_glide_kinematics.settings.tables import start_text as start_text
    from tri_glide_kinematics.settings.values import check_joint_names as check_joint_names
    from tri_glide_kinematics.settings.values import check_travel as check_travel
    from tri_glide_kinematics.settings.values import description_of as description_of
    from tri_glide_kinematics.settings.values import (
        drive_group_settings_of as drive_group_settings_of,
    )
    from tri_glide_kinematics.settings.values import forces_of as forces_of
    from tri_glide_kinematics.settings.values import in_position_bounds_of as in_position_bounds_of
    from tri_glide_kinematics.settings.values import limits_of as limits_of
    from tri_glide_kinematics.settings.values import machine_of as machine_of
    from tri_glide_kinematics.settings.values import motion_limits_of as motion_limits_of
    from tri_glide_kinematics.settings.values import position_control_of as position_control_of
    from tri_glide_kinematics.settings.values import scaled_limits_of as scaled_limits_of
    from tri_glide_kinematics.settings.values import shaper_of as shaper_of
    from tri_glide_kinematics.settings.values import supervision_bounds_of as supervision_bounds_of
    from tri_glide_kinematics.settings.values import swing_of as swing_of
    from tri_glide_kinematics.settings.values import true_travel_of as true_travel_of
    from tri_glide_kinematics.settings.values import workspace_limits_of as workspace_limits_of
    from tri_glide_kinematics.settings.values import workspace_of as workspace_of

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
