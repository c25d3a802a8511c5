"""Workspace: where the platform and the sliders may be."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.workspace.limits import OVERRUN_TOLERANCES as OVERRUN_TOLERANCES
    from tri_glide_kinematics.workspace.limits import ROUNDING as ROUNDING
    from tri_glide_kinematics.workspace.limits import Cylinder as Cylinder
    from tri_glide_kinematics.workspace.limits import OutsideWorkspaceError as OutsideWorkspaceError
    from tri_glide_kinematics.workspace.limits import WorkspaceLimit as WorkspaceLimit
    from tri_glide_kinematics.workspace.limits import WorkspaceLimits as WorkspaceLimits
    from tri_glide_kinematics.workspace.limits import overruns as overruns
    from tri_glide_kinematics.workspace.limits import places_inside as places_inside
    from tri_glide_kinematics.workspace.limits import slacks as slacks
    from tri_glide_kinematics.workspace.tracing import SAMPLES_IN_PIECE as SAMPLES_IN_PIECE
    from tri_glide_kinematics.workspace.tracing import TOLERANCE as TOLERANCE
    from tri_glide_kinematics.workspace.tracing import ConditionField as ConditionField
    from tri_glide_kinematics.workspace.tracing import SliderMotionState as SliderMotionState
    from tri_glide_kinematics.workspace.workspace import Workspace as Workspace
    from tri_glide_kinematics.workspace.workspace import edge_rings as edge_rings
    from tri_glide_kinematics.workspace.workspace import outline as outline

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
