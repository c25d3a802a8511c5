"""Mechanisms: solvers for four-bar linkages, F-mechanisms and a landing gear; their files."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.f_mechanism import (
        DegenerateLinkageError as DegenerateLinkageError,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism import NotAPoseError as NotAPoseError
    from tri_glide_kinematics.mechanisms.f_mechanism import SelfMotionError as SelfMotionError
    from tri_glide_kinematics.mechanisms.files import MechanismFile as MechanismFile
    from tri_glide_kinematics.mechanisms.files import MechanismFileError as MechanismFileError
    from tri_glide_kinematics.mechanisms.files import load_mechanism as load_mechanism
    from tri_glide_kinematics.mechanisms.four_bar import CrankLimitError as CrankLimitError
    from tri_glide_kinematics.mechanisms.four_bar import NotAssemblableError as NotAssemblableError

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
