"""The message about the machine: its numbers are those of the package and of its page."""

import inspect
import math
import re

import pytest
from documents import ROOT, text
from rclpy.clock import Clock

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics import control, tri_glide, workspace
from tri_glide_kinematics.control import (
    FAULT,
    IDLE,
    Cause,
    CommandRefusedError,
    ControllerStatus,
    MotionProgress,
    OperatingState,
    Reason,
)
from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, Refusal
from tri_glide_kinematics.motion import path, trajectory
from tri_glide_kinematics.motion.engine import TargetKind
from tri_glide_kinematics.reason_log import RefusalLog
from tri_glide_kinematics.ros.outputs import cause_of, state_of
from tri_glide_kinematics.ros.outputs.machine_state import machine_state

PAGE = ROOT / "docs" / "machine_state.md"
PREFIXES = {"CAUSE_": Cause, "REFUSAL_": Refusal, "TARGET_": TargetKind}
CONSTANTS = {
    name: value
    for name, value in inspect.getmembers(MachineState)
    if name.isupper() and isinstance(value, int)
}
STATES = {name: value for name, value in CONSTANTS.items() if not name.startswith(tuple(PREFIXES))}


def told(status, refused=None, remark="", progress=None):
    refused = refused or RefusalLog(lambda text: None, 1)
    return machine_state(status, progress or MotionProgress(), refused, remark, "base", Clock())


@pytest.mark.parametrize("prefix", PREFIXES)
def test_the_numbers_of_the_message_are_those_of_the_package(prefix):
    listed = {name: value for name, value in CONSTANTS.items() if name.startswith(prefix)}
    if prefix == "TARGET_":
        assert listed.pop("TARGET_NONE") == 0
    assert listed == {f"{prefix}{each.name}": each.value for each in PREFIXES[prefix]}


def test_each_state_has_a_number_of_its_own_and_zero_is_none():
    assert set(STATES) == {state.name for state in OperatingState}
    assert len(set(STATES.values())) == len(STATES)
    assert 0 not in STATES.values()
    for state in OperatingState:
        message = told(ControllerStatus(state, Reason(Cause.COMMAND, ""), "", False, False))
        assert state_of(message) is state


def test_the_page_has_each_state_cause_target_and_refusal_once():
    rows = re.findall(r"^\| `([A-Z_]+)` \|", text(PAGE), re.MULTILINE)
    assert sorted(rows) == sorted(CONSTANTS)


def test_a_number_of_a_newer_node_is_not_known():
    assert state_of(MachineState(state=200)) is None
    assert cause_of(MachineState(cause=200)) is None
    assert state_of(MachineState()) is None


def test_all_that_is_known_is_told():
    refused = RefusalLog(lambda text: None, 1)
    refused.refuse("refused a target pose: nan", NotFiniteError("x", math.nan).refusal)
    status = ControllerStatus(
        FAULT,
        Reason(Cause.TARGET_TOO_FAR, "too far"),
        "target",
        target_missed=True,
        held_at_edge=False,
        target_distance=0.01,
        target_kind=TargetKind.POSITION,
        target_position=(0.1, 0.2, 0.3),
        leads=True,
        speed_scale=0.5,
        path_speed_scale=1.5,
        shaper_waits=True,
        is_teaching=True,
        platform_speed_limit=0.25,
        stops=7,
    )
    progress = MotionProgress((0.4, 0.5, 0.6), 0.07, 3, 0.8, 9.0)
    message = told(status, refused, "two senders", progress)
    assert (message.state, message.cause) == (MachineState.FAULT, MachineState.CAUSE_TARGET_TOO_FAR)
    assert (message.reason, message.target_text, message.remark) == (
        "too far",
        "target",
        "two senders",
    )
    assert (message.target_kind, message.target_distance) == (MachineState.TARGET_POSITION, 0.01)
    assert (message.target.x, message.target.y, message.target.z) == (0.1, 0.2, 0.3)
    assert math.isnan(message.target_velocity.x)
    assert message.sends_setpoints and not message.target_reached
    assert message.speed_scale == 0.5 and message.shaper_waits
    assert message.path_speed_scale == 1.5
    assert message.teach_mode and message.platform_speed_limit == 0.25
    assert message.stops == 7
    assert (message.position.x, message.position.y, message.position.z) == (0.4, 0.5, 0.6)
    assert (message.speed, message.segment) == (0.07, 3)
    assert (message.way_remaining, message.time_remaining) == (0.8, 9.0)
    assert (message.refused, message.refusal) == (1, MachineState.REFUSAL_NOT_FINITE)
    assert message.refusal_text == "refused a target pose: nan"
    assert message.header.frame_id == "base" and message.header.stamp.sec > 0


def test_what_is_not_known_is_nan_or_none():
    message = told(ControllerStatus(IDLE, Reason(Cause.MEASUREMENT, ""), "", False, False))
    assert message.target_kind == MachineState.TARGET_NONE
    assert all(math.isnan(part) for part in (message.target.x, message.target_distance))
    assert message.refusal == MachineState.REFUSAL_NONE
    assert message.platform_speed_limit == 0.0
    unknown = (message.position.y, message.speed, message.way_remaining, message.time_remaining)
    assert all(map(math.isnan, unknown))


def test_each_error_of_a_command_has_a_refusal():
    """A command that is refused for it is refused for a reason that programs know."""
    rooms = (path, trajectory, tri_glide, workspace, control)
    exported = [getattr(room, name) for room in rooms for name in room.__all__]
    classes = [each for each in exported if inspect.isclass(each)]
    kinds = {each for each in classes if issubclass(each, KinematicsError)}
    assert len(kinds) > 20
    # No command has a geometry, or is refused for a state that must not follow another one.
    # A CommandRefusedError is given its refusal when it is made.
    others = {KinematicsError, CommandRefusedError, control.ForbiddenTransitionError}
    geometry = tri_glide.GeometryError
    without = {kind for kind in kinds - others if kind.refusal is Refusal.OTHER}
    assert all(issubclass(kind, geometry) for kind in without), without
