"""No bytes, on whatever topic, service or action of any node, end it or move anything."""

from shared_machine import shared_nodes

from benchmarks.soak_bytes import soak

# ``make soak`` has more.
COUNT = 3_000


def test_bytes_by_chance_end_no_node_and_move_nothing(client, nodes, ros_context, tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("files"))
    with shared_nodes(ros_context, tmp_path_factory, "fuzzed") as alone:
        assert soak((client, nodes), alone, folder, COUNT) == []
