"""Answers requests about landing gears."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

from tri_glide_interfaces.msg import BodyState as BodyMessage
from tri_glide_interfaces.msg import LandingGear as LandingGearMessage
from tri_glide_interfaces.msg import LandingGearMotion as MotionMessage
from tri_glide_interfaces.msg import Reaction as ReactionMessage
from tri_glide_interfaces.srv import SolveLandingGear
from tri_glide_kinematics.mechanisms.landing_gear import (
    BodyState,
    LandingGear,
    LandingGearMotion,
    Reaction,
)

Message = TypeVar("Message", BodyMessage, ReactionMessage)


def solve(request: SolveLandingGear.Request, response: SolveLandingGear.Response) -> None:
    """Fill the response with motion, momentum and reactions.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    state = gear_of(request.gear).state(motion_of(request.motion))
    response.gear = _message(BodyMessage, state.gear)
    response.wheel = _message(BodyMessage, state.wheel)
    response.hinge = _message(ReactionMessage, state.hinge)
    response.axle = _message(ReactionMessage, state.axle)


def gear_of(message: LandingGearMessage) -> LandingGear:
    """Return the gear that a message describes.

    Raises:
        KinematicsError: if it describes none.
    """
    return LandingGear(
        l1=message.l1,
        l2=message.l2,
        l3=message.l3,
        l4=message.l4,
        gear_mass=message.gear_mass,
        wheel_mass=message.wheel_mass,
        gear_inertia=(
            (message.gear_ixx, message.gear_ixy, message.gear_ixz),
            (message.gear_ixy, message.gear_iyy, message.gear_iyz),
            (message.gear_ixz, message.gear_iyz, message.gear_izz),
        ),
        wheel_axial_inertia=message.wheel_axial_inertia,
        wheel_transverse_inertia=message.wheel_transverse_inertia,
        gravity=message.gravity.tolist(),
    )


def motion_of(message: MotionMessage) -> LandingGearMotion:
    """Return the motion that a message describes."""
    return LandingGearMotion(**{name: getattr(message, name) for name in _names(MotionMessage)})


def _message(kind: type[Message], values: BodyState | Reaction) -> Message:
    """Return a message of ``kind``, filled from the attributes that its fields are named after."""
    return kind(**{name: getattr(values, name).tolist() for name in _names(kind)})


def _names(kind: type[Any]) -> Iterable[str]:
    return kind.get_fields_and_field_types()
