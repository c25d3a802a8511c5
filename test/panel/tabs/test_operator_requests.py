"""The desk on a real page server, with real topics: whose wishes are fulfilled, and which not."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest
from geometry_msgs.msg import TwistStamped
from joined_domain import joined_domain
from mechanisms_rig import page_server
from rclpy.context import Context
from std_srvs.srv import Trigger
from viser import GuiEvent, ViserServer

from testing.client import Probe
from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.panel.button_jogs import RENEWALS
from tri_glide_kinematics.panel.machine_link import LATEST_ONLY, NOBODY, MachineLink
from tri_glide_kinematics.panel.tabs import Desk, OperatorsInput

pytestmark = pytest.mark.nodes

OPERATOR, OTHER = 0, 1
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
SPEED = 0.02  # m/s


class Table:
    """A desk at which two pages sit, and what it sends."""

    def __init__(self, context: Context, server: ViserServer) -> None:
        self.probe = Probe(context, "/desk", "panel")
        self.done: list[str] = []
        self.refusals: list[str] = []
        link = MachineLink(self.probe.node, self.refusals.append)
        self.desk = Desk(link, lambda: self.done.append("on stop"))
        self.server = server
        self.number = server.gui.add_number("number", 1.0)
        self.twists: list[float] = []
        self.probe.node.create_subscription(
            TwistStamped,
            "target_twist",
            lambda told: self.twists.append(told.twist.linear.x),
            LATEST_ONLY,
        )
        self.probe.wait_for(lambda: self.probe.node.count_subscribers("target_twist"), "the topic")
        for page in (OPERATOR, OTHER):
            self.desk.controls.opened(page)

    def event(self, page: int) -> Any:
        return GuiEvent(None, page, self.number)  # type: ignore[arg-type]

    def stop(self, page: int) -> None:
        asyncio.run(self.desk.stop(self.event(page)))

    def release(self, page: int) -> None:
        asyncio.run(self.desk.release(self.event(page)))

    def hold(self, count: int = 6, page: int = OPERATOR) -> list[float]:
        """Hold a button for so many messages; return the twists that come of it."""
        self.twists.clear()
        for _ in range(count):
            self.desk.hold(self.event(page), X, SPEED)
            self.probe.spin_for(1.0 / RENEWALS)
        return list(self.twists)


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    with joined_domain() as context:
        yield context


@pytest.fixture
def table(context: Context) -> Iterator[Table]:
    with page_server() as server:
        table = Table(context, server)
        yield table
        table.probe.close()


def test_stop_drops_what_was_wished_before_it(table: Table) -> None:
    desk, done = table.desk, table.done
    desk.wish(lambda: done.append("before"))
    table.stop(OTHER)
    desk.wish(lambda: done.append("after"))
    desk.fulfil()
    assert done == ["on stop", "after"]


def test_a_stop_during_a_wish_ends_what_it_has_sent(table: Table) -> None:
    desk, done = table.desk, table.done

    def go() -> None:
        table.stop(OTHER)
        done.append("sent")

    desk.wish(go)
    desk.wish(lambda: done.append("later"))
    desk.fulfil()
    assert done == ["sent", "on stop"]


def test_after_the_stop_of_another_page_a_held_button_has_to_be_released(table: Table) -> None:
    assert SPEED in table.hold()
    table.stop(OTHER)
    assert not table.hold()
    # ik_node takes this pause for a release.
    table.probe.spin_for(0.3)
    assert not table.hold()
    table.release(OPERATOR)
    assert SPEED in table.hold()


def test_what_was_ended_elsewhere_has_to_be_released_too(table: Table) -> None:
    assert SPEED in table.hold()
    table.desk.end_hold()
    assert not table.hold()


def test_who_only_looks_on_does_not_end_the_jog_of_the_operator(table: Table) -> None:
    table.twists.clear()
    for _ in range(10):
        table.desk.hold(table.event(OPERATOR), X, SPEED)
        table.desk.hold(table.event(OTHER), Y, SPEED)
        table.probe.spin_for(1.0 / RENEWALS)
        table.release(OTHER)
    assert set(table.twists) == {SPEED}
    assert "nothing done" in table.desk.refusal


def test_who_gets_the_controls_while_holding_has_to_press_again(table: Table) -> None:
    assert not table.hold(page=OTHER)
    table.desk.controls.ask(OTHER)
    table.desk.give(OPERATOR)
    assert not table.hold(page=OTHER)
    table.release(OTHER)
    assert SPEED in table.hold(page=OTHER)


def test_a_page_that_answers_no_more_has_no_controls_until_it_presses_again(table: Table) -> None:
    desk = table.desk
    assert SPEED in table.hold()
    desk.answers(OPERATOR, False)
    assert desk.controls.holder is None
    desk.answers(OPERATOR, True)
    assert desk.controls.holder is None
    assert desk.controls.ask(OPERATOR)
    assert SPEED not in table.hold()
    table.release(OPERATOR)
    assert SPEED in table.hold()


def test_an_input_goes_back_if_its_page_only_looks_on(table: Table) -> None:
    taken: list[float] = []
    number = OperatorsInput(table.desk, table.number, taken.append)
    for page, value in ((OPERATOR, 2.0), (OTHER, 7.0)):
        table.number.value = value
        asyncio.run(number._take(table.event(page)))
    table.desk.fulfil()
    assert number.value == table.number.value == 2.0
    assert taken == [2.0]


def test_an_ik_node_that_was_started_anew_is_another_one(table: Table, context: Context) -> None:
    link = table.desk.link
    assert link.identity == NOBODY
    seen = set()
    for _ in range(2):
        server = Probe(context, "/desk", "ik_node")
        server.node.create_publisher(MachineState, "ik_node/machine_state", 1)
        server.node.create_service(Trigger, "ik_node/stop", lambda _, answer: answer)
        table.probe.wait_for(lambda: link.identity, "ik_node")
        seen.add(link.identity)
        server.close()
        table.probe.wait_for(lambda: link.identity == NOBODY, "its end")
    assert len(seen) == 2


def test_a_choice_that_is_none_is_not_taken(table: Table) -> None:
    group = table.server.gui.add_button_group("choice", ("save", "load"))
    taken: list[str] = []
    take = table.desk.on(taken.append)
    for value in ("save", "x" * 1000, "load"):
        group._impl.value = value
        asyncio.run(take(GuiEvent(None, OPERATOR, group)))  # type: ignore[arg-type]
        table.desk.fulfil()
    assert taken == ["save", "load"]
    assert table.desk.refusal == f"nothing done: there is no choice '{'x' * 20}'"
