"""A client that ends without a clean shutdown does not hold the control cycle.

``benchmarks/soak_ends.py`` does the same for hundreds of clients.
"""

import pytest

from testing.ends import WAYS, Delays, delays_alone, delays_beside_ends, run_in_real_time

pytestmark = pytest.mark.alone

# Of each way: by shared memory, about one end of four holds the cycle for 0.2 s and longer.
COUNT = 4
TIME_ALONE = 2.0  # s
ALLOWED = 0.15  # s more than alone: other programs may keep this computer busy


def test_the_cycle_goes_on_beside_clients_that_end(machine):
    machine.start()
    run_in_real_time(machine.ik.pid)
    delays = Delays(machine)
    alone = delays_alone(machine, delays, TIME_ALONE)
    for way in WAYS:
        beside = delays_beside_ends(machine, delays, way, COUNT)
        assert beside[0] < alone[0] + ALLOWED, way
