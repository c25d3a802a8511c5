"""Programs that run on a controller with the real engine; time is that of its cycles."""

import math
from pathlib import Path

import numpy as np
import pytest
from controller_rig import LIMITS, MACHINE, PERIOD, Rig
from motion_machine import WORKSPACE
from soak import combined, many, seed

from tri_glide_kinematics.control import (
    DISABLED,
    IDLE,
    PAUSED,
    WAS_STOPPED,
    Cause,
    ProgramRuns,
    ToldRun,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import MotionKind
from tri_glide_kinematics.motion.engine import Follow, GoalCode, PathOutputs
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.programs import (
    START_TIMEOUT,
    DriveFile,
    Dwell,
    GoalEnd,
    GoalProgress,
    MachineNow,
    MoveStep,
    PathStep,
    ProgramRun,
    ProgramSettings,
    RunState,
    Scales,
    StopKind,
    TimeLeft,
    check_program,
    load_kept,
    read_program,
)

START = (0.0, 0.0, 0.29)
SETTINGS = ProgramSettings(offsets={"G54": (0.0, 0.0, 0.25)}, start=START, optional_stop=True)
CYCLES = 5  # between two looks, as a node has them
MOST = 4000  # looks of one wait
TIMEOUT = 1.0  # s without a word of a run, after which it is lost


class Goal:
    """A command of the controller, as a run sees it."""

    def __init__(self, rig, command, is_path):
        self.progress = None
        self._rig = rig
        self._command = command
        self._is_path = is_path
        self.is_cancelled = False

    @property
    def end(self):
        outcome = self._command.outcome
        if outcome is None:
            return None
        deviation = self._command.deviation if self._is_path else math.nan
        return GoalEnd(outcome.code, outcome.text, self._rig.place, deviation)

    def cancel(self):
        self.is_cancelled = True
        self._rig.controller.cancel(self._command)

    def look(self):
        told = self._rig.controller.path_progress
        if self.end is None and self._rig.controller.leads_to(self._command) and told is not None:
            self._command.deviation = told.deviation
            path = (told.way, told.segment) if self._is_path else ()
            times = max(told.way_remaining, 0.0), told.time_remaining
            self.progress = GoalProgress(self._rig.place, *times, *path)


class Machine(Rig):
    """A machine that takes goals; what it is asked for is kept."""

    server = "/cell/ik_node"

    def __init__(self):
        super().__init__(start=MACHINE.inverse(START), kind=MotionKind.LINEAR)
        self.is_ready = True
        self.has_delivered = True
        self.taken_by = ""
        self.runs = ProgramRuns(TIMEOUT)
        self.identities = frozenset({b"one"})
        self.outputs = []
        self.said = []
        self.moves = []
        self.goal = None
        self.cycle(2)

    @property
    def place(self):
        return MACHINE.forward(self.heights)

    @property
    def now_told(self):
        status, progress = self.controller.status, self.controller.progress
        position, speed = progress.position, progress.speed
        return MachineNow(status.state, status.stops, speed, position, progress.segment)

    def move_to(self, position, frame="", speed=0.0, kind=""):
        self.moves.append(position)
        here = self.place
        if math.dist(here, position) < 1e-6:
            return self._sent(lambda: self.controller.pursue_position(position), False)
        line = FlatPath.of((SegmentKind.LINE,), position, (0.0,), (speed,), 0.0)
        path = at_once(line.path_from(here))
        return self._sent(lambda: self.controller.pursue(Follow(path)), False)

    def follow(self, segments, frame="", outputs=()):
        path = at_once(segments.path_from(self.place))
        changes = PathOutputs([each.joint for each in outputs], list(outputs), len(segments))
        return self._sent(lambda: self.controller.pursue(Follow(path, outputs=changes)), True)

    def put_out(self, output):
        self.outputs.append(output)

    def tell(self, news):
        told = ToldRun(f"{news.file}, line {news.line}", news.safe_outputs)
        self.runs.tell(news.number, told, has_ended=news.state is RunState.ENDED)

    def cycle(self, count=1):
        """Do what ``ik_node`` does in a cycle."""
        for _ in range(count):
            lost = self.runs.lost(self.now)
            if lost is not None:
                self.controller.stop(lost)
            super().cycle()
            self.outputs += self.controller.passed_outputs
            self.controller.passed_outputs.clear()
            if self.controller.rests:
                self.outputs += self.runs.safe_outputs
                self.runs.safe_outputs.clear()

    def _sent(self, pursue, is_path):
        try:
            command = pursue()
        except KinematicsError as error:
            command = Follow(None, "nothing")
            command.end(GoalCode.REFUSED, str(error))
        self.goal = Goal(self, command, is_path)
        return self.goal

    @property
    def told(self):
        """Name and value of each output that has changed."""
        return [(each.name, each.value) for each in self.outputs]


class View:
    """A machine as a run sees it: its ``now`` is what it does, and not the time."""

    def __init__(self, machine):
        self._machine = machine

    def __getattr__(self, name):
        return getattr(self._machine, "now_told" if name == "now" else name)


@pytest.fixture
def machine():
    return Machine()


def run_of(machine, work, **options):
    work = read_program(work, SETTINGS, "part.gcode") if isinstance(work, str) else work
    return ProgramRun(View(machine), work, say=machine.said.append, **options)


def drive_until(machine, run, condition):
    """Let both go on until something holds."""
    for _ in range(MOST):
        if condition():
            return
        machine.cycle(CYCLES)
        if machine.goal is not None:
            machine.goal.look()
        run.look(machine.now)
    raise AssertionError(f"not in {MOST} looks: {run.state}, {run.doing}")


def drive(machine, run, state=RunState.ENDED):
    drive_until(machine, run, lambda: run.state is state)


SPINDLE_AND_WAY = "M3 S500\nG1 X40 Y0 Z40 F3000\nG1 X-40\nM5\n"


@pytest.mark.parametrize("error", [KinematicsError("no machine"), OSError("no disk")])
@pytest.mark.parametrize("method", ["follow", "move_to", "put_out"])
def test_a_run_whose_machine_raises_ends_at_rest(machine, method, error, monkeypatch):
    """It was running for ever: nothing drove it on, and no other one could begin."""

    def fail(*_, **__):
        raise error

    run = run_of(machine, SPINDLE_AND_WAY)
    put_out, failing = machine.put_out, [method]

    def put_out_or_fail(output):
        return fail() if failing == ["put_out"] and output.value else put_out(output)

    monkeypatch.setattr(machine, "put_out", put_out_or_fail)
    if method != "put_out":
        monkeypatch.setattr(machine, method, fail)
    drive(machine, run)
    assert not run.is_whole
    assert str(error) in [each.text for each in run.reports]
    assert any(each.endswith(f": {error}") for each in machine.said)
    assert machine.told[-1] == ("spindle", 0.0)


def test_a_run_that_cannot_switch_off_ends_all_the_same(machine):
    run = under_way(machine, SPINDLE_AND_WAY)

    def fail(*_):
        raise KinematicsError("nobody takes it")

    machine.put_out = fail
    run.stop()
    with pytest.raises(KinematicsError, match="nobody takes it"):
        drive(machine, run)
    assert run.state is RunState.ENDED


def under_way(machine, text, way=0.01):
    """Return a run whose platform has come so far along x [m]."""
    run = run_of(machine, text)
    drive_until(machine, run, lambda: machine.place[0] > way)
    return run


def paused(machine):
    """Return a run whose path the machine was made to pause in its middle."""
    run = under_way(machine, "G1 X0 Y0 Z40 F6000\nX60 F1200\nM2\n", 0.02)
    machine.controller.pause()
    drive_until(machine, run, lambda: machine.controller.state is PAUSED and is_at_rest(machine))
    return run


def pass_time(machine, run, duration):
    end = machine.now + duration
    drive_until(machine, run, lambda: machine.now >= end)


def results(run):
    return [(each.step.line_at(), each.step.word, each.result) for each in run.reports]


def is_at_rest(machine):
    return not machine.controller.progress.speed > 0.0


def test_all_kinds_of_steps_are_driven(machine):
    run = run_of(
        machine, "G1 X0 Y0 Z40 F6000\nG64 P1\nX10\nY10\nM3 S500\nG4 P0.5\nM62 P2\nX0\nM2\n"
    )
    begin = machine.now
    drive(machine, run)
    assert run.is_whole
    words = ["path", "output", "wait", "output", "path", "output", "stop"]
    assert results(run) == [
        (line, word, "succeeded") for line, word in zip((3, 5, 6, 7, 8, 9, 9), words)
    ]
    assert machine.told == [("spindle", 500.0), ("digital", 1.0), ("spindle", 0.0)]
    path, _, dwell, *_ = run.reports
    assert 0.5 <= dwell.time < 0.52
    assert path.time < machine.now - begin
    assert 0.018 < path.length < 0.02
    assert 0.0005 < path.deviation <= 0.001
    assert machine.said[0] == "line 3: to the start of the path at 50 mm/s"
    assert machine.said[1:3] == ["line 3: path of 2 segments", "line 5: output spindle 0 is 500"]


def test_a_drive_file_is_driven_from_where_the_platform_is(machine):
    line = FlatPath.of((SegmentKind.LINE,), (0.02, 0.0, 0.29), (0.0,), (0.1,), 0.0)
    steps = (PathStep(line, None), MoveStep((0.02, 0.0, 0.3), 0.05), Dwell(0.1))
    run = run_of(machine, DriveFile("", steps))
    drive_until(machine, run, lambda: "segment 1 of 1" in run.doing)
    drive(machine, run)
    assert results(run) == [(0, word, "succeeded") for word in ("path", "move", "wait")]
    assert [each.length for each in run.reports] == [
        pytest.approx(0.02, rel=1e-6),
        pytest.approx(0.01, rel=1e-6),
        None,
    ]
    assert run.reports[1].time > 0.01 / 0.05
    assert machine.moves == [(0.02, 0.0, 0.3)]
    assert machine.said[0] == "step 1 of 3: path of 1 segment"


def test_without_a_machine_it_says_what_is_missing(machine):
    machine.is_ready = False
    run = run_of(machine, DriveFile("", (Dwell(1.0), Dwell(2.0))))
    begin = machine.now
    drive(machine, run)
    assert machine.now - begin == pytest.approx(START_TIMEOUT, abs=0.02)
    assert [report.result for report in run.reports] == ["lost", "not driven"]
    assert "the actions of /cell/ik_node after 10 s" in run.reports[0].text


@pytest.mark.parametrize("how", ["stop", "disable", "fault"])
def test_a_stop_of_the_machine_ends_a_program_that_waits_between_two_motions(machine, how):
    run = run_of(machine, "M3 S9\nG4 P60\nG0 X10\nM2\n")
    pass_time(machine, run, 0.5)
    if how == "fault":
        machine.offset = 0.2
    else:
        getattr(machine.controller, how)()
    drive(machine, run)
    assert [each.result for each in run.reports[:3]] == ["succeeded", "stopped", "not driven"]
    assert run.reports[1].text == WAS_STOPPED
    assert machine.told == [("spindle", 9.0), ("spindle", 0.0)]


def test_a_stop_before_the_first_step_is_said_and_nothing_moves(machine):
    run = run_of(machine, "G0 X10 Y0 Z40\nM2\n")
    machine.controller.stop()
    drive(machine, run)
    assert [each.result for each in run.reports] == ["not driven"] * 2
    assert machine.said == [WAS_STOPPED]
    assert machine.goal is None


def test_what_is_refused_ends_it_with_its_line(machine):
    machine.controller.disable()
    machine.cycle_until(DISABLED)
    run = run_of(machine, "(a part)\nG4 P0.1\nG0 X10 Y0 Z40\nM2\n")
    drive(machine, run)
    # Before the dwell it goes to where the program is to go on.
    assert results(run)[0] == (2, "wait", "refused")
    assert [each.result for each in run.reports[1:]] == ["not driven"] * 2
    assert machine.said[-1].startswith("line 2: no motion while disabled")


def test_a_single_block_waits_before_each_line(machine):
    text = "G0 X0 Y0 Z40\nX10\nM62 P3\nG3 X20 I5 F3000\nG1 X30\nX40\nM2\n"
    run = run_of(machine, text, single_block=True)
    for line, end in {3: 10.0, 4: 10.0, 5: 20.0}.items():
        drive(machine, run, RunState.WAITING)
        assert (run.line, run.waits_at, run.doing) == (line, None, f"line {line} is next")
        assert machine.place == pytest.approx((1e-3 * end, 0.0, 0.29), abs=1e-6)
        assert is_at_rest(machine)
        run.go_on()
        assert run.state is RunState.WAITING
        run.look(machine.now)
        assert run.state is RunState.RUNNING
    assert machine.told == [("digital", 1.0)]
    run.single_block = False
    drive(machine, run)
    assert run.is_whole
    assert [each.step.line_at() for each in run.reports] == [2, 3, 4, 5, 6, 7]


def test_a_single_block_that_is_switched_on_in_a_path_waits_at_its_end(machine):
    run = under_way(machine, "G1 X0 Y0 Z40 F6000\nX20\nX40\nG4 P0.01\nX0\nM2\n", 0.005)
    run.single_block = True
    drive(machine, run, RunState.WAITING)
    assert run.line == 4
    assert machine.place == pytest.approx((0.04, 0.0, 0.29), abs=1e-6)
    run.stop()
    drive(machine, run)
    assert not run.is_whole


def test_it_goes_on_from_where_it_was_left_after_a_stop_of_the_program(machine):
    run = run_of(machine, "G0 X10 Y0 Z40\nT1 M6\nX0\nM1\nM2\n")
    drive(machine, run, RunState.WAITING)
    assert (run.waits_at.kind, run.waits_at.line) == (StopKind.TOOL, 2)
    assert run.doing == "line 2: M6, tool 1"
    # Whoever changes a tool moves the platform.
    machine.controller.move_to((0.03, 0.0, 0.3))
    pass_time(machine, run, 2.0)
    assert run.state is RunState.WAITING
    run.go_on()
    drive_until(machine, run, lambda: run.waits_at is not None and run.waits_at.line == 4)
    assert machine.moves[1] == pytest.approx((0.01, 0.0, 0.29))
    run.go_on()
    drive(machine, run)
    assert run.is_whole
    assert machine.said.count("line 3: to the start of the path at 50 mm/s") == 1


@pytest.mark.parametrize("speed", [0.05, 0.02])
def test_the_way_to_the_start_is_as_fast_as_the_operator_wants(machine, speed):
    # Where nobody says anything, it is calm.
    options = {} if speed == 0.05 else {"approach": speed}
    run = run_of(machine, "G0 X10 Y0 Z40\nM1\nG1 X20 F60\nM2\n", **options)
    drive(machine, run, RunState.WAITING)
    machine.controller.move_to((0.04, 0.0, 0.3))
    pass_time(machine, run, 2.0)
    run.go_on()
    speeds = []
    drive_until(
        machine,
        run,
        lambda: (
            speeds.append(machine.controller.progress.speed)
            or machine.said[-1] == "line 3: path of 1 segment"
        ),
    )
    assert max(speeds) == pytest.approx(speed, rel=1e-3)
    assert f"line 3: to the start of the path at {1000.0 * speed:g} mm/s" in machine.said
    assert machine.moves[-1] == pytest.approx((0.01, 0.0, 0.29))


def test_a_paused_path_that_is_left_for_a_target_goes_on_where_it_was(machine):
    run = paused(machine)
    pass_time(machine, run, 0.1)
    place = machine.place
    machine.controller.move_to((0.0, 0.03, 0.29))
    drive(machine, run, RunState.WAITING)
    assert run.doing == "line 2: moved while the path was paused"
    assert run.line == 2
    pass_time(machine, run, 2.0)
    run.go_on()
    drive(machine, run)
    assert run.is_whole
    assert machine.moves[-1] == pytest.approx(place, abs=1e-4)
    assert machine.place == pytest.approx((0.06, 0.0, 0.29), abs=1e-6)


def test_a_paused_path_that_is_resumed_and_then_replaced_is_not_gone_on_with(machine):
    run = paused(machine)
    machine.controller.resume()
    drive_until(machine, run, lambda: machine.place[0] > 0.03)
    machine.controller.move_to((0.0, 0.03, 0.29))
    drive(machine, run)
    assert [each.result for each in run.reports] == ["superseded", "not driven"]


@pytest.mark.parametrize("ending", ["stop", "disable", "another command", "the run's own"])
def test_the_platform_rests_before_the_spindle_is_off(machine, ending):
    run = under_way(machine, "M3 S9 M8\nM64 P4\nG1 X60 F1200\nM2\n")
    assert "now line 3" in run.doing
    if ending == "another command":
        machine.controller.move_to((-0.08, 0.0, 0.29))
    elif ending == "the run's own":
        run.stop()
        assert run.state is RunState.STOPPING
        assert machine.goal.is_cancelled
    else:
        getattr(machine.controller, ending)()
    drive_until(machine, run, lambda: len(machine.outputs) > 3)
    assert is_at_rest(machine)
    drive(machine, run)
    assert not run.is_whole
    assert run.was_stopped == (ending != "another command")
    assert any("at line 3" in report.text for report in run.reports)
    # What else is on stays on.
    assert machine.told[3:] == [("flood", 0.0), ("spindle", 0.0)]


def test_who_lets_go_waits_for_nothing(machine):
    run = under_way(machine, "M3 S9\nG1 X60 F1200\nM2\n")
    run.let_go()
    assert machine.told[-1] == ("spindle", 0.0)
    assert machine.goal.is_cancelled
    assert not is_at_rest(machine)


@pytest.mark.parametrize(
    ("how", "text", "after"),
    [
        ("another", "another ik_node was started", 0.5),
        ("gone", "ik_node is gone", 3.0),
        ("does not rest", "the platform may still move", 10.0),
    ],
)
def test_a_machine_that_is_lost_is_not_waited_for(machine, how, text, after):
    run = run_of(machine, "M3 S9\nG1 X60 F60\nM2\n")
    drive_until(machine, run, lambda: "now line 2" in run.doing)
    begin = machine.now
    if how == "another":
        machine.identities = frozenset({b"other"})
    elif how == "gone":
        machine.is_ready = False
    else:
        machine.goal.cancel = lambda: None
        run.stop()
    # What is told of the machine does not change any more: time alone goes on.
    machine.cycle = lambda count: setattr(machine, "now", machine.now + count * PERIOD)
    drive(machine, run)
    assert run.reports[1].result == "lost"
    assert run.reports[1].text == text
    assert machine.now - begin == pytest.approx(after, abs=0.6)
    # The other one is there: whoever has the goal still shall stop.
    assert getattr(machine.goal, "is_cancelled", False) == (how == "another")
    assert machine.told[-1] == ("spindle", 0.0)


def test_an_ik_node_that_ends_tells_no_more_whether_the_platform_moves(machine):
    run = under_way(machine, "M3 S9\nG1 X60 F1200\nM2\n")
    machine.controller.end("the node ends")
    machine.measures = False
    end = machine.now
    drive(machine, run)
    assert run.reports[1].result == "shutdown"
    assert machine.told[-1] == ("spindle", 0.0)
    assert machine.now - end < 1.0


def test_outputs_have_time_to_arrive(machine):
    machine.has_delivered = False
    run = run_of(machine, "M3 S9\nM2\n")
    drive(machine, run)
    assert not run.is_delivered(machine.now + 2.9)
    assert run.is_delivered(machine.now + 3.1)
    machine.has_delivered = True
    assert run.is_delivered(machine.now)


def test_it_is_kept_how_far_it_came(machine, tmp_path):
    kept = tmp_path / "folder" / "kept.yaml"
    run = run_of(machine, "G1 X40 Y0 Z40 F2400\nX0\nX40\nM0\nM2\n", kept=kept)
    drive_until(machine, run, lambda: run.line == 3)
    assert load_kept(kept).line in (1, 2)
    pass_time(machine, run, 0.81)
    assert (load_kept(kept).line, load_kept(kept).state) == (3, RunState.RUNNING)
    drive(machine, run, RunState.WAITING)
    assert (load_kept(kept).line, load_kept(kept).state) == (4, RunState.WAITING)
    run.go_on()
    drive(machine, run)
    assert load_kept(kept).is_whole


def test_no_room_to_keep_it_is_said_once(machine, tmp_path):
    (tmp_path / "file").touch()
    run = run_of(machine, "G4 P2\nM2\n", kept=tmp_path / "file" / "kept.yaml")
    drive(machine, run)
    assert run.is_whole
    assert sum("how far the program comes is not kept" in said for said in machine.said) == 1
    assert machine.controller.state is IDLE


# Outputs at rest and on the way, a dwell, and a stop at which it waits.
DYING = "M3 S9 M8\nG4 P0.5\nG64 P1\nG1 X0 Y0 Z40 F6000\nM62 P4\nX60 F1200\nM9\nM8\nX0\nM0\nM2\n"


@pytest.mark.parametrize("number", range(many(5)))
def test_where_what_drives_dies_the_platform_rests_and_then_the_outputs_are_safe(machine, number):
    instant = np.random.default_rng(seed(51) + number).uniform(0.02, 8.5)
    run = run_of(machine, DYING)
    pass_time(machine, run, instant)
    stops, died = machine.controller.status.stops, machine.now
    assert not stops
    before = dict(machine.told)
    while machine.controller.status.stops == stops:
        machine.cycle()
    assert 0.7 < machine.now - died < 1.1
    assert machine.controller.reason.cause is Cause.PROGRAM_LOST
    assert f"what drives {Path('part.gcode').absolute()}, line" in machine.controller.reason.text
    while any(dict(machine.told)[name] for name in ("spindle", "flood")):
        assert machine.now - died < 1.5
        machine.cycle()
    assert is_at_rest(machine)
    assert dict(machine.told).get("digital") == before.get("digital")
    # It comes back: nothing moves, and nothing is switched on.
    heights, count, moves = machine.heights, len(machine.outputs), len(machine.moves)
    drive(machine, run)
    assert machine.heights == heights
    assert len(machine.moves) == moves
    assert not any(each.value for each in machine.outputs[count:])
    assert not run.is_whole
    assert not machine.runs.lost(machine.now + 2.0)


@pytest.mark.parametrize("pause", [0.6, 0.8])
def test_what_was_held_for_too_long_does_not_go_on(machine, pause):
    run = run_of(machine, "M3 S9\nG4 P0.5\nM8\nG1 X30 Y0 Z40 F6000\nM2\n")
    pass_time(machine, run, 0.2)
    # Less than ik_node waits for: nothing was told by the machine.
    machine.cycle(round(pause / PERIOD))
    moves = list(machine.moves)
    drive(machine, run)
    assert run.is_whole == (pause < 0.7)
    if pause > 0.7:
        assert "nothing drove it for 0.8 s" in " ".join(machine.said)
        assert machine.moves == moves
        assert machine.told[-1] == ("spindle", 0.0)


def test_a_run_is_refused_while_somebody_else_drives_one_and_switches_nothing(machine):
    machine.taken_by = "drive runs part.gcode"
    run = run_of(machine, "M3 S9\nG1 X30 Y0 Z40 F6000\nM2\n")
    drive(machine, run)
    assert run.reports[0].text == "nothing begun: drive runs part.gcode"
    assert machine.told == machine.moves == []
    assert not machine.runs.lost(machine.now)


LASTING = {
    "cuts and rapids": "G64 P0.1\n" + "G0 X30 Z45\nZ40\nG1 X0 F3000\nG0 Z45\nG1 Y8 F6000\nY0\n" * 4,
    "exact stops, dwells": "G61\n" + "G0 X20\nG4 P0.3\nG1 X0 F3000\nG3 X10 Y10 R10\nG1 X0 Y0\n" * 5,
    "a slow end": "G0 X0 Y0 Z40\n" + "G0 X40\nX-40\n" * 8 + "G1 X-35 F150\n",
    "dense": "".join(
        f"G1 X{30 * np.cos(0.05 * n):.4f} Y{30 * np.sin(0.05 * n):.4f} Z40 F{1500 + 20 * n}\n"
        for n in range(200)
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "scales"), combined(tuple(LASTING), (Scales(), Scales(0.4, 0.1), Scales(1.5, 1.0)))
)
def test_the_time_that_is_left_is_that_which_it_takes_in_the_end(machine, name, scales):
    program = read_program(LASTING[name] + "M2\n", SETTINGS, "part.gcode")
    left = TimeLeft(program, check_program(program, WORKSPACE, LIMITS))
    machine.controller.set_limits(LIMITS, 1.0, *scales)
    run, told = run_of(machine, program), []
    begin = machine.now
    while run.state is not RunState.ENDED:
        machine.cycle(CYCLES)
        machine.goal.look() if machine.goal else None
        run.look(machine.now)
        goal = machine.goal
        way = goal.progress.way_remaining if goal and goal.progress else math.nan
        rest = left.look(machine.now, run.line, way, scales)
        told.append((machine.now - begin, rest))
    assert run.is_whole
    total = machine.now - begin
    times, rests = np.transpose(told)
    tenths = np.interp(total * np.arange(10) / 10.0, times, rests) + total * np.arange(10) / 10.0
    assert tenths == pytest.approx(total, rel=0.05)
