"""Sizing: from a wish to a machine, proved over the whole volume; maps and surfaces of machines."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.sizing.designs import field_bounds as field_bounds
    from tri_glide_kinematics.sizing.designs import needs as needs
    from tri_glide_kinematics.sizing.fields import Cells as Cells
    from tri_glide_kinematics.sizing.fields import Loads as Loads
    from tri_glide_kinematics.sizing.proof import Extremes as Extremes
    from tri_glide_kinematics.sizing.proof import largest_over as largest_over
    from tri_glide_kinematics.sizing.search import ImpossibleWishError as ImpossibleWishError
    from tri_glide_kinematics.sizing.search import Stop as Stop
    from tri_glide_kinematics.sizing.search import size as size
    from tri_glide_kinematics.sizing.sizing import Sizing as Sizing
    from tri_glide_kinematics.sizing.sizing import sizing_of as sizing_of
    from tri_glide_kinematics.sizing.wish import Box as Box
    from tri_glide_kinematics.sizing.wish import Demand as Demand
    from tri_glide_kinematics.sizing.wish import Objective as Objective
    from tri_glide_kinematics.sizing.wish import Volume as Volume
    from tri_glide_kinematics.sizing.wish import Wish as Wish
    from tri_glide_kinematics.sizing.wish import some_places as some_places

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
