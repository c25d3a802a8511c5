"""What the page says of the machine, in millimetres."""

from __future__ import annotations

import math

import pytest
from strategies import DEFAULT_LIMITS

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import PAUSED, Cause, OperatingState
from tri_glide_kinematics.panel.words import (
    CAUSES,
    COLORS,
    FAULT,
    READY,
    REFUSALS,
    WARNING,
    MachineStatus,
    clock_text,
    outside_text,
)
from tri_glide_kinematics.settings import IK_NODE
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace

VALUES = {parameter.name: parameter.default for parameter in IK_NODE}
WORKSPACE = Workspace(TriGlide(DEFAULT_GEOMETRY), DEFAULT_LIMITS)


def told(**values: object) -> MachineState:
    """Return a message about a machine in motion along a path."""
    message = MachineState(
        state=MachineState.MOVING,
        cause=MachineState.CAUSE_COMMAND,
        target_kind=MachineState.TARGET_PATH,
        speed=0.0123,
        segment=4,
        way_remaining=0.1245,
        time_remaining=71.2,
        speed_scale=1.0,
        path_speed_scale=1.0,
    )
    message.target.x, message.target.y, message.target.z = 0.03, -0.02, 0.3
    message.position.x, message.position.y, message.position.z = 0.0123456, -0.02, 0.25
    for name, value in values.items():
        setattr(message, name, value)
    return message


def test_each_state_cause_and_refusal_has_its_words() -> None:
    assert set(COLORS) == set(OperatingState)
    assert set(CAUSES) == set(Cause)
    numbers = {
        getattr(MachineState, name)
        for name in dir(type(MachineState)) + dir(MachineState)
        if name.startswith("REFUSAL_")
    }
    assert set(REFUSALS) == numbers - {MachineState.REFUSAL_NONE, MachineState.REFUSAL_OTHER}


@pytest.mark.parametrize(
    ("state", "color"),
    [
        (MachineState.IDLE, READY),
        (MachineState.FAULT, FAULT),
        (MachineState.DISABLED, WARNING),
        (0, WARNING),
        (200, WARNING),
    ],
)
def test_colours(state: int, color: str) -> None:
    assert MachineStatus(MachineState(state=state)).color == color


def test_no_cause_tells_metres() -> None:
    for cause in Cause:
        words = MachineStatus(told(cause=int(cause), target_distance=0.0005)).reason(VALUES)
        assert words
        assert "{" not in words
        assert not [word for word in words.split() if word.strip(";,") == "m"]


def test_lengths_are_those_of_the_page() -> None:
    status = MachineStatus(told())
    assert status.reason(VALUES) == "path to (30, -20, 300) mm"
    far = told(cause=MachineState.CAUSE_TARGET_NOT_REACHED, target_distance=0.0025)
    bound = 1000.0 * VALUES["position_tolerance"]
    words = f"measured 2.5 mm from the target, more than {bound:g} mm"
    assert MachineStatus(far).reason(VALUES) == words


def test_where_the_machine_is_and_what_is_left() -> None:
    status = MachineStatus(told())
    assert status.position == "X 12.35  Y −20.00  Z 250.00  mm"
    assert status.speed == "12.3 mm/s"
    assert status.left == "segment 5 · 124.5 mm · 1:12 left of this path"
    slow = MachineStatus(told(speed_scale=0.4, path_speed_scale=1.5))
    assert slow.speed == "12.3 mm/s · speed 40 % · F 150 %"


def test_the_teach_mode_and_the_speed_limit_are_told() -> None:
    assert MachineStatus(told()).speed_limit == ""
    assert MachineStatus(told(platform_speed_limit=0.4)).speed_limit == "at most 400 mm/s"
    # It is switched on, and the motion of before is still faster.
    for limit in (0.0, 0.4):
        slowing = told(teach_mode=True, platform_speed_limit=limit)
        assert MachineStatus(slowing).speed_limit == "teach mode · slows down"
    for limit, words in ((0.25, "250"), (0.1, "100")):
        slow = told(teach_mode=True, platform_speed_limit=limit)
        assert MachineStatus(slow).speed_limit == f"teach mode · at most {words} mm/s"
    assert MachineStatus(MachineState(teach_mode=True)).speed_limit == ""


def test_what_is_not_known_is_not_told() -> None:
    message = told(speed=math.nan, way_remaining=math.nan, time_remaining=math.nan)
    message.position.x = math.nan
    status = MachineStatus(message)
    assert (status.position, status.speed, status.left) == ("", "", "")


def test_a_remark_stands_behind_the_reason() -> None:
    status = MachineStatus(
        MachineState(
            state=MachineState.PAUSED,
            cause=MachineState.CAUSE_PAUSE_ASKED,
            reason="rests at 0.3 m",
            remark="two of them",
        )
    )
    assert status.reason(VALUES) == "pause was asked for; two of them"
    assert (status.state, status.cause, status.word) == (PAUSED, Cause.PAUSE_ASKED, "paused")


@pytest.mark.parametrize("message", [MachineState(), MachineState(state=200, cause=200)])
def test_a_message_without_values_means_nothing(message: MachineState) -> None:
    status = MachineStatus(message)
    assert (status.state, status.cause, status.word, status.reason({})) == (None, None, "", "")
    assert (status.position, status.speed, status.left) == ("", "", "")


def test_a_refusal_names_the_number_and_the_bound() -> None:
    words = outside_text(WORKSPACE, (0.9, 0.0, 0.3))
    assert words is not None
    assert words.startswith("(900, 0, 300) mm is outside the workspace: ")
    assert words.endswith(" mm")
    assert outside_text(WORKSPACE, (0.0, 0.0, 0.25)) is None


def test_durations() -> None:
    assert [clock_text(each) for each in (0.2, 60.0, 3661.0)] == ["0:01", "1:00", "1:01:01"]
