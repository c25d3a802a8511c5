"""A transfer under control: its outputs at their instants, and one end however that comes."""

import math
from functools import partial

import pytest
from controller_rig import MACHINE, PERIOD, Rig, controller_of

from tri_glide_kinematics.control import DISABLED, FAULT, IDLE, MOVING
from tri_glide_kinematics.motion.engine import GoalCode, Station, Transfer

HEIGHT, LOW = 0.275, 0.25
HERE, BELT = (0.0, -0.1, LOW), (-0.1, 0.1, LOW)
SPEED = (0.15, 0.0, 0.0)
CLOSE, OPEN = (0.01, "close"), (0.02, "open")


class Cell:
    """A machine at rest above a belt, and what it tells cycle by cycle."""

    def __init__(self, drive_delay=0.0, **how):
        self.rig = Rig(start=MACHINE.inverse(HERE), in_pieces=True)
        self.rig.pieces = 60
        self.delay = drive_delay
        if drive_delay:
            self.rig.controller = controller_of(self.rig.engine, drive_delay=drive_delay)
            self.rig.measures = False
            self.rig.controller.measured(self.rig.heights, self.rig.now)
            self.rig.controller._supervisor.cycle = lambda now: None
        self.rig.cycle(3)
        self.outputs, self.errors, self.arrived = [], [], []
        self.seen = self.rig.now
        part = Station(BELT, 0.05, SPEED, outputs=(CLOSE,))
        transfer = Transfer(
            (part, Station(HERE, outputs=(OPEN,))), HEIGHT, seen=self.seen, lifts=False, **how
        )
        self.goal = self.rig.controller.pursue(transfer)

    @property
    def controller(self):
        return self.rig.controller

    def part(self, time):
        """Return where the part is at a ``time``."""
        return tuple(x + (time - self.seen) * v for x, v in zip(BELT, SPEED))

    def cycles(self, until, most=2000):
        """Go on until something is so."""
        for _ in range(most):
            self.rig.cycle()
            self.outputs += [(self.rig.now, each) for each in self.controller.passed_outputs]
            self.controller.passed_outputs.clear()
            progress = self.controller.transfer_progress
            if progress is not None:
                arrivals = [self.rig.now + arrival for arrival in progress.arrivals]
                self.arrived.append(arrivals)
                if -0.05 <= progress.arrivals[0] <= 0.0:
                    place = MACHINE.forward(self.controller.commanded_heights)
                    self.errors.append(math.dist(place, self.part(self.rig.now + self.delay)))
            if until(self):
                return self
        raise AssertionError(f"it did not come in {most} cycles: {self.controller.reason}")


def over(cell):
    return cell.goal.outcome is not None


def at(station, after, cell):
    """Return whether a ``station`` was reached so long ago."""
    progress = cell.controller.transfer_progress
    return progress is not None and progress.arrivals[station] <= -after


def test_outputs_come_within_a_cycle_of_their_instants():
    cell = Cell().cycles(over)
    assert cell.goal.outcome.code is GoalCode.SUCCEEDED
    assert max(cell.errors) < 1e-6
    (closed, close), (opened, open_) = cell.outputs
    assert (close, open_) == ("close", "open")
    # The instants that were told first held.
    first, last = cell.arrived[0]
    assert closed == pytest.approx(first + 0.01, abs=PERIOD)
    assert opened == pytest.approx(last + 0.02, abs=PERIOD)
    assert cell.arrived[-1] == pytest.approx([first, last], abs=1e-9)


def test_drives_that_are_late_are_led():
    cell = Cell(drive_delay=0.06).cycles(partial(at, 1, 0.1))
    assert max(cell.errors) < 1e-6
    first, last = cell.arrived[0]
    assert [output for _, output in cell.outputs] == ["close", "open"]
    assert cell.outputs[0][0] == pytest.approx(first + 0.01 + 0.06, abs=PERIOD)
    assert cell.outputs[1][0] == pytest.approx(last + 0.02 + 0.06, abs=PERIOD)


def test_the_next_one_is_planned_before_the_end_of_the_one_before_and_loses_no_output():
    cell = Cell().cycles(partial(at, 0, 0.2))
    arrival = cell.arrived[0][1]
    first = cell.goal
    stations = (Station((0.05, 0.1, LOW), 0.05, outputs=((0.0, "close"),)), Station(HERE))
    goal = cell.controller.pursue(Transfer(stations, HEIGHT, lifts=False, leave_at=arrival + 0.05))
    leaves = []

    def moves(cell):
        if cell.rig.now > arrival + PERIOD and cell.controller.commanded_heights != at_rest:
            leaves.append(cell.rig.now)
        return bool(leaves)

    cell.cycles(lambda cell: cell.rig.now >= arrival)
    at_rest = cell.controller.commanded_heights
    assert math.dist(MACHINE.forward(at_rest), HERE) < 1e-9
    cell.cycles(moves)
    # At the instant that was asked for, though the plan was ready long before.
    assert leaves[0] == pytest.approx(arrival + 0.05, abs=2 * PERIOD)
    cell.goal = goal
    cell.cycles(over)
    assert goal.outcome.code is GoalCode.SUCCEEDED
    assert first.outcome.code in (GoalCode.SUCCEEDED, GoalCode.SUPERSEDED)
    assert [output for _, output in cell.outputs] == ["close", "open", "close"]


ENDS = {
    "stop": (lambda rig: rig.controller.stop(), IDLE, GoalCode.STOPPED),
    "disable": (lambda rig: rig.controller.disable(), DISABLED, GoalCode.DISABLED),
    "fault": (lambda rig: setattr(rig, "offset", 0.05), FAULT, GoalCode.FAULT),
}
PHASES = {
    "way there": lambda cell: cell.controller.state is MOVING,
    "descent": lambda cell: (p := cell.controller.transfer_progress) and p.arrivals[0] < 0.08,
    "dwell": partial(at, 0, 0.03),
    "lift": partial(at, 0, 0.1),
    "way back": partial(at, 0, 0.4),
    "release": partial(at, 1, 0.0),
}


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("end", ENDS)
def test_in_each_phase_it_ends_once_and_the_gripper_keeps_its_value(end, phase):
    ask, state, code = ENDS[end]
    cell = Cell().cycles(PHASES[phase])
    told = list(cell.outputs)
    ask(cell.rig)
    lowest = []

    def rests(cell):
        lowest.append(MACHINE.forward(cell.controller.commanded_heights)[2])
        return (cell.controller.state is state and not cell.controller.leads) or (
            state is IDLE and cell.controller.state is IDLE
        )

    cell.cycles(rests)
    assert cell.goal.outcome.code is code
    assert min(lowest) >= LOW - 1e-4
    heights = cell.controller.commanded_heights
    cell.cycles(lambda cell: True)
    cell.rig.cycle(100)
    assert cell.controller.commanded_heights == heights
    assert cell.outputs == told
    assert cell.controller.passed_outputs == []


def test_a_part_that_stops_in_the_descent_is_given_up_and_told():
    cell = Cell(allowed=1e-3).cycles(PHASES["descent"])
    stands = cell.part(cell.rig.now)
    cell.controller.renew(0, Station(stands, 0.05), cell.rig.now)
    cell.cycles(over)
    code, text = cell.goal.outcome
    assert code is GoalCode.NOT_REACHED
    assert "the place is missed by" in text
    assert "more than 1 mm" in text
    cell.cycles(lambda cell: cell.controller.state is IDLE)
    assert MACHINE.forward(cell.controller.commanded_heights)[2] == pytest.approx(HEIGHT)
    assert cell.outputs == []


@pytest.mark.parametrize(
    ("phase", "late", "is_met"),
    [("way there", 0.004, True), ("way there", 0.3, True), ("descent", 0.1, False)],
)
def test_cycles_that_are_left_out_do_not_make_the_gripper_miss(phase, late, is_met):
    cell = Cell(allowed=1e-3).cycles(PHASES[phase])
    cell.rig.now += late
    cell.cycles(over)
    code = cell.goal.outcome.code
    assert code is (GoalCode.SUCCEEDED if is_met else GoalCode.NOT_REACHED)
    assert bool(cell.errors) is is_met
    assert max(cell.errors, default=0.0) < 1e-5
    # What was due in the time that is lost has been told.
    assert cell.outputs or not is_met


def test_after_cycles_that_were_left_out_the_next_station_is_met_and_not_the_last_one():
    cell = Cell().cycles(partial(at, 0, 0.2))
    cell.rig.now += 0.02
    cell.seen = cell.rig.now
    stations = Station(BELT, 0.05, SPEED), Station(HERE)
    cell.goal = cell.controller.pursue(Transfer(stations, HEIGHT, seen=cell.seen, lifts=False))
    cell.errors.clear()
    cell.cycles(over)
    assert cell.goal.outcome.code is GoalCode.SUCCEEDED
    assert max(cell.errors) < 1e-5


def test_a_cancelled_transfer_goes_up_from_the_part():
    cell = Cell().cycles(PHASES["descent"])
    cell.controller.cancel(cell.goal)
    cell.cycles(over)
    assert cell.goal.outcome.code is GoalCode.CANCELED
    assert MACHINE.forward(cell.controller.commanded_heights)[2] == pytest.approx(HEIGHT)
    assert cell.outputs == []


def test_a_part_that_gets_faster_is_met_and_the_outputs_come_as_much_later():
    cell = Cell().cycles(lambda cell: cell.controller.state is MOVING)
    cell.rig.cycle(50)
    # At once 50 mm/s more: the way back is longer.
    now = cell.rig.now
    faster = Station(cell.part(now), 0.05, (SPEED[0] + 0.05, 0.0, 0.0))
    assert cell.controller.renew(0, faster, now)
    cell.part = lambda time: faster.after(time - now).position
    cell.cycles(over)
    assert cell.goal.outcome.code is GoalCode.SUCCEEDED
    assert max(cell.errors) < 1e-6
    (_, first), (_, last) = cell.arrived[0], cell.arrived[-1]
    assert last > first + 0.02
    assert cell.outputs[1][0] == pytest.approx(last + 0.02, abs=PERIOD)
