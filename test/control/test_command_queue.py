"""Commands come to the engine one in a cycle, and what the engine says comes back."""

from controller_rig import (
    HOME,
    IN_POSITION,
    LIMITS,
    PERIOD,
    TARGET,
    TARGET_TIMEOUT,
    TWIST_TIMEOUT,
    UPPER,
    engine,
)

from tri_glide_kinematics.control import Cause, CommandQueue, NewestTarget, Reason, Streams
from tri_glide_kinematics.motion import MotionKind, MotionPhase, NoRoomError
from tri_glide_kinematics.motion.engine import Follow, GoalCode, Jog, Move, Track
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind


def commands_at(heights, in_pieces=False, kind=MotionKind.SLIDER, newest=None):
    moving = engine(kind, in_pieces)
    moving.start(heights)
    streams = Streams.with_timeouts(TWIST_TIMEOUT, TARGET_TIMEOUT)
    return CommandQueue(moving, PERIOD, streams, newest or NewestTarget(IN_POSITION)), moving


def test_the_same_limits_again_take_no_turn():
    commands, _ = commands_at(HOME)
    commands.put_limits(LIMITS, 1.0, 1.0)
    commands.put(Move(TARGET))
    assert commands.carry_out(moving=False) is not None


def test_a_jog_without_room_is_held_and_a_move_goes_on():
    outwards = Jog((0.0, 0.0, 0.1), received=0.0)
    commands, moving = commands_at(UPPER)
    commands.put(outwards)
    done = commands.carry_out(moving=False)
    assert done is not None and done.reason.cause is Cause.EDGE
    commands, moving = commands_at(UPPER)
    outwards = Jog((0.0, 0.0, 0.1), received=0.0)
    commands.put(outwards)
    refused = commands.carry_out(moving=True)
    assert refused is not None and isinstance(refused.refusal, NoRoomError)
    assert outwards.outcome == (GoalCode.REFUSED, str(refused.refusal))
    assert moving.phase is MotionPhase.IDLE


def test_a_path_that_is_still_made_is_not_taken_while_a_newer_command_waits():
    commands, moving = commands_at(HOME)

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
    assert done is not None and done.command is target and moving.target == TARGET
    assert path.outcome == (GoalCode.SUPERSEDED, f"superseded by {target}")


def test_a_report_of_a_target_never_waits_for_a_step_that_is_prepared():
    commands, moving = commands_at(HOME, in_pieces=True)
    moving.set_shaper(Shaper.of(ShaperKind.EI, Mode(15.0, 0.03)))
    prepared = 0
    for cycle in range(100):
        report = Track(TARGET, (0.0, 0.0, 0.0), seen=cycle * PERIOD)
        prepared += moving.preparing
        commands.put(report)
        commands.next_cycle(cycle * PERIOD)
        done = commands.carry_out(moving=False, may_go_on=lambda: False)
        assert done is not None and done.command is report
        commands.step()
    assert moving.phase is MotionPhase.TRACKING
    assert prepared > 10


def test_no_command_waits_for_a_plan_that_is_sooner_at_the_end_of_a_line():
    for newer in (Move((0.0, 0.0, 0.25)), None):
        commands, moving = commands_at(HOME, in_pieces=True, kind=MotionKind.LINEAR)
        commands.put(Move(TARGET))
        commands.next_cycle(0.0)
        while commands.carry_out(moving=False, may_go_on=lambda: False) is None:
            commands.step()
            commands.next_cycle(0.0)
        commands.step()
        while not moving.preparing:
            commands.step()
        assert moving.phase is MotionPhase.MOVING
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
            assert moving.preparing_goal
        else:
            assert moving.limits_pending or moving.speed_scale == 0.5


def test_who_waits_is_not_told_of_a_newer_command_that_is_gone_in_time():
    newest = NewestTarget(IN_POSITION)
    commands, _ = commands_at(HOME, newest=newest)
    first, second = Move(TARGET), Move((-0.05, 0.02, 0.25))
    newest.take(first, Reason(Cause.COMMAND, "first"))
    commands.put(second)
    commands.next_cycle(0.0)
    assert commands.withdraw(second) and not commands.withdraw(second)
    for _ in range(5):
        commands.next_cycle(0.0)
    assert first.outcome is None
