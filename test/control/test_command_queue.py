"""Commands come to the engine one in a cycle, and what the engine says comes back."""

from __future__ import annotations

from tri_glide_kinematics.control import (
    Cause,
    CommandQueue,
    InPositionBounds,
    NewestTarget,
    Streams,
)
from tri_glide_kinematics.motion import (
    MotionEngine,
    MotionKind,
    MotionPhase,
    NoRoomError,
    SliderLimits,
)
from tri_glide_kinematics.motion.engine import Follow, GoalCode, Jog, Move, Track
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

PERIOD = 0.002
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
TARGET = (0.05, 0.03, 0.3)
RELEASED = Jog((0.0, 0.0, 0.0))
TOP = (0.9, 0.9, 0.9)


def commands_at(heights, in_pieces=False, kind=MotionKind.SLIDER):
    workspace = Workspace(
        TriGlide(DEFAULT_GEOMETRY), WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
    )
    engine = MotionEngine(workspace, LIMITS, kind=kind, in_pieces=in_pieces)
    engine.start(heights)
    newest = NewestTarget(InPositionBounds(0.0005, 0.02, 0.5, 0.005))
    return CommandQueue(engine, PERIOD, Streams.with_timeouts(0.1, 0.5), newest), engine


def test_a_target_waits_while_limits_have_their_turn():
    commands, engine = commands_at((0.6, 0.6, 0.6))
    commands.put_limits(LIMITS, 0.5, 1.0)
    assert commands.carry_out(moving=False) is None
    target = Move(TARGET)
    commands.put(target)
    assert commands.carry_out(moving=False) is None
    assert commands.target is target
    commands.step()
    commands.next_cycle(0.0)
    done = commands.carry_out(moving=False)
    assert done is not None and done.command is target
    assert engine.target == TARGET and engine.speed_scale == 0.5


def test_the_same_limits_again_take_no_turn():
    commands, _ = commands_at((0.6, 0.6, 0.6))
    commands.put_limits(LIMITS, 1.0, 1.0)
    commands.put(Move(TARGET))
    assert commands.carry_out(moving=False) is not None


def test_only_a_waiting_twist_is_dropped_with_twists():
    commands, _ = commands_at((0.6, 0.6, 0.6))
    target = Move(TARGET)
    commands.put(target)
    commands.drop_stream(RELEASED)
    assert commands.target is target
    commands.put(Jog((0.0, 0.0, 0.1), received=0.0))
    commands.drop_stream(RELEASED)
    assert commands.target is None


def test_a_jog_without_room_is_held_and_a_move_goes_on():
    outwards = Jog((0.0, 0.0, 0.1), received=0.0)
    commands, engine = commands_at(TOP)
    commands.put(outwards)
    done = commands.carry_out(moving=False)
    assert done is not None and done.reason.cause is Cause.EDGE
    commands, engine = commands_at(TOP)
    outwards = Jog((0.0, 0.0, 0.1), received=0.0)
    commands.put(outwards)
    refused = commands.carry_out(moving=True)
    assert refused is not None and isinstance(refused.refusal, NoRoomError)
    assert outwards.outcome == (GoalCode.REFUSED, str(refused.refusal))
    assert engine.phase is MotionPhase.IDLE


def test_a_path_that_is_still_made_is_not_taken_while_a_newer_command_waits():
    commands, engine = commands_at((0.6, 0.6, 0.6))

    def make(_):
        while True:
            yield

    path, target = Follow.made(make, "endless path"), Move(TARGET)
    commands.put(path)
    assert commands.carry_out(moving=False, may_go_on=lambda: False) is None
    commands.put(target)
    assert commands.decided(moving=False) is None and path.outcome is None
    commands.next_cycle(0.0)
    done = commands.carry_out(moving=False)
    assert done is not None and done.command is target and engine.target == TARGET
    assert path.outcome == (GoalCode.SUPERSEDED, f"superseded by {target}")


def test_a_report_of_a_target_never_waits_for_a_step_that_is_prepared():
    commands, engine = commands_at((0.6, 0.6, 0.6), in_pieces=True)
    engine.set_shaper(Shaper.of(ShaperKind.EI, Mode(15.0, 0.03)))
    prepared = 0
    for cycle in range(100):
        report = Track(TARGET, (0.0, 0.0, 0.0), seen=cycle * PERIOD)
        prepared += engine.preparing
        commands.put(report)
        commands.next_cycle(cycle * PERIOD)
        done = commands.carry_out(moving=False, may_go_on=lambda: False)
        assert done is not None and done.command is report
        commands.step()
    assert engine.phase is MotionPhase.TRACKING
    assert prepared > 10


def test_no_command_waits_for_a_plan_that_is_sooner_at_the_end_of_a_line():
    for newer in (Move((0.0, 0.0, 0.25)), None):
        commands, engine = commands_at((0.6, 0.6, 0.6), in_pieces=True, kind=MotionKind.LINEAR)
        commands.put(Move(TARGET))
        commands.next_cycle(0.0)
        while commands.carry_out(moving=False, may_go_on=lambda: False) is None:
            commands.step()
            commands.next_cycle(0.0)
        commands.step()
        while not engine.preparing:
            commands.step()
        assert engine.phase is MotionPhase.MOVING
        if newer:
            commands.put(newer)
        else:
            commands.put_limits(LIMITS, 0.5, 1.0)
        # Two commands of one kind are some cycles apart in any case.
        for _ in range(4):
            commands.next_cycle(0.0)
            commands.carry_out(moving=True, may_go_on=lambda: False)
            commands.step()
        if newer:
            assert engine.preparing_goal
        else:
            assert engine.limits_pending or engine.speed_scale == 0.5
