"""Answers questions about planar mechanisms and the landing gear by services."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node

from tri_glide_interfaces.msg import (
    CrankSweep,
    FourBarDeadCentre,
    FourBarProperties,
    Point2,
    TraceEvent,
)
from tri_glide_interfaces.msg import FMechanism as FMechanismMessage
from tri_glide_interfaces.msg import FMechanismPose as FMechanismPoseMessage
from tri_glide_interfaces.msg import FourBar as FourBarMessage
from tri_glide_interfaces.msg import FourBarPose as FourBarPoseMessage
from tri_glide_interfaces.msg import LandingGear as LandingGearMessage
from tri_glide_interfaces.msg import LandingGearMotion as MotionMessage
from tri_glide_interfaces.srv import (
    SolveFMechanism,
    SolveFourBar,
    SolveLandingGear,
    TraceFMechanism,
    TraceFourBar,
)
from tri_glide_kinematics.checks import finite
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.mechanisms.f_mechanism import (
    EventKind,
    FMechanism,
    FMechanismEvent,
    FMechanismPose,
    FMechanismTrace,
)
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
from tri_glide_kinematics.mechanisms.landing_gear import LandingGear, LandingGearMotion
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle
from tri_glide_kinematics.ros.serving import CALLS, Answers, PatientServices
from tri_glide_kinematics.wording import number_text

# Of each: the mechanism that a message describes, a function for each service that fills the
# response, and the messages that this is made of.

# Largest absolute value of a number in a request, in its unit.
LARGEST = 1e9
# Smallest size of a mechanism [m].
SMALLEST = 1e-9

POINT = "tri_glide_interfaces/Point2"
COLUMN = "sequence<double>"

Message = TypeVar("Message")


class RefusedRequestError(KinematicsError):
    """A request contradicts itself, or asks for something that cannot be answered."""


def check_numbers(message: Any, name: str = "") -> None:
    """Check all numbers of a message except those in arrays of any length.

    A length beyond that of any machine would overflow in the middle of a formula.

    Raises:
        NotFiniteError: if a number is NaN or infinite; it is named by its place in the message.
        OutOfBoundsError: if its absolute value is above ``LARGEST``.
    """
    for field in message.get_fields_and_field_types():
        _check_value(getattr(message, field), f"{name}.{field}" if name else field)


def _check_value(value: Any, name: str) -> None:
    if isinstance(value, float):
        finite(name, value, LARGEST)
    elif isinstance(value, (list, np.ndarray)):
        for index, item in enumerate(value):
            _check_value(item, f"{name}[{index}]")
    elif hasattr(value, "get_fields_and_field_types"):
        check_numbers(value, name)


def check_size(name: str, size: float) -> None:
    """Check that a mechanism is not so small that squares of its lengths vanish.

    Raises:
        OutOfBoundsError: if its largest length is below ``SMALLEST``.
    """
    if size < SMALLEST:
        raise OutOfBoundsError(name, size, f"at least {SMALLEST:g}", "m")


def point(message: Point2) -> tuple[float, float]:
    """Return x and y."""
    return message.x, message.y


def point_message(place: Iterable[float]) -> Point2:
    """Return a point of x and y."""
    x, y = place
    return Point2(x=float(x), y=float(y))


def column(values: NDArray[np.float64]) -> array[float]:
    """Return numbers in the one form that messages take without looking at each of them."""
    return array("d", values.tobytes())


def filled(message: Message, values: object, **others: Any) -> Message:
    """Fill a message from ``others``, or else from the attributes that its fields are named after.

    Many points, of shape (n, 2), fill two columns: NAME_x and NAME_y. None leaves a field as it is.
    """
    kinds: dict[str, str] = message.get_fields_and_field_types()  # type: ignore[attr-defined]
    for field, kind in kinds.items():
        axis = ("_x", "_y").index(field[-2:]) if field[-2:] in ("_x", "_y") else None
        name = field if axis is None else field[:-2]
        value = others[name] if name in others else getattr(values, name, None)
        if value is None:
            continue
        if kind == POINT:
            value = point_message(value)
        elif kind.startswith(POINT):
            value = [point_message(each) for each in value]
        elif kind == COLUMN and isinstance(value, np.ndarray):
            value = column(value if axis is None else value[:, axis])
        elif isinstance(value, np.ndarray):
            value = value.tolist()
        setattr(message, field, value)
    return message


def one_of(name: str, value: int, choices: Iterable[int]) -> int:
    """Return ``value``.

    Raises:
        RefusedRequestError: if it is not one of the ``choices``.
    """
    allowed = tuple(choices)
    if value not in allowed:
        names = " or ".join(map(str, allowed))
        raise RefusedRequestError(f"{name} = {value} must be {names}")
    return value


def crank_angles(sweep: CrankSweep, max_steps: int, max_turns: int) -> NDArray[np.float64]:
    """Return the crank angles of the rows of a trace, rising or falling. Shape (n,) [rad].

    Raises:
        NotFiniteError: if an angle of the array is NaN or infinite.
        OutOfBoundsError: if there are no or too many steps, or too many turns, or the angles that
            were given one by one do not all rise or all fall.
    """
    given = np.asarray(sweep.crank_angles, dtype=np.float64)
    steps = given.size - 1 if given.size else sweep.steps
    if not 1 <= steps <= max_steps:
        name = "len(crank_angles) - 1" if given.size else "steps"
        raise OutOfBoundsError(name, steps, f"from 1 to {max_steps}")
    if given.size:
        for index in np.flatnonzero(~(np.abs(given) <= LARGEST)):
            _check_value(float(given[index]), f"crank_angles[{index}]")
        differences = np.diff(given)
        for index in np.flatnonzero(differences * (given[-1] - given[0]) <= 0.0):
            value = float(given[index + 1])
            bound = "beyond the one before, all rising or all falling,"
            raise OutOfBoundsError(f"crank_angles[{index + 1}]", value, bound, "rad")
        first, last = float(given[0]), float(given[-1])
    else:
        first, last = sweep.start_angle, sweep.end_angle
    turns = abs(last - first) / math.tau
    if turns > max_turns:
        raise OutOfBoundsError("range of the crank angle", turns, f"at most {max_turns}", "turns")
    return given if given.size else np.linspace(first, last, steps + 1)


# A trace has at most this many steps.
#
# Of an F-mechanism they take about half a second; the response of 14 MB about a four-bar linkage is
# made and sent in less than 1 s.
MAX_STEPS = 100_000
# A trace covers at most this many turns of the crank.
FOUR_BAR_TURNS = 1000

BRANCHES = {FourBarPoseMessage.OPEN: Branch.OPEN, FourBarPoseMessage.CROSSED: Branch.CROSSED}
BRANCH_NUMBERS = {
    Branch.OPEN: FourBarPoseMessage.OPEN,
    Branch.CROSSED: FourBarPoseMessage.CROSSED,
    None: FourBarPoseMessage.BOTH,
}
FOUR_BAR_EVENTS = {
    SweepEventKind.LIMIT: TraceEvent.LIMIT,
    SweepEventKind.CHANGE_POINT: TraceEvent.BIFURCATION,
}


def solve_four_bar(request: SolveFourBar.Request, response: SolveFourBar.Response) -> None:
    """Fill the response with both poses.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    linkage = linkage_of(request.linkage)
    response.properties = properties_message(linkage)
    poses = linkage.solve(request.crank_angle, request.crank_velocity, request.crank_acceleration)
    if not poses:
        raise CrankLimitError(request.crank_angle, linkage.crank_ranges)
    response.poses = [four_bar_pose_message(pose, point(request.coupler_point)) for pose in poses]


def trace_four_bar(request: TraceFourBar.Request, response: TraceFourBar.Response) -> None:
    """Fill the response with one branch over a range of crank angles.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    linkage = linkage_of(request.linkage)
    branch = BRANCHES[one_of("branch", request.branch, BRANCHES)]
    angles = crank_angles(request.sweep, MAX_STEPS, FOUR_BAR_TURNS)
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
    _fill_four_bar_columns(response, sweep, point(request.coupler_point))
    response.events = [_four_bar_event_message(event) for event in sweep_events(linkage, angles)]


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


def four_bar_pose_message(
    pose: FourBarPose, coupler_point: tuple[float, float]
) -> FourBarPoseMessage:
    """Return a pose with the motion of a point of the coupler plane."""
    motion = pose.point_of_coupler_plane(*coupler_point)
    return filled(
        FourBarPoseMessage(),
        pose,
        branch=BRANCH_NUMBERS[pose.branch],
        coupler_point=motion.position,
        coupler_point_velocity=motion.velocity,
        coupler_point_acceleration=motion.acceleration,
    )


def properties_message(linkage: FourBar) -> FourBarProperties:
    """Return what a linkage can do."""
    extremes = linkage.transmission_extremes
    message = filled(
        FourBarProperties(assembled_crank_angle=math.nan),
        linkage,
        grashof_class=linkage.grashof_class.value,
        has_change_point=linkage.lengths.has_change_point,
        crank_range_begin=[begin for begin, _ in linkage.crank_ranges],
        crank_range_end=[end for _, end in linkage.crank_ranges],
        smallest_transmission_angle=extremes.smallest,
        smallest_transmission_angle_at=extremes.smallest_at,
        largest_transmission_angle=extremes.largest,
        largest_transmission_angle_at=extremes.largest_at,
        dead_centres=[_dead_centre_message(centre) for centre in linkage.dead_centres],
        assembled_branch=None,
    )
    if isinstance(linkage, AssembledFourBar):
        message.assembled_branch = BRANCH_NUMBERS[linkage.assembled_branch]
    return message


def _fill_four_bar_columns(
    response: TraceFourBar.Response, sweep: BranchSweep, coupler_point: tuple[float, float]
) -> None:
    motion = sweep.point_of_coupler_plane(*coupler_point)
    filled(
        response,
        sweep,
        crank_angle=sweep.crank_angles,
        coupler_angle=sweep.coupler_angles,
        rocker_angle=sweep.rocker_angles,
        coupler_velocity=sweep.coupler_velocities,
        rocker_velocity=sweep.rocker_velocities,
        coupler_acceleration=sweep.coupler_accelerations,
        rocker_acceleration=sweep.rocker_accelerations,
        transmission_angle=sweep.transmission_angles,
        crank_pin=sweep.crank_pins,
        rocker_pin=sweep.rocker_pins,
        coupler_point=motion.position,
        coupler_point_velocity=motion.velocity,
        coupler_point_acceleration=motion.acceleration,
    )


def _dead_centre_message(centre: DeadCentre) -> FourBarDeadCentre:
    return FourBarDeadCentre(
        kind=centre.kind.value,
        crank_angle=centre.crank_angle,
        rocker_angle=centre.rocker_angle,
        branch=BRANCH_NUMBERS[centre.branch],
    )


def _four_bar_event_message(event: SweepEvent) -> TraceEvent:
    return TraceEvent(
        kind=FOUR_BAR_EVENTS[event.kind],
        row=event.row,
        crank_angle=event.crank_angle,
        angle=event.rocker_angle,
        position=point_message(event.rocker_pin),
    )


# A trace covers at most this many turns of the crank: they take about two seconds.
F_MECHANISM_TURNS = 100
JOINTS = ("a1", "b1", "c1", "a2", "b2", "c2")

F_MECHANISM_EVENTS = {
    EventKind.TURNING_POINT: TraceEvent.TURNING_POINT,
    EventKind.BIFURCATION: TraceEvent.BIFURCATION,
    EventKind.SINGULAR: TraceEvent.SINGULAR,
    EventKind.END: TraceEvent.END,
    EventKind.CLOSED: TraceEvent.CLOSED,
}


def solve_f_mechanism(request: SolveFMechanism.Request, response: SolveFMechanism.Response) -> None:
    """Fill the response with all poses.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    mechanism = mechanism_of(request.mechanism)
    platform_point = point(request.platform_point)
    poses = _poses(mechanism, request.crank_angle)
    response.poses = [f_mechanism_pose_message(pose, platform_point) for pose in poses]


def trace_f_mechanism(request: TraceFMechanism.Request, response: TraceFMechanism.Response) -> None:
    """Fill the response with one branch.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    mechanism = mechanism_of(request.mechanism)
    platform_point = point(request.platform_point)
    angles = crank_angles(request.sweep, MAX_STEPS, F_MECHANISM_TURNS)
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
    joints = np.concatenate((branch.crank_pins, branch.platform_joints), axis=1)
    filled(
        response,
        branch,
        turns_fully=_turns_fully(branch, request.change_phases),
        point=branch.point(platform_point),
        point_velocity=branch.point_velocity(platform_point),
        events=[_f_mechanism_event_message(event) for event in branch.events],
        **dict(zip(JOINTS, joints.swapaxes(0, 1))),
    )


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


def f_mechanism_pose_message(
    pose: FMechanismPose, platform_point: tuple[float, float]
) -> FMechanismPoseMessage:
    """Return a pose with the motion of a point of the platform."""
    return filled(
        FMechanismPoseMessage(),
        pose,
        point=pose.point(platform_point),
        point_velocity=pose.point_velocity(platform_point),
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
        if turns > F_MECHANISM_TURNS:
            bound = f"at most {F_MECHANISM_TURNS}"
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


def _f_mechanism_event_message(event: FMechanismEvent) -> TraceEvent:
    return TraceEvent(
        kind=F_MECHANISM_EVENTS[event.kind],
        row=event.index - 1,
        crank_angle=event.crank_angle,
        angle=event.pose.angle,
        position=point_message(event.pose.position),
        phase_b=event.phase_b,
        phase_c=event.phase_c,
    )


def solve_landing_gear(
    request: SolveLandingGear.Request, response: SolveLandingGear.Response
) -> None:
    """Fill the response with motion, momentum and reactions.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    state = gear_of(request.gear).state(motion_of(request.motion))
    for name in ("gear", "wheel", "hinge", "axle"):
        filled(getattr(response, name), getattr(state, name))


def gear_of(message: LandingGearMessage) -> LandingGear:
    """Return the gear that a message describes.

    Raises:
        KinematicsError: if it describes none.
    """
    lengths, masses = ("l1", "l2", "l3", "l4"), ("gear_mass", "wheel_mass")
    inertias = ("wheel_axial_inertia", "wheel_transverse_inertia")
    return LandingGear(
        **{name: getattr(message, name) for name in (*lengths, *masses, *inertias)},
        gear_inertia=(
            (message.gear_ixx, message.gear_ixy, message.gear_ixz),
            (message.gear_ixy, message.gear_iyy, message.gear_iyz),
            (message.gear_ixz, message.gear_iyz, message.gear_izz),
        ),
        gravity=message.gravity.tolist(),
    )


def motion_of(message: MotionMessage) -> LandingGearMotion:
    """Return the motion that a message describes."""
    names = message.get_fields_and_field_types()
    return LandingGearMotion(**{name: getattr(message, name) for name in names})


Fill = Callable[[Any, Any], None]

SERVICES: tuple[tuple[str, type, Fill], ...] = (
    ("solve_four_bar", SolveFourBar, solve_four_bar),
    ("trace_four_bar", TraceFourBar, trace_four_bar),
    ("solve_f_mechanism", SolveFMechanism, solve_f_mechanism),
    ("trace_f_mechanism", TraceFMechanism, trace_f_mechanism),
    ("solve_landing_gear", SolveLandingGear, solve_landing_gear),
)


class MechanismNode(Node):
    """Holds nothing between two requests: each is answered from what it brings."""

    def __init__(self) -> None:
        """Offer the services."""
        super().__init__("mechanism_node")
        LiveParameters(self, ())
        self._answers = Answers(self)
        services = (
            self.create_service(kind, f"~/{name}", self._callback(name, fill), qos_profile=CALLS)
            for name, kind, fill in SERVICES
        )
        self.cycle = Cycle(tuple(services))
        PatientServices(self)

    def _callback(self, name: str, fill: Fill) -> Callable[[Any, Any], Any]:
        """Return the callback of a service with this ``name``."""

        def answer(request: Any, response: Any) -> Any:
            with self._answers.told_in(response, name):
                check_numbers(request)
                fill(request, response)
            return response

        return answer
