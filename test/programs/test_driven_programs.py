"""Random programs are driven within their tolerances, and tell each output at its place."""

import numpy as np
import pytest
from soak import some

from testing.driven_programs import DrivenProgram, drive_program
from testing.program_writer import written_program
from tri_glide_kinematics.programs import Dialect

COUNT = len(some(range(3), 1))  # of each dialect
THINGS = 5  # that a program does
# Differences over a cycle see a little more than there is.
ROUNDING = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("dialect", Dialect)
def test_programs_keep_their_path_and_tell_their_outputs_where_they_belong(dialect):
    found = DrivenProgram()
    for seed in range(COUNT):
        rng = np.random.default_rng((seed, *dialect.name.encode()))
        found.add(drive_program(written_program(rng, dialect, THINGS), rng))
    assert found.runs >= COUNT - found.refused
    assert found.outputs > 0
    assert found.missing == 0
    # The nearest setpoint may be the one before.
    assert found.farthest <= 1
    assert found.distance <= 1.0
    assert found.use <= 1.0 + ROUNDING
