"""Paths that go on from a place on one of their segments."""

import pytest

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.programs import Output, PathRun, ProgramSettings, read_program

# Lines, a full circle with an output at its begin, and a helix of three turns.
TEXT = """\
G21 G90 G17
G1 X10 Y0 Z300 F1000
M62 P1
G3 X10 Y0 I-10 J0
G2 X10 Y0 Z310 I-10 P3
G1 X20
M62 P2
G1 X30
M2
"""


def run_of(text: str) -> PathRun:
    step = read_program(text, ProgramSettings(start=(0.0, 0.0, 0.3))).steps[0]
    assert isinstance(step, PathRun)
    return step


@pytest.mark.parametrize("part", [0.01, 0.3, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("segment", range(5))
def test_the_rest_leads_along_the_same_path(segment: int, part: float) -> None:
    run = run_of(TEXT)
    path = at_once(run.segments.path_from(run.start)).segments
    joints = path.joints
    way = joints[segment] + part * (joints[segment + 1] - joints[segment])
    # As far beside the path as it is rounded.
    place = at_once(run.segments.path_from(run.start)).driven.derivatives([way], 0)[0][0]
    (rest,) = run.behind_place(segment, (place[0], place[1], place[2]))
    assert isinstance(rest, PathRun)
    assert rest.lines.tolist() == run.lines.tolist()[segment:]
    assert rest.start == pytest.approx(place, abs=6e-5)
    left = at_once(rest.segments.path_from(rest.start)).segments
    assert left.lengths.sum() == pytest.approx(joints[-1] - way, abs=6e-5)
    assert left.points[1:] == pytest.approx(path.points[segment + 1 :], abs=1e-9)
    # What was passed is not told again.
    lines = [each.line for each in run.outputs if each.joint > segment]
    assert [each.line for each in rest.outputs] == lines


def test_at_the_end_of_a_segment_the_next_one_is_driven_with_its_outputs() -> None:
    run = run_of(TEXT)
    first, rest = run.behind_place(0, (0.01, 0.0, 0.3))
    assert isinstance(first, Output)
    assert first.line == 3
    assert isinstance(rest, PathRun)
    assert len(rest.lines) == 4
    assert run.behind_place(4, (0.03, 0.0, 0.31)) == ()
