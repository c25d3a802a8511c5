"""All branches of an F-mechanism."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.mechanisms.f_mechanism.overview.overview import (
        FMechanismOverview as FMechanismOverview,
    )
    from tri_glide_kinematics.mechanisms.f_mechanism.overview.overview import survey as survey

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
