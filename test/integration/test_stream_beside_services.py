"""Whoever calls a service, and however new the client is: the streams of messages go on."""

import json
import subprocess
import sys
from contextlib import suppress
from importlib import import_module

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.node import NodeNameNonExistentError
from std_srvs.srv import SetBool

from testing import calling_client
from testing.client import UNFIT

pytestmark = pytest.mark.alone

FAR = (0.0, 0.0, 0.5)
# So slow that it takes longer to get there than all clients take to start.
SLOW = {"speed_scale": 0.003}
# What a gap may be longer than those before [s]: the middleware would wait for 0.1 s, and a busy
# computer starts a process meanwhile.
MORE_THAN_ALONE = 0.09
# They put off the discovery of the readers of answers.
SUBSCRIPTIONS = 100
CLIENTS = 4
CALLED = ("get_parameters", "stop")
OWN_SERVICES = 7  # of rclpy, in each node


def longest_gap(client, messages, first=0, rank=1):
    """Return the longest gap, or the second longest and so on, between stamps [s]."""
    times = [client.time_of(message) for message in messages[first:]]
    return 1e-9 * float(np.sort(np.diff(times))[-rank])


def gap_alone(machine, client):
    """Return the longest gap between commands while nobody calls anything."""
    first = len(machine.commands)
    client.wait_for(lambda: len(machine.commands) > first + 150, "commands")
    return longest_gap(client, machine.commands, first)


def set_off(machine, client):
    """Begin to move, and return how many states and commands there were by then."""
    machine.wait_for_new_state("moving", lambda: client.send_pose(FAR))
    return len(machine.states), len(machine.commands)


def started_client(server):
    """Start a client that waits for a word before it joins the domain."""
    arguments = [calling_client.CLEANLY, server, str(SUBSCRIPTIONS), *CALLED]
    return subprocess.Popen(
        [sys.executable, calling_client.__file__, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def test_clients_that_call_as_soon_as_they_can(machine, client):
    processes = [started_client(f"{client.namespace}/ik_node") for _ in range(CLIENTS)]
    machine.start(SLOW)
    assert [process.stdout.readline() for process in processes] == ["ready\n"] * CLIENTS
    allowed = gap_alone(machine, client) + MORE_THAN_ALONE
    gaps = []
    for process in processes:
        with process:
            states, first = set_off(machine, client)
            print("go", file=process.stdin, flush=True)
            client.wait_for(lambda process=process: process.poll() is not None, "the client")
            answers = json.loads(process.stdout.read())
        machine.wait_for_state("idle")
        machine.catch_up()
        assert all(answers.values()) and len(answers) == len(CALLED), answers
        # The stop came in mid-motion.
        assert machine.states_since(states) == ["stopping", "idle"]
        gaps.append(longest_gap(client, machine.commands, first))
    assert np.median(gaps) < allowed, gaps


def test_clients_that_cannot_be_answered(machine, client, nodes, unfit_node):
    poses = client.record(PoseStamped, "platform_pose")
    nodes.start("fk_node")
    machine.start(SLOW)
    client.wait_for(lambda: poses, "poses")
    allowed = gap_alone(machine, client) + MORE_THAN_ALONE
    states, _ = set_off(machine, client)
    streams = (machine.commands, machine.measured, poses)
    first = [len(stream) for stream in streams]
    callers = [
        caller
        for node in ("ik_node", "simulator_node", "fk_node")
        for caller in callers_of_all_services(client, unfit_node, node)
    ]
    for caller in callers:
        caller.call_async(harmless_request(caller.srv_type))
    # Half as long as an answer is kept before it is tried at the price of a gap: 5 s.
    client.wait_for(lambda: len(machine.commands) > first[0] + 125, "commands")
    client.wait_for(lambda: "stopping" in machine.states_since(states), "the stop")
    machine.catch_up()
    # Each of the services would hold its node once; a busy computer does so now and then.
    gaps = [
        longest_gap(client, stream, begin, rank=OWN_SERVICES // 2)
        for stream, begin in zip(streams, first)
    ]
    assert max(gaps) < allowed, gaps


def harmless_request(kind):
    """Return a request that changes nothing, save that it may stop the motion."""
    return SetBool.Request(data=True) if kind is SetBool else kind.Request()


def callers_of_all_services(client, node, server):
    """Return an unfit client of each service of ``server``."""
    services = []

    def known():
        with suppress(NodeNameNonExistentError):
            services[:] = node.get_service_names_and_types_by_node(server, client.namespace)
        return len(services) >= OWN_SERVICES

    client.wait_for(known, f"the services of {server}")
    for name, (kind,) in services:
        package, folder, type_name = kind.split("/")
        module = import_module(f"{package}.{folder}")
        if folder == "action":
            action, _, service = type_name.rpartition("_")
            service_type = getattr(getattr(module, action).Impl, f"{service}Service")
        else:
            service_type = getattr(module, type_name)
        yield node.create_client(service_type, name, qos_profile=UNFIT)
