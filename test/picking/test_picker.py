"""Each part has one outcome, whatever happens to a machine that is where it has to be."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from tri_glide_kinematics.motion.engine import GoalCode, Station, Transfer
from tri_glide_kinematics.picking import (
    BeltMotion,
    CycleTimes,
    GivingUp,
    GripperClosedError,
    Machine,
    PartOutcome,
    Parts,
    Picker,
    PickOrder,
    PickSettings,
    Places,
    Readings,
    Renewal,
    RunEnd,
    SimulatedBelt,
    SimulatedCamera,
    SimulatedEncoder,
    SimulatedGripper,
    grid,
    laid_parts,
)
from tri_glide_kinematics.vectors import plus

ALONG = (0.6, -0.8, 0.0)
POINT = (0.01, 0.0, -0.05)
SETTINGS = PickSettings(0.1, point=POINT, waiting=(0.0, 0.0, 0.1))
TRAVEL, STEP = 0.3, 0.002


class IdealMachine:
    """Is at each station when it is to be, one transfer after the other."""

    def __init__(self) -> None:
        self.machine = Machine((0.0, 0.0, 0.1))
        self.before = self.transfer = None
        # When it takes commands again, which it does not while it brakes.
        self.rests = math.inf
        # Of the present transfer; of all: arrivals, stations, and as of when these are.
        self.arrivals: list[float] = []
        self.visits: list[tuple[float, Station, float]] = []
        self.outputs: list[tuple[float, bool]] = []

    def take(self, task: Transfer | Renewal | GivingUp | None, now: float) -> None:
        if isinstance(task, Transfer):
            time = max(now + 0.05, task.leave_at, *self.arrivals[-1:])
            self.before, self.transfer, self.arrivals = self.transfer, task, []
            for station in task.stations:
                time += TRAVEL
                self.arrivals.append(time)
                self.visits.append((time, station, task.seen))
                self.outputs += [(time + after, told) for after, told in station.outputs]
                time += station.dwell
        elif isinstance(task, Renewal):
            self.visits[-2] = (self.arrivals[0], *task)
        elif isinstance(task, GivingUp):
            self.end(GoalCode.CANCELED, task.reason)
            self.machine, self.rests = self.machine._replace(accepts=False), now + 0.1

    def end(self, code: GoalCode, text: str) -> None:
        self.transfer.end(code, text)
        self.outputs.clear()

    def look(self, now: float) -> Machine:
        if now > self.rests:
            self.machine, self.rests = self.machine._replace(accepts=True), math.inf
        passed = [told for time, told in self.outputs if time <= now]
        self.outputs = [each for each in self.outputs if each[0] > now]
        position = self.machine.position
        for time, station, seen in self.visits:
            if time <= now:
                position = station.after(now - seen).position
        goes_on = self.transfer is not None and self.transfer.outcome is None
        if goes_on and now > self.arrivals[-1] + 0.05:
            self.transfer.end(GoalCode.SUCCEEDED, "")
        arrivals = tuple(time - now for time in self.arrivals) if goes_on else ()
        return self.machine._replace(position=position, arrivals=arrivals, passed=passed)


class Cell:
    """A belt with parts, an encoder, a camera, a gripper, and what picks."""

    def __init__(self, *changes, places=None, jumps=(), silences=(), **gripper) -> None:
        self.belt = SimulatedBelt(ALONG, 0.2, changes)
        self.parts = laid_parts(self.belt, 6, 0.12, first=(-0.3, 0.4, 0.0), width=0.1)
        self.gripper = SimulatedGripper(self.belt, self.parts, **gripper)
        readings = Readings(100.0, 0.005, 0.003)
        self.encoder = SimulatedEncoder(self.belt, readings, 5e-5, jumps=jumps, silences=silences)
        view = (-0.6, -0.2)
        self.camera = SimulatedCamera("", self.belt, self.parts, view, Readings(30.0, 0.15))
        cycle = CycleTimes(TRAVEL + 0.05, TRAVEL + 0.07)
        order = PickOrder(ALONG, (-0.12, 0.12), lambda *_: cycle)
        self.places = places or Places([(0.0, 0.2, 0.0)], is_fixed=True)
        parts = Parts(ALONG)
        self.picker = Picker(BeltMotion(5e-5), parts, order, self.places, SETTINGS)
        self.machine, self.now, self.holds = IdealMachine(), 0.0, None
        self.tasks: list[object] = []

    def run(self, is_over: Callable[[Cell], bool]) -> Cell:
        while not is_over(self):
            self.now += STEP
            assert self.now < 100.0
            for report in self.encoder.take(self.now):
                self.picker.report(*report)
            for sighting in self.camera.take(self.now):
                self.picker.see(sighting)
            state = self.machine.look(self.now)
            for closes in state.passed:
                self.gripper.order(closes, self.now)
            self.holds = self.gripper.step(self.now, plus(state.position, POINT))
            task = self.picker.step(self.now, state._replace(holds=self.holds))
            self.machine.take(task, self.now)
            if isinstance(task, Renewal):
                self.picker.renewed(task)
            elif task is not None:
                self.tasks.append(task)
        return self

    def outcomes(self) -> list[PartOutcome]:
        """The outcomes of all parts that have ended, each of which ended once."""
        parts = [event.part for event in self.picker.events]
        assert len({part.number for part in parts}) == len(parts)
        return [part.outcome for part in parts]


def has_ended(cell: Cell) -> bool:
    return not cell.picker.is_running


def started(*changes, **cell) -> Cell:
    cell = Cell(*changes, **cell)
    cell.picker.run()
    return cell


def test_parts_are_placed_in_their_places_from_a_belt_that_changes_its_speed():
    changes = [(2.0, 0.1, 0.2), (4.0, 0.25, 0.2), (6.0, -0.1, 0.2), (7.5, 0.15, 0.2)]
    tray = grid((0.2, 0.2, 0.0), (2, 3), ((0.05, 0.0, 0.0), (0.0, 0.03, 0.0)))
    cell = started(*changes, places=Places(tray)).run(has_ended)
    assert cell.outcomes() == [PartOutcome.PLACED] * 6
    assert cell.picker.end is RunEnd.PLACES_FULL
    for part, place in zip(cell.parts, tray):
        assert math.dist(part.placed, place) < 1e-9
    for grip, event in zip(cell.gripper.grips, cell.picker.events):
        assert math.hypot(*grip.error) < 0.001
        assert event.error == pytest.approx(math.hypot(*grip.error), abs=1e-4)
        assert event.gripped == pytest.approx(grip.time, abs=2.0 * STEP)


def stopped(cell: Cell) -> None:
    cell.machine.machine = cell.machine.machine._replace(stops=1)
    cell.machine.end(GoalCode.STOPPED, "stop was asked for")


def disabled(cell: Cell) -> None:
    cell.machine.machine = cell.machine.machine._replace(accepts=False)
    cell.machine.end(GoalCode.DISABLED, "disabled by request")


def taken_over(cell: Cell) -> None:
    cell.machine.end(GoalCode.SUPERSEDED, "superseded by a jog")


@pytest.mark.parametrize("happens", [stopped, disabled, taken_over])
@pytest.mark.parametrize("time", [1.5, 1.8, 1.88, 1.94, 2.05, 2.2])
def test_whatever_ends_a_transfer_gives_one_outcome_and_nothing_begins_again(happens, time):
    """On the way to a part, at it, with it in the gripper, and when the next one is begun too."""
    cell = started().run(lambda cell: cell.now > time)
    held, orders = cell.gripper.held, len(cell.gripper.grips)
    on_the_way = [cycle.part for cycle in cell.picker._cycles]
    tasks = len(cell.tasks)
    happens(cell)
    cell.run(lambda cell: cell.now > time + 0.3)
    assert not cell.picker.is_running
    assert len(cell.tasks) == tasks
    assert (cell.gripper.held, len(cell.gripper.grips)) == (held, orders)
    cell.machine.machine = cell.machine.machine._replace(accepts=True)
    if held is not None:
        with pytest.raises(GripperClosedError, match="empty it first"):
            cell.picker.run()
        held.lost = cell.now
    cell.picker.run(is_emptied=True)
    outcomes = cell.run(lambda cell: cell.now > 6.5).outcomes()
    assert len(outcomes) == 6
    assert outcomes.count(PartOutcome.PLACED) == sum(bool(part.placed) for part in cell.parts)
    assert outcomes.count(PartOutcome.LOST) == (held is not None)
    assert all(part.outcome for part in on_the_way)


def test_a_gripper_that_somebody_else_has_closed_is_emptied_first():
    cell = Cell()
    cell.picker.step(0.0, Machine((0.0, 0.0, 0.1), passed=[True]))
    with pytest.raises(GripperClosedError):
        cell.picker.run()
    cell.picker.step(0.0, Machine((0.0, 0.0, 0.1), passed=[False]))
    cell.picker.run()


def test_a_gripper_that_closes_with_no_part_to_be_gripped_ends_the_run():
    """Whoever has closed it: it may hold something, which nobody knows."""
    cell = started().run(lambda cell: cell.now > 1.0)
    assert not cell.picker.target
    cell.picker.step(cell.now, cell.machine.machine._replace(passed=[True]))
    assert cell.picker.end is RunEnd.GRIPPER_CLOSED
    with pytest.raises(GripperClosedError):
        cell.picker.run()


def test_a_gripper_that_is_told_to_close_once_more_keeps_its_part():
    cell = started().run(lambda cell: cell.gripper.held)
    cell.picker.step(cell.now, cell.machine.machine._replace(passed=[True]))
    assert cell.picker.is_running
    cell.run(lambda cell: len(cell.outcomes()) == 2)
    assert cell.outcomes() == [PartOutcome.PLACED] * 2


def test_a_sensor_tells_what_was_missed_and_what_was_lost_and_the_places_stay_free():
    tray = Places(grid((0.2, 0.2, 0.0), (1, 20), ((0.0, 0.0, 0.0), (0.0, 0.03, 0.0))))
    cell = Cell(places=tray, losing=0.4)
    cell.parts[2].slide, cell.parts[2].since = (0.0, 0.1, 0.0), 2.3
    cell.picker.run()
    outcomes = cell.run(lambda cell: len(cell.picker.events) == 6).outcomes()
    lost = [
        PartOutcome.LOST if math.isfinite(part.lost) else PartOutcome.PLACED for part in cell.parts
    ]
    assert 0 < lost.count(PartOutcome.LOST) < 4
    lost[2] = PartOutcome.MISSED
    assert outcomes == lost
    assert "holds nothing" in cell.picker.events[2].part.text
    assert tray.take().number == lost.count(PartOutcome.PLACED)


@pytest.mark.parametrize("begins", [1.0, 1.7])
def test_while_the_encoder_is_silent_no_transfer_is_begun_and_one_is_given_up(begins):
    cell = started(silences=[(begins, begins + 1.6)])
    cell.run(lambda cell: cell.now > begins + 0.15)
    tasks = len(cell.tasks)
    assert isinstance(cell.tasks[-1], GivingUp) == (begins > 1.5)
    cell.run(lambda cell: cell.now > begins + 1.6)
    assert len(cell.tasks) == tasks
    outcomes = cell.run(lambda cell: len(cell.picker.events) == 6).outcomes()
    assert (outcomes[0] is PartOutcome.MISSED) == (begins > 1.5)
    assert cell.gripper.grips[0].time > begins + 1.6
    assert PartOutcome.PASSED in outcomes
    assert outcomes.count(PartOutcome.PLACED) >= 3


def test_a_run_ends_when_the_belt_is_silent_for_long_and_does_not_begin_again():
    cell = started(silences=[(1.95, 5.0)]).run(has_ended)
    assert cell.now == pytest.approx(1.95 + 0.1 + 2.0, abs=0.1)
    assert (cell.picker.end, cell.picker.text) == (RunEnd.BELT_SILENT, RunEnd.BELT_SILENT.value)
    tasks = len(cell.tasks)
    cell.run(lambda cell: cell.now > 7.0)
    assert len(cell.tasks) == tasks
    assert cell.gripper.held is None


@pytest.mark.parametrize("time", [1.7, 1.95])
def test_after_a_jump_of_the_encoder_only_what_the_gripper_holds_is_known(time):
    cell = started(jumps=[(time, 0.05)]).run(lambda cell: cell.now > time + 0.05)
    assert set(cell.outcomes()) == {PartOutcome.LOST}
    assert any(isinstance(task, GivingUp) for task in cell.tasks) == (cell.gripper.held is None)
    cell.run(lambda cell: cell.now > 7.0)
    ended = cell.outcomes().count(PartOutcome.PLACED)
    assert ended == sum(bool(part.placed) for part in cell.parts) > 3
    assert cell.picker.is_running


def test_a_transfer_that_fails_costs_one_part_and_one_that_has_gone_up_with_its_part_goes_on():
    cell = started().run(lambda cell: cell.picker._cycles)
    cell.machine.end(GoalCode.REFUSED, "outside the workspace")
    cell.run(lambda cell: len(cell.picker._cycles) == 2)
    cell.machine.before.end(GoalCode.NOT_REACHED, "it moves too fast")
    cell.run(lambda cell: len(cell.picker.events) == 2)
    assert cell.outcomes() == [PartOutcome.PASSED, PartOutcome.PLACED]
    assert cell.picker.events[0].part.text == "outside the workspace"
    cell.run(lambda cell: len(cell.picker._cycles) == 2)
    cell.machine.before.end(GoalCode.NOT_REACHED, "it moves too fast")
    cell.run(lambda cell: len(cell.machine.transfer.stations) == 1)
    cell.machine.end(GoalCode.REFUSED, "too heavy")
    cell.run(has_ended)
    assert (cell.picker.end, cell.picker.text) == (RunEnd.TRANSFER_FAILED, "too heavy")
    assert cell.picker.events[-1].part.outcome is PartOutcome.LOST


@pytest.mark.parametrize("closes", [True, False])
def test_a_gripper_that_closes_just_after_the_transfer_was_given_up_has_the_part(closes):
    """The drives are late: the output was on its way already, or it was not."""
    cell = started().run(lambda cell: len(cell.picker._cycles) == 1)
    cell.run(lambda cell: cell.machine.arrivals[0] < cell.now + 0.05)
    outputs = cell.machine.outputs[:1]
    cell.machine.end(GoalCode.NOT_REACHED, "it moves too fast")
    cell.machine.outputs = outputs if closes else []
    cell.run(lambda cell: cell.picker.events)
    assert cell.outcomes() == [PartOutcome.PLACED if closes else PartOutcome.MISSED]


def test_a_run_that_is_to_finish_places_what_it_has_begun():
    cell = started().run(lambda cell: cell.gripper.held)
    cell.picker.finish(RunEnd.STOPPED)
    # The first reason counts.
    cell.picker.finish(RunEnd.CANCELED)
    cell.run(has_ended)
    assert cell.outcomes() == [PartOutcome.PLACED] * 2
    assert cell.picker.end is RunEnd.STOPPED


def test_a_machine_whose_cycles_come_late_is_told_anew_where_its_part_is_then():
    cell = started().run(lambda cell: cell.picker.target)
    machine, told = cell.machine, cell.machine.visits[-2][2]
    cell.run(lambda cell: cell.now > told + 0.05)
    assert machine.visits[-2][2] == told
    machine.arrivals = [time + 0.05 for time in machine.arrivals]
    before = cell.now
    cell.run(lambda cell: cell.now > before + 2.0 * STEP)
    assert machine.visits[-2][2] > told


def test_no_more_parts_are_begun_than_are_wanted():
    cell = Cell(losing=0.4)
    cell.picker.run(count=3)
    outcomes = cell.run(has_ended).outcomes()
    assert outcomes.count(PartOutcome.PLACED) == 3 < len(outcomes)
