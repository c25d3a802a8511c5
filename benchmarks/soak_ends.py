"""Soak of the transport: clients that end without a clean shutdown, and starts of a machine.

Run it as ``python -m benchmarks.soak_ends``; it exits with 1 if clients that exit or are killed
make a gap in the commands that is more than 20 ms longer than the longest one alone, or if one of
many starts of ``simulator_node`` and ``ik_node`` with their defaults ends in a fault.
"""

from __future__ import annotations

import argparse
import sys
import time

from rclpy.context import Context

from benchmarks.soak_nodes import context_in_own_domain, say, session
from testing.ends import Stream, gaps_alone, gaps_beside_ends, run_in_real_time
from testing.machine import Machine

TIME_PER_CLIENT = 0.75  # s, about what a client takes; so long the machine runs alone before
ALLOWED = 0.020  # s more than alone
WATCHED = 2.0  # s that a start is watched for after the machine is idle


def in_milliseconds(gaps: list[float]) -> str:
    """Return the longest gaps [s] as text."""
    return f"longest gaps {' '.join(f'{1e3 * gap:.1f}' for gap in gaps)} ms"


def ends(context: Context, counts: dict[str, int]) -> bool:
    """Let clients end beside a running machine; return whether its commands went on.

    The time alone comes first: what a dead process holds up may come later.
    """
    with session(context, "ends") as (client, launcher):
        machine = Machine(client, launcher, listen=False).start()
        if not all(run_in_real_time(node.pid) for node in launcher.started):
            say("real-time priority is not allowed here: gaps are also made by other processes")
        stream = Stream(machine)
        time_alone = TIME_PER_CLIENT * sum(counts.values())
        alone = gaps_alone(machine, stream, time_alone)
        say(f"{time_alone:.0f} s alone: {in_milliseconds(alone)}")
        passed = True
        for way, count in counts.items():
            if count:
                begin = time.monotonic()
                gaps = gaps_beside_ends(machine, stream, way, count)
                elapsed = time.monotonic() - begin
                say(f"{count} clients end by {way} in {elapsed:.0f} s: {in_milliseconds(gaps)}")
                passed = gaps[0] <= alone[0] + ALLOWED and passed
    return passed


def starts(context: Context, count: int) -> bool:
    """Start a machine again and again; return whether it never faulted."""
    faults = 0
    for number in range(count):
        with session(context, f"start_{number}") as (client, launcher):
            machine = Machine(client, launcher, listen=False)
            machine.start_simulator()
            # With its defaults: the machines of tests are more patient.
            machine.ik = launcher.start("ik_node")
            machine.wait_for_state("idle")
            client.spin_for(WATCHED)
            if "fault" in machine.ik.output:
                faults += 1
                say(f"start {number}: {machine.reason}")
    say(f"{count} starts, {faults} faults")
    return not faults


def main() -> int:
    """Run the soak from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--exits", type=int, default=200, help="clients that exit at once")
    parser.add_argument("--kills", type=int, default=200, help="clients that are killed")
    parser.add_argument("--starts", type=int, default=100, help="of simulator_node and ik_node")
    arguments = parser.parse_args()
    with context_in_own_domain() as context:
        passed = True
        if arguments.exits or arguments.kills:
            passed = ends(context, {"exit": arguments.exits, "kill": arguments.kills})
        passed = starts(context, arguments.starts) and passed
    say("passed" if passed else "FAILED")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
