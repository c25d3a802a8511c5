"""Programs: files of commands, and what came of each of them."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.programs.drive_files import NOT_DRIVEN as NOT_DRIVEN
    from tri_glide_kinematics.programs.drive_files import DriveFile as DriveFile
    from tri_glide_kinematics.programs.drive_files import DriveFileError as DriveFileError
    from tri_glide_kinematics.programs.drive_files import MoveStep as MoveStep
    from tri_glide_kinematics.programs.drive_files import PathStep as PathStep
    from tri_glide_kinematics.programs.drive_files import ProgressLine as ProgressLine
    from tri_glide_kinematics.programs.drive_files import Step as Step
    from tri_glide_kinematics.programs.drive_files import StepReport as StepReport
    from tri_glide_kinematics.programs.drive_files import WaitStep as WaitStep
    from tri_glide_kinematics.programs.drive_files import in_millimetres as in_millimetres
    from tri_glide_kinematics.programs.drive_files import is_whole as is_whole
    from tri_glide_kinematics.programs.drive_files import load_drive as load_drive
    from tri_glide_kinematics.programs.drive_files import table as table

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
