"""The tri-glide: geometry, kinematics both ways, conditioning."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.tri_glide.conditioning import ball_that_keeps as ball_that_keeps
    from tri_glide_kinematics.tri_glide.conditioning import (
        extreme_singular_values as extreme_singular_values,
    )
    from tri_glide_kinematics.tri_glide.conditioning import (
        extreme_singular_values_batch as extreme_singular_values_batch,
    )
    from tri_glide_kinematics.tri_glide.conditioning import jacobian_rows as jacobian_rows
    from tri_glide_kinematics.tri_glide.conditioning import least_rises as least_rises
    from tri_glide_kinematics.tri_glide.geometry import DEFAULT_GEOMETRY as DEFAULT_GEOMETRY
    from tri_glide_kinematics.tri_glide.geometry import ArmsNeverMeetError as ArmsNeverMeetError
    from tri_glide_kinematics.tri_glide.geometry import (
        CoincidentAnchorsError as CoincidentAnchorsError,
    )
    from tri_glide_kinematics.tri_glide.geometry import (
        CollinearAnchorsError as CollinearAnchorsError,
    )
    from tri_glide_kinematics.tri_glide.geometry import GeometryError as GeometryError
    from tri_glide_kinematics.tri_glide.geometry import TriGlideGeometry as TriGlideGeometry
    from tri_glide_kinematics.tri_glide.kinematics import ArmTooShortError as ArmTooShortError
    from tri_glide_kinematics.tri_glide.kinematics import NoPoseError as NoPoseError
    from tri_glide_kinematics.tri_glide.kinematics import (
        PlatformAboveSliderError as PlatformAboveSliderError,
    )
    from tri_glide_kinematics.tri_glide.kinematics import (
        SpheresDoNotMeetError as SpheresDoNotMeetError,
    )
    from tri_glide_kinematics.tri_glide.kinematics import TriGlide as TriGlide
    from tri_glide_kinematics.tri_glide.kinematics import UnreachableError as UnreachableError
    from tri_glide_kinematics.tri_glide.kinematics import (
        WrongAssemblyModeError as WrongAssemblyModeError,
    )

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
