"""Sizing: from a wish to a machine, proved over the whole volume; maps and surfaces of machines."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.sizing.duty import Cycle as Cycle
    from tri_glide_kinematics.sizing.duty import DutyLoad as DutyLoad
    from tri_glide_kinematics.sizing.duty import duty_load as duty_load
    from tri_glide_kinematics.sizing.duty import pick_and_place as pick_and_place
    from tri_glide_kinematics.sizing.extents import Maps as Maps
    from tri_glide_kinematics.sizing.extents import NoCylinderError as NoCylinderError
    from tri_glide_kinematics.sizing.extents import height_ranges as height_ranges
    from tri_glide_kinematics.sizing.extents import inscribed_height as inscribed_height
    from tri_glide_kinematics.sizing.extents import inscribed_radius as inscribed_radius
    from tri_glide_kinematics.sizing.extents import level_corners as level_corners
    from tri_glide_kinematics.sizing.extents import maps as maps
    from tri_glide_kinematics.sizing.mesh import Mesh as Mesh
    from tri_glide_kinematics.sizing.mesh import glb_bytes as glb_bytes
    from tri_glide_kinematics.sizing.mesh import stl_bytes as stl_bytes
    from tri_glide_kinematics.sizing.mesh import surface as surface
    from tri_glide_kinematics.sizing.search import ImpossibleWishError as ImpossibleWishError
    from tri_glide_kinematics.sizing.search import size as size
    from tri_glide_kinematics.sizing.sizing import Sizing as Sizing
    from tri_glide_kinematics.sizing.sizing import field_bounds as field_bounds
    from tri_glide_kinematics.sizing.sizing import needs as needs
    from tri_glide_kinematics.sizing.sizing import parameter_text as parameter_text
    from tri_glide_kinematics.sizing.sizing import sizing_of as sizing_of
    from tri_glide_kinematics.sizing.wish import Box as Box
    from tri_glide_kinematics.sizing.wish import Demand as Demand
    from tri_glide_kinematics.sizing.wish import Objective as Objective
    from tri_glide_kinematics.sizing.wish import Volume as Volume
    from tri_glide_kinematics.sizing.wish import Wish as Wish
    from tri_glide_kinematics.sizing.wish import heights_of as heights_of
    from tri_glide_kinematics.sizing.wish import some_places as some_places

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
