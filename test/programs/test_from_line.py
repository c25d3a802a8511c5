"""The rest of a program from a line on is the tail of the whole program, as it has been set up."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from testing.program_writer import written_program
from tri_glide_kinematics.programs import (
    Dialect,
    Output,
    PathRun,
    ProgramError,
    ProgramSettings,
    StopKind,
    from_line,
    read_program,
)


def done_by(steps):
    """Yield the line and what is done, segment by segment and at which place, with its bounds."""
    for step in steps:
        if not isinstance(step, PathRun):
            done = (step.name, step.number, step.value) if isinstance(step, Output) else step
            yield step.line_at(), done
            continue
        flat = step.segments
        offsets = [*flat.offsets.tolist(), len(flat.numbers)]
        for index, line in enumerate(step.lines.tolist()):
            yield from (
                (each.line, (each.name, each.number, each.value))
                for each in step.outputs
                if each.joint == index
            )
            start = flat.start_of(index, step.start)
            numbers = flat.numbers[offsets[index] : offsets[index + 1]].tolist()
            bounds = float(flat.tolerances[index]), float(flat.speeds[index])
            yield line, (int(flat.kinds[index]), *start, *numbers, *bounds, bool(step.rapid[index]))


def is_output(done):
    """Tell whether it is an output that changes."""
    return isinstance(done, tuple) and isinstance(done[0], str)


def same(one, other):
    """Tell whether two things that are done are the same, places to 1e-12 m."""
    if isinstance(one, tuple) and not is_output(one):
        return np.allclose(one, other, rtol=0.0, atol=1e-12)
    return one == other


@pytest.mark.parametrize("dialect", Dialect)
@given(seed=st.integers(0, 2**32 - 1))
@settings(derandomize=True, deadline=None, max_examples=5)
def test_the_rest_is_the_tail_of_the_whole(dialect, seed):
    written = written_program(np.random.default_rng(seed), dialect)
    program = read_program(written.text, written.settings)
    whole = list(done_by(program.steps))
    last = whole[-1][0]
    for line in range(1, last + 1):
        rest = list(done_by(from_line(program, line).steps))
        tail = [each for each in whole if each[0] >= line]
        again = rest[: len(rest) - len(tail)]
        assert [each[0] for each in rest[len(again) :]] == [each[0] for each in tail]
        assert all(same(one[1], two[1]) for one, two in zip(rest[len(again) :], tail))
        # They are part of the first line of the rest: nobody who stops there begins before it.
        assert {each[0] for each in again} <= {rest[len(again)][0]}
        # Each output that was changed before has its last value.
        changed = [done for at, done in whole if at < line and is_output(done)]
        in_force = {done[:2]: done for done in changed}
        assert {done[:2]: done for _, done in again} == in_force
        assert len(again) == len(in_force)
    with pytest.raises(ProgramError, match=f"line {last + 1}: nothing is done from here on"):
        from_line(program, last + 1)


def test_the_tool_that_has_to_be_in_the_machine_is_told():
    program = read_program("T1 M6\nG0 X1\nT2 M6\nG0 X2\nM2\n", ProgramSettings())
    assert not from_line(program, 1).told
    assert [(each.line, each.reason) for each in from_line(program, 4).told] == [
        (3, "tool 2 has to be in the machine already")
    ]
    assert [each.line for each in from_line(program, 2).told] == [1]


@pytest.mark.parametrize(("line", "begin"), [(1, 0.0), (2, 0.001), (3, 0.001), (4, 0.002)])
def test_a_line_that_does_nothing_begins_with_the_next_one(line, begin):
    program = read_program("G0 X1\n(a comment)\nG91 G1 X1 F600\nX1\nM2\n", ProgramSettings())
    run, end = from_line(program, line).steps
    assert run.start == pytest.approx((begin, 0.0, 0.0))
    assert end.kind is StopKind.END
