"""Programs of our own writer mean what they were written for, in each dialect."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from soak import some

from testing.program_writer import Piece, WrittenProgram, written_program
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.path import FlatPath
from tri_glide_kinematics.programs import (
    Dialect,
    Dwell,
    Output,
    PathRun,
    Program,
    ProgramStop,
    read_program,
)

PARTS = np.linspace(0.0, 1.0, 9)


def places_on(run: PathRun):
    """Return places on all segments as programmed. Shape (n, parts, 3) [m]."""
    flat = run.segments
    exact = FlatPath.of(flat.kinds, flat.numbers, (0.0,), (), 0.0)
    path = at_once(exact.path_from(run.start))
    joints = path.segments.joints
    ways = joints[:-1, np.newaxis] + PARTS * np.diff(joints)[:, np.newaxis]
    spans = np.repeat(np.arange(len(flat)), len(PARTS))
    driven = path.driven
    assert len(driven.segment) == len(flat)
    return driven.derivatives_on(spans, ways.ravel(), 0)[0].reshape(len(flat), len(PARTS), 3)


def said_by(output: Output):
    return output.name, output.number, output.value


def done_by(program: Program):
    """Yield what a program does, each with its line, and with the number of the run of a piece."""
    for number, step in enumerate(program.steps):
        if isinstance(step, PathRun):
            places, flat = places_on(step), step.segments
            for index, line in enumerate(step.lines.tolist()):
                for output in step.outputs:
                    if output.joint == index:
                        yield said_by(output), output.line, -1
                bounds = flat.speeds[index], flat.tolerances[index]
                yield (places[index], *bounds), line, number
        elif isinstance(step, Dwell):
            yield step.duration, step.line, -1
        elif isinstance(step, Output):
            yield said_by(step), step.line, -1
        elif isinstance(step, ProgramStop):
            yield step.kind, step.line, -1


def check_meaning(written: WrittenProgram) -> None:
    program = read_program(written.text, written.settings)
    found = list(done_by(program))
    expected = [each for each in zip(written.meant, written.lines) if each[0] is not None]
    assert [line for _, line, _ in found] == [line for _, line in expected]
    for (done, _, _), (meant, _) in zip(found, expected):
        if isinstance(meant, Piece):
            places, speed, tolerance = done
            assert np.linalg.norm(places - meant.at(PARTS), axis=1).max() < 1e-9
            assert speed == pytest.approx(meant.speed, rel=1e-9)
            assert tolerance == pytest.approx(meant.tolerance, abs=1e-12)
        else:
            assert done == pytest.approx(meant) if isinstance(meant, float) else done == meant
    # It rests where it is to rest, and nowhere else.
    runs = [number for _, _, number in found if number >= 0]
    rests, has_rested = [], False
    for meant in written.meant:
        if isinstance(meant, Piece):
            rests.append(has_rested)
            has_rested = False
        elif not isinstance(meant, tuple):
            has_rested = True
    assert (np.diff(runs) > 0).tolist() == rests[1:]


@pytest.mark.slow
@pytest.mark.parametrize("dialect", Dialect)
@given(seed=st.integers(0, 2**32 - 1))
@settings(derandomize=True, deadline=None, max_examples=len(some(range(100), 12)))
def test_a_program_means_what_it_was_written_for(dialect, seed):
    check_meaning(written_program(np.random.default_rng(seed), dialect))
