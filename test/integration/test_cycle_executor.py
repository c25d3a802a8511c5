"""With a fast timer, what is urgent is looked at in each cycle, and the rest often enough."""

from __future__ import annotations

import time

import pytest
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_srvs.srv import Trigger

from tri_glide_kinematics.ros.cycle_executor import LONGEST_WAIT, CycleExecutor

PERIOD = 0.001  # s


class Looks(CycleExecutor):
    """Counts how often it is asked to wait for an entity, and does."""

    def __init__(self, context, urgent):
        super().__init__(urgent, context=context)
        self.asked = {}
        self.done = {}

    def can_execute(self, entity):
        answer = super().can_execute(entity)
        self.asked[entity] = self.asked.get(entity, 0) + 1
        self.done[entity] = self.done.get(entity, 0) + answer
        return answer


@pytest.fixture
def cycling(ros_context, namespace, request):
    """Return a node's executor, an urgent service, one that is not, and the cycles so far.

    The parameter is the period of its urgent timer [s]; with None, the timer is not urgent.
    """
    period = request.param
    node = Node("cycling", namespace=namespace, context=ros_context)
    cycles = []
    steady = Clock(clock_type=ClockType.STEADY_TIME)
    timer = node.create_timer(period or PERIOD, lambda: cycles.append(None), clock=steady)
    urgent, other = (
        node.create_service(Trigger, f"~/{name}", lambda _, response: response)
        for name in ("urgent", "other")
    )
    executor = Looks(ros_context, (timer, urgent) if period else (urgent,))
    executor.add_node(node)
    yield executor, urgent, other, cycles
    executor.shutdown()
    node.destroy_node()


@pytest.mark.parametrize("cycling", [PERIOD], indirect=True)
def test_what_is_urgent_is_waited_for_always_and_the_rest_now_and_then(cycling):
    executor, urgent, other, cycles = cycling
    begin = time.monotonic()
    while len(cycles) < 300:
        executor.spin_once()
    looks = (time.monotonic() - begin) / LONGEST_WAIT + 1.0
    assert executor.done[urgent] == executor.asked[urgent] >= 300
    assert executor.asked[other] >= 300
    # rclpy waits more than once where it was woken for nothing.
    assert 1 <= executor.done[other] <= 3.0 * looks


@pytest.mark.parametrize("cycling", [PERIOD, None, 60.0], indirect=True)
@pytest.mark.parametrize("name", ["urgent", "other"])
def test_services_are_served(client, cycling, name):
    executor, *_ = cycling
    caller = client.node.create_client(Trigger, f"cycling/{name}")

    def once(condition):
        client.wait_for(lambda: executor.spin_once() or condition(), name)

    once(caller.service_is_ready)
    for _ in range(3):
        once(caller.call_async(Trigger.Request()).done)
