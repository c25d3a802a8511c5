"""Parts are picked from a simulated belt and placed, and each has one outcome, whatever happens."""

from __future__ import annotations

import signal

import pytest
from rclpy.action import ActionClient
from std_srvs.srv import Trigger

from testing.client import LATCHED
from tri_glide_interfaces.action import Pick
from tri_glide_interfaces.msg import Output, PartEvent, PickState
from tri_glide_kinematics.ros.goal_sender import SentGoal
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS

# A computer with more to do is late: so the belt is slow, the parts large and far apart.
FASTER = {"rate": 100.0}
BELT = {"belt_speeds": [0.0, 0.03, 1.0], "part_distance": 0.15, "gripper_reach": 0.05}
PICKS = {
    "allowed_error": 0.05,
    "height": 0.275,
    "closing_time": 0.025,
    "opening_time": 0.025,
    "has_sensor": True,
    "belt_timeout": 1.0,
}


class Cell:
    """A machine beside a belt, and what a client hears of both."""

    def __init__(self, machine, client, nodes):
        machine.start(FASTER, FASTER)
        self.machine, self.client = machine, client
        self.belt = nodes.start("simulated_cell_node", BELT)
        nodes.start("pick_node", PICKS)
        self.events = client.record(PartEvent, "pick_node/part_events")
        self.states = client.record(PickState, "pick_node/pick_state", LATCHED)
        self.outputs = client.record(Output, "outputs", LATEST_OUTPUTS)
        self._runs = ActionClient(client.node, Pick, "pick_node/run")

    def run(self, count=0):
        """Return a run that has begun."""
        self.client.wait_for(lambda: self.states and self.states[-1].parts, "parts on the belt")
        goal = self.asked(count)
        while goal.result is not None:
            # The node has not heard of the machine yet.
            assert goal.result.code == Pick.Result.REFUSED
            goal = self.asked(count)
        return goal

    def asked(self, count=0):
        """Return a goal that is answered: it runs, or has a result."""
        seen, goal = len(self.states), SentGoal(self._runs, Pick.Goal(count=count))
        self.client.wait_for(
            lambda: goal.result or any(each.running for each in self.states[seen:]), "an answer"
        )
        return goal

    def end_of(self, goal):
        """Return the result of a run."""
        self.client.wait_for(lambda: goal.result, "the end of a run", timeout=120.0)
        return goal.result

    def outcomes(self):
        """Return the outcomes of parts, each of which has one."""
        assert len({event.part for event in self.events}) == len(self.events)
        return [event.outcome for event in self.events]


@pytest.fixture
def cell(machine, client, nodes):
    return Cell(machine, client, nodes)


def test_parts_are_placed_until_the_belt_is_silent(cell, client):
    result = cell.end_of(cell.run(3))
    assert (result.code, result.placed) == (Pick.Result.SUCCEEDED, 3), result.text
    client.wait_for(lambda: cell.outcomes().count(PartEvent.PLACED) == 3, "events")
    values = [output.value for output in cell.outputs]
    assert values[-6:] == [1.0, 0.0] * 3
    goal = cell.run()
    cell.belt.signal(signal.SIGKILL)
    # No part can be told from another place any more: what is on its way is placed or given up.
    client.wait_for(lambda: not cell.states[-1].target, "no part to be picked")
    cell.machine.wait_for_state("idle")
    assert goal.result is None
    assert client.call(Trigger, "pick_node/stop", Trigger.Request()).success
    assert cell.end_of(goal).code == Pick.Result.STOPPED


def test_a_stop_of_the_machine_ends_the_run_and_the_gripper_stays_closed(cell, client):
    goal = cell.run()
    client.wait_for(lambda: cell.outputs and cell.outputs[-1].value, "a part in the gripper", 60.0)
    closed = len(cell.outputs)
    client.stop()
    assert cell.end_of(goal).code == Pick.Result.FAILED
    client.wait_for(lambda: PartEvent.LOST in cell.outcomes(), "the outcome of the part")
    cell.machine.wait_for_state("idle")
    # It may hold a part, which nobody has taken out.
    assert cell.end_of(cell.asked()).code == Pick.Result.REFUSED
    assert cell.outcomes().count(PartEvent.LOST) == 1
    assert len(cell.outputs) == closed
    client.wait_for(lambda: not cell.states[-1].running, "no run")
