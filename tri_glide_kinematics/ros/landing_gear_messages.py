"""Answers requests about landing gears."""

from __future__ import annotations

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


def solve(request: SolveLandingGear.Request, response: SolveLandingGear.Response) -> None:
    """Fill the response with motion, momentum and reactions.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    state = gear_of(request.gear).state(motion_of(request.motion))
    response.gear = _body_message(state.gear)
    response.wheel = _body_message(state.wheel)
    response.hinge = _reaction_message(state.hinge)
    response.axle = _reaction_message(state.axle)


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
    return LandingGearMotion(
        pitch_angle=message.pitch_angle,
        retraction_angle=message.retraction_angle,
        yaw_velocity=message.yaw_velocity,
        retraction_velocity=message.retraction_velocity,
        spin_velocity=message.spin_velocity,
        yaw_acceleration=message.yaw_acceleration,
        retraction_acceleration=message.retraction_acceleration,
        spin_acceleration=message.spin_acceleration,
        forward_velocity=message.forward_velocity,
        forward_acceleration=message.forward_acceleration,
    )


def _body_message(body: BodyState) -> BodyMessage:
    return BodyMessage(
        position=body.position,
        velocity=body.velocity,
        acceleration=body.acceleration,
        coriolis_acceleration=body.coriolis_acceleration,
        angular_velocity=body.angular_velocity,
        angular_acceleration=body.angular_acceleration,
        momentum=body.momentum,
        momentum_rate=body.momentum_rate,
        angular_momentum=body.angular_momentum,
        angular_momentum_rate=body.angular_momentum_rate,
    )


def _reaction_message(reaction: Reaction) -> ReactionMessage:
    return ReactionMessage(
        position=reaction.position,
        force=reaction.force,
        moment=reaction.moment,
        axial_moment=float(reaction.axial_moment),
    )
