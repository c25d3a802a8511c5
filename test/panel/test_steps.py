"""Where a step leads to when others, or something else, came before it."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.control import IDLE, MOVING, OperatingState
from tri_glide_kinematics.panel.machine import STEP_PATIENCE, Steps

UP = (0.0, 0.0, 0.01)
OWN = (IDLE, MOVING)
HERE, ON_THE_WAY = (0.0, 0.0, 0.25), (0.0, 0.0, 0.253)


@pytest.fixture
def steps() -> Steps:
    """Return what knows of one step that was sent from HERE at 10 s."""
    steps = Steps()
    assert steps.go_on(UP, HERE, IDLE, is_on_way=False, now=10.0) == (0.0, 0.0, 0.26)
    return steps


def second(
    steps: Steps,
    state: OperatingState | None = MOVING,
    *,
    is_on_way: bool = True,
    now: float = 12.0,
) -> float:
    """Return the height of the target of another step, from ON_THE_WAY [m]."""
    target = steps.go_on(UP, ON_THE_WAY, state, is_on_way=is_on_way, now=now)
    assert target is not None
    return target[2]


def test_steps_add_up_while_the_machine_moves(steps: Steps) -> None:
    assert second(steps) == pytest.approx(0.27)
    assert second(steps, now=13.0) == pytest.approx(0.28)


@pytest.mark.parametrize(("patience", "height"), [(0.9, 0.27), (1.1, 0.263)])
def test_one_that_is_not_seen_yet_counts_for_some_time(
    steps: Steps, patience: float, height: float
) -> None:
    assert second(steps, IDLE, now=10.0 + patience * STEP_PATIENCE) == pytest.approx(height)


@pytest.mark.parametrize("state", [None, *OperatingState])
def test_a_state_in_between_drops_it_but_for_its_own_motion_and_its_end(
    steps: Steps, state: OperatingState | None
) -> None:
    steps.look(state)
    now, height = (12.0, 0.27) if state in OWN else (10.1, 0.263)
    assert second(steps, now=now) == pytest.approx(height)


def test_a_goal_that_has_ended_drops_it(steps: Steps) -> None:
    # As that of another sender has replaced it: the machine moves all the time.
    assert second(steps, is_on_way=False, now=10.1) == pytest.approx(0.263)


def test_a_stop_drops_it(steps: Steps) -> None:
    steps.drop()
    assert second(steps, now=10.1) == pytest.approx(0.263)


def test_without_a_place_there_is_no_step() -> None:
    assert Steps().go_on(UP, None, IDLE, is_on_way=False, now=0.0) is None
