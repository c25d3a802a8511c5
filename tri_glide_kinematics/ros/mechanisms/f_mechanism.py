"""Answers requests about F-mechanisms."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tri_glide_interfaces.msg import FMechanism as FMechanismMessage
from tri_glide_interfaces.msg import FMechanismPose as PoseMessage
from tri_glide_interfaces.msg import TraceEvent
from tri_glide_interfaces.srv import SolveFMechanism, TraceFMechanism
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.mechanisms.f_mechanism import (
    EventKind,
    FMechanism,
    FMechanismEvent,
    FMechanismPose,
    FMechanismTrace,
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
"""A trace has at most this many steps: they take about half a second."""
MAX_TURNS = 100
"""A trace covers at most this many turns of the crank: they take about two seconds."""

EVENT_KINDS = {
    EventKind.TURNING_POINT: TraceEvent.TURNING_POINT,
    EventKind.BIFURCATION: TraceEvent.BIFURCATION,
    EventKind.SINGULAR: TraceEvent.SINGULAR,
    EventKind.END: TraceEvent.END,
    EventKind.CLOSED: TraceEvent.CLOSED,
}


def solve(request: SolveFMechanism.Request, response: SolveFMechanism.Response) -> None:
    """Fill the response with all poses.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    mechanism = mechanism_of(request.mechanism)
    platform_point = point(request.platform_point)
    poses = _poses(mechanism, request.crank_angle)
    response.poses = [pose_message(pose, platform_point) for pose in poses]


def trace(request: TraceFMechanism.Request, response: TraceFMechanism.Response) -> None:
    """Fill the response with one branch.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    mechanism = mechanism_of(request.mechanism)
    platform_point = point(request.platform_point)
    angles = crank_angles(request.sweep, MAX_STEPS, MAX_TURNS)
    start = float(angles[0])
    phases = _end_phases(request)
    branch = mechanism.trace(
        start,
        _start_pose(request, _poses(mechanism, start)),
        float(angles[-1]),
        steps=angles.size - 1,
        crank_angles=angles if len(request.sweep.crank_angles) else None,
        phases=phases,
        through=request.go_through,
    )
    response.turns = branch.turns
    response.turns_fully = _turns_fully(branch, request.change_phases)
    _fill_columns(response, branch, platform_point)
    response.events = [_event_message(event) for event in branch.events]


def mechanism_of(message: FMechanismMessage) -> FMechanism:
    """Return the mechanism that a message describes.

    Raises:
        KinematicsError: if it describes none.
    """
    mechanism = FMechanism(
        [point(pivot) for pivot in message.base],
        message.crank_lengths.tolist(),
        message.rod_lengths.tolist(),
        [point(joint) for joint in message.platform],
        message.phase_b,
        message.phase_c,
        message.counter_rotating,
    )
    check_size("largest length of the mechanism", mechanism.size)
    return mechanism


def pose_message(pose: FMechanismPose, platform_point: tuple[float, float]) -> PoseMessage:
    """Return a pose with the motion of a point of the platform."""
    return PoseMessage(
        angle=pose.angle,
        position=point_message(pose.position),
        crank_pins=[point_message(pin) for pin in pose.crank_pins],
        platform_joints=[point_message(joint) for joint in pose.platform_joints],
        angular_velocity=pose.angular_velocity,
        velocity=point_message(pose.velocity),
        point=point_message(pose.point(platform_point)),
        point_velocity=point_message(pose.point_velocity(platform_point)),
        residual=pose.residual,
        singularity=pose.singularity,
        is_double=pose.double,
    )


def _poses(mechanism: FMechanism, crank_angle: float) -> tuple[FMechanismPose, ...]:
    """Return at least one pose."""
    poses = mechanism.poses(crank_angle)
    if not poses:
        raise RefusedRequestError(
            f"crank_angle = {number_text(crank_angle)} rad: the mechanism has no position there"
        )
    return poses


def _start_pose(
    request: TraceFMechanism.Request, poses: tuple[FMechanismPose, ...]
) -> FMechanismPose:
    kinds = (TraceFMechanism.Request.BY_INDEX, TraceFMechanism.Request.BY_ANGLE)
    if one_of("start_by", request.start_by, kinds) == TraceFMechanism.Request.BY_INDEX:
        if request.pose_index >= len(poses):
            raise RefusedRequestError(
                f"pose_index = {request.pose_index} must be less than {len(poses)}, the number of "
                "positions at the first crank angle"
            )
        return poses[request.pose_index]
    angle = request.pose_angle
    return min(poses, key=lambda pose: abs(math.remainder(pose.angle - angle, math.tau)))


def _end_phases(request: TraceFMechanism.Request) -> tuple[float, float] | None:
    """Return both phase shifts at the end of the trace, or None if they stay as they are."""
    if not request.change_phases:
        return None
    mechanism = request.mechanism
    for name, start, end in (
        ("end_phase_b", mechanism.phase_b, request.end_phase_b),
        ("end_phase_c", mechanism.phase_c, request.end_phase_c),
    ):
        turns = abs(end - start) / math.tau
        if turns > MAX_TURNS:
            bound = f"at most {MAX_TURNS}"
            raise OutOfBoundsError(f"change to {name}", turns, bound, "turns")
    return request.end_phase_b, request.end_phase_c


def _turns_fully(branch: FMechanismTrace, phases_change: bool) -> int:
    if phases_change:
        return TraceFMechanism.Response.UNDECIDED
    if branch.turns_fully:
        return TraceFMechanism.Response.YES
    if branch.turning_points or branch.closed:
        return TraceFMechanism.Response.NO
    return TraceFMechanism.Response.UNDECIDED


def _fill_columns(
    response: TraceFMechanism.Response,
    branch: FMechanismTrace,
    platform_point: tuple[float, float],
) -> None:
    response.crank_angle = column(branch.crank_angle)
    response.phase_b = column(branch.phase_b)
    response.phase_c = column(branch.phase_c)
    response.angle = column(branch.angle)
    response.position_x, response.position_y = _columns(branch.position)
    response.a1_x, response.a1_y = _columns(branch.crank_pins[:, 0])
    response.b1_x, response.b1_y = _columns(branch.crank_pins[:, 1])
    response.c1_x, response.c1_y = _columns(branch.crank_pins[:, 2])
    response.a2_x, response.a2_y = _columns(branch.platform_joints[:, 0])
    response.b2_x, response.b2_y = _columns(branch.platform_joints[:, 1])
    response.c2_x, response.c2_y = _columns(branch.platform_joints[:, 2])
    response.angular_velocity = column(branch.angular_velocity)
    response.velocity_x, response.velocity_y = _columns(branch.velocity)
    response.residual = column(branch.residual)
    response.singularity = column(branch.singularity)
    response.point_x, response.point_y = _columns(branch.point(platform_point))
    response.point_velocity_x, response.point_velocity_y = _columns(
        branch.point_velocity(platform_point)
    )


def _columns(points: NDArray[np.float64]) -> tuple[object, object]:
    """Return x and y of points. Shape (n, 2)."""
    return column(points[:, 0]), column(points[:, 1])


def _event_message(event: FMechanismEvent) -> TraceEvent:
    return TraceEvent(
        kind=EVENT_KINDS[event.kind],
        row=event.index - 1,
        crank_angle=event.crank_angle,
        angle=event.pose.angle,
        position=point_message(event.pose.position),
        phase_b=event.phase_b,
        phase_c=event.phase_c,
    )
