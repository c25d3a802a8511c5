"""Requests about F-mechanisms: the answer is the library's, or says what is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from f_mechanism_samples import bifurcating_mechanism
from mechanism_requests import ask, columns, example_2, turn

from tri_glide_interfaces.msg import CrankSweep, FMechanism, Point2, TraceEvent
from tri_glide_interfaces.srv import SolveFMechanism, TraceFMechanism
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.mechanisms.f_mechanism import (
    DegenerateLinkageError,
    EventKind,
    SelfMotionError,
)
from tri_glide_kinematics.ros import mechanisms as mechanism_messages
from tri_glide_kinematics.ros.mechanisms import RefusedRequestError


def message_of(mechanism):
    """Return the message that describes a mechanism of the library."""
    linkage = mechanism.linkage
    return FMechanism(
        base=[Point2(x=p.real, y=p.imag) for p in linkage.pivots],
        crank_lengths=linkage.cranks,
        rod_lengths=linkage.rods,
        platform=[Point2(x=p.real, y=p.imag) for p in linkage.joints],
        phase_b=mechanism.phase_b,
        phase_c=mechanism.phase_c,
        counter_rotating=mechanism.counter_rotating,
    )


def solve_f_mechanism(**fields):
    return ask(mechanism_messages.solve_f_mechanism, SolveFMechanism, **fields)


def trace_f_mechanism(**fields):
    return ask(mechanism_messages.trace_f_mechanism, TraceFMechanism, **fields)


class TestSolveFMechanism:
    def test_positions_of_example_2(self):
        response = solve_f_mechanism(
            mechanism=example_2(),
            crank_angle=math.radians(146.0),
            platform_point=Point2(x=40.0, y=18.0),
        )
        angles = [math.degrees(pose.angle) for pose in response.poses]
        assert angles == pytest.approx([-75.688, -55.562, -18.443, -0.982], abs=5e-4)
        for pose in response.poses:
            assert abs(pose.residual) < 1e-10
            for pin, joint, rod in zip(pose.crank_pins, pose.platform_joints, (35.0, 34.0, 54.0)):
                assert math.hypot(pin.x - joint.x, pin.y - joint.y) == pytest.approx(rod)
            # The point asked for is B2.
            joint = pose.platform_joints[1]
            assert (pose.point.x, pose.point.y) == pytest.approx((joint.x, joint.y))
            assert not pose.is_double
            assert pose.singularity != 0.0

    def test_velocities_are_those_of_the_positions(self):
        step = 1e-6
        before, at, after = (
            solve_f_mechanism(
                mechanism=example_2(), crank_angle=angle, platform_point=Point2(x=3.0, y=-5.0)
            ).poses
            for angle in (1.0 - step, 1.0, 1.0 + step)
        )
        assert len(before) == len(at) == len(after) > 0
        for low, pose, high in zip(before, at, after):
            differences = (
                high.angle - low.angle,
                high.position.x - low.position.x,
                high.position.y - low.position.y,
                high.point.x - low.point.x,
                high.point.y - low.point.y,
            )
            expected = (
                pose.angular_velocity,
                pose.velocity.x,
                pose.velocity.y,
                pose.point_velocity.x,
                pose.point_velocity.y,
            )
            assert np.array(differences) / (2.0 * step) == pytest.approx(expected, rel=1e-5)

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

    @pytest.mark.parametrize(
        ("changes", "error", "text"),
        [
            ({"crank_lengths": [19.0, 0.0, 16.0]}, OutOfBoundsError, "crank_lengths[1] = 0 m"),
            ({"rod_lengths": [35.0, 34.0, -1.0]}, OutOfBoundsError, "rod_lengths[2] = -1 m"),
            ({"platform": [Point2()] * 3}, DegenerateLinkageError, "coincide"),
        ],
    )
    def test_a_mechanism_that_is_none_is_refused(self, changes, error, text):
        with pytest.raises(error) as caught:
            solve_f_mechanism(mechanism=example_2(**changes))
        assert text in str(caught.value)

    def test_a_mechanism_smaller_than_an_atom_is_refused(self):
        tiny = [Point2(x=1e-11), Point2(y=1e-11), Point2()]
        mechanism = FMechanism(
            base=tiny, crank_lengths=[1e-11] * 3, rod_lengths=[1e-11] * 3, platform=tiny
        )
        with pytest.raises(OutOfBoundsError, match=r"largest length of the mechanism = 1\.4"):
            solve_f_mechanism(mechanism=mechanism)


class TestTraceFMechanism:
    YES, NO, UNDECIDED = (
        TraceFMechanism.Response.YES,
        TraceFMechanism.Response.NO,
        TraceFMechanism.Response.UNDECIDED,
    )

    def test_the_branch_that_turns_fully(self):
        response = trace_f_mechanism(
            mechanism=example_2(), sweep=turn(), platform_point=Point2(x=-7.0, y=28.0)
        )
        rows = columns(response)
        assert {len(values) for values in rows.values()} == {361}
        assert len(rows) == 27
        assert response.turns_fully == self.YES
        assert response.turns == pytest.approx(1.0)
        assert [event.kind for event in response.events] == [TraceEvent.CLOSED]
        assert response.events[0].row == 360
        assert rows["crank_angle"] == pytest.approx(np.linspace(0.0, math.tau, 361))
        for row in range(0, 361, 45):
            poses = solve_f_mechanism(
                mechanism=example_2(),
                crank_angle=float(rows["crank_angle"][row]),
                platform_point=Point2(x=-7.0, y=28.0),
            ).poses
            gaps = [
                abs(math.remainder(pose.angle - rows["angle"][row], math.tau)) for pose in poses
            ]
            pose = poses[int(np.argmin(gaps))]
            assert min(gaps) < 1e-9
            places = {
                "position": pose.position,
                "velocity": pose.velocity,
                "point": pose.point,
                "point_velocity": pose.point_velocity,
            }
            places.update(zip(("a1", "b1", "c1"), pose.crank_pins))
            places.update(zip(("a2", "b2", "c2"), pose.platform_joints))
            for name, place in places.items():
                found = (rows[f"{name}_x"][row], rows[f"{name}_y"][row])
                assert found == pytest.approx((place.x, place.y), abs=1e-8)
            assert rows["angular_velocity"][row] == pytest.approx(pose.angular_velocity, abs=1e-8)
            assert rows["singularity"][row] == pytest.approx(pose.singularity, abs=1e-8)
            assert rows["residual"][row] < 1e-10

    def test_a_turning_point_stops_the_trace_or_is_passed(self):
        request = {"mechanism": example_2(), "sweep": turn(), "pose_index": 1}
        stopped = trace_f_mechanism(**request)
        passed = trace_f_mechanism(**request, go_through=True)
        (event,) = stopped.events
        assert event.kind == TraceEvent.TURNING_POINT
        assert event.row == len(stopped.angle) - 1
        assert stopped.turns_fully == passed.turns_fully == self.NO
        kinds = [event.kind for event in passed.events]
        assert kinds == [TraceEvent.TURNING_POINT] * 4 + [TraceEvent.CLOSED]
        same = passed.events[0]
        assert (same.crank_angle, same.angle) == (event.crank_angle, event.angle)
        assert list(passed.angle[: len(stopped.angle)]) == list(stopped.angle)
        # Beyond a turning point the cranks run the other way.
        crank = np.array(passed.crank_angle)
        assert crank[event.row + 2] < crank[event.row + 1] < event.crank_angle

    def test_a_bifurcation_stops_the_trace_or_is_passed(self):
        mechanism, crank_angle, (angle, place) = bifurcating_mechanism(np.random.default_rng(5))
        request = {
            "mechanism": message_of(mechanism),
            "sweep": CrankSweep(
                start_angle=crank_angle - 0.01, end_angle=crank_angle + 0.01, steps=20
            ),
            "start_by": TraceFMechanism.Request.BY_ANGLE,
            "pose_angle": angle,
        }
        stopped = trace_f_mechanism(**request)
        passed = trace_f_mechanism(**request, go_through=True)
        event = stopped.events[-1]
        assert event.kind == TraceEvent.BIFURCATION
        assert event.row == len(stopped.angle) - 1 == 10
        assert event.crank_angle == pytest.approx(crank_angle, abs=1e-9)
        assert math.remainder(event.angle - angle, math.tau) == pytest.approx(0.0, abs=1e-8)
        assert (event.position.x, event.position.y) == pytest.approx((place.real, place.imag))
        assert [event.kind for event in passed.events] == [TraceEvent.BIFURCATION, TraceEvent.END]
        assert len(passed.angle) == 21
        assert np.abs(np.diff(passed.angle, 2)).max() < 1e-3

    def test_events_have_the_names_of_the_library(self):
        numbers = mechanism_messages.F_MECHANISM_EVENTS
        assert set(numbers) == set(EventKind)
        for kind, number in numbers.items():
            assert number == getattr(TraceEvent, kind.name)
        assert len(set(numbers.values())) == len(numbers)

    def test_start_by_angle_takes_the_nearest_position(self):
        poses = solve_f_mechanism(mechanism=example_2(), crank_angle=math.radians(146.0)).poses
        sweep = CrankSweep(start_angle=math.radians(146.0), end_angle=2.6, steps=1)
        for index, pose in enumerate(poses):
            by_index = trace_f_mechanism(mechanism=example_2(), sweep=sweep, pose_index=index)
            by_angle = trace_f_mechanism(
                mechanism=example_2(),
                sweep=sweep,
                start_by=TraceFMechanism.Request.BY_ANGLE,
                pose_angle=pose.angle + math.tau + 0.01,
            )
            assert by_angle == by_index
            assert by_index.angle[0] == pytest.approx(pose.angle, abs=1e-9)
            assert by_index.turns_fully == self.UNDECIDED
            assert [event.kind for event in by_index.events] == [TraceEvent.END]

    def test_angles_given_one_by_one_are_the_rows(self):
        given = [0.0, 0.1, 0.25, 1.0]
        sweep = CrankSweep(crank_angles=given)
        response = trace_f_mechanism(mechanism=example_2(), sweep=sweep)
        assert list(response.crank_angle) == pytest.approx(given, abs=1e-15)

    def test_phases_change_along_the_trace(self):
        start, end = math.radians(243.0), math.radians(250.0)
        response = trace_f_mechanism(
            mechanism=example_2(),
            sweep=CrankSweep(start_angle=0.0, end_angle=1.0, steps=10),
            change_phases=True,
            end_phase_b=end,
            end_phase_c=math.radians(-20.0),
        )
        assert response.turns_fully == self.UNDECIDED
        assert list(response.phase_b) == pytest.approx(np.linspace(start, end, 11))
        last = solve_f_mechanism(
            mechanism=example_2(phase_b=end, phase_c=math.radians(-20.0)), crank_angle=1.0
        )
        gaps = [abs(pose.angle - response.angle[-1]) for pose in last.poses]
        assert min(gaps) < 1e-9
        assert response.events[-1].phase_b == pytest.approx(end)

    def test_phases_change_while_the_cranks_stand_still(self):
        response = trace_f_mechanism(
            mechanism=example_2(),
            sweep=CrankSweep(start_angle=1.0, end_angle=1.0, steps=5),
            change_phases=True,
            end_phase_b=math.radians(243.0),
            end_phase_c=math.radians(-10.0),
        )
        assert list(response.crank_angle) == [1.0] * 6
        assert response.phase_c[-1] == pytest.approx(math.radians(-10.0))

    @pytest.mark.parametrize(
        ("fields", "error", "text"),
        [
            ({"pose_index": 2}, RefusedRequestError, "pose_index = 2 must be less than 2"),
            ({"start_by": 7}, RefusedRequestError, "start_by = 7 must be 0 or 1"),
            (
                {"change_phases": True, "end_phase_b": 700.0},
                OutOfBoundsError,
                "change to end_phase_b = 110.73",
            ),
            (
                {"sweep": CrankSweep(end_angle=1.0, steps=1_000_000)},
                OutOfBoundsError,
                "steps = 1000000 must be from 1 to 100000",
            ),
            (
                {"sweep": CrankSweep(end_angle=630.0, steps=10)},
                OutOfBoundsError,
                "turns must be at most 100 turns",
            ),
        ],
    )
    def test_what_cannot_be_served_is_refused(self, fields, error, text):
        with pytest.raises(error) as caught:
            trace_f_mechanism(**{"mechanism": example_2(), "sweep": turn(), **fields})
        assert text in str(caught.value)
