"""Requests on a real page server, with real topics: whose wishes are fulfilled, and which not."""

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
from tri_glide_kinematics.panel.inputs import OperatorsInput
from tri_glide_kinematics.panel.link import LATEST_ONLY, NOBODY, MachineLink
from tri_glide_kinematics.panel.operator_requests import RENEWALS, OperatorRequests

pytestmark = pytest.mark.nodes

OPERATOR, OTHER = 0, 1
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
SPEED = 0.02  # m/s


class TwoPages:
    """Two pages that make requests, and what is sent for them."""

    def __init__(self, context: Context, server: ViserServer) -> None:
        self.probe = Probe(context, "/operator", "panel")
        self.done: list[str] = []
        self.refusals: list[str] = []
        link = MachineLink(self.probe.node, self.refusals.append)
        self.requests = OperatorRequests(link, lambda: self.done.append("on stop"))
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
            self.requests.controls.opened(page)

    def event(self, page: int) -> Any:
        return GuiEvent(None, page, self.number)  # type: ignore[arg-type]

    def stop(self, page: int) -> None:
        asyncio.run(self.requests.stop(self.event(page)))

    def release(self, page: int) -> None:
        asyncio.run(self.requests.release(self.event(page)))

    def hold(self, count: int = 6, page: int = OPERATOR) -> list[float]:
        """Hold a button for so many messages; return the twists that come of it."""
        self.twists.clear()
        for _ in range(count):
            self.requests.hold(self.event(page), X, lambda: SPEED)
            self.probe.spin_for(1.0 / RENEWALS)
        return list(self.twists)


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    with joined_domain() as context:
        yield context


@pytest.fixture
def pages(context: Context) -> Iterator[TwoPages]:
    with page_server() as server:
        pages = TwoPages(context, server)
        yield pages
        pages.probe.close()


def test_stop_drops_what_was_wished_before_it(pages: TwoPages) -> None:
    requests, done = pages.requests, pages.done
    requests.wish(lambda: done.append("before"))
    pages.stop(OTHER)
    requests.wish(lambda: done.append("after"))
    requests.fulfil()
    assert done == ["on stop", "after"]


def test_what_is_shown_in_an_input_outlasts_stop(pages: TwoPages) -> None:
    requests, done = pages.requests, pages.done
    number = OperatorsInput(requests, pages.number, lambda value: done.append(f"number {value}"))
    pages.number.value = 3.0
    asyncio.run(number._take(pages.event(OPERATOR)))
    requests.wish(lambda: done.append("before"))
    pages.stop(OTHER)
    requests.fulfil()
    assert done == ["number 3.0", "on stop"]


def test_a_stop_during_a_wish_ends_what_it_has_sent(pages: TwoPages) -> None:
    requests, done = pages.requests, pages.done

    def go() -> None:
        pages.stop(OTHER)
        done.append("sent")

    requests.wish(go)
    requests.wish(lambda: done.append("later"))
    requests.fulfil()
    assert done == ["sent", "on stop"]


def test_after_the_stop_of_another_page_a_held_button_has_to_be_released(pages: TwoPages) -> None:
    assert SPEED in pages.hold()
    pages.stop(OTHER)
    assert not pages.hold()
    # ik_node takes this pause for a release.
    pages.probe.spin_for(0.3)
    assert not pages.hold()
    pages.release(OPERATOR)
    assert SPEED in pages.hold()


def test_what_was_ended_elsewhere_has_to_be_released_too(pages: TwoPages) -> None:
    assert SPEED in pages.hold()
    pages.requests.end_hold()
    assert not pages.hold()


def test_who_only_looks_on_does_not_end_the_jog_of_the_operator(pages: TwoPages) -> None:
    pages.twists.clear()
    for _ in range(10):
        pages.requests.hold(pages.event(OPERATOR), X, lambda: SPEED)
        pages.requests.hold(pages.event(OTHER), Y, lambda: SPEED)
        pages.probe.spin_for(1.0 / RENEWALS)
        pages.release(OTHER)
    assert set(pages.twists) == {SPEED}
    assert "nothing done" in pages.requests.refusal


def test_who_gets_the_controls_while_holding_has_to_press_again(pages: TwoPages) -> None:
    assert not pages.hold(page=OTHER)
    pages.requests.controls.ask(OTHER)
    pages.requests.give(OPERATOR)
    assert not pages.hold(page=OTHER)
    pages.release(OTHER)
    assert SPEED in pages.hold(page=OTHER)


def test_a_page_that_answers_no_more_has_no_controls_until_it_presses_again(
    pages: TwoPages,
) -> None:
    requests = pages.requests
    assert SPEED in pages.hold()
    requests.answers(OPERATOR, False)
    assert requests.controls.holder is None
    requests.answers(OPERATOR, True)
    assert requests.controls.holder is None
    assert requests.controls.ask(OPERATOR)
    assert SPEED not in pages.hold()
    pages.release(OPERATOR)
    assert SPEED in pages.hold()


def test_an_input_goes_back_if_its_page_only_looks_on(pages: TwoPages) -> None:
    taken: list[float] = []
    number = OperatorsInput(pages.requests, pages.number, taken.append)
    for page, value in ((OPERATOR, 2.0), (OTHER, 7.0)):
        pages.number.value = value
        asyncio.run(number._take(pages.event(page)))
    pages.requests.fulfil()
    assert number.value == pages.number.value == 2.0
    assert taken == [2.0]


def test_an_ik_node_that_was_started_anew_is_another_one(pages: TwoPages, context: Context) -> None:
    link = pages.requests.link
    assert link.identity == NOBODY
    seen = set()
    for _ in range(2):
        server = Probe(context, "/operator", "ik_node")
        server.node.create_publisher(MachineState, "ik_node/machine_state", 1)
        server.node.create_service(Trigger, "ik_node/stop", lambda _, answer: answer)
        pages.probe.wait_for(lambda: link.identity, "ik_node")
        seen.add(link.identity)
        server.close()
        pages.probe.wait_for(lambda: link.identity == NOBODY, "its end")
    assert len(seen) == 2


def test_a_choice_that_is_none_is_not_taken(pages: TwoPages) -> None:
    group = pages.server.gui.add_button_group("choice", ("save", "load"))
    taken: list[str] = []
    take = pages.requests.on(taken.append)
    for value in ("save", "x" * 1000, "load"):
        group._impl.value = value
        asyncio.run(take(GuiEvent(None, OPERATOR, group)))  # type: ignore[arg-type]
        pages.requests.fulfil()
    assert taken == ["save", "load"]
    assert pages.requests.refusal == f"nothing done: there is no choice '{'x' * 20}'"
