"""Many calls at once: each of them is answered.

Where clients have rclpy's own settings, the node stands still while it is called. Otherwise it may
answer each call before the next one is made, if the computer is busy; and of the answers that come
while a client does not look, it keeps ten.
"""

import pytest
from rcl_interfaces.srv import GetParameters
from shared_machine import shared_nodes
from std_srvs.srv import SetBool, Trigger

from testing.client import Client
from testing.machine import Machine
from tri_glide_interfaces.srv import ListMeasurements, SolveFourBar

# The middleware keeps ten of each.
CLIENTS, CALLS = 30, 20
PATIENCE = 30.0  # s, for what takes three at most

# One of each way in which nodes look at services: in each cycle, in turns beside a cycle that
# waits for its time or for messages, and by rclpy alone.
SERVICES = {
    "ik_node/stop": (Trigger, Trigger.Request()),
    "ik_node/enable": (SetBool, SetBool.Request(data=True)),
    "fk_node/get_parameters": (GetParameters, GetParameters.Request(names=["use_sim_time"])),
    "calibration_node/list": (ListMeasurements, ListMeasurements.Request()),
    "mechanism_node/solve_four_bar": (SolveFourBar, SolveFourBar.Request()),
}

# What is lost as a client is kept from looking is not the nodes' fault.
pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def cell(ros_context, tmp_path_factory):
    """Return a machine beside which the other nodes run."""
    with shared_nodes(ros_context, tmp_path_factory, "calls") as (client, launcher):
        for name in ("fk_node", "calibration_node", "mechanism_node"):
            launcher.start(name)
        Machine(client, launcher).start()
        yield client.namespace, {node.name: node for node in launcher.started}


@pytest.fixture
def caller(cell, ros_context):
    """Return a client that listens to nothing."""
    namespace, _ = cell
    client = Client(ros_context, namespace)
    yield client
    client.close()


@pytest.fixture
def at_once(cell):
    """Return what lets the node of a service stand still."""
    _, nodes = cell
    return lambda name: nodes[name.split("/")[0]].standing_still()


def clients_of(caller, name, count):
    """Make clients with rclpy's own settings that know a service, which go with their node."""
    clients = [caller.node.create_client(SERVICES[name][0], name) for _ in range(count)]
    for client in clients:
        caller.wait_for(client.service_is_ready, name)
    return clients


def calls(clients, name, times=1):
    """Call before any answer is looked at."""
    return [client.call_async(SERVICES[name][1]) for client in clients for _ in range(times)]


def wait_for_all(caller, futures):
    caller.wait_for(lambda: all(each.done() for each in futures), "all answers", PATIENCE)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ik_node/stop", "fk_node/get_parameters"])
def test_each_of_many_clients_gets_its_answer(caller, at_once, name):
    clients = clients_of(caller, name, CLIENTS)
    with at_once(name):
        futures = calls(clients, name)
    wait_for_all(caller, futures)


@pytest.mark.parametrize("name", SERVICES)
def test_each_call_of_one_client_gets_its_answer(caller, at_once, name):
    clients = clients_of(caller, name, 1)
    # Of what it sends before the node knows it, the middleware keeps ten.
    wait_for_all(caller, calls(clients, name))
    with at_once(name):
        futures = calls(clients, name, CALLS)
    wait_for_all(caller, futures)
