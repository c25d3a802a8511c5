"""Soak of the nodes as real processes: rough treatment, drivers that die, ten minutes at 1 kHz.

Run it as ``python -m benchmarks.soak_nodes``; it exits with 1 if a process ended, a limit was
broken, a target was not reached, an output was left on, or the memory of a process grew by more
than 1 MB after the first minute.
"""

import os
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context

from benchmarks.command_line import numbers
from benchmarks.machine import processor_time
from testing.client import Client
from testing.commands import assert_stretches_within_limits
from testing.domain import own_context, own_domain
from testing.forks import ForkedNodes
from testing.machine import Machine
from testing.processes import TIMEOUT, Launcher, RunningNode, launched, python_path
from testing.scenarios import (
    NORMAL_VALUES,
    assert_normal_target_is_reached,
    flood,
    parameter_storm,
)
from tri_glide_interfaces.msg import FourBar, Output
from tri_glide_interfaces.srv import SolveFourBar
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS
from tri_glide_kinematics.ros.starting import COMPUTER, choose_transport, executable

TARGETS = ((0.08, 0.03, 0.35), (-0.06, 0.05, 0.22), (0.0, 0.0, 0.25))
ALL_NODES = ("simulator_node", "ik_node", "fk_node", "mechanism_node")
# Outputs at rest and on the way, a dwell, and a stop at which it would wait.
DYING = "M3 S9 M8\nG4 P0.5\nG64 P1\nG1 X0 Y0 Z40 F6000\nX60 F1800\nM9\nM8\nX0\nG4 P9\nM2\n"
# Until all is off: program_timeout, what was told just before, the stop, and a busy computer [s].
LONGEST_DEATH = 2.0
ALLOWED_GROWTH = 1.0  # MB, after the first minute
FLOOD_RATE = 10_000.0  # targets a second
MEGABYTE = 1024.0 * 1024.0


def say(text: str) -> None:
    """Print one line at once."""
    print(f"soak: {text}", flush=True)


def verdict(passed: bool, reason: str = "") -> int:
    """Say whether a soak has passed, or the ``reason`` why not, and return its exit code."""
    say("passed" if passed else f"FAILED {reason}")
    return 0 if passed else 1


@contextmanager
def context_in_own_domain() -> Iterator[Context]:
    """Give a context in a domain of its own."""
    with own_domain():
        say(choose_transport(COMPUTER).text)
        with own_context() as context:
            yield context


@contextmanager
def session(context: Context, name: str) -> Iterator[tuple[Client, Launcher]]:
    """Give a client and a launcher in a namespace of their own."""
    with tempfile.TemporaryDirectory() as folder:
        client = Client(context, f"/soak_{name}")
        try:
            with launched(Path(folder), client.namespace) as launcher:
                yield client, launcher
        finally:
            client.close()


def rough_treatment(context: Context, minutes: float) -> None:
    """Abuse a machine in two ways, for so long each, and check it afterwards."""
    duration = 60.0 * minutes
    for name in ("flood", "parameter storm"):
        say(f"{name} for {duration:.0f} s")
        with session(context, name.replace(" ", "_")) as (client, launcher):
            machine = Machine(client, launcher).start()
            if name == "flood":
                for kind in ("pose", "twist", "state"):
                    flood(machine, FLOOD_RATE, round(FLOOD_RATE * duration / 3.0), kind)
            else:
                say(f"{parameter_storm(machine, duration)} sets of parameters")
            assert machine.ik.is_running
            assert machine.simulator.is_running
            assert client.set_parameters("ik_node", NORMAL_VALUES).successful
            assert_normal_target_is_reached(machine)
            assert_stretches_within_limits(machine)
            say(f"{len(machine.commands)} commands, none outside the limits")


def deaths(context: Context, count: int, seed: int = 51) -> float:
    """Kill so many programs at random instants; return the longest time until all is off [s]."""
    say(f"{count} programs whose driver is killed")
    rng, longest = random.Random(seed), 0.0
    with session(context, "deaths") as (client, launcher), tempfile.TemporaryDirectory() as folder:
        machine = Machine(client, launcher).start()
        outputs = client.record(Output, "true_outputs", LATEST_OUTPUTS)
        file = Path(folder) / "part.gcode"
        file.write_text(DYING)
        log, forks = Path(folder) / "drive.log", ForkedNodes({"PYTHONPATH": python_path()})
        command = [str(executable("drive")), str(file), "--progress", f"{folder}/kept.yaml"]
        command += ["--ros-args", "-r", f"__ns:={client.namespace}"]

        def is_on() -> bool:
            return any({each.name: each.value for each in outputs}.values())

        for number in range(count):
            driver = forks.start_command(command, log)
            try:
                client.wait_for(is_on, f"the spindle: {log}", 5.0 * TIMEOUT)
                client.spin_for(rng.uniform(0.0, 5.0))
            finally:
                driver.kill()
                driver.wait(TIMEOUT)
            killed = time.monotonic()
            client.wait_for(lambda: not is_on(), "outputs that are off", longest_nap=0.01)
            taken = time.monotonic() - killed
            longest = max(longest, taken)
            assert not any(machine.commands[-1].velocity)
            client.wait_for(lambda: machine.cause is Cause.PROGRAM_LOST, "the lost run")
            say(f"{number + 1}: off after {taken:.2f} s, the longest {longest:.2f} s")
            del machine.commands[:-1], machine.measured[:-1], machine.states[:-1]
    return longest


def resident(node: RunningNode) -> float:
    """Return the resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{node.pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / MEGABYTE


def endurance(context: Context, minutes: float, rate: float) -> bool:
    """Run all nodes, with targets all the time; return whether memory stayed flat."""
    say(f"all nodes at {rate:g} Hz for {minutes:g} minutes")
    with session(context, "endurance") as (client, launcher):
        machine = Machine(client, launcher, listen=False)
        for name in ALL_NODES:
            parameters = {} if name == "mechanism_node" else {"rate": rate}
            node = launcher.start(name, {**parameters, "measured_timeout": 1.0})
            if name == "ik_node":
                machine.ik = node
        diagnostics = client.record(DiagnosticArray, "/diagnostics", keep=1000)
        machine.wait_until_connected()
        request = SolveFourBar.Request(
            linkage=FourBar(crank=2.0, coupler=7.0, rocker=9.0, ground=6.0), crank_angle=0.5
        )
        begin = time.monotonic()
        busy = [processor_time(node.pid) for node in launcher.started]
        sizes: list[list[float]] = [[] for _ in launcher.started]
        settled = 0
        moves = 0
        while (elapsed := time.monotonic() - begin) < 60.0 * minutes:
            target = TARGETS[moves % len(TARGETS)]
            machine.wait_for_new_state("idle", partial(client.send_pose, target))
            moves += 1
            assert client.call(SolveFourBar, "mechanism_node/solve_four_bar", request).success
            assert all(node.is_running for node in launcher.started)
            for size, node in zip(sizes, launcher.started):
                size.append(resident(node))
            if elapsed < 60.0:
                settled = len(sizes[0]) - 1
        elapsed = time.monotonic() - begin
        flat = True
        for node, size, before in zip(launcher.started, sizes, busy):
            growth = max(size[settled:]) - size[settled]
            flat = flat and growth <= ALLOWED_GROWTH
            load = 1e-7 * (processor_time(node.pid) - before) / elapsed
            say(
                f"{node.name:15} {size[settled]:6.1f} MB after a minute, then at most "
                f"{growth:+.2f} MB; {load:.0f} % of a core"
            )
        values = [
            {entry.key: entry.value for entry in status.values}
            for array in diagnostics
            for status in array.status
            if status.name.endswith("ik_node")
        ]
        rates = sorted(float(entry["loop rate [1/s]"]) for entry in values[1:])
        say(
            f"{moves} moves; {rates[len(rates) // 2]:.1f} cycles a second, "
            f"{values[-1]['late cycles']} late"
        )
        assert "fault" not in machine.states_since(0)
    return flat


def main() -> int:
    """Run the soak from the command line."""
    arguments = numbers(
        __doc__,
        rough_minutes=(1.0, "of each rough treatment"),
        deaths=(20, "programs whose driver is killed"),
        minutes=(10.0, "of endurance"),
        rate=(1000.0, "cycles a second"),
    )
    with context_in_own_domain() as context:
        if arguments.rough_minutes > 0.0:
            rough_treatment(context, arguments.rough_minutes)
        longest = deaths(context, arguments.deaths)
        if longest > LONGEST_DEATH:
            return verdict(False, f"{longest:.2f} s until an output was off")
        if arguments.minutes <= 0.0:
            return verdict(True)
        flat = endurance(context, arguments.minutes, arguments.rate)
    return verdict(flat, "the memory of a process grows")


if __name__ == "__main__":
    sys.exit(main())
