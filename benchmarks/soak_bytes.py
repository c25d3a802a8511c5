"""Soak of the inputs: bytes of any kind on every topic, service and action of all nodes.

Run it as ``python -m benchmarks.soak_bytes --count 1000000``; it exits with 1 if a node ended, has
grown or answers no more, or if the machine moved, or does not move afterwards when it is told to.
"""

import sys
from importlib.util import find_spec
from tempfile import TemporaryDirectory

from rcl_interfaces.srv import ListParameters

from benchmarks.command_line import numbers
from benchmarks.soak_nodes import context_in_own_domain, resident, say, session, verdict
from testing.byte_fuzzing import Fuzzer
from testing.client import Client
from testing.machine import Machine
from testing.processes import Launcher
from testing.scenarios import assert_normal_target_is_reached

BATCH = 10_000
MOST_LINES = 500  # in the log of a node for each batch: some of each kind in a second
INPUTS = {
    "/joint_states",
    "/target_path",
    "/ik_node/stop",
    "/ik_node/follow_path/_action/send_goal",
    "/fk_node/set_parameters",
}
# A node that makes what one request claims grows by 900 MB.
MOST_GROWTH = 30.0  # MB


def soak(
    led: tuple[Client, Launcher], alone: tuple[Client, Launcher], folder: str, count: int
) -> list[str]:
    """Send bytes to all nodes, with ik_node in one namespace and without it in another.

    Args:
        led: client and launcher of a machine with ik_node.
        alone: the same where others listen to setpoints: whoever sends these is a fault.
        folder: for measurements, as requests to save are valid, whatever the name.
        count: of the inputs that are sent.

    Returns:
        What was wrong.
    """
    client = led[0]
    machine = Machine(*led).start()
    led[1].start("fk_node")
    alone[1].start("simulator_node")
    alone[1].start("calibration_node", {"folder": folder})
    alone[1].start("mechanism_node")
    if find_spec("viser"):
        alone[1].start("panel_node", {"port": 0})
    everyone = (*led[1].started, *alone[1].started)
    fuzzers = [
        (one, Fuzzer(one, [node.name for node in launcher.started], but))
        for (one, launcher), but in ((led, ("joint_commands",)), (alone, ()))
    ]
    missing = INPUTS - {one.name.removeprefix(machine.namespace) for one in fuzzers[0][1].inputs}
    wrong = [f"nothing was sent to {name}" for name in sorted(missing)]
    machine.catch_up()
    resting = machine.heights()
    sizes: list[dict[int, float]] = []
    sent = 0
    while sent < count and not wrong:
        for one, fuzzer in fuzzers:
            sent += fuzzer.run(one, min(BATCH, count) // 2)
        # Among the requests is one to disable the machine.
        client.wait_for(lambda: client.enable().success, "the machine to be enabled")
        machine.catch_up()
        if moved := {machine.heights(message) for message in machine.commands} - {resting}:
            reasons = [state.reason for state in machine.states][-20:]
            wrong.append(f"{len(moved)} other setpoints; states: {reasons}")
        for node in everyone:
            if not node.is_running:
                wrong.append(f"{node.name} has ended: {node.written[-300:]}")
            # What the library itself writes of requests that it cannot read is not ours to bound.
            lines = sum(line.startswith("[") for line in node.written.splitlines())
            if lines > MOST_LINES * max(1, sent // BATCH):
                wrong.append(f"{node.name} has written {lines} lines: {node.written[-300:]}")
        sizes.append({node.pid: resident(node) for node in everyone if node.is_running})
        grown = max(size - sizes[0].get(pid, size) for pid, size in sizes[-1].items())
        say(f"{sent} inputs, the largest growth of a node: {grown:.0f} MB")
        if grown >= MOST_GROWTH:
            wrong.append(f"a node has grown by {grown:.0f} MB")
        machine.forget()
    for _, fuzzer in fuzzers:
        fuzzer.close()
    if not wrong:
        for one, launcher in (led, alone):
            for node in launcher.started:
                kind = ListParameters
                assert one.call(kind, f"{node.name}/list_parameters", kind.Request())
        assert_normal_target_is_reached(machine)
    return wrong


def main() -> int:
    """Run the soak from the command line."""
    count = numbers(__doc__, count=(1_000_000, "inputs")).count
    with (
        TemporaryDirectory() as folder,
        context_in_own_domain() as context,
        session(context, "bytes_led") as led,
        session(context, "bytes_alone") as alone,
    ):
        wrong = soak(led, alone, folder, count)
    for text in wrong:
        say(text)
    return verdict(not wrong)


if __name__ == "__main__":
    sys.exit(main())
