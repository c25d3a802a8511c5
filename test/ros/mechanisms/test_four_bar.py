"""Requests about four-bar linkages: the answer is the library's, or says what is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mechanism_requests import ask, columns, textbook, turn

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
    NotAssemblableError,
)
from tri_glide_kinematics.ros.mechanisms import four_bar as four_bar_messages
from tri_glide_kinematics.ros.mechanisms.fields import RefusedRequestError

OPEN, CROSSED = FourBarPose.OPEN, FourBarPose.CROSSED


def solve_four_bar(**fields):
    return ask(four_bar_messages.solve, SolveFourBar, **fields)


def trace_four_bar(**fields):
    return ask(four_bar_messages.trace, TraceFourBar, **fields)


class TestSolveFourBar:
    def test_both_branches_of_the_textbook_linkage(self):
        response = solve_four_bar(
            linkage=textbook(),
            crank_angle=math.radians(30.0),
            crank_velocity=10.0,
            coupler_point=Point2(x=7.0, y=0.0),
        )
        first, second = response.poses
        assert (first.branch, second.branch) == (OPEN, CROSSED)
        for pose, angles, velocities, accelerations in (
            (first, (88.837241, 117.286068), (-5.990966, -3.991735), (26.08002, 53.33059)),
            (second, (-115.210812, -143.659639), (-0.662352, -2.661583), (77.91986, 50.66928)),
        ):
            assert np.degrees((pose.coupler_angle, pose.rocker_angle)) == pytest.approx(
                angles, abs=1e-6
            )
            assert (pose.coupler_velocity, pose.rocker_velocity) == pytest.approx(
                velocities, abs=1e-6
            )
            assert (pose.coupler_acceleration, pose.rocker_acceleration) == pytest.approx(
                accelerations, abs=1e-5
            )
            # The coupler point asked for is the rocker pin, which turns about its pivot.
            assert (pose.coupler_point.x, pose.coupler_point.y) == pytest.approx(
                (pose.rocker_pin.x, pose.rocker_pin.y)
            )
            velocity = pose.coupler_point_velocity
            assert math.hypot(velocity.x, velocity.y) == pytest.approx(
                9.0 * abs(pose.rocker_velocity)
            )
            acceleration = pose.coupler_point_acceleration
            assert math.hypot(acceleration.x, acceleration.y) == pytest.approx(
                9.0 * math.hypot(pose.rocker_acceleration, pose.rocker_velocity**2)
            )
            assert not pose.is_singular
            assert (pose.rocker_pivot.x, pose.rocker_pivot.y) == (6.0, 0.0)

    def test_the_properties_are_those_of_the_library(self):
        linkage = four_bar.FourBar(2.0, 7.0, 9.0, 6.0)
        properties = solve_four_bar(linkage=textbook()).properties
        assert properties.grashof_class == FourBarProperties.CRANK_ROCKER
        assert properties.crank_turns_fully
        assert not properties.has_change_point
        assert math.isnan(properties.assembled_crank_angle)
        extremes = linkage.transmission_extremes
        assert properties.smallest_transmission_angle == extremes.smallest
        assert properties.smallest_transmission_angle_at == extremes.smallest_at
        assert properties.largest_transmission_angle == extremes.largest
        assert properties.largest_transmission_angle_at == extremes.largest_at
        assert [
            (centre.kind, centre.crank_angle, centre.rocker_angle, centre.branch)
            for centre in properties.dead_centres
        ] == [
            (
                centre.kind.value,
                centre.crank_angle,
                centre.rocker_angle,
                OPEN if centre.branch is four_bar.Branch.OPEN else CROSSED,
            )
            for centre in linkage.dead_centres
        ]
        assert len(properties.dead_centres) == 4

    def test_constants_name_every_class_and_dead_centre(self):
        names = {name: getattr(FourBarProperties, name) for name in GrashofClass.__members__}
        assert names == {name: member.value for name, member in GrashofClass.__members__.items()}
        kinds = {name: getattr(FourBarDeadCentre, name) for name in DeadCentreKind.__members__}
        assert kinds == {name: member.value for name, member in DeadCentreKind.__members__.items()}

    def test_a_linkage_given_by_its_joints_is_that_of_the_sheet(self):
        linkage = FourBar(
            given_by=FourBar.JOINTS,
            crank_pin=Point2(x=65.183, y=45.552),
            rocker_pin=Point2(x=28.332, y=46.047),
            rocker_pivot=Point2(x=-74.783, y=4.195),
        )
        response = solve_four_bar(linkage=linkage, crank_angle=math.radians(37.964))
        properties = response.properties
        lengths = (properties.ground, properties.crank, properties.coupler, properties.rocker)
        assert lengths == pytest.approx((74.901, 79.522, 36.854, 111.285), abs=5e-4)
        assert properties.assembled_crank_angle == pytest.approx(math.atan2(45.552, 65.183))
        pose = response.poses[properties.assembled_branch]
        assert (pose.crank_pin.x, pose.crank_pin.y) == pytest.approx((62.695, 48.919), abs=5e-4)
        assert (pose.rocker_pin.x, pose.rocker_pin.y) == pytest.approx((25.933, 51.529), abs=5e-4)

    def test_beyond_a_limit_there_are_properties_and_no_poses(self):
        request = SolveFourBar.Request(
            linkage=FourBar(crank=5.0, coupler=2.5, rocker=4.0, ground=6.0), crank_angle=math.pi
        )
        response = SolveFourBar.Response()
        with pytest.raises(CrankLimitError, match=r"crank_angle = 3\.14159265 rad is beyond"):
            four_bar_messages.solve(request, response)
        assert not response.poses
        properties = response.properties
        begin, end = properties.crank_range_begin, properties.crank_range_end
        assert len(begin) == len(end) > 0
        assert all(low < high for low, high in zip(begin, end))

    @pytest.mark.parametrize(
        ("changes", "error", "text"),
        [
            ({"crank": 0.0}, OutOfBoundsError, "crank = 0 m must be greater than 0"),
            ({"crank": 1e-300}, OutOfBoundsError, "crank = 1e-300 m must be at least"),
            ({"rocker": -9.0}, OutOfBoundsError, "rocker = -9 m must be greater than 0"),
            ({"coupler": 17.0}, NotAssemblableError, "coupler = 17 m must be shorter"),
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
    @pytest.mark.parametrize("branch", [OPEN, CROSSED])
    def test_rows_are_the_poses_of_one_branch(self, branch):
        point = Point2(x=3.0, y=1.5)
        motion = {"crank_velocity": 3.0, "crank_acceleration": -2.0, "coupler_point": point}
        response = trace_four_bar(linkage=textbook(), branch=branch, sweep=turn(), **motion)
        rows = columns(response)
        assert {len(values) for values in rows.values()} == {361}
        assert len(rows) == 18
        for row in range(0, 361, 45):
            angle = float(rows["crank_angle"][row])
            pose = solve_four_bar(linkage=textbook(), crank_angle=angle, **motion).poses[branch]
            for name, values in rows.items():
                if hasattr(pose, name):
                    assert values[row] == pytest.approx(getattr(pose, name), rel=1e-12)
                elif name != "crank_angle":
                    place, axis = name.rsplit("_", 1)
                    expected = getattr(getattr(pose, place), axis)
                    assert values[row] == pytest.approx(expected, rel=1e-12, abs=1e-12)
        assert not response.events
        assert response.properties.grashof_class == FourBarProperties.CRANK_ROCKER

    @pytest.mark.parametrize("sense", [1.0, -1.0])
    def test_limits_are_events_between_reachable_rows_and_others(self, sense):
        linkage = FourBar(
            crank=5.0,
            coupler=2.5,
            rocker=4.0,
            ground=6.0,
            ground_angle=0.3,
            crank_pivot=Point2(x=1.0),
        )
        sweep = CrankSweep(start_angle=-7.0 * sense, end_angle=9.0 * sense, steps=1000)
        response = trace_four_bar(linkage=linkage, sweep=sweep, crank_velocity=1.0)
        rows = columns(response)
        reachable = ~np.isnan(rows["rocker_angle"])
        borders = np.flatnonzero(reachable[1:] != reachable[:-1])
        assert [event.row for event in response.events] == borders.tolist()
        assert len(borders) >= 8
        pin_x = rows["rocker_pin_x"]
        for event in response.events:
            assert event.kind == TraceEvent.LIMIT
            between = sorted(rows["crank_angle"][event.row : event.row + 2])
            assert between[0] <= event.crank_angle <= between[1]
            inside = event.row if reachable[event.row] else event.row + 1
            # Near a limit the rocker moves with the root of the distance to it.
            assert abs(math.remainder(rows["rocker_angle"][inside] - event.angle, math.tau)) < 0.3
            assert abs(pin_x[inside] - event.position.x) < 4.0 * 0.3
        assert np.isnan(rows["coupler_point_velocity_x"][~reachable]).all()
        assert not np.isnan(rows["crank_angle"]).any()

    def test_a_limit_on_a_row_belongs_to_that_row(self):
        linkage = FourBar(crank=5.0, coupler=2.5, rocker=4.0, ground=6.0)
        limit = solve_four_bar(linkage=linkage, crank_angle=1.0).properties.crank_range_end[0]
        sweep = CrankSweep(crank_angles=[limit - 0.1, limit, limit + 0.1])
        response = trace_four_bar(linkage=linkage, sweep=sweep, crank_velocity=1.0)
        (event,) = response.events
        assert (event.row, event.crank_angle) == (1, limit)
        assert np.isnan(response.rocker_velocity[1:]).all()
        assert np.isnan(response.rocker_angle).tolist() == [False, False, True]

    def test_a_parallelogram_passes_its_change_points_on_one_branch(self):
        linkage = FourBar(crank=2.0, coupler=5.0, rocker=2.0, ground=5.0)
        sweep = CrankSweep(start_angle=-0.5, end_angle=2.5 * math.tau, steps=1000)
        response = trace_four_bar(linkage=linkage, branch=OPEN, sweep=sweep, crank_velocity=1.0)
        assert {event.kind for event in response.events} == {TraceEvent.BIFURCATION}
        angles = [event.crank_angle for event in response.events]
        assert angles == pytest.approx([k * math.pi for k in range(6)], abs=1e-12)
        crank = np.array(response.crank_angle)
        turned = np.array(response.rocker_angle) - crank
        assert np.abs(np.remainder(turned + 1.0, math.tau) - 1.0).max() < 1e-9

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
