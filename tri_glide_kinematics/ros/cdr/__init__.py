"""Messages as bytes, written at once where a message of Python would take too long."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.cdr.array_bytes import MarkerShape as MarkerShape
    from tri_glide_kinematics.ros.cdr.array_bytes import joint_trajectory as joint_trajectory
    from tri_glide_kinematics.ros.cdr.array_bytes import marker_array as marker_array
    from tri_glide_kinematics.ros.cdr.request_bytes import (
        read_kinds_within_bytes as read_kinds_within_bytes,
    )
    from tri_glide_kinematics.ros.cdr.request_bytes import read_within_bytes as read_within_bytes
    from tri_glide_kinematics.ros.cdr.stamped_triples import FIRST as FIRST
    from tri_glide_kinematics.ros.cdr.stamped_triples import FOURTH as FOURTH
    from tri_glide_kinematics.ros.cdr.stamped_triples import KIND as KIND
    from tri_glide_kinematics.ros.cdr.stamped_triples import MARKS as MARKS
    from tri_glide_kinematics.ros.cdr.stamped_triples import PLAIN as PLAIN
    from tri_glide_kinematics.ros.cdr.stamped_triples import SECOND as SECOND
    from tri_glide_kinematics.ros.cdr.stamped_triples import STAMP_END as STAMP_END
    from tri_glide_kinematics.ros.cdr.stamped_triples import STAMP_OFFSET as STAMP_OFFSET
    from tri_glide_kinematics.ros.cdr.stamped_triples import THIRD as THIRD
    from tri_glide_kinematics.ros.cdr.stamped_triples import NoSuchPlaceError as NoSuchPlaceError
    from tri_glide_kinematics.ros.cdr.stamped_triples import StampedTriples as StampedTriples
    from tri_glide_kinematics.ros.cdr.stamped_triples import byte_order as byte_order
    from tri_glide_kinematics.ros.cdr.stamped_triples import offset_of as offset_of

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
