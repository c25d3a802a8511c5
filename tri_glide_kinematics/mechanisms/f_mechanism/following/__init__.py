"""A branch of an F-mechanism, followed through its turning points."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.f_mechanism.following.curve import Curve as Curve
    from tri_glide_kinematics.mechanisms.f_mechanism.following.curve import Drive as Drive
    from tri_glide_kinematics.mechanisms.f_mechanism.following.stations import (
        explicit_stations as explicit_stations,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.following.stations import (
        uniform_stations as uniform_stations,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.following.trace import (
        TraceOptions as TraceOptions,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.following.trace import (
        starting_point as starting_point,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.following.trace import (
        straight_drive as straight_drive,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.following.trace import (
        trace_branch as trace_branch,
    )

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
