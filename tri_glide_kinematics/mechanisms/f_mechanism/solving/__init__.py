"""All positions of an F-mechanism at given crank angles."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.batch import solve_batch as solve_batch
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.batch_roots import (
        row_roots as row_roots,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import ROUNDING as ROUNDING
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.closure import Closure as Closure
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.exact import (
        exact_positions as exact_positions,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import CrankPins as CrankPins
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import Linkage as Linkage
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import Number as Number
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import direction as direction
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.linkage import pins_at as pins_at
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.polynomial import Cubic as Cubic
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.polynomial import (
        derivatives as derivatives,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.polynomial import evaluate as evaluate
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.positions import pose_of as pose_of
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.positions import poses_at as poses_at
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import CONVERGED as CONVERGED
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import motion as motion
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import newton_step as newton_step
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import position_of as position_of
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import refined as refined
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import (
        rod_jacobian as rod_jacobian,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.rods import (
        singularity_unit as singularity_unit,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.solving.roots import real_roots as real_roots

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
