"""The whole cell in virtual time: controller and picker, and a belt that does what it likes."""

import math
from collections import Counter

import pytest

from testing.pick_cell import LOW, SETTINGS, Cell
from tri_glide_kinematics.picking import PartOutcome, Places, SimulatedBelt, laid_parts

ALONG = (1.0, 0.0, 0.0)


def cell_of(speed, count, changes=(), spacing=0.25, **how):
    """Return a cell that picks parts from a belt at a ``speed`` [m/s]."""
    belt = SimulatedBelt(ALONG, speed, changes)
    parts = laid_parts(belt, count, spacing, first=(-0.5, 0.08, LOW))
    cell = Cell(belt, parts, **how)
    cell.picker.run()
    return cell


def outcomes(cell):
    """Return how many parts had each outcome; each of them has one."""
    numbers = [event.part.number for event in cell.outcomes]
    assert len(numbers) == len(set(numbers))
    return Counter(event.part.outcome for event in cell.outcomes)


@pytest.mark.parametrize(("speed", "delay", "latency"), [(0.05, 0.01, 0.15), (0.3, 0.06, 0.0)])
def test_at_a_constant_speed_the_gripper_is_on_the_part(speed, delay, latency):
    cell = cell_of(speed, 2, spacing=1.7 * speed, drive_delay=delay, latency=latency)
    cell.run_until(lambda cell: len(cell.outcomes) == 2, 40.0)
    assert outcomes(cell) == {PartOutcome.PLACED: 2}
    assert max(cell.errors()) < 2e-5
    assert cell.lowest > LOW - 1e-6
    # What the picker says of it is what truly is.
    told = [event.error for event in cell.outcomes]
    assert told == pytest.approx(cell.errors(), abs=2e-5)


def test_a_change_of_speed_just_before_the_grip_is_caught_up_with():
    """The platform stays at the part for somewhat longer: the way down needs all jerk itself."""
    grip = cell_of(0.1, 1, drive_delay=0.01).run_until(lambda cell: bool(cell.outcomes), 20.0)
    for before in (0.095, 0.11, 0.13, 0.16):
        changes = ((grip.gripper.grips[0].time - before, 0.3, 0.2),)
        cell = cell_of(0.1, 1, changes, drive_delay=0.01)
        cell.run_until(lambda cell: bool(cell.outcomes), 20.0)
        assert outcomes(cell) == {PartOutcome.PLACED: 1}
        assert max(cell.errors()) < 1e-3, before


def test_a_belt_that_stops_and_reverses_ends_no_part_twice_and_nothing_below_the_parts():
    changes = [(6.0, 0.0, 5.0), (7.0, 0.1, 5.0), (8.3, -0.1, 5.0), (9.0, 0.15, 5.0)]
    cell = cell_of(0.15, 5, changes, spacing=0.2)
    cell.run_until(lambda cell: len(cell.outcomes) == 5, 40.0)
    assert sum(outcomes(cell).values()) == 5
    assert cell.lowest > LOW - 1e-6
    assert max(cell.errors(), default=0.0) < 5e-3


def test_a_silent_encoder_is_no_pick():
    cell = cell_of(0.15, 1, silences=[(2.0, math.inf)])
    cell.run_until(lambda cell: bool(cell.outcomes), 8.0)
    assert not cell.gripper.grips
    assert cell.lowest > LOW - 1e-6


@pytest.mark.parametrize("seconds", [0.0, 0.25, 0.45, 0.6, 0.9])
@pytest.mark.parametrize("end", ["stop", "disable", "fail"])
def test_whatever_ends_a_run_each_part_has_one_outcome_and_nothing_begins_again(end, seconds):
    cell = cell_of(0.15, 3)
    cell.run_until(lambda cell: cell.controller.transfer_progress is not None, 20.0)
    cell.cycle(round(seconds / 0.002))
    held = cell.gripper.held
    if end == "fail":
        cell.controller.fail(RuntimeError("for a test"))
    else:
        getattr(cell.controller, end)()
    cell.cycle(500)
    heights = cell.heights
    cell.cycle(2000)
    assert cell.heights == heights
    assert not cell.picker.is_running
    assert cell.gripper.held is held
    assert PartOutcome.PLACED not in outcomes(cell)
    assert sum(outcomes(cell).values()) <= 3


def test_full_places_end_the_run_in_the_last_one():
    places = Places([(0.0, -0.1, LOW), (0.05, -0.1, LOW)])
    cell = cell_of(0.1, 4, spacing=0.16, places=places, settings=SETTINGS)
    cell.run_until(lambda cell: not cell.picker.is_running, 40.0).cycle(50)
    assert outcomes(cell)[PartOutcome.PLACED] == 2
    assert cell.picker.text == "all places are full"
    cell.picker.run()
    assert not places.is_full
    where = [part.placed for part in cell.parts if part.placed is not None]
    assert sorted(where) == [pytest.approx((0.0, -0.1, LOW)), pytest.approx((0.05, -0.1, LOW))]
