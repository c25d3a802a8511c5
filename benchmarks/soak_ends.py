"""Soak of the transport: clients that end without a clean shutdown, and starts of a machine.

Run it as ``python -m benchmarks.soak_ends``; it exits with 1 if clients that exit or are killed
delay a control cycle by 20 ms more than the largest delay alone, if a machine faults, or if one of
many starts of ``simulator_node`` and ``ik_node`` with their defaults ends in a fault.
"""

import sys
import time

from rclpy.context import Context

from benchmarks.command_line import numbers
from benchmarks.soak_nodes import context_in_own_domain, say, session, verdict
from testing.client import Client
from testing.ends import Delays, delays_alone, delays_beside_ends, run_in_real_time
from testing.machine import Machine
from testing.processes import Launcher

TIME_PER_CLIENT = 0.75  # s, about what a client takes; so long the machine runs alone before
ALLOWED = 0.020  # s more than alone
WATCHED = 2.0  # s that a start is watched for after the machine is idle


def in_milliseconds(delays: list[float]) -> str:
    """Return the largest delays [s] as text."""
    return f"largest delays {' '.join(f'{1e3 * delay:.1f}' for delay in delays)} ms"


def start_with_defaults(client: Client, launcher: Launcher) -> Machine:
    """Start a machine as a user does: those of tests are more patient."""
    machine = Machine(client, launcher, listen=False)
    machine.start_simulator()
    machine.ik = launcher.start("ik_node")
    machine.wait_for_state("idle")
    return machine


def ends(context: Context, counts: dict[str, int]) -> bool:
    """Let clients end beside a running machine; return whether its control cycle went on.

    The time alone comes first: what a dead process holds up may come later.
    """
    with session(context, "ends") as (client, launcher):
        machine = start_with_defaults(client, launcher)
        if not all(run_in_real_time(node.pid) for node in launcher.started):
            say("real-time priority is not allowed here: other processes delay cycles, too")
        delays = Delays(machine)
        time_alone = TIME_PER_CLIENT * sum(counts.values())
        alone = delays_alone(machine, delays, time_alone)
        say(f"{time_alone:.0f} s alone: {in_milliseconds(alone)}")
        passed = True
        for way, count in counts.items():
            if count:
                begin = time.monotonic()
                beside = delays_beside_ends(machine, delays, way, count)
                elapsed = time.monotonic() - begin
                say(f"{count} clients end by {way} in {elapsed:.0f} s: {in_milliseconds(beside)}")
                passed = beside[0] <= alone[0] + ALLOWED and passed
        if "fault" in machine.states_since(0):
            say(f"a fault: {machine.reason}")
            passed = False
    return passed


def starts(context: Context, count: int) -> bool:
    """Start a machine again and again; return whether it never faulted."""
    faults = 0
    for number in range(count):
        with session(context, f"start_{number}") as (client, launcher):
            machine = start_with_defaults(client, launcher)
            client.spin_for(WATCHED)
            if "fault" in machine.states_since(0):
                faults += 1
                say(f"start {number}: {machine.reason}")
    say(f"{count} starts, {faults} faults")
    return not faults


def main() -> int:
    """Run the soak from the command line."""
    arguments = numbers(
        __doc__,
        exits=(200, "clients that exit at once"),
        kills=(200, "clients that are killed"),
        starts=(100, "of simulator_node and ik_node"),
    )
    with context_in_own_domain() as context:
        passed = True
        if arguments.exits or arguments.kills:
            passed = ends(context, {"exit": arguments.exits, "kill": arguments.kills})
        passed = starts(context, arguments.starts) and passed
    return verdict(passed)


if __name__ == "__main__":
    sys.exit(main())
