"""What a sweep of the crank meets: its limits and its change points, in order."""

import math

import numpy as np
import pytest

from tri_glide_kinematics.mechanisms.four_bar import Branch, FourBar, SweepEventKind, sweep_events

LIMITED = FourBar(5.0, 2.5, 4.0, 6.0, crank_pivot=(1.0, 0.0), ground_angle=0.3)
PARALLELOGRAM = FourBar(2.0, 5.0, 2.0, 5.0)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_limits_lie_where_the_rows_begin_and_cease_to_be_reachable(sense):
    angles = sense * np.linspace(-7.0, 9.0, 1001)
    events = sweep_events(LIMITED, angles)
    reachable = LIMITED.sweep(angles).open.is_reachable
    assert [event.row for event in events] == np.flatnonzero(np.diff(reachable)).tolist()
    assert {event.kind for event in events} == {SweepEventKind.LIMIT}
    for event in events:
        between = sorted(angles[event.row : event.row + 2])
        assert between[0] <= event.crank_angle <= between[1]


@pytest.mark.parametrize("linkage", [LIMITED, PARALLELOGRAM])
def test_an_event_has_the_place_of_the_pose_there(linkage):
    for event in sweep_events(linkage, np.linspace(-4.0, 4.0, 11)):
        # Rounding decides on which side of a limit an angle lies: the pose is solved inside.
        poses = [
            pose
            for offset in (0.0, 1e-12, -1e-12)
            for pose in linkage.solve(event.crank_angle + offset)
        ]
        assert poses[0].rocker_pin == pytest.approx(event.rocker_pin, abs=1e-4)
        turn = math.remainder(poses[0].rocker_angle - event.rocker_angle, math.tau)
        assert turn == pytest.approx(0.0, abs=1e-4)


def test_a_parallelogram_meets_a_change_point_every_half_turn():
    events = sweep_events(PARALLELOGRAM, np.linspace(-0.5, 2.5 * math.tau, 1001))
    assert {event.kind for event in events} == {SweepEventKind.CHANGE_POINT}
    angles = [event.crank_angle for event in events]
    assert angles == pytest.approx([k * math.pi for k in range(6)], abs=1e-12)


def test_a_limit_on_a_row_belongs_to_that_row():
    limit = LIMITED.crank_ranges[0][1]
    (event,) = sweep_events(LIMITED, np.array([limit - 0.1, limit, limit + 0.1]))
    assert event.row == 1
    assert event.crank_angle == pytest.approx(limit, abs=1e-15)
    (event,) = sweep_events(LIMITED, np.array([limit - 0.1, limit + 0.1, limit + 0.2]))
    assert event.row == 0


def test_a_crank_rocker_meets_nothing():
    linkage = FourBar(2.0, 7.0, 9.0, 6.0)
    assert sweep_events(linkage, np.linspace(0.0, 20.0, 100)) == ()
    assert linkage.sweep([0.0]).branch(Branch.OPEN).is_reachable.all()
