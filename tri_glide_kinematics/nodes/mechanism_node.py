"""Answers questions about planar mechanisms and the landing gear by services."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node

from tri_glide_interfaces import msg, srv
from tri_glide_kinematics.checks import finite
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.mechanisms import f_mechanism, four_bar, landing_gear
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism, FMechanismPose
from tri_glide_kinematics.mechanisms.four_bar import Branch, FourBar
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle
from tri_glide_kinematics.ros.serving import CALLS, Answers, PatientServices
from tri_glide_kinematics.vectors import Point
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


def plain(value: Any) -> Any:
    """Return what a field holds: points as x and y, arrays as lists."""
    if isinstance(value, msg.Point2):
        return value.x, value.y
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [plain(item) for item in value] if isinstance(value, list) else value


def contents(message: Any) -> dict[str, Any]:
    """Return all fields of a message by their names."""
    return {name: plain(getattr(message, name)) for name in message.get_fields_and_field_types()}


def point_message(place: Iterable[float]) -> msg.Point2:
    """Return a point of x and y."""
    x, y = place
    return msg.Point2(x=float(x), y=float(y))


def column(values: NDArray[np.float64]) -> array[float]:
    """Return numbers in the one form that messages take without looking at each of them."""
    return array("d", values.tobytes())


def filled(message: Message, values: object, **others: Any) -> Message:
    """Fill a message from ``others``, or else from the attributes that its fields are named after.

    A column is named after one of many values, and its attribute after all of them. Many points, of
    shape (n, 2), fill two columns: NAME_x and NAME_y. None leaves a field as it is.
    """
    kinds: dict[str, str] = message.get_fields_and_field_types()  # type: ignore[attr-defined]
    for field, kind in kinds.items():
        axis = ("_x", "_y").index(field[-2:]) if field[-2:] in ("_x", "_y") else None
        name = field if axis is None else field[:-2]
        many = f"{name[:-1]}ies" if name.endswith("y") else f"{name}s"
        value = others.get(name, getattr(values, name, getattr(values, many, None)))
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


def crank_angles(sweep: msg.CrankSweep, max_steps: int, max_turns: int) -> NDArray[np.float64]:
    """Return the crank angles of the rows of a trace, rising or falling. Shape (n,) [rad].

    Raises:
        NotFiniteError: if an angle of the array is NaN or infinite.
        OutOfBoundsError: if there are no or too many steps, or too many turns, or the angles that
            were given one by one do not all rise or all fall.
    """
    given = np.asarray(sweep.crank_angles, dtype=np.float64)
    steps, name = sweep.steps, "steps"
    if given.size:
        steps, name = given.size - 1, "len(crank_angles) - 1"
    if not 1 <= steps <= max_steps:
        raise OutOfBoundsError(name, steps, f"from 1 to {max_steps}")
    for index in np.flatnonzero(~(np.abs(given) <= LARGEST)):
        _check_value(float(given[index]), f"crank_angles[{index}]")
    for index in np.flatnonzero(np.diff(given) * np.sign(np.diff(given[:2])) <= 0.0):
        before, value = given[index : index + 2].tolist()
        bound = f"beyond the one before (all rise, or all fall), {number_text(before)}"
        raise OutOfBoundsError(f"crank_angles[{index + 1}]", value, bound, "rad")
    even = np.linspace(sweep.start_angle, sweep.end_angle, steps + 1)
    angles = given if given.size else even
    turns = abs(float(angles[-1] - angles[0])) / math.tau
    if turns > max_turns:
        raise OutOfBoundsError("range of the crank angle", turns, f"at most {max_turns}", "turns")
    return angles


# A trace has at most this many steps.
#
# Of an F-mechanism they take about half a second; the response of 14 MB about a four-bar linkage is
# made and sent in less than 1 s.
MAX_STEPS = 100_000
# A trace covers at most this many turns of the crank.
FOUR_BAR_TURNS = 1000

BRANCHES = {msg.FourBarPose.OPEN: Branch.OPEN, msg.FourBarPose.CROSSED: Branch.CROSSED}
BRANCH_NUMBERS = {branch: number for number, branch in BRANCHES.items()}
FOUR_BAR_EVENTS = {
    four_bar.SweepEventKind.LIMIT: msg.TraceEvent.LIMIT,
    four_bar.SweepEventKind.CHANGE_POINT: msg.TraceEvent.BIFURCATION,
}


def solve_four_bar(request: srv.SolveFourBar.Request, response: srv.SolveFourBar.Response) -> None:
    """Fill the response with both poses.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    linkage = linkage_of(request.linkage)
    response.properties = properties_message(linkage)
    poses = linkage.solve(request.crank_angle, request.crank_velocity, request.crank_acceleration)
    if not poses:
        raise four_bar.CrankLimitError(request.crank_angle, linkage.crank_ranges)
    response.poses = [
        filled(
            msg.FourBarPose(),
            pose,
            branch=BRANCH_NUMBERS[pose.branch],
            **_coupler_point(pose, request),
        )
        for pose in poses
    ]


def trace_four_bar(request: srv.TraceFourBar.Request, response: srv.TraceFourBar.Response) -> None:
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
    filled(response, sweep, **_coupler_point(sweep, request))
    response.events = [
        filled(
            msg.TraceEvent(),
            event,
            kind=FOUR_BAR_EVENTS[event.kind],
            angle=event.rocker_angle,
            position=event.rocker_pin,
        )
        for event in four_bar.sweep_events(linkage, angles)
    ]


def linkage_of(message: msg.FourBar) -> FourBar:
    """Return the linkage that a message describes.

    Raises:
        KinematicsError: if it describes none.
    """
    given = contents(message)
    make: Callable[..., FourBar] = FourBar
    names = ["crank", "coupler", "rocker", "ground", "crank_pivot", "ground_angle", "tolerance"]
    kinds = (message.LENGTHS, message.JOINTS)
    if one_of("given_by", message.given_by, kinds) == message.JOINTS:
        make = FourBar.from_joints
        names = ["crank_pivot", "crank_pin", "rocker_pin", "rocker_pivot", "tolerance"]
    linkage = make(**{name: given[name] for name in names})
    check_size("longest link", linkage.lengths.longest)
    return linkage


def properties_message(linkage: FourBar) -> msg.FourBarProperties:
    """Return what a linkage can do."""
    extremes = linkage.transmission_extremes
    assembled = linkage if isinstance(linkage, four_bar.AssembledFourBar) else None
    return filled(
        msg.FourBarProperties(assembled_crank_angle=math.nan),
        linkage,
        grashof_class=linkage.grashof_class.value,
        has_change_point=linkage.lengths.has_change_point,
        crank_range_begin=[begin for begin, _ in linkage.crank_ranges],
        crank_range_end=[end for _, end in linkage.crank_ranges],
        smallest_transmission_angle=extremes.smallest,
        smallest_transmission_angle_at=extremes.smallest_at,
        largest_transmission_angle=extremes.largest,
        largest_transmission_angle_at=extremes.largest_at,
        dead_centres=[
            filled(
                msg.FourBarDeadCentre(),
                centre,
                kind=centre.kind.value,
                branch=_branch_number(centre.branch),
            )
            for centre in linkage.dead_centres
        ],
        assembled_branch=_branch_number(assembled.assembled_branch) if assembled else 0,
    )


def _branch_number(branch: Branch | None) -> int:
    return BRANCH_NUMBERS[branch] if branch else msg.FourBarPose.BOTH


def _coupler_point(moved: Any, request: Any) -> dict[str, NDArray[np.float64]]:
    """Return the motion of the point of the coupler plane that was asked for."""
    motion = moved.point_of_coupler_plane(*plain(request.coupler_point))
    return {
        "coupler_point": motion.position,
        "coupler_point_velocity": motion.velocity,
        "coupler_point_acceleration": motion.acceleration,
    }


# A trace covers at most this many turns of the crank: they take about two seconds.
F_MECHANISM_TURNS = 100
JOINTS = ("a1", "b1", "c1", "a2", "b2", "c2")

F_MECHANISM_EVENTS = {kind: getattr(msg.TraceEvent, kind.name) for kind in f_mechanism.EventKind}


def solve_f_mechanism(
    request: srv.SolveFMechanism.Request, response: srv.SolveFMechanism.Response
) -> None:
    """Fill the response with all poses.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    poses = _poses(mechanism_of(request.mechanism), request.crank_angle)
    response.poses = [
        filled(msg.FMechanismPose(), pose, is_double=pose.double, **_platform_point(pose, request))
        for pose in poses
    ]


def trace_f_mechanism(
    request: srv.TraceFMechanism.Request, response: srv.TraceFMechanism.Response
) -> None:
    """Fill the response with one branch.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    mechanism = mechanism_of(request.mechanism)
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
        events=[
            filled(
                msg.TraceEvent(),
                event,
                kind=F_MECHANISM_EVENTS[event.kind],
                row=event.index - 1,
                angle=event.pose.angle,
                position=event.pose.position,
            )
            for event in branch.events
        ],
        **_platform_point(branch, request),
        **dict(zip(JOINTS, joints.swapaxes(0, 1))),
    )


def mechanism_of(message: msg.FMechanism) -> FMechanism:
    """Return the mechanism that a message describes.

    Raises:
        KinematicsError: if it describes none.
    """
    mechanism = FMechanism(**contents(message))
    check_size("largest length of the mechanism", mechanism.size)
    return mechanism


def _platform_point(moved: Any, request: Any) -> dict[str, Any]:
    """Return the motion of the point of the platform that was asked for."""
    place: Point = plain(request.platform_point)
    return {"point": moved.point(place), "point_velocity": moved.point_velocity(place)}


def _poses(mechanism: FMechanism, crank_angle: float) -> tuple[FMechanismPose, ...]:
    """Return at least one pose."""
    poses = mechanism.poses(crank_angle)
    if not poses:
        raise RefusedRequestError(
            f"crank_angle = {number_text(crank_angle)} rad: the mechanism has no position there"
        )
    return poses


def _start_pose(
    request: srv.TraceFMechanism.Request, poses: tuple[FMechanismPose, ...]
) -> FMechanismPose:
    kinds = (request.BY_INDEX, request.BY_ANGLE)
    if one_of("start_by", request.start_by, kinds) == request.BY_INDEX:
        if request.pose_index >= len(poses):
            raise RefusedRequestError(
                f"pose_index = {request.pose_index} must be less than {len(poses)}, the number of "
                "positions at the first crank angle"
            )
        return poses[request.pose_index]
    angle = request.pose_angle
    return min(poses, key=lambda pose: abs(math.remainder(pose.angle - angle, math.tau)))


def _end_phases(request: srv.TraceFMechanism.Request) -> tuple[float, float] | None:
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


def _turns_fully(branch: f_mechanism.FMechanismTrace, phases_change: bool) -> int:
    answers = srv.TraceFMechanism.Response
    if phases_change:
        return answers.UNDECIDED
    if branch.turns_fully:
        return answers.YES
    return answers.NO if branch.turning_points or branch.closed else answers.UNDECIDED


def solve_landing_gear(
    request: srv.SolveLandingGear.Request, response: srv.SolveLandingGear.Response
) -> None:
    """Fill the response with motion, momentum and reactions.

    Raises:
        KinematicsError: if there is no answer; the message says why.
    """
    motion = landing_gear.LandingGearMotion(**contents(request.motion))
    state = gear_of(request.gear).state(motion)
    for name in ("gear", "wheel", "hinge", "axle"):
        filled(getattr(response, name), getattr(state, name))


def gear_of(message: msg.LandingGear) -> landing_gear.LandingGear:
    """Return the gear that a message describes.

    Raises:
        KinematicsError: if it describes none.
    """
    given = contents(message)
    axes = ("xx", "xy", "xz"), ("xy", "yy", "yz"), ("xz", "yz", "zz")
    inertia = [[given[f"gear_i{pair}"] for pair in row] for row in axes]
    others = {name: value for name, value in given.items() if not name.startswith("gear_i")}
    return landing_gear.LandingGear(gear_inertia=inertia, **others)


Fill = Callable[[Any, Any], None]

SERVICES: tuple[tuple[str, type, Fill], ...] = (
    ("solve_four_bar", srv.SolveFourBar, solve_four_bar),
    ("trace_four_bar", srv.TraceFourBar, trace_four_bar),
    ("solve_f_mechanism", srv.SolveFMechanism, solve_f_mechanism),
    ("trace_f_mechanism", srv.TraceFMechanism, trace_f_mechanism),
    ("solve_landing_gear", srv.SolveLandingGear, solve_landing_gear),
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
