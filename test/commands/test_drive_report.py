"""What a drive prints."""

import io

from tri_glide_kinematics.commands.drive import ProgressLine, table
from tri_glide_kinematics.programs import (
    Dwell,
    MoveStep,
    Output,
    ProgramStop,
    StepReport,
    StopKind,
)

MOVE = MoveStep((0.0, 0.0, 0.25))


class Terminal(io.StringIO):
    """Says that it is a terminal."""

    def isatty(self):
        return True


def test_elsewhere_only_what_stays_is_written():
    output = io.StringIO()
    progress = ProgressLine(output)
    progress.say("step 1")
    progress.show("half")
    progress.say("step 2")
    assert output.getvalue() == "drive: step 1\ndrive: step 2\n"


def test_on_a_terminal_progress_is_one_line_that_is_written_over():
    output = Terminal()
    progress = ProgressLine(output)
    progress.show("half")
    progress.show("all")
    progress.say("done")
    progress.say("next")
    expected = "\r\033[Kdrive: half\r\033[Kdrive: all\r\033[Kdrive: done\ndrive: next\n"
    assert output.getvalue() == expected


def test_the_table_has_what_is_known_and_dashes_for_the_rest():
    lines = table(
        [
            StepReport(MOVE, "succeeded", True, 2.0, 0.1),
            StepReport(MOVE, "canceled", False, 0.5, 0.01, 0.00025),
            StepReport(Dwell(1.0), "not driven"),
        ]
    ).splitlines()
    assert lines[0].split() == "step result time length mean speed largest deviation".split()
    assert lines[1].split() == "1 move succeeded 2.00 s 100.0 mm 50.0 mm/s -".split()
    assert lines[2].split() == "2 move canceled 0.50 s 10.0 mm 20.0 mm/s 0.250 mm".split()
    assert lines[3].split() == "3 wait not driven - - - -".split()
    assert len({len(line) for line in lines}) == 1


def test_steps_of_a_program_are_named_by_their_lines():
    lines = table(
        [
            StepReport(Output("spindle", 0, 100.0, 3, 0), "succeeded", True),
            StepReport(Dwell(0.5, 12), "succeeded", True, 0.5),
            StepReport(ProgramStop(StopKind.PAUSE, 14), "stopped"),
        ]
    ).splitlines()
    assert lines[0].split()[0] == "line"
    assert [line.split()[:3] for line in lines[1:]] == [
        ["3", "output", "succeeded"],
        ["12", "wait", "succeeded"],
        ["14", "stop", "stopped"],
    ]
    assert len({len(line) for line in lines}) == 1
