"""Many calls at once, by clients with rclpy's own settings: each of them is answered."""

from __future__ import annotations

import pytest
from rcl_interfaces.srv import GetParameters
from shared_machine import shared_machine
from std_srvs.srv import SetBool, Trigger

from testing.client import Client
from testing.crowd import Crowd
from testing.goals import GoalClient
from tri_glide_interfaces.srv import ListMeasurements, SolveFourBar
from tri_glide_kinematics.motion.engine import GoalCode

CLIENTS, CALLS, GOALS = 50, 20, 100

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
    others = ("fk_node", "calibration_node", "mechanism_node")
    with shared_machine(ros_context, tmp_path_factory, "calls", others=others) as machine:
        yield machine


@pytest.fixture
def caller(cell, ros_context):
    """Return a client that listens to nothing."""
    client = Client(ros_context, cell.namespace)
    yield client
    client.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ik_node/stop", "fk_node/get_parameters"])
def test_each_of_many_clients_gets_its_answer(caller, name):
    kind, request = SERVICES[name]
    with Crowd(caller, kind, name, CLIENTS) as crowd:
        crowd.call(request)
        crowd.wait()


@pytest.mark.parametrize("name", SERVICES)
def test_each_call_of_one_client_gets_its_answer(caller, name):
    kind, request = SERVICES[name]
    with Crowd(caller, kind, name, 1) as crowd:
        # Of what it sends before the node knows it, the middleware keeps ten.
        crowd.call(request)
        crowd.wait()
        crowd.call(request, CALLS)
        crowd.wait()


@pytest.mark.slow
@pytest.mark.parametrize("action", ["move_to", "follow_path"])
def test_each_of_many_goals_is_accepted_and_ends(caller, action):
    client = GoalClient(caller)
    send = {
        "move_to": client.move_to,
        "follow_path": lambda position: client.follow([(0.01, 0.0, 0.27), position]),
    }[action]
    send((0.0, 0.0, 0.25)).result()
    goals = [send((0.0, 0.0, 0.25 + 0.0001 * number)) for number in range(GOALS)]
    codes = [goal.result().code for goal in goals]
    assert codes[-1] == GoalCode.SUCCEEDED
    assert set(codes[:-1]) <= {GoalCode.SUPERSEDED, GoalCode.SUCCEEDED}
    assert all(goal.accepted and goal.responses == 1 for goal in goals)
    client.close()
