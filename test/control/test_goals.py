"""How goals end: once, truly, and for every reason that there is."""

import random

import pytest
from controller_rig import HOME, IN_POSITION, LIMITS, MACHINE, PERIOD, TARGET, Rig, ended

from tri_glide_kinematics.control import CYCLES_UNTIL_TOLD, IDLE, MOVING, Cause, CommandRefusedError
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionKind, PlatformPath
from tri_glide_kinematics.motion.engine import Follow, GoalCode, Move, Outcome

OTHER = (-0.05, 0.02, 0.25)


@pytest.fixture(params=[False, True], ids=["at once", "in pieces"])
def rig(request):
    rig = Rig(kind=MotionKind.LINEAR, in_pieces=request.param)
    rig.cycle(2)
    return rig


# Plans that take several cycles, so that a command waits meanwhile.
in_pieces = pytest.mark.parametrize("rig", [True], ids=["in pieces"], indirect=True)


def pursue(rig, position=TARGET):
    return rig.controller.pursue_position(position)


def under_way(rig):
    """Return a goal whose motion goes on, slow enough to be stopped before its target."""
    rig.controller.set_limits(LIMITS, 0.3)
    goal = pursue(rig)
    rig.cycle(30)
    assert rig.controller.leads_to(goal)
    assert goal.outcome is None
    return goal


def test_it_succeeds_only_when_it_is_measured_to_have_settled(rig):
    rig.offset = 0.001
    goal = pursue(rig)
    rig.cycle_until(MOVING)
    while rig.engine.remaining > 0.0 or rig.controller.newest_target.command is not goal:
        rig.cycle()
    rig.cycle(50)
    assert goal.outcome is None
    assert rig.controller.state is MOVING
    rig.offset = 0.0
    rig.cycle(int(IN_POSITION.settling_time / PERIOD) - 2)
    assert goal.outcome is None
    rig.cycle(4)
    assert goal.outcome == (
        GoalCode.SUCCEEDED,
        "target (0.05, 0.03, 0.3) m is reached, measured 0 m away",
    )
    assert rig.heights == pytest.approx(MACHINE.inverse(TARGET), abs=1e-9)


def test_a_goal_that_is_reached_already_succeeds(rig):
    assert ended(rig, pursue(rig)).code is GoalCode.SUCCEEDED
    assert ended(rig, pursue(rig)).code is GoalCode.SUCCEEDED


def test_it_is_not_reached_where_the_platform_is_measured_elsewhere(rig):
    goal = under_way(rig)
    rig.offset = 0.001
    code, text = ended(rig, goal)
    assert code is GoalCode.NOT_REACHED
    assert "NOT reached, measured 0.0" in text
    # It may get there after all, but the one who waits was told.
    rig.offset = 0.0
    rig.cycle(50)
    assert goal.outcome == (code, text)


def test_a_target_that_is_missed_by_far_is_a_fault(rig):
    goal = under_way(rig)
    rig.offset = 0.02
    code, text = ended(rig, goal)
    assert code is GoalCode.FAULT
    assert text == rig.controller.reason.text
    assert rig.controller.reason.cause is Cause.TARGET_TOO_FAR


NEWER = {
    "pose": (lambda rig: rig.controller.move_to(OTHER), "target (-0.05, 0.02, 0.25) m"),
    "same pose": (lambda rig: rig.controller.move_to(TARGET), "target (0.05, 0.03, 0.3) m"),
    "goal": (lambda rig: pursue(rig, OTHER), "target (-0.05, 0.02, 0.25) m"),
    "same goal": (pursue, "target (0.05, 0.03, 0.3) m"),
    "twist": (lambda rig: rig.jog((0.0, 0.0, 0.02)), "twist (0, 0, 0.02) m/s"),
    "moving target": (
        lambda rig: rig.controller.track(OTHER, (0.0, 0.0, 0.0), rig.now, rig.now),
        "moving target (-0.05, 0.02, 0.25) m, velocity (0, 0, 0) m/s",
    ),
}


@pytest.mark.parametrize("name", NEWER)
def test_a_newer_command_of_any_kind_supersedes_it(rig, name):
    goal = under_way(rig)
    command, text = NEWER[name]
    newer = command(rig)
    # Even if the newer one is planned for longer.
    ended(rig, goal, most=CYCLES_UNTIL_TOLD + 2)
    assert goal.outcome == (GoalCode.SUPERSEDED, f"superseded by {text}")
    if newer is not None:
        assert ended(rig, newer).code is GoalCode.SUCCEEDED


def test_a_refused_command_does_not_supersede_it(rig):
    goal = under_way(rig)
    for refused in (
        lambda: pursue(rig, (0.5, 0.0, 0.3)),
        lambda: rig.controller.move_to((0.5, 0.0, 0.3)),
    ):
        with pytest.raises(KinematicsError, match="outside the workspace"):
            refused()
    rig.jog((0.0, 0.0, 0.0))
    assert ended(rig, goal).code is GoalCode.SUCCEEDED


def test_goals_that_wait_are_superseded_one_by_one(rig):
    goals = [pursue(rig, position) for position in (TARGET, OTHER, TARGET, OTHER)]
    codes = [ended(rig, goal).code for goal in goals]
    assert codes == [GoalCode.SUPERSEDED] * 3 + [GoalCode.SUCCEEDED]
    assert rig.heights == pytest.approx(MACHINE.inverse(OTHER), abs=1e-9)


def test_a_cancelled_goal_ends_where_it_rests(rig):
    goal = under_way(rig)
    rig.controller.cancel(goal)
    rig.controller.cancel(goal)
    code, text = ended(rig, goal)
    assert (code, text) == (GoalCode.CANCELED, "cancelled: target (0.05, 0.03, 0.3) m")
    assert rig.controller.state is IDLE
    assert rig.heights != pytest.approx(MACHINE.inverse(TARGET), abs=1e-4)
    assert rig.cycle().velocities == (0.0, 0.0, 0.0)
    rig.controller.cancel(goal)
    assert ended(rig, pursue(rig)).code is GoalCode.SUCCEEDED


def test_a_cancelled_goal_waits_for_sliders_that_lag(rig):
    goal = under_way(rig)
    rig.controller.cancel(goal)
    rig.offset = 0.001
    rig.cycle_until(IDLE)
    rig.cycle(50)
    assert goal.outcome is None
    rig.offset = 0.0
    assert ended(rig, goal, most=20).code is GoalCode.CANCELED


def test_a_cancelled_goal_whose_sliders_never_arrive_ends_all_the_same(rig):
    goal = under_way(rig)
    rig.controller.cancel(goal)
    rig.offset = 0.001
    assert ended(rig, goal, most=500).code is GoalCode.CANCELED


def test_a_command_that_comes_in_the_stop_of_a_cancelled_goal_is_taken(rig):
    goal = under_way(rig)
    rig.controller.cancel(goal)
    rig.cycle(2)
    newer = pursue(rig, OTHER)
    code, text = ended(rig, goal, most=100)
    assert (code, text) == (GoalCode.CANCELED, f"cancelled: {goal}; then came {newer}")
    assert ended(rig, newer).code is GoalCode.SUCCEEDED


@in_pieces
def test_a_goal_that_waits_is_given_up_and_what_goes_on_goes_on(rig):
    going = under_way(rig)
    waiting = pursue(rig, OTHER)
    rig.controller.cancel(waiting)
    assert waiting.outcome == (
        GoalCode.CANCELED,
        "cancelled before it began: target (-0.05, 0.02, 0.25) m",
    )
    assert ended(rig, going).code is GoalCode.SUCCEEDED


@pytest.mark.parametrize("cancelled", [False, True])
def test_what_ends_the_motion_ends_the_goal_at_once(rig, cancelled):
    def fault():
        rig.controller.measured((rig.heights[0] + 0.04, *rig.heights[1:]), rig.now)

    ends = {
        GoalCode.DISABLED: rig.controller.disable,
        GoalCode.FAULT: fault,
        GoalCode.SHUTDOWN: lambda: rig.controller.end("the node ends"),
    }
    for code, end in ends.items():
        goal = under_way(rig)
        if cancelled:
            rig.controller.cancel(goal)
        end()
        assert goal.outcome is not None
        assert goal.outcome.code is code
        rig.cycle(300)
        if code is not GoalCode.SHUTDOWN:
            rig.controller.enable(rig.now)
            rig.controller.move_to(HOME_POSITION)
            rig.cycle(500)
    assert goal.outcome.text == "the node ends"


HOME_POSITION = MACHINE.forward(HOME)


def test_a_stop_ends_the_goal_at_once_and_refuses_the_next_one(rig):
    goal = under_way(rig)
    rig.controller.stop()
    assert goal.outcome == (GoalCode.STOPPED, "stop was asked for")
    with pytest.raises(CommandRefusedError, match="before the stop is over"):
        pursue(rig)


def test_a_stop_leaves_a_cancelled_goal_cancelled(rig):
    goal = under_way(rig)
    rig.controller.cancel(goal)
    rig.controller.stop()
    assert goal.outcome is None
    assert ended(rig, goal).code is GoalCode.CANCELED


@in_pieces
def test_a_stop_ends_goals_that_wait_too(rig):
    under_way(rig)
    goal = pursue(rig, OTHER)
    rig.controller.stop()
    assert goal.outcome == (GoalCode.STOPPED, "stop was asked for")


def test_a_way_that_is_found_blocked_later_is_refused_with_the_text_that_is_logged():
    # Both ends are just below the end of the travel, and the line between them is above it.
    start = MACHINE.inverse((-0.068, -0.019, 0.522))
    rig = Rig(kind=MotionKind.LINEAR, in_pieces=True, start=start)
    rig.cycle(2)
    rig.controller.set_limits(LIMITS, 0.05)
    before = pursue(rig, (-0.064, -0.015, 0.522))
    rig.cycle(10)
    goal = pursue(rig, (-0.113, -0.067, 0.505))
    code, text = ended(rig, goal)
    assert code is GoalCode.REFUSED
    assert "breaks the upper end of slider travel" in text
    assert rig.refusals == [f"{goal}: {text}"]
    # What went on goes on, though the one who waited was told that there was a newer command.
    assert ended(rig, before).code is GoalCode.SUPERSEDED
    rig.cycle_until(IDLE)
    assert rig.heights == pytest.approx(MACHINE.inverse((-0.064, -0.015, 0.522)), abs=1e-9)


def test_limits_that_change_do_not_end_it(rig):
    goal = under_way(rig)
    rig.controller.set_limits(LIMITS, 0.2)
    rig.cycle(20)
    rig.controller.set_limits(LIMITS, 1.0)
    assert ended(rig, goal).code is GoalCode.SUCCEEDED


def test_an_outcome_is_set_once():
    goal = Move(TARGET)
    goal.end(GoalCode.FAULT, "first")
    goal.end(GoalCode.SUCCEEDED, "second")
    assert goal.outcome == Outcome(GoalCode.FAULT, "first")


def test_whatever_comes_each_goal_has_an_end_and_only_the_last_may_succeed(rig):
    """Goals, cancels, poses, twists, stops and faults in any order."""
    source = random.Random(5)
    goals = []

    def place():
        return (source.uniform(-0.07, 0.07), source.uniform(-0.07, 0.07), source.uniform(0.2, 0.35))

    def recover():
        rig.controller.measured(rig.heights, rig.now)
        rig.controller.enable(rig.now)

    events = [
        lambda: goals.append(pursue(rig, place())),
        lambda: goals.append(pursue(rig, place())),
        lambda: rig.controller.cancel(source.choice(goals)),
        lambda: rig.controller.cancel(goals[-1]),
        lambda: rig.controller.move_to(place()),
        lambda: rig.jog((source.uniform(-0.1, 0.1), 0.0, 0.0)),
        lambda: rig.controller.set_limits(LIMITS, source.uniform(0.2, 1.0)),
        rig.controller.stop,
        rig.controller.disable,
        recover,
        recover,
    ]
    goals.append(pursue(rig))
    for _ in range(150):
        try:
            source.choice(events)()
        except KinematicsError:
            pass
        rig.cycle(source.choice((0, 1, 3, 20, 200)))
        going = [goal for goal in goals if goal.outcome is None]
        assert all(goal in goals[-3:] or goal.is_cancelled for goal in going)
    rig.cycle(1000)
    assert all(goal.outcome is not None for goal in goals)
    codes = {goal.outcome.code for goal in goals}
    assert codes >= {
        GoalCode.SUCCEEDED,
        GoalCode.CANCELED,
        GoalCode.SUPERSEDED,
        GoalCode.STOPPED,
        GoalCode.DISABLED,
    }


def path_that_is_never_made():
    """Return a path whose points do not stop coming."""

    def make(_):
        while True:
            yield

    return Follow.made(make, "endless path")


@in_pieces
def test_a_goal_that_has_superseded_another_comes_to_rest_when_it_is_cancelled(rig):
    going = under_way(rig)
    waiting = rig.controller.pursue(path_that_is_never_made())
    while going.outcome is None:
        rig.cycle(1)
    assert going.outcome.code is GoalCode.SUPERSEDED
    rig.controller.cancel(waiting)
    assert ended(rig, waiting).code is GoalCode.CANCELED
    assert rig.controller.state is not MOVING


@in_pieces
def test_what_is_to_be_replaced_cannot_be_paused_or_resumed(rig):
    rig.controller.pursue(Follow.made(lambda _: line_to(TARGET), "path"))
    rig.cycle(60)
    newer = rig.controller.pursue(path_that_is_never_made())
    for ask in (rig.controller.pause, rig.controller.resume):
        with pytest.raises(CommandRefusedError, match="endless path"):
            ask()
    assert newer.outcome is None


def line_to(position):
    yield
    return PlatformPath.start(MACHINE.forward(HOME)).line_to(position)
