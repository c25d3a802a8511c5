"""A client that ends without a clean shutdown does not hold the stream of commands.

``benchmarks/soak_ends.py`` does the same for hundreds of clients.
"""

from __future__ import annotations

import pytest

from testing.ends import WAYS, Stream, gaps_alone, gaps_beside_ends, run_in_real_time

COUNT = 16  # by shared memory, about one end of four makes a gap of 0.2 s and longer
TIME_ALONE = 10.0  # s
ALLOWED = 0.15  # s more than alone: other tests may keep this computer busy


@pytest.mark.parametrize("way", WAYS)
def test_commands_go_on_beside_clients_that_end(machine, way):
    machine.start()
    run_in_real_time(machine.ik.pid)
    stream = Stream(machine)
    alone = gaps_alone(machine, stream, TIME_ALONE)
    gaps = gaps_beside_ends(machine, stream, way, COUNT)
    assert gaps[0] < alone[0] + ALLOWED
