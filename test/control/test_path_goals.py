"""Goals that are paths: how they end, go on in one another, and give way to what is newer."""

import math
import random

import pytest
from controller_rig import LIMITS, MACHINE, Rig, ended
from motion_machine import SHAPER

from tri_glide_kinematics.control import IDLE, MOVING, PAUSED, Cause, Reason
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion import MotionKind, MotionPhase
from tri_glide_kinematics.motion.engine import Follow, GoalCode, PathOutputs
from tri_glide_kinematics.motion.path import FlatPath

SQUARE = [(0.02, 0.0, 0.25), (0.02, 0.02, 0.25), (0.0, 0.02, 0.25), (0.0, 0.0, 0.25)]
BEYOND = [(-0.02, 0.0, 0.25), (-0.02, -0.02, 0.25)]
START = MACHINE.inverse((0.0, 0.0, 0.25))


@pytest.fixture
def rig():
    rig = Rig(kind=MotionKind.LINEAR, in_pieces=True, start=START)
    # The next part of a path has to be planned while the present one is driven.
    rig.pieces = 30
    rig.cycle(2)
    return rig


def target(rig, points, extends=False, outputs=None, tolerance=0.001):
    flat = FlatPath.of([0] * len(points), [x for p in points for x in p], (), (), tolerance)

    def make(end):
        return flat.path_from(end or MACHINE.forward(rig.controller.commanded_heights))

    return Follow.made(make, f"path of {len(points)} segments", extends, outputs)


def pursue(rig, points=SQUARE, extends=False, outputs=None, tolerance=0.001):
    return rig.controller.pursue(target(rig, points, extends, outputs, tolerance))


def under_way(rig, points=SQUARE, outputs=None):
    rig.controller.set_limits(LIMITS, 0.3)
    goal = pursue(rig, points, outputs=outputs)
    for _ in range(2000):
        rig.cycle()
        # The way is known a little after the motion has begun.
        progress = rig.controller.path_progress
        if progress is not None and rig.controller.leads_to(goal) and progress.way > 0.012:
            return goal
    raise AssertionError("it does not begin")


def place(rig):
    return MACHINE.forward(rig.heights)


def test_it_succeeds_at_the_end_of_the_path(rig):
    goal = under_way(rig)
    assert rig.controller.state is MOVING
    code, text = ended(rig, goal)
    assert code is GoalCode.SUCCEEDED
    assert text == "path of 4 segments is reached, measured 0 m away"
    assert place(rig) == pytest.approx(SQUARE[-1], abs=1e-9)
    assert rig.controller.state is IDLE


@pytest.mark.parametrize("pieces", [20, 30])
def test_the_state_is_moving_as_soon_as_the_path_is_followed(pieces):
    # So slow a planner has the next part in preparation in nearly every cycle of the path.
    rig = Rig(kind=MotionKind.LINEAR, in_pieces=True, start=START)
    rig.pieces = pieces
    rig.cycle(2)
    for _ in range(10):
        rig.jog((0.0, 0.02, 0.0))
        rig.cycle(2)
    angles = [0.05 * count for count in range(1, 200)]
    circle = [(0.03 * math.sin(a), 0.03 - 0.03 * math.cos(a), 0.25) for a in angles]
    goal = pursue(rig, circle)
    states = []
    for _ in range(5000):
        rig.cycle()
        if goal.outcome is not None:
            break
        if rig.engine.phase is MotionPhase.FOLLOWING:
            states.append(rig.controller.state)
    assert goal.outcome.code is GoalCode.SUCCEEDED
    assert len(states) > 100
    assert set(states) == {MOVING}


def test_a_cancelled_path_rests_on_it_or_beside_it(rig):
    goal = under_way(rig)
    rig.controller.cancel(goal)
    assert ended(rig, goal).code is GoalCode.CANCELED
    # On one of the first three sides of the square.
    x, y, z = place(rig)
    assert min(abs(y), abs(x - 0.02), abs(y - 0.02)) <= 0.001
    # Beside it where a stop along the path would take much longer than the sliders' own stop.
    assert z == pytest.approx(0.25, abs=1e-3)
    assert place(rig) != pytest.approx(SQUARE[-1], abs=1e-3)


@pytest.mark.parametrize(
    ("command", "end"),
    [
        (lambda rig: rig.controller.move_to((0.01, -0.03, 0.3)), (0.01, -0.03, 0.3)),
        (lambda rig: pursue(rig, BEYOND), BEYOND[-1]),
        (lambda rig: rig.jog((0.0, 0.0, 0.02)), None),
    ],
    ids=["pose", "path", "twist"],
)
def test_a_newer_command_supersedes_it(rig, command, end):
    goal = under_way(rig)
    newer = command(rig)
    code, text = ended(rig, goal, most=20)
    assert code is GoalCode.SUPERSEDED
    if newer is not None:
        assert text == "superseded by path of 2 segments"
        assert ended(rig, newer).code is GoalCode.SUCCEEDED
    if end is not None:
        rig.cycle_until(IDLE)
        assert place(rig) == pytest.approx(end, abs=1e-9)


def test_a_path_is_extended_and_both_goals_end_at_its_end(rig):
    goals = [under_way(rig), pursue(rig, BEYOND, extends=True), pursue(rig, SQUARE, extends=True)]
    assert [ended(rig, goal).code for goal in goals] == [GoalCode.SUCCEEDED] * 3
    assert place(rig) == pytest.approx(SQUARE[-1], abs=1e-9)


def test_where_no_path_is_followed_an_extension_begins_one(rig):
    assert ended(rig, pursue(rig, BEYOND, extends=True)).code is GoalCode.SUCCEEDED
    assert ended(rig, pursue(rig, SQUARE, extends=True)).code is GoalCode.SUCCEEDED


def test_what_waited_behind_a_path_that_is_refused_is_refused_too(rig):
    going = under_way(rig)
    goals = [pursue(rig, points, extends=True) for points in ([(0.5, 0.0, 0.25)], BEYOND)]
    assert [ended(rig, goal).code for goal in goals] == [GoalCode.REFUSED] * 2
    assert goals[1].outcome.text == "the path that it goes on from was refused"
    assert ended(rig, going).code is GoalCode.SUCCEEDED
    assert place(rig) == pytest.approx(SQUARE[-1], abs=1e-9)


def test_behind_a_pose_an_extension_is_a_path_that_supersedes_it(rig):
    rig.controller.set_limits(LIMITS, 0.1)
    pose = rig.controller.pursue_position((0.05, 0.0, 0.3))
    rig.cycle(30)
    path = pursue(rig, BEYOND, extends=True)
    assert ended(rig, pose, most=100).code is GoalCode.SUPERSEDED
    assert ended(rig, path).code is GoalCode.SUCCEEDED


def test_a_cancelled_part_ends_the_whole_path(rig):
    goals = [under_way(rig), pursue(rig, BEYOND, extends=True)]
    rig.cycle(100)
    rig.controller.cancel(goals[1])
    assert ended(rig, goals[1]).code is GoalCode.CANCELED
    assert goals[0].outcome.code is GoalCode.SUPERSEDED


@pytest.mark.parametrize("extends", [False, True])
def test_what_cannot_be_driven_is_refused_with_the_segment_and_what_went_on_goes_on(rig, extends):
    going = under_way(rig)
    refused = pursue(rig, [(0.01, 0.0, 0.25), (0.5, 0.0, 0.25)], extends)
    code, text = ended(rig, refused)
    assert code is GoalCode.REFUSED
    assert "egment" in text
    assert any(text in refusal for refusal in rig.refusals)
    rig.cycle_until(IDLE)
    assert place(rig) == pytest.approx(SQUARE[-1], abs=1e-9)
    assert going.outcome is not None


def test_it_pauses_and_goes_on(rig):
    goal = under_way(rig)
    assert rig.controller.pause() == "comes to rest on the path"
    assert rig.controller.reason == Reason(Cause.PAUSE_ASKED, "path of 4 segments, paused")
    assert rig.controller.state is PAUSED
    rig.cycle(500)
    assert goal.outcome is None
    assert rig.cycle().velocities == (0.0, 0.0, 0.0)
    assert rig.controller.state is PAUSED
    assert rig.controller.resume() == "goes on along the path"
    assert rig.controller.state is MOVING and rig.controller.reason.cause is Cause.COMMAND
    assert ended(rig, goal).code is GoalCode.SUCCEEDED
    with pytest.raises(KinematicsError, match="path"):
        rig.controller.pause()


def test_it_is_paused_whenever_its_path_is_whatever_is_asked_for(rig):
    source = random.Random(5)
    controller = rig.controller
    commands = {
        "path": lambda: pursue(rig, source.choice((SQUARE, BEYOND))),
        "append": lambda: pursue(rig, source.choice((SQUARE, BEYOND)), extends=True),
        "pause": controller.pause,
        "resume": controller.resume,
        "pose": lambda: controller.move_to((0.0, 0.01, 0.26)),
        "jog": rig.jog,
        "limits": lambda: controller.set_limits(LIMITS, source.choice((0.2, 1.0))),
        "stop": controller.stop,
    }
    weights = (2, 1, 4, 2, 1, 1, 1, 1)
    cycles = 0
    for _ in range(60):
        (name,) = source.choices(list(commands), weights)
        try:
            commands[name]()
        except KinematicsError as error:
            assert error.refusal is not Refusal.OTHER, error
        for _ in range(source.choice((1, 2, 5, 20, 100))):
            rig.cycle()
            is_paused = rig.engine.is_paused and rig.engine.phase is not MotionPhase.IDLE
            # At the end of the path the setpoints rest before the platform is measured there.
            assert (controller.state is PAUSED) >= is_paused
            assert (controller.state is PAUSED) == (controller.reason.cause is Cause.PAUSE_ASKED)
            cycles += controller.state is PAUSED
    assert cycles > 60


def test_a_stop_while_it_pauses_ends_it(rig):
    goal = under_way(rig)
    rig.controller.pause()
    rig.cycle(300)
    rig.controller.stop()
    assert goal.outcome.code is GoalCode.STOPPED
    rig.cycle_until(IDLE)


def test_a_path_that_is_still_put_together_is_given_up_for_what_is_newer(rig):
    points = [(0.02 * (k % 2), 0.0001 * k, 0.25) for k in range(1, 300)]
    goal = pursue(rig, points)
    rig.controller.move_to((0.0, 0.0, 0.3))
    assert ended(rig, goal, most=50).code is GoalCode.SUPERSEDED
    rig.cycle_until(MOVING)
    rig.cycle_until(IDLE)
    assert place(rig) == pytest.approx((0.0, 0.0, 0.3), abs=1e-9)


def jog_ends(rig, way):
    """Let a jog end while the path is planned that came after it."""
    if way == "twist of zero":
        rig.jog((0.0, 0.0, 0.0))
    else:
        # It is not renewed for longer than its timeout.
        rig.cycle(60)


@pytest.mark.parametrize("way", ["silence", "twist of zero"])
@pytest.mark.parametrize("cycles", [5, 40])
def test_a_path_that_is_planned_waits_on_while_the_jog_before_it_ends(rig, way, cycles):
    rig.pieces = 1
    rig.jog()
    rig.cycle(cycles)
    goal = pursue(rig)
    rig.cycle(2)
    jog_ends(rig, way)
    assert ended(rig, goal).code is GoalCode.SUCCEEDED
    assert place(rig) == pytest.approx(SQUARE[-1], abs=1e-9)


def test_a_path_that_is_planned_waits_on_while_the_goal_before_it_is_cancelled(rig):
    rig.pieces = 1
    rig.controller.set_limits(LIMITS, 0.1)
    before = rig.controller.pursue_position((0.05, 0.0, 0.3))
    rig.cycle(50)
    goal = pursue(rig)
    rig.cycle()
    rig.controller.cancel(before)
    assert ended(rig, goal).code is GoalCode.SUCCEEDED


# One output at the start of each segment of the square.
AT_EACH = PathOutputs((0, 1, 2, 3), ("a", "b", "c", "d"), 4)


def told(rig, goal, most=5000):
    """Return what is told until a goal ends, each with the place of the setpoint in that cycle."""
    found = []
    for _ in range(most):
        if goal.outcome is not None:
            return found
        rig.cycle()
        found += [(output, place(rig)) for output in rig.controller.passed_outputs]
        rig.controller.passed_outputs.clear()
    raise AssertionError("it does not end")


@pytest.mark.parametrize("tolerance", [0.0, 0.001])
@pytest.mark.parametrize("shaper", [None, SHAPER])
def test_each_output_is_told_in_the_cycle_in_which_its_segment_begins(rig, tolerance, shaper):
    if shaper is not None and tolerance == 0.0:
        tolerance = 1e-5
    rig.engine.set_shaper(shaper)
    goal = pursue(rig, outputs=AT_EACH, tolerance=tolerance)
    rig.controller.passed_outputs.clear()
    before, found = place(rig), []
    while goal.outcome is None:
        rig.cycle()
        here = place(rig)
        found += [(output, before, here) for output in rig.controller.passed_outputs]
        rig.controller.passed_outputs.clear()
        before = here
    assert [output for output, *_ in found] == ["a", "b", "c", "d"]
    assert goal.outcome.code is GoalCode.SUCCEEDED
    driven = rig.engine.driven_path
    for (_, before, here), joint in zip(found, driven.joints):
        there, along = driven.derivatives([joint], 1)[:, 0]
        # With a shaper, which cuts the corner, the place of the setpoint is the mean of places.
        slack = 1e-9 if shaper is None else math.dist(before, here)
        assert (there - before) @ along > -slack
        assert (here - there) @ along > -slack
        assert math.dist(here, there) < math.dist(before, here) + tolerance + 1e-9


def test_outputs_at_one_place_are_told_in_their_order_and_those_of_a_longer_path_too(rig):
    goals = [
        pursue(rig, outputs=PathOutputs((3, 3), ("a", "b"), 4)),
        pursue(rig, BEYOND, extends=True, outputs=PathOutputs((0, 1), ("c", "d"), 2)),
    ]
    found = told(rig, goals[1])
    assert [output for output, _ in found] == ["a", "b", "c", "d"]
    assert found[2][1] == pytest.approx(SQUARE[-1], abs=0.002)
    assert found[3][1] == pytest.approx(BEYOND[0], abs=0.002)


def test_a_first_segment_that_leads_nowhere_does_not_shift_the_places(rig):
    points = [MACHINE.forward(rig.heights), *SQUARE]
    found = told(rig, pursue(rig, points, outputs=PathOutputs((0, 1, 2), ("a", "b", "c"), 5)))
    assert [output for output, _ in found] == ["a", "b", "c"]
    assert found[1][1] == pytest.approx((0.0, 0.0, 0.25), abs=1e-3)
    assert found[2][1] == pytest.approx(SQUARE[0], abs=0.002)


def test_an_output_is_told_once_though_the_path_is_paused_around_its_place(rig):
    goal = pursue(rig, outputs=AT_EACH)
    found, pauses = [], 0
    while goal.outcome is None:
        rig.cycle(7)
        found += rig.controller.passed_outputs
        rig.controller.passed_outputs.clear()
        if rig.controller.state is MOVING and pauses < 30:
            pauses += 1
            rig.controller.pause()
        elif rig.controller.state is PAUSED and rig.engine.phase is MotionPhase.PAUSED:
            rig.controller.resume()
    assert pauses > 10
    assert found == ["a", "b", "c", "d"]


@pytest.mark.parametrize("way", ["stop", "cancel", "pose", "path"])
def test_what_the_platform_does_not_come_to_is_not_told(rig, way):
    goal = under_way(rig, outputs=AT_EACH)
    rig.controller.passed_outputs.clear()
    assert rig.controller.newest_target.outputs
    {
        "stop": rig.controller.stop,
        "cancel": lambda: rig.controller.cancel(goal),
        "pose": lambda: rig.controller.move_to((0.0, 0.02, 0.26)),
        "path": lambda: pursue(rig, outputs=PathOutputs((3,), ("other",), 4)),
    }[way]()
    rig.cycle(1)
    rig.cycle_until(IDLE)
    late = [output for output in rig.controller.passed_outputs if output in ("c", "d")]
    assert late == []
    assert not rig.controller.newest_target.outputs
    assert ("other" in rig.controller.passed_outputs) == (way == "path")


def test_each_of_many_changes_of_the_override_is_in_force_while_a_path_is_driven(rig):
    flat = FlatPath.of([0] * 2, [x for p in SQUARE[:2] for x in p], (), (0.01,), 0.001)
    goal = rig.controller.pursue(
        Follow.made(lambda _: flat.path_from(MACHINE.forward(rig.heights)), "square")
    )
    rig.cycle(200)
    for scale in (0.5, 1.0, 2.0):
        rig.controller.set_limits(LIMITS, 1.0, scale)
        rig.cycle(120)
        assert goal.outcome is None
        assert rig.engine.path_speed_scale == scale
        assert rig.controller.progress.speed == pytest.approx(0.01 * scale, rel=0.01)
    assert ended(rig, goal, 20_000).code is GoalCode.SUCCEEDED


def test_the_progress_tells_place_speed_and_what_is_left(rig):
    assert rig.controller.progress == (MACHINE.forward(rig.heights), 0.0, 0, 0.0, 0.0)
    goal = under_way(rig)
    told = rig.controller.progress
    assert told.position == pytest.approx(place(rig), abs=1e-12)
    assert told.speed > 0.0 and told.segment == 0
    assert told.way_remaining == rig.controller.path_progress.way_remaining
    ended(rig, goal)
    rig.controller.move_to((0.0, 0.0, 0.3))
    rig.cycle_until(MOVING)
    rig.cycle(20)
    told = rig.controller.progress
    assert told.way_remaining == pytest.approx(0.3 - place(rig)[2], abs=1e-9)
    assert told.time_remaining == rig.controller.remaining > 0.0
    rig.cycle_until(IDLE)
    rig.jog((0.0, 0.0, 0.02))
    rig.cycle(20)
    assert math.isnan(rig.controller.progress.time_remaining)
    rig.controller.disable()
    rig.cycle(200)
    assert math.isnan(rig.controller.progress.speed)
