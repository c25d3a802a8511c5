"""Requests about F-mechanisms: the answer is the library's, or says what is wrong."""

import math

import f_mechanism_samples
import numpy as np
import pytest
from f_mechanism_samples import bifurcating_mechanism
from mechanism_requests import ask, assert_columns, assert_message, example_2, message_of, turn

from tri_glide_interfaces.msg import CrankSweep, FMechanism, Point2, TraceEvent
from tri_glide_interfaces.srv import SolveFMechanism, TraceFMechanism
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.mechanisms.f_mechanism import EventKind, SelfMotionError
from tri_glide_kinematics.nodes import mechanism_node as mechanism_messages
from tri_glide_kinematics.nodes.mechanism_node import RefusedRequestError


def solve_f_mechanism(**fields):
    return ask(mechanism_messages.solve_f_mechanism, SolveFMechanism, **fields)


def trace_f_mechanism(**fields):
    return ask(mechanism_messages.trace_f_mechanism, TraceFMechanism, **fields)


class TestSolveFMechanism:
    def test_the_poses_are_those_of_the_library(self):
        crank_angle, point = math.radians(146.0), (40.0, 18.0)
        response = solve_f_mechanism(
            mechanism=example_2(), crank_angle=crank_angle, platform_point=Point2(x=40.0, y=18.0)
        )
        poses = f_mechanism_samples.example_2().poses(crank_angle)
        assert len(response.poses) == len(poses) == 4
        for message, pose in zip(response.poses, poses):
            others = ("crank_angle", "double")
            same = {name: value for name, value in vars(pose).items() if name not in others}
            moved = {"point": pose.point(point), "point_velocity": pose.point_velocity(point)}
            assert_message(message, {**same, **moved, "is_double": pose.double})

    def test_no_position_is_no_success(self):
        far = example_2(rod_lengths=[1.0, 1.0, 1.0])
        with pytest.raises(RefusedRequestError, match=r"crank_angle = 0\.5 rad: .* no position"):
            solve_f_mechanism(mechanism=far, crank_angle=0.5)

    def test_a_self_motion_is_said(self):
        # Three equal cranks and rods, base and platform congruent: a parallelogram linkage.
        corners = [Point2(x=x, y=y) for x, y in ((0.0, 0.0), (4.0, 0.0), (1.0, 3.0))]
        mechanism = FMechanism(
            base=corners, crank_lengths=[1.0] * 3, rod_lengths=[2.0] * 3, platform=corners
        )
        with pytest.raises(SelfMotionError, match=r"crank_angle = 0\.5 rad: the platform can"):
            solve_f_mechanism(mechanism=mechanism, crank_angle=0.5)

    def test_a_mechanism_smaller_than_an_atom_is_refused(self):
        tiny = [Point2(x=1e-11), Point2(y=1e-11), Point2()]
        mechanism = FMechanism(
            base=tiny, crank_lengths=[1e-11] * 3, rod_lengths=[1e-11] * 3, platform=tiny
        )
        with pytest.raises(OutOfBoundsError, match=r"largest length of the mechanism = 1\.4"):
            solve_f_mechanism(mechanism=mechanism)


EXAMPLE = f_mechanism_samples.example_2()
START = math.radians(146.0)
BIFURCATING, CROSSING, (CROSSING_ANGLE, _) = bifurcating_mechanism(np.random.default_rng(5))
YES, NO, UNDECIDED = (
    TraceFMechanism.Response.YES,
    TraceFMechanism.Response.NO,
    TraceFMechanism.Response.UNDECIDED,
)


def by_angle(index):
    """Ask for a short trace from one of four positions by its angle, and not for it exactly."""
    return (
        EXAMPLE,
        {
            "sweep": CrankSweep(start_angle=START, end_angle=2.6, steps=1),
            "start_by": TraceFMechanism.Request.BY_ANGLE,
            "pose_angle": EXAMPLE.poses(START)[index].angle + math.tau + 0.01,
        },
        (START, index),
        {"end": 2.6, "steps": 1},
        UNDECIDED,
    )


def at_bifurcation(through):
    poses = BIFURCATING.poses(CROSSING - 0.01)
    gaps = [abs(math.remainder(pose.angle - CROSSING_ANGLE, math.tau)) for pose in poses]
    return (
        BIFURCATING,
        {
            "sweep": CrankSweep(start_angle=CROSSING - 0.01, end_angle=CROSSING + 0.01, steps=20),
            "start_by": TraceFMechanism.Request.BY_ANGLE,
            "pose_angle": CROSSING_ANGLE,
            "go_through": through,
        },
        (CROSSING - 0.01, int(np.argmin(gaps))),
        {"end": CROSSING + 0.01, "steps": 20, "through": through},
        UNDECIDED,
    )


def with_phases(end, phase_b, phase_c):
    """Change the phases along a sweep from 1 rad to its ``end``."""
    return (
        EXAMPLE,
        {
            "sweep": CrankSweep(start_angle=1.0, end_angle=end, steps=10),
            "change_phases": True,
            "end_phase_b": phase_b,
            "end_phase_c": phase_c,
        },
        (1.0, 0),
        {"end": end, "steps": 10, "phases": (phase_b, phase_c)},
        UNDECIDED,
    )


GIVEN = [0.0, 0.1, 0.25, 1.0]
TURN = {"end": math.tau, "steps": 360}
# A mechanism, the request, the first crank angle and the number of the position there, what the
# library is asked for, and whether the cranks turn fully.
TRACES = {
    "one that turns fully": (EXAMPLE, {"sweep": turn()}, (0.0, 0), TURN, YES),
    "to a turning point": (EXAMPLE, {"sweep": turn(), "pose_index": 1}, (0.0, 1), TURN, NO),
    "through turning points": (
        EXAMPLE,
        {"sweep": turn(), "pose_index": 1, "go_through": True},
        (0.0, 1),
        {**TURN, "through": True},
        NO,
    ),
    "to a bifurcation": at_bifurcation(through=False),
    "through a bifurcation": at_bifurcation(through=True),
    **{f"by angle {index}": by_angle(index) for index in range(4)},
    "angles given one by one": (
        EXAMPLE,
        {"sweep": CrankSweep(crank_angles=GIVEN)},
        (0.0, 0),
        {"crank_angles": GIVEN},
        UNDECIDED,
    ),
    "phases that change": with_phases(2.0, math.radians(250.0), math.radians(-20.0)),
    "phases that change at rest": with_phases(1.0, EXAMPLE.phase_b, math.radians(-10.0)),
}


class TestTraceFMechanism:
    @pytest.mark.parametrize(
        ("mechanism", "fields", "start", "asked", "turns_fully"), TRACES.values(), ids=TRACES
    )
    def test_a_trace_is_that_of_the_library(self, mechanism, fields, start, asked, turns_fully):
        point = (-7.0, 28.0)
        response = trace_f_mechanism(
            mechanism=message_of(mechanism), platform_point=Point2(x=-7.0, y=28.0), **fields
        )
        crank_angle, index = start
        branch = mechanism.trace(crank_angle, mechanism.poses(crank_angle)[index], **asked)
        assert (response.turns_fully, response.turns) == (turns_fully, branch.turns)
        scalars = (
            *("crank_angle", "phase_b", "phase_c", "angle", "angular_velocity"),
            *("residual", "singularity"),
        )
        places = {
            "position": branch.position,
            "velocity": branch.velocity,
            "point": branch.point(point),
            "point_velocity": branch.point_velocity(point),
        }
        places.update(zip(("a1", "b1", "c1"), branch.crank_pins.swapaxes(0, 1)))
        places.update(zip(("a2", "b2", "c2"), branch.platform_joints.swapaxes(0, 1)))
        assert_columns(response, {name: getattr(branch, name) for name in scalars}, places)
        assert len(response.events) == len(branch.events) > 0
        for message, event in zip(response.events, branch.events):
            expected = {
                "kind": getattr(TraceEvent, event.kind.name),
                "row": event.index - 1,
                "crank_angle": event.crank_angle,
                "angle": event.pose.angle,
                "position": event.pose.position,
                "phase_b": event.phase_b,
                "phase_c": event.phase_c,
            }
            assert_message(message, expected)

    def test_events_have_the_names_of_the_library(self):
        numbers = mechanism_messages.F_MECHANISM_EVENTS
        assert set(numbers) == set(EventKind)
        for kind, number in numbers.items():
            assert number == getattr(TraceEvent, kind.name)
        assert len(set(numbers.values())) == len(numbers)

    @pytest.mark.parametrize(
        ("fields", "error", "text"),
        [
            ({"pose_index": 2}, RefusedRequestError, "pose_index = 2 must be less than 2"),
            ({"start_by": 7}, RefusedRequestError, "start_by = 7 must be 0 or 1"),
            ({"change_phases": True, "end_phase_b": 700.0}, OutOfBoundsError, "_phase_b = 110.73"),
            ({"sweep": CrankSweep(end_angle=1.0, steps=100_001)}, OutOfBoundsError, "to 100000"),
            ({"sweep": CrankSweep(end_angle=630.0, steps=10)}, OutOfBoundsError, "at most 100 t"),
        ],
    )
    def test_what_cannot_be_served_is_refused(self, fields, error, text):
        with pytest.raises(error) as caught:
            trace_f_mechanism(**{"mechanism": example_2(), "sweep": turn(), **fields})
        assert text in str(caught.value)
