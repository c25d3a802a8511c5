"""The action server of a control cycle, in this process: who is told what, and for how long."""

import itertools
import time
from uuid import uuid4

import pytest
from action_msgs.msg import GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from geometry_msgs.msg import PoseStamped
from joined_domain import joined_domain
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile

from testing.client import Client
from testing.domain import own_context
from testing.goals import SentGoal
from tri_glide_interfaces.action import MoveTo
from tri_glide_kinematics.ros.serving import ActionServer, GoalEnd, PatientServices, action_server

pytestmark = pytest.mark.nodes

NUMBERS = itertools.count()
# Answers are not kept by services, so a reader of kept ones is never connected to them.
UNFIT = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DEEP = QoSProfile(depth=200)
BLOCK = 0.09  # s: the middleware waits for 0.1 s


class Goal:
    """What the caller of a server knows of a goal."""

    def __init__(self):
        self.ended_as = None
        self.text = ""

    def end(self, ended_as, text):
        self.ended_as, self.text = ended_as, text


class Desk:
    """A server and its client in one node, both served by one loop."""

    def __init__(self, client):
        self.client = client
        self.begun = []
        self.cancelled = []
        node = client.node
        self.patient = PatientServices(node, lambda: False)
        self.server = ActionServer(
            node,
            MoveTo,
            "~/move_to",
            self.patient,
            begin=self.begin,
            cancel=self.cancel,
            end=lambda goal: goal.ended_as,
            result=lambda goal: MoveTo.Result(text=goal.text),
            feedback=lambda goal: MoveTo.Feedback(way_remaining=1.0),
        )
        # A burst must not be lost on this side.
        self.actions = ActionClient(
            node,
            MoveTo,
            "~/move_to",
            goal_service_qos_profile=DEEP,
            result_service_qos_profile=DEEP,
        )
        self.served = []
        spin_once = client.spin_once

        def spin_and_serve(longest_nap=0.001):
            begin = time.monotonic()
            self.server.look()
            self.server.answer()
            self.server.publish()
            self.served.append(time.monotonic() - begin)
            spin_once(0.001)

        client.spin_once = spin_and_serve
        client.wait_for(self.actions.server_is_ready, "the server")

    def begin(self, request):
        if request.pose.header.frame_id == "raise":
            raise RuntimeError("a mistake")
        goal = Goal()
        self.begun.append(goal)
        return goal

    def cancel(self, goal):
        self.cancelled.append(goal)

    def send(self, frame=""):
        pose = PoseStamped()
        pose.header.frame_id = frame
        return SentGoal(self.client, self.actions, MoveTo.Goal(pose=pose))


@pytest.fixture
def desk():
    with joined_domain() as context:
        client = Client(context, f"/desk_{next(NUMBERS)}")
        yield Desk(client)
        client.close()


@pytest.mark.parametrize("end", GoalEnd)
def test_each_end_has_its_status(desk, end):
    sent = desk.send().wait_until_accepted()
    desk.server.tell_progress()
    desk.client.wait_for(lambda: sent.feedback, "feedback")
    if end is GoalEnd.CANCELED:
        assert sent.cancel().return_code == CancelGoal.Response.ERROR_NONE
        assert desk.cancelled == desk.begun
    others = [sent.ask_again() for _ in range(3)]
    desk.begun[0].end(end, "because")
    result = sent.result()
    expected = {
        GoalEnd.SUCCEEDED: GoalStatus.STATUS_SUCCEEDED,
        GoalEnd.CANCELED: GoalStatus.STATUS_CANCELED,
    }
    assert sent.status == expected.get(end, GoalStatus.STATUS_ABORTED)
    assert result.text == "because"
    # Whoever asks gets it.
    desk.client.wait_for(lambda: all(other.done() for other in others), "all results")
    assert {other.result().status for other in others} == {sent.status}


def test_a_goal_that_has_ended_already_is_not_cancelled(desk):
    sent = desk.send().wait_until_accepted()
    # Its end is known, but not told yet.
    future = sent.cancel_without_waiting()
    desk.begun[0].end(GoalEnd.SUCCEEDED, "there")
    desk.client.wait_for(future.done, "an answer")
    assert not future.result().goals_canceling
    sent.result()
    assert sent.status == GoalStatus.STATUS_SUCCEEDED
    assert desk.cancelled == []
    assert sent.cancel().return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED


def test_all_goals_are_cancelled_by_a_request_that_names_none(desk):
    sent = [desk.send().wait_until_accepted() for _ in range(3)]
    service = desk.client.node.create_client(CancelGoal, "~/move_to/_action/cancel_goal")
    desk.client.wait_for(service.service_is_ready, "the service")
    future = service.call_async(CancelGoal.Request())
    desk.client.wait_for(future.done, "an answer")
    assert len(future.result().goals_canceling) == 3
    for goal in desk.begun:
        goal.end(GoalEnd.CANCELED, "cancelled")
    for each in sent:
        each.result()
        assert each.status == GoalStatus.STATUS_CANCELED


def test_the_list_of_states_stays_short_and_results_are_forgotten_later(monkeypatch, request):
    monkeypatch.setattr(action_server, "STATE_TOLD", 0.2)
    desk = request.getfixturevalue("desk")
    states = desk.client.record(
        GoalStatusArray,
        "~/move_to/_action/status",
        QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    )
    old = desk.send().wait_until_accepted()
    desk.begun[0].end(GoalEnd.SUCCEEDED, "there")
    old.result()

    def is_listed():
        desk.server.tell_progress()
        newer = desk.send().wait_until_accepted()
        desk.begun[-1].end(GoalEnd.SUCCEEDED, "there")
        newer.result()
        return len(states[-1].status_list) < len(desk.begun)

    def status():
        desk.server.tell_progress()
        again = old.ask_again()
        desk.client.wait_for(again.done, "an answer")
        return again.result().status

    desk.client.wait_for(is_listed, "the first goal to be listed no more")
    assert status() == GoalStatus.STATUS_SUCCEEDED
    monkeypatch.setattr(action_server, "KEPT", 0.0)
    assert status() == GoalStatus.STATUS_UNKNOWN


def test_of_many_results_the_newest_are_kept(monkeypatch, request):
    monkeypatch.setattr(action_server, "STATE_TOLD", 0.01)
    monkeypatch.setattr(action_server, "MOST", 2)
    desk = request.getfixturevalue("desk")
    sent = []
    for _ in range(4):
        sent.append(desk.send().wait_until_accepted())
        desk.begun[-1].end(GoalEnd.SUCCEEDED, "there")
        sent[-1].result()

    def known():
        desk.server.tell_progress()
        answers = [each.ask_again() for each in sent]
        desk.client.wait_for(lambda: all(answer.done() for answer in answers), "the answers")
        return [answer.result().status == GoalStatus.STATUS_SUCCEEDED for answer in answers]

    desk.client.wait_for(lambda: known() == [False, False, True, True], "two results")


def test_no_goal_of_a_burst_is_lost(desk):
    sent = [desk.send() for _ in range(60)]
    desk.client.wait_for(lambda: all(each.accepted for each in sent), "all to be accepted")
    for number, goal in enumerate(desk.begun):
        goal.end(GoalEnd.ABORTED, f"{number}")
    assert [each.result().text for each in sent] == [f"{number}" for number in range(60)]


def test_a_mistake_in_a_goal_is_survived(desk, capfd):
    assert desk.send("raise").wait_until_accepted().accepted is False
    assert "dropped a request: RuntimeError: a mistake" in capfd.readouterr().err
    sent = desk.send().wait_until_accepted()
    desk.begun[0].end(GoalEnd.SUCCEEDED, "there")
    assert sent.result().text == "there"


def test_a_client_that_is_not_connected_in_full_holds_nobody_up(desk, unfit_context):
    unfit = unfit_context.create_client(
        MoveTo.Impl.SendGoalService,
        f"{desk.client.node.get_fully_qualified_name()}/move_to/_action/send_goal",
        qos_profile=UNFIT,
    )

    def heard():
        request = MoveTo.Impl.SendGoalService.Request()
        request.goal_id.uuid = list(uuid4().bytes)
        unfit.call_async(request)
        desk.client.spin_once()
        return len(desk.begun) >= 20

    desk.client.wait_for(heard, "its requests")
    desk.client.spin_for(0.3)
    # Each answer would do so; a busy computer does so now and then.
    assert sum(int(time / BLOCK) for time in desk.served) < len(desk.begun) / 2
    unfit_context.destroy_client(unfit)
    before = len(desk.begun)
    sent = desk.send().wait_until_accepted()
    desk.begun[before].end(GoalEnd.SUCCEEDED, "there")
    assert sent.result().text == "there"


@pytest.fixture
def unfit_context(desk):
    with own_context() as context:
        client = Client(context, "/unfit")
        yield client.node
        client.close()
