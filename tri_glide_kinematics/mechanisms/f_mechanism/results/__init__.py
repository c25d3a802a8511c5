"""Results of solving and following an F-mechanism."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.f_mechanism.results.pose import (
        FMechanismPose as FMechanismPose,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.results.pose import (
        FMechanismPoses as FMechanismPoses,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.results.trace import EventKind as EventKind
    from tri_glide_kinematics.mechanisms.f_mechanism.results.trace import (
        FMechanismEvent as FMechanismEvent,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.results.trace import (
        FMechanismTrace as FMechanismTrace,
    )

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
