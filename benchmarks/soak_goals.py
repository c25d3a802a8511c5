"""Soak of the actions of ik_node: goals, cancels and newer commands, over real processes.

Run it as ``python -m benchmarks.soak_goals``; it exits with 1 if a result is lost, wrong or given
twice, or if one comes more than 20 ms after what ended its goal.
"""

import gc
import os
import sys

from benchmarks.command_line import numbers
from benchmarks.soak_nodes import context_in_own_domain, resident, say, session, verdict
from testing.ends import run_in_real_time
from testing.goal_storm import GoalStorm
from testing.goals import GoalClient
from testing.machine import Machine

# A stop takes as long as it takes: only what ends a goal at once is judged.
WITHOUT_LIMIT = ("cancel, to rest",)
LONGEST_DELAY = 0.02  # s
BATCH = 1000
CLIENT_PRIORITY = 5  # in real time


def main() -> int:
    """Run the soak from the command line."""
    arguments = numbers(__doc__, goals=(10_000, "to be sent"), seed=(1, "of these"))
    passed = True
    with (
        context_in_own_domain() as context,
        session(context, "goals") as (client, launcher),
    ):
        machine = Machine(client, launcher, listen=False)
        machine.start()
        goals = GoalClient(client)
        goals.wait_for_server()
        nodes = [run_in_real_time(node.pid) for node in launcher.started]
        # Who sends goals does not hold the machine, nor the threads that take in what it sends.
        if not all((*nodes, run_in_real_time(os.getpid(), main=CLIENT_PRIORITY))):
            say("real-time priority is not allowed here: other processes delay results, too")
        # The collector of garbage would hold this client for 35 ms and more at a time.
        gc.disable()
        for number in range(0, arguments.goals, BATCH):
            gc.collect()
            storm = GoalStorm(machine, goals, arguments.seed + number)
            report = storm.run(min(BATCH, arguments.goals - number))
            ends = ", ".join(f"{count} {code.name}" for code, count in report.codes.items())
            say(f"{report.goals} goals: {ends}; memory {resident(machine.ik):.1f} MB")
            for kind, delay in report.largest_delays().items():
                rest = report.largest_delays(0.01)[kind]
                say(f"  {kind}: {1e3 * delay:.1f} ms at most, {1e3 * rest:.1f} ms for 99 %")
                if kind not in WITHOUT_LIMIT:
                    passed = passed and delay <= LONGEST_DELAY
            for text in report.wrong:
                say(f"  WRONG: {text}")
            passed = passed and not report.wrong
    return verdict(passed)


if __name__ == "__main__":
    sys.exit(main())
