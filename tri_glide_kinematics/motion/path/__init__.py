"""Paths: what is asked for, and what is driven."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.errors import ApartError as ApartError
    from tri_glide_kinematics.motion.errors import EmptyPathError as EmptyPathError
    from tri_glide_kinematics.motion.errors import NoArcError as NoArcError
    from tri_glide_kinematics.motion.errors import PathError as PathError
    from tri_glide_kinematics.motion.errors import PathPlaceError as PathPlaceError
    from tri_glide_kinematics.motion.errors import RepeatedPointError as RepeatedPointError
    from tri_glide_kinematics.motion.errors import SegmentError as SegmentError
    from tri_glide_kinematics.motion.errors import ShortSegmentError as ShortSegmentError
    from tri_glide_kinematics.motion.errors import TooManySegmentsError as TooManySegmentsError
    from tri_glide_kinematics.motion.path.corners import ShapedCorners as ShapedCorners
    from tri_glide_kinematics.motion.path.driven_path import ArcLength as ArcLength
    from tri_glide_kinematics.motion.path.driven_path import DrivenPath as DrivenPath
    from tri_glide_kinematics.motion.path.piecewise_path import PathPolylines as PathPolylines
    from tri_glide_kinematics.motion.path.piecewise_path import polylines_of as polylines_of
    from tri_glide_kinematics.motion.path.place_check import check_place as check_place
    from tri_glide_kinematics.motion.path.place_check import clearances as clearances
    from tri_glide_kinematics.motion.path.platform_path import PLACE_OF_ANGLE as PLACE_OF_ANGLE
    from tri_glide_kinematics.motion.path.platform_path import FlatPath as FlatPath
    from tri_glide_kinematics.motion.path.platform_path import PlatformPath as PlatformPath
    from tri_glide_kinematics.motion.path.platform_path import SegmentKind as SegmentKind
    from tri_glide_kinematics.motion.path.platform_path import polyline_from as polyline_from
    from tri_glide_kinematics.motion.path.segments import LARGEST_ANGLE as LARGEST_ANGLE
    from tri_glide_kinematics.motion.path.segments import LARGEST_PLACE as LARGEST_PLACE
    from tri_glide_kinematics.motion.path.segments import LARGEST_SPEED as LARGEST_SPEED
    from tri_glide_kinematics.motion.path.segments import LEAST_SPEED as LEAST_SPEED
    from tri_glide_kinematics.motion.path.segments import MOST_SEGMENTS as MOST_SEGMENTS
    from tri_glide_kinematics.motion.path.segments import SHORTEST as SHORTEST
    from tri_glide_kinematics.motion.path.segments import Segments as Segments
    from tri_glide_kinematics.motion.path.segments import check_count as check_count

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
