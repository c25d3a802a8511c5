"""Commands come to the engine one in a cycle, and what the engine says comes back."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.control import (
    Cause,
    CommandQueue,
    Streams,
    TargetPosition,
    TargetVelocity,
)
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, NoRoomError, SliderLimits
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

PERIOD = 0.002
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
TARGET = TargetPosition((0.05, 0.03, 0.3))
TOP = (0.9, 0.9, 0.9)


def commands_at(heights):
    workspace = Workspace(
        TriGlide(DEFAULT_GEOMETRY), WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 6.0)
    )
    engine = MotionEngine(workspace, LIMITS)
    engine.start(heights)
    return CommandQueue(engine, PERIOD, Streams.with_timeouts(0.1, 0.5)), engine


def test_a_target_waits_while_limits_have_their_turn():
    commands, engine = commands_at((0.6, 0.6, 0.6))
    commands.put_limits(LIMITS, 0.5)
    assert commands.carry_out(moving=False) is None
    commands.put(TARGET)
    assert commands.carry_out(moving=False) is None
    assert commands.target is TARGET
    commands.step()
    commands.next_cycle(0.0)
    done = commands.carry_out(moving=False)
    assert done is not None and done.target is TARGET
    assert engine.target == TARGET.position and engine.speed_scale == 0.5


def test_the_same_limits_again_take_no_turn():
    commands, _ = commands_at((0.6, 0.6, 0.6))
    commands.put_limits(LIMITS, 1.0)
    commands.put(TARGET)
    assert commands.carry_out(moving=False) is not None


def test_only_a_waiting_twist_is_dropped_with_twists():
    commands, _ = commands_at((0.6, 0.6, 0.6))
    commands.put(TARGET)
    commands.drop_twist()
    assert commands.target is TARGET
    commands.put(TargetVelocity((0.0, 0.0, 0.1), 0.0, 0.0))
    commands.drop_twist()
    assert commands.target is None


def test_a_jog_without_room_is_held_and_a_move_goes_on():
    outwards = TargetVelocity((0.0, 0.0, 0.1), 0.0, 0.0)
    commands, engine = commands_at(TOP)
    commands.put(outwards)
    done = commands.carry_out(moving=False)
    assert done is not None and done.reason.cause is Cause.EDGE
    commands, engine = commands_at(TOP)
    commands.put(outwards)
    with pytest.raises(NoRoomError):
        commands.carry_out(moving=True)
    assert engine.phase is MotionPhase.IDLE
