"""Answers requests about four-bar linkages."""

from __future__ import annotations

import math

from tri_glide_interfaces.msg import FourBar as FourBarMessage
from tri_glide_interfaces.msg import FourBarDeadCentre, FourBarProperties, TraceEvent
from tri_glide_interfaces.msg import FourBarPose as PoseMessage
from tri_glide_interfaces.srv import SolveFourBar, TraceFourBar
from tri_glide_kinematics.mechanisms.four_bar import (
    AssembledFourBar,
    Branch,
    BranchSweep,
    CrankLimitError,
    DeadCentre,
    FourBar,
    FourBarPose,
    SweepEvent,
    SweepEventKind,
    sweep_events,
)
from tri_glide_kinematics.ros.mechanisms.fields import (
    RefusedRequestError,
    check_size,
    column,
    crank_angles,
    one_of,
    point,
    point_message,
)
from tri_glide_kinematics.wording import number_text

MAX_STEPS = 100_000
"""A trace has at most this many steps: its response of 14 MB is made and sent in less than 1 s."""
MAX_TURNS = 1000
"""A trace covers at most this many turns of the crank."""

BRANCHES = {PoseMessage.OPEN: Branch.OPEN, PoseMessage.CROSSED: Branch.CROSSED}
_BRANCH_NUMBERS = {
    Branch.OPEN: PoseMessage.OPEN,
    Branch.CROSSED: PoseMessage.CROSSED,
    None: PoseMessage.BOTH,
}
_EVENT_KINDS = {
    SweepEventKind.LIMIT: TraceEvent.LIMIT,
    SweepEventKind.CHANGE_POINT: TraceEvent.BIFURCATION,
}


def solve(request: SolveFourBar.Request, response: SolveFourBar.Response) -> None:
    """Fill the response with both poses.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    linkage = linkage_of(request.linkage)
    response.properties = properties_message(linkage)
    poses = linkage.solve(request.crank_angle, request.crank_velocity, request.crank_acceleration)
    if not poses:
        raise CrankLimitError(request.crank_angle, linkage.crank_ranges)
    response.poses = [pose_message(pose, point(request.coupler_point)) for pose in poses]


def trace(request: TraceFourBar.Request, response: TraceFourBar.Response) -> None:
    """Fill the response with one branch over a range of crank angles.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    linkage = linkage_of(request.linkage)
    branch = BRANCHES[one_of("branch", request.branch, BRANCHES)]
    angles = crank_angles(request.sweep, MAX_STEPS, MAX_TURNS)
    sweep = linkage.sweep(angles, request.crank_velocity, request.crank_acceleration).branch(branch)
    response.properties = properties_message(linkage)
    if not sweep.is_reachable.any():
        reach = " or ".join(
            f"from {number_text(low)} to {number_text(high)}" for low, high in linkage.crank_ranges
        )
        raise RefusedRequestError(
            f"none of {angles.size} crank angles from {number_text(angles[0])} to "
            f"{number_text(angles[-1])} rad is within the crank's limits: it reaches {reach} rad"
        )
    _fill_columns(response, sweep, point(request.coupler_point))
    response.events = [_event_message(event) for event in sweep_events(linkage, angles)]


def linkage_of(message: FourBarMessage) -> FourBar:
    """Return the linkage that a message describes.

    Raises:
        KinematicsError: if it describes none.
    """
    linkage = _linkage(message)
    check_size("longest link", linkage.lengths.longest)
    return linkage


def _linkage(message: FourBarMessage) -> FourBar:
    kinds = (FourBarMessage.LENGTHS, FourBarMessage.JOINTS)
    if one_of("given_by", message.given_by, kinds) == FourBarMessage.JOINTS:
        return FourBar.from_joints(
            point(message.crank_pivot),
            point(message.crank_pin),
            point(message.rocker_pin),
            point(message.rocker_pivot),
            message.tolerance,
        )
    return FourBar(
        crank=message.crank,
        coupler=message.coupler,
        rocker=message.rocker,
        ground=message.ground,
        crank_pivot=point(message.crank_pivot),
        ground_angle=message.ground_angle,
        tolerance=message.tolerance,
    )


def pose_message(pose: FourBarPose, coupler_point: tuple[float, float]) -> PoseMessage:
    """Return a pose with the motion of a point of the coupler plane."""
    motion = pose.point_of_coupler_plane(*coupler_point)
    return PoseMessage(
        branch=_BRANCH_NUMBERS[pose.branch],
        coupler_angle=pose.coupler_angle,
        rocker_angle=pose.rocker_angle,
        coupler_velocity=pose.coupler_velocity,
        rocker_velocity=pose.rocker_velocity,
        coupler_acceleration=pose.coupler_acceleration,
        rocker_acceleration=pose.rocker_acceleration,
        transmission_angle=pose.transmission_angle,
        is_singular=pose.is_singular,
        crank_pivot=point_message(pose.crank_pivot),
        crank_pin=point_message(pose.crank_pin),
        rocker_pin=point_message(pose.rocker_pin),
        rocker_pivot=point_message(pose.rocker_pivot),
        coupler_point=point_message(motion.position),
        coupler_point_velocity=point_message(motion.velocity),
        coupler_point_acceleration=point_message(motion.acceleration),
    )


def properties_message(linkage: FourBar) -> FourBarProperties:
    """Return what a linkage can do."""
    extremes = linkage.transmission_extremes
    message = FourBarProperties(
        crank=linkage.crank,
        coupler=linkage.coupler,
        rocker=linkage.rocker,
        ground=linkage.ground,
        ground_angle=linkage.ground_angle,
        assembled_crank_angle=math.nan,
        grashof_class=linkage.grashof_class.value,
        has_change_point=linkage.lengths.has_change_point,
        crank_turns_fully=linkage.crank_turns_fully,
        crank_range_begin=[begin for begin, _ in linkage.crank_ranges],
        crank_range_end=[end for _, end in linkage.crank_ranges],
        smallest_transmission_angle=extremes.smallest,
        smallest_transmission_angle_at=extremes.smallest_at,
        largest_transmission_angle=extremes.largest,
        largest_transmission_angle_at=extremes.largest_at,
        dead_centres=[_dead_centre_message(centre) for centre in linkage.dead_centres],
    )
    if isinstance(linkage, AssembledFourBar):
        message.assembled_crank_angle = linkage.assembled_crank_angle
        message.assembled_branch = _BRANCH_NUMBERS[linkage.assembled_branch]
    return message


def _fill_columns(
    response: TraceFourBar.Response, sweep: BranchSweep, coupler_point: tuple[float, float]
) -> None:
    motion = sweep.point_of_coupler_plane(*coupler_point)
    response.crank_angle = column(sweep.crank_angles)
    response.coupler_angle = column(sweep.coupler_angles)
    response.rocker_angle = column(sweep.rocker_angles)
    response.coupler_velocity = column(sweep.coupler_velocities)
    response.rocker_velocity = column(sweep.rocker_velocities)
    response.coupler_acceleration = column(sweep.coupler_accelerations)
    response.rocker_acceleration = column(sweep.rocker_accelerations)
    response.transmission_angle = column(sweep.transmission_angles)
    response.crank_pin_x, response.crank_pin_y = map(column, sweep.crank_pins.T)
    response.rocker_pin_x, response.rocker_pin_y = map(column, sweep.rocker_pins.T)
    response.coupler_point_x, response.coupler_point_y = map(column, motion.position.T)
    response.coupler_point_velocity_x, response.coupler_point_velocity_y = map(
        column, motion.velocity.T
    )
    response.coupler_point_acceleration_x, response.coupler_point_acceleration_y = map(
        column, motion.acceleration.T
    )


def _dead_centre_message(centre: DeadCentre) -> FourBarDeadCentre:
    return FourBarDeadCentre(
        kind=centre.kind.value,
        crank_angle=centre.crank_angle,
        rocker_angle=centre.rocker_angle,
        branch=_BRANCH_NUMBERS[centre.branch],
    )


def _event_message(event: SweepEvent) -> TraceEvent:
    return TraceEvent(
        kind=_EVENT_KINDS[event.kind],
        row=event.row,
        crank_angle=event.crank_angle,
        angle=event.rocker_angle,
        position=point_message(event.rocker_pin),
    )
