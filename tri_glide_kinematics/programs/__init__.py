"""Programs: files of commands, and what came of each of them."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.programs.check import NoMotionError as NoMotionError
    from tri_glide_kinematics.programs.check import ProgramCheck as ProgramCheck
    from tri_glide_kinematics.programs.check import Scales as Scales
    from tri_glide_kinematics.programs.check import TimeLeft as TimeLeft
    from tri_glide_kinematics.programs.check import check_program as check_program
    from tri_glide_kinematics.programs.check import time_steps as time_steps
    from tri_glide_kinematics.programs.dialects import Dialect as Dialect
    from tri_glide_kinematics.programs.drive_files import DriveFile as DriveFile
    from tri_glide_kinematics.programs.drive_files import DriveFileError as DriveFileError
    from tri_glide_kinematics.programs.drive_files import load_drive as load_drive
    from tri_glide_kinematics.programs.gcode import read_program as read_program
    from tri_glide_kinematics.programs.kept import KeptError as KeptError
    from tri_glide_kinematics.programs.kept import KeptLine as KeptLine
    from tri_glide_kinematics.programs.kept import RunState as RunState
    from tri_glide_kinematics.programs.kept import buttons_file as buttons_file
    from tri_glide_kinematics.programs.kept import default_kept_file as default_kept_file
    from tri_glide_kinematics.programs.kept import default_zeros_file as default_zeros_file
    from tri_glide_kinematics.programs.kept import line_to_go_on_from as line_to_go_on_from
    from tri_glide_kinematics.programs.kept import load_buttons as load_buttons
    from tri_glide_kinematics.programs.kept import load_kept as load_kept
    from tri_glide_kinematics.programs.kept import load_zeros as load_zeros
    from tri_glide_kinematics.programs.kept import touched_off as touched_off
    from tri_glide_kinematics.programs.kept import with_kept_zeros as with_kept_zeros
    from tri_glide_kinematics.programs.kept import write_buttons as write_buttons
    from tri_glide_kinematics.programs.kept import write_zeros as write_zeros
    from tri_glide_kinematics.programs.loading import LONGEST_TEXT as LONGEST_TEXT
    from tri_glide_kinematics.programs.loading import POINTS_ENDING as POINTS_ENDING
    from tri_glide_kinematics.programs.loading import PROGRAM_ENDINGS as PROGRAM_ENDINGS
    from tri_glide_kinematics.programs.loading import is_program as is_program
    from tri_glide_kinematics.programs.loading import load_program as load_program
    from tri_glide_kinematics.programs.loading import load_work as load_work
    from tri_glide_kinematics.programs.loading import read_short as read_short
    from tri_glide_kinematics.programs.points import load_points as load_points
    from tri_glide_kinematics.programs.program import Dwell as Dwell
    from tri_glide_kinematics.programs.program import MoveStep as MoveStep
    from tri_glide_kinematics.programs.program import Output as Output
    from tri_glide_kinematics.programs.program import PathRun as PathRun
    from tri_glide_kinematics.programs.program import PathStep as PathStep
    from tri_glide_kinematics.programs.program import Program as Program
    from tri_glide_kinematics.programs.program import ProgramStop as ProgramStop
    from tri_glide_kinematics.programs.program import Step as Step
    from tri_glide_kinematics.programs.program import StopKind as StopKind
    from tri_glide_kinematics.programs.program import Work as Work
    from tri_glide_kinematics.programs.program import from_line as from_line
    from tri_glide_kinematics.programs.run import APPROACH_SPEED as APPROACH_SPEED
    from tri_glide_kinematics.programs.run import START_TIMEOUT as START_TIMEOUT
    from tri_glide_kinematics.programs.run import SWITCHED_OFF as SWITCHED_OFF
    from tri_glide_kinematics.programs.run import GoalEnd as GoalEnd
    from tri_glide_kinematics.programs.run import GoalProgress as GoalProgress
    from tri_glide_kinematics.programs.run import MachineNow as MachineNow
    from tri_glide_kinematics.programs.run import ProgramMachine as ProgramMachine
    from tri_glide_kinematics.programs.run import ProgramRun as ProgramRun
    from tri_glide_kinematics.programs.run import RunNews as RunNews
    from tri_glide_kinematics.programs.run import StepReport as StepReport
    from tri_glide_kinematics.programs.run import in_millimetres as in_millimetres
    from tri_glide_kinematics.programs.settings import WORK_OFFSETS as WORK_OFFSETS
    from tri_glide_kinematics.programs.settings import ProgramSettings as ProgramSettings
    from tri_glide_kinematics.programs.settings import SettingsError as SettingsError
    from tri_glide_kinematics.programs.settings import load_own_settings as load_own_settings
    from tri_glide_kinematics.programs.settings import load_settings as load_settings
    from tri_glide_kinematics.programs.words import ProgramError as ProgramError
    from tri_glide_kinematics.programs.words import TellPart as TellPart
    from tri_glide_kinematics.programs.words import tell_nobody as tell_nobody

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
