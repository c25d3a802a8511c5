"""Soak of the inputs: bytes of any kind on every topic, service and action of all nodes.

Run it as ``python -m benchmarks.soak_bytes --count 1000000``; it exits with 1 if a node ended, has
grown or answers no more, or if the machine moved, or does not move afterwards when it is told to.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from tempfile import TemporaryDirectory
from typing import Any

from rcl_interfaces.srv import ListParameters

from benchmarks.command_line import numbers
from benchmarks.soak_nodes import context_in_own_domain, resident, say, session, verdict
from testing.byte_fuzzing import Fuzzer
from testing.machine import Machine
from testing.scenarios import assert_normal_target_is_reached

BATCH = 10_000
# A node that makes what one request claims grows by 900 MB.
MOST_GROWTH = 30.0  # MB


def main() -> int:
    """Run the soak from the command line."""
    count = numbers(__doc__, count=(1_000_000, "inputs")).count
    passed = True
    with (
        TemporaryDirectory() as folder,
        context_in_own_domain() as context,
        session(context, "bytes_led") as (client, nodes),
        session(context, "bytes_alone") as (other, launcher),
    ):
        machine = Machine(client, nodes).start()
        nodes.start("fk_node")
        led = ("simulator_node", "ik_node", "fk_node")
        # Whoever sends setpoints is a fault, so others that listen to these have no ik_node.
        alone = ["simulator_node", "calibration_node", "mechanism_node"]
        alone += ["panel_node"] if find_spec("viser") else []
        # Requests to save are valid, whatever the name.
        own: dict[str, dict[str, Any]] = {
            "panel_node": {"port": 0},
            "calibration_node": {"folder": folder},
        }
        for name in alone:
            launcher.start(name, own.get(name))
        pairs = ((client, led, ("joint_commands",)), (other, tuple(alone), ()))
        fuzzers = [(one, Fuzzer(one, names, but)) for one, names, but in pairs]
        machine.catch_up()
        resting = machine.heights()
        everyone = (*nodes.started, *launcher.started)
        sizes: list[dict[int, float]] = []
        sent = 0
        while sent < count and passed:
            for one, fuzzer in fuzzers:
                sent += fuzzer.run(one, BATCH // 2)
            # Among the requests is one to disable the machine.
            client.wait_for(lambda: client.enable().success, "the machine to be enabled")
            machine.catch_up()
            moved = {machine.heights(message) for message in machine.commands} - {resting}
            ended = [node.name for node in everyone if not node.is_running]
            running = [node for node in everyone if node.is_running]
            sizes.append({node.pid: resident(node) for node in running})
            grown = max(size - sizes[0].get(pid, size) for pid, size in sizes[-1].items())
            say(
                f"{sent} inputs, ended: {ended}, other setpoints: {len(moved)}, "
                f"the largest growth of a node: {grown:.0f} MB"
            )
            passed = not moved and not ended and grown < MOST_GROWTH
            if moved:
                say(f"states: {[state.reason for state in machine.states][-20:]}")
            del machine.commands[:-1], machine.measured[:-1], machine.states[:-1]
        for _, fuzzer in fuzzers:
            fuzzer.close()
        for one, names, _ in pairs:
            for name in names:
                one.call(ListParameters, f"{name}/list_parameters", ListParameters.Request())
        assert_normal_target_is_reached(machine)
    return verdict(passed)


if __name__ == "__main__":
    sys.exit(main())
