"""Requests and answers about planar mechanisms as messages."""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.ros.mechanisms.fields import LARGEST as LARGEST
    from tri_glide_kinematics.ros.mechanisms.fields import (
        RefusedRequestError as RefusedRequestError,
    )
    from tri_glide_kinematics.ros.mechanisms.fields import check_numbers as check_numbers
    from tri_glide_kinematics.ros.mechanisms.fields import column as column
    from tri_glide_kinematics.ros.mechanisms.fields import crank_angles as crank_angles

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
