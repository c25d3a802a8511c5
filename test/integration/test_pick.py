"""Parts are picked from a simulated belt and placed, and each has one outcome, whatever happens."""

from __future__ import annotations

import math
import signal

import pytest
import yaml
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from testing.client import LATCHED
from tri_glide_interfaces.action import Pick
from tri_glide_interfaces.msg import Output, PartEvent, PickState
from tri_glide_interfaces.srv import TeachPick
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
    result = cell.end_of(cell.run(2))
    assert (result.code, result.placed) == (Pick.Result.SUCCEEDED, 2), result.text
    client.wait_for(lambda: cell.outcomes().count(PartEvent.PLACED) == 2, "events")
    errors = [event.grip_error for event in cell.events if event.outcome == PartEvent.PLACED]
    # How small they are is tested in virtual time: on a busy computer all that is heard is late.
    assert not any(map(math.isnan, errors))
    values = [output.value for output in cell.outputs]
    assert values[-4:] == [1.0, 0.0] * 2
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


def test_a_run_that_is_cancelled_ends_with_the_part_that_it_has(cell, client):
    """That it begins no other one, test/picking/test_picker.py shows."""
    goal = cell.run()
    client.wait_for(lambda: cell.outputs and cell.outputs[-1].value, "a part in the gripper", 60.0)
    goal.cancel()
    result = cell.end_of(goal)
    assert (result.code, goal.status) == (Pick.Result.CANCELED, GoalStatus.STATUS_CANCELED)
    # Where all that is heard is late, the gripper may have missed it.
    assert result.placed + result.missed >= 1 and not result.lost
    client.wait_for(lambda: cell.outputs[-1].value == 0.0, "an open gripper")
    client.wait_for(lambda: not (cell.states[-1].running or cell.states[-1].target), "no run")


def test_the_belt_is_taught_by_two_touches_of_one_mark(machine, client, nodes, tmp_path):
    """Touch, run, touch: what is found is used, and kept for the next start."""
    machine.start(FASTER, FASTER)
    taught, wrong = tmp_path / "taught.yaml", {"belt_direction": [0.0, 1.0, 0.0]}
    values = {**PICKS, **wrong, "metres_per_count": 0.5, "taught_file": str(taught)}
    nodes.start("pick_node", values)
    states = client.record(PickState, "pick_node/pick_state", LATCHED)
    reports = client.record(JointState, "belt_states")
    # It rests, runs, and rests again.
    speeds = [0.0, 0.0, 1.0, 5.0, 0.05, 1.0, 7.0, 0.0, 1.0]
    nodes.start("simulated_cell_node", {"belt_speeds": speeds})
    mark = (-0.05, 0.03, 0.3)

    def touched(run):
        """Return the answer, with the gripper on the mark after the belt has run so far [m]."""
        x, y, z = mark
        client.send_pose((x + run, y, z))

        def is_there():
            told = machine.states[-1]
            place = told.position.x, told.position.y, told.position.z
            return told.state == told.IDLE and place == pytest.approx((x + run, y, z), abs=1e-4)

        client.wait_for(is_there, "the gripper on the mark")
        request = TeachPick.Request(what="belt")
        answer = client.call(TeachPick, "pick_node/teach", request)
        while "must rest" in answer.message:
            # The node has not heard of it yet.
            answer = client.call(TeachPick, "pick_node/teach", request)
        return answer

    client.wait_for(lambda: states and reports, "a belt")
    begin = reports[-1].position[0]
    first = touched(0.0)
    assert not first.success and "at least 2" in first.message
    client.wait_for(lambda: reports[-1].position[0] > begin + 0.05, "a belt that runs")
    client.wait_for(
        lambda: len(reports) > 50 and reports[-1].position == reports[-20].position, "its rest"
    )
    run = reports[-1].position[0] - begin
    second = touched(run)
    assert second.success, second.message
    kept = yaml.safe_load(taught.read_text())
    assert kept["belt_direction"] == pytest.approx((1.0, 0.0, 0.0), abs=0.01)
    assert kept["metres_per_count"] == pytest.approx(1.0, rel=0.01)
    # The position that it tells is in metres now.
    client.wait_for(
        lambda: states[-1].belt_position == pytest.approx(reports[-1].position[0], abs=0.002),
        "the belt by what was taught",
    )
