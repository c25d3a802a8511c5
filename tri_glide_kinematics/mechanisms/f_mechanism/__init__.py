"""The F-mechanism: a planar 3-RRR robot whose three cranks turn together."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.f_mechanism.curve import EventKind as EventKind
    from tri_glide_kinematics.mechanisms.f_mechanism.mechanism import (
        DegenerateLinkageError as DegenerateLinkageError,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.mechanism import FMechanism as FMechanism
    from tri_glide_kinematics.mechanisms.f_mechanism.mechanism import (
        FMechanismOverview as FMechanismOverview,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.positions import (
        FMechanismPose as FMechanismPose,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.positions import (
        FMechanismPoses as FMechanismPoses,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.positions import (
        SelfMotionError as SelfMotionError,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import CrankPins as CrankPins
    from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import Linkage as Linkage
    from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import as_points as as_points
    from tri_glide_kinematics.mechanisms.f_mechanism.rod_equations import pins_at as pins_at
    from tri_glide_kinematics.mechanisms.f_mechanism.trace import FMechanismEvent as FMechanismEvent
    from tri_glide_kinematics.mechanisms.f_mechanism.trace import FMechanismTrace as FMechanismTrace
    from tri_glide_kinematics.mechanisms.f_mechanism.trace import NotAPoseError as NotAPoseError

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
