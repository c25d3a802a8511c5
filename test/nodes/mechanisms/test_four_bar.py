"""Requests about four-bar linkages: the answer is the library's, or says what is wrong."""

import math

import numpy as np
import pytest
from mechanism_requests import ask, assert_columns, assert_message, textbook, turn

from tri_glide_interfaces.msg import (
    CrankSweep,
    FourBar,
    FourBarDeadCentre,
    FourBarPose,
    FourBarProperties,
    Point2,
    TraceEvent,
)
from tri_glide_interfaces.srv import SolveFourBar, TraceFourBar
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.mechanisms import four_bar
from tri_glide_kinematics.mechanisms.four_bar import (
    CrankLimitError,
    DeadCentreKind,
    GrashofClass,
)
from tri_glide_kinematics.nodes import mechanism_node as mechanism_messages
from tri_glide_kinematics.nodes.mechanism_node import RefusedRequestError, crank_angles

OPEN, CROSSED = FourBarPose.OPEN, FourBarPose.CROSSED


def solve_four_bar(**fields):
    return ask(mechanism_messages.solve_four_bar, SolveFourBar, **fields)


def trace_four_bar(**fields):
    return ask(mechanism_messages.trace_four_bar, TraceFourBar, **fields)


TEXTBOOK = four_bar.FourBar(2.0, 7.0, 9.0, 6.0)
PARALLELOGRAM = four_bar.FourBar(2.0, 5.0, 2.0, 5.0)
LIMITED = four_bar.FourBar(5.0, 2.5, 4.0, 6.0, crank_pivot=(1.0, 0.0), ground_angle=0.3)
LIMIT = LIMITED.crank_ranges[0][1]
# Source 002.
JOINTS = {
    "crank_pin": (65.183, 45.552),
    "rocker_pin": (28.332, 46.047),
    "rocker_pivot": (-74.783, 4.195),
}
SHEET = four_bar.FourBar.from_joints((0.0, 0.0), *JOINTS.values())


def number_of(branch):
    """Return the number that a branch has in messages."""
    return {four_bar.Branch.OPEN: OPEN, four_bar.Branch.CROSSED: CROSSED}.get(
        branch, FourBarPose.BOTH
    )


def message_of(linkage):
    """Return the message that describes a linkage of the library."""
    if linkage is SHEET:
        joints = {name: Point2(x=x, y=y) for name, (x, y) in JOINTS.items()}
        return FourBar(given_by=FourBar.JOINTS, **joints)
    lengths = {name: getattr(linkage, name) for name in ("crank", "coupler", "rocker", "ground")}
    x, y = linkage.crank_pivot
    return FourBar(crank_pivot=Point2(x=x, y=y), ground_angle=linkage.ground_angle, **lengths)


class TestSolveFourBar:
    @pytest.mark.parametrize("linkage", [TEXTBOOK, SHEET, LIMITED, PARALLELOGRAM])
    def test_poses_and_properties_are_those_of_the_library(self, linkage):
        motion = (0.6, 10.0, -2.0)
        response = solve_four_bar(
            linkage=message_of(linkage),
            crank_angle=motion[0],
            crank_velocity=motion[1],
            crank_acceleration=motion[2],
            coupler_point=Point2(x=3.0, y=1.5),
        )
        poses = linkage.solve(*motion)
        assert len(response.poses) == len(poses) == 2
        for message, pose in zip(response.poses, poses):
            point = pose.point_of_coupler_plane(3.0, 1.5)
            expected = {
                name: getattr(pose, name)
                for name in message.get_fields_and_field_types()
                if name != "branch" and not name.startswith("coupler_point")
            }
            expected["branch"] = number_of(pose.branch)
            expected["coupler_point"] = point.position
            expected["coupler_point_velocity"] = point.velocity
            expected["coupler_point_acceleration"] = point.acceleration
            assert_message(message, expected)
        self.assert_properties(response.properties, linkage)

    @staticmethod
    def assert_properties(properties, linkage):
        extremes = linkage.transmission_extremes
        centres = properties.dead_centres
        assert [(each.kind, each.crank_angle, each.branch) for each in centres] == [
            (each.kind.value, each.crank_angle, number_of(each.branch))
            for each in linkage.dead_centres
        ]
        np.testing.assert_array_equal(
            [each.rocker_angle for each in centres],
            [each.rocker_angle for each in linkage.dead_centres],
        )
        same = ("crank", "coupler", "rocker", "ground", "ground_angle", "crank_turns_fully")
        expected = {
            **{name: getattr(linkage, name) for name in same},
            "assembled_crank_angle": getattr(linkage, "assembled_crank_angle", math.nan),
            "assembled_branch": number_of(linkage.assembled_branch) if linkage is SHEET else 0,
            "grashof_class": linkage.grashof_class.value,
            "has_change_point": linkage.lengths.has_change_point,
            "crank_range_begin": [begin for begin, _ in linkage.crank_ranges],
            "crank_range_end": [end for _, end in linkage.crank_ranges],
            "smallest_transmission_angle": extremes.smallest,
            "smallest_transmission_angle_at": extremes.smallest_at,
            "largest_transmission_angle": extremes.largest,
            "largest_transmission_angle_at": extremes.largest_at,
            "dead_centres": centres,
        }
        assert_message(properties, expected)

    def test_constants_name_every_class_and_dead_centre(self):
        names = {name: getattr(FourBarProperties, name) for name in GrashofClass.__members__}
        assert names == {name: member.value for name, member in GrashofClass.__members__.items()}
        kinds = {name: getattr(FourBarDeadCentre, name) for name in DeadCentreKind.__members__}
        assert kinds == {name: member.value for name, member in DeadCentreKind.__members__.items()}

    def test_beyond_a_limit_there_are_properties_and_no_poses(self):
        request = SolveFourBar.Request(
            linkage=FourBar(crank=5.0, coupler=2.5, rocker=4.0, ground=6.0), crank_angle=math.pi
        )
        response = SolveFourBar.Response()
        with pytest.raises(CrankLimitError, match=r"crank_angle = 3\.14159265 rad is beyond"):
            mechanism_messages.solve_four_bar(request, response)
        assert not response.poses
        properties = response.properties
        begin, end = properties.crank_range_begin, properties.crank_range_end
        assert len(begin) == len(end) > 0
        assert all(low < high for low, high in zip(begin, end))

    @pytest.mark.parametrize(
        ("changes", "error", "text"),
        [
            ({"given_by": 2}, RefusedRequestError, "given_by = 2 must be 0 or 1"),
            ({"given_by": 1}, OutOfBoundsError, "crank = 0 m must be greater than 0"),
            ({"tolerance": 0.1}, OutOfBoundsError, "tolerance = 0.1 must be from 0 to 1e-3"),
        ],
    )
    def test_a_linkage_that_is_none_is_refused(self, changes, error, text):
        linkage = textbook()
        for name, value in changes.items():
            setattr(linkage, name, value)
        with pytest.raises(error) as caught:
            solve_four_bar(linkage=linkage)
        assert text in str(caught.value)

    def test_a_linkage_smaller_than_an_atom_is_refused(self):
        linkage = FourBar(crank=2e-11, coupler=7e-11, rocker=9e-11, ground=6e-11)
        with pytest.raises(OutOfBoundsError, match="longest link = 9e-11 m must be at least 1e-09"):
            solve_four_bar(linkage=linkage)


class TestTraceFourBar:
    @pytest.mark.parametrize(
        ("linkage", "branch", "sweep"),
        [
            (TEXTBOOK, OPEN, turn()),
            (TEXTBOOK, CROSSED, turn()),
            (LIMITED, OPEN, CrankSweep(start_angle=-7.0, end_angle=9.0, steps=1000)),
            (LIMITED, CROSSED, CrankSweep(start_angle=7.0, end_angle=-9.0, steps=1000)),
            (LIMITED, OPEN, CrankSweep(crank_angles=[LIMIT - 0.1, LIMIT, LIMIT + 0.1])),
            (PARALLELOGRAM, OPEN, CrankSweep(start_angle=-0.5, end_angle=16.0, steps=1000)),
        ],
    )
    def test_a_trace_is_that_of_the_library(self, linkage, branch, sweep):
        response = trace_four_bar(
            linkage=message_of(linkage),
            branch=branch,
            sweep=sweep,
            crank_velocity=3.0,
            crank_acceleration=-2.0,
            coupler_point=Point2(x=3.0, y=1.5),
        )
        angles = np.array(response.crank_angle)
        found = linkage.sweep(angles, 3.0, -2.0).branch(mechanism_messages.BRANCHES[branch])
        point = found.point_of_coupler_plane(3.0, 1.5)
        scalars = {
            "crank_angle": crank_angles(sweep, 1000, 10),
            "coupler_angle": found.coupler_angles,
            "rocker_angle": found.rocker_angles,
            "coupler_velocity": found.coupler_velocities,
            "rocker_velocity": found.rocker_velocities,
            "coupler_acceleration": found.coupler_accelerations,
            "rocker_acceleration": found.rocker_accelerations,
            "transmission_angle": found.transmission_angles,
        }
        places = {
            "crank_pin": found.crank_pins,
            "rocker_pin": found.rocker_pins,
            "coupler_point": point.position,
            "coupler_point_velocity": point.velocity,
            "coupler_point_acceleration": point.acceleration,
        }
        assert_columns(response, scalars, places)
        events = four_bar.sweep_events(linkage, angles)
        assert len(response.events) == len(events)
        kinds = {"LIMIT": TraceEvent.LIMIT, "CHANGE_POINT": TraceEvent.BIFURCATION}
        for message, event in zip(response.events, events):
            expected = {
                "kind": kinds[event.kind.name],
                "row": event.row,
                "crank_angle": event.crank_angle,
                "angle": event.rocker_angle,
                "position": event.rocker_pin,
                "phase_b": 0.0,
                "phase_c": 0.0,
            }
            assert_message(message, expected)
        TestSolveFourBar.assert_properties(response.properties, linkage)

    def test_nothing_within_reach_is_no_success(self):
        linkage = FourBar(crank=5.0, coupler=2.5, rocker=4.0, ground=6.0)
        sweep = CrankSweep(start_angle=3.0, end_angle=3.2, steps=10)
        with pytest.raises(RefusedRequestError, match=r"none of 11 crank angles from 3 to 3\.2"):
            trace_four_bar(linkage=linkage, sweep=sweep)

    def test_other_branches_do_not_exist(self):
        with pytest.raises(RefusedRequestError, match="branch = 2 must be 0 or 1"):
            trace_four_bar(linkage=textbook(), branch=FourBarPose.BOTH, sweep=turn())

    def test_so_many_steps_are_served_and_no_more(self):
        many = CrankSweep(end_angle=1.0, steps=100_000)
        response = trace_four_bar(linkage=textbook(), sweep=many)
        assert len(response.rocker_angle) == 100_001
        with pytest.raises(OutOfBoundsError, match="steps = 100001 must be from 1 to 100000"):
            trace_four_bar(linkage=textbook(), sweep=CrankSweep(end_angle=1.0, steps=100_001))
