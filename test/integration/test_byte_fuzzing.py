"""No bytes, on whatever topic, service or action of any node, end it or move anything."""

from importlib.util import find_spec

from rcl_interfaces.srv import ListParameters
from shared_machine import shared_nodes

from testing.byte_fuzzing import Fuzzer
from testing.scenarios import assert_normal_target_is_reached

# ``make soak`` has more.
COUNT = 6_000
MOST_LINES = 500  # in the log of a node: some of each kind in a second


def lines_of(node):
    """Return the lines of the log of a ``node``."""
    return [line for line in node.written.splitlines() if line.startswith("[")]


def test_bytes_by_chance_end_no_node_and_move_nothing(
    machine, client, nodes, ros_context, tmp_path_factory
):
    machine.start()
    nodes.start("fk_node")
    led = ("simulator_node", "ik_node", "fk_node")
    # Whoever sends setpoints is a fault, so others that listen to these have no ik_node.
    with shared_nodes(ros_context, tmp_path_factory, "fuzzed") as (other, launcher):
        alone = ["simulator_node", "calibration_node", "mechanism_node"]
        # Requests to save are valid, whatever the name.
        folder = {"folder": str(tmp_path_factory.mktemp("files"))}
        for name in alone:
            launcher.start(name, folder if name == "calibration_node" else None)
        if find_spec("viser"):
            alone.append("panel_node")
            launcher.start("panel_node", {"port": 0})
        fuzzers = (Fuzzer(client, led, but=("joint_commands",)), Fuzzer(other, alone))
        found = {one.name.removeprefix(machine.namespace) for one in fuzzers[0].inputs}
        assert found > {
            "/joint_states",
            "/target_path",
            "/ik_node/stop",
            "/ik_node/follow_path/_action/send_goal",
            "/fk_node/set_parameters",
        }
        machine.catch_up()
        resting, first = machine.heights(), len(machine.commands)
        for fuzzer, each in zip(fuzzers, (client, other)):
            assert fuzzer.run(each, COUNT // 2) >= COUNT // 2
            fuzzer.close()
        for node in (*nodes.started, *launcher.started):
            assert node.is_running, f"{node.name}: {len(node.written)} {node.written[-300:]}"
            # What the library itself writes of requests that it cannot read is not ours to bound.
            assert len(lines_of(node)) < MOST_LINES, node.written[-300:]
        for each, names in ((client, led), (other, alone)):
            for name in names:
                assert each.call(
                    ListParameters, f"{name}/list_parameters", ListParameters.Request()
                )
    # Among the requests is one to disable the machine.
    client.wait_for(lambda: client.enable().success, "the machine to be enabled")
    machine.catch_up()
    assert {machine.heights(message) for message in machine.commands[first:]} == {resting}
    assert_normal_target_is_reached(machine)
