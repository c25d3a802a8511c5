"""Requests on a real page server, with real topics: whose wishes are fulfilled, and which not."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any

import pytest
from geometry_msgs.msg import TwistStamped
from panel_rig import OPERATOR, OTHER, PanelRig
from rclpy.context import Context
from std_srvs.srv import Trigger

from testing.client import Probe
from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.panel.link import LATEST_ONLY, NOBODY
from tri_glide_kinematics.panel.operators import RENEWALS

pytestmark = pytest.mark.nodes

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
SPEED = 0.02  # m/s


class TwoPages:
    """Two pages that make requests, and what is sent for them."""

    def __init__(self, rig: PanelRig) -> None:
        self.rig, self.probe, self.requests = rig, rig.probe, rig.requests
        self.done: list[str] = []
        self.requests.on_stop.append(lambda: self.done.append("on stop"))
        self.number = rig.gui.add_number("number", 1.0)
        self.twists: list[float] = []
        self.probe.node.create_subscription(
            TwistStamped,
            "target_twist",
            lambda told: self.twists.append(told.twist.linear.x),
            LATEST_ONLY,
        )
        self.probe.wait_for(lambda: self.probe.node.count_subscribers("target_twist"), "the topic")

    def event(self, page: int) -> Any:
        return self.rig.event(self.number, page)

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


@pytest.fixture
def pages(rig: PanelRig) -> TwoPages:
    return TwoPages(rig)


def test_stop_drops_what_was_wished_before_it(pages: TwoPages) -> None:
    requests, done = pages.requests, pages.done
    requests.wish(lambda: done.append("before"))
    pages.stop(OTHER)
    requests.wish(lambda: done.append("after"))
    requests.fulfil()
    assert done == ["on stop", "after"]


def test_what_is_shown_in_an_input_outlasts_stop(pages: TwoPages) -> None:
    requests, done = pages.requests, pages.done
    number = requests.field(pages.number, lambda value: done.append(f"number {value}"))
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
    number = pages.requests.field(pages.number, taken.append)
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
        server = Probe(context, pages.probe.namespace, "ik_node")
        server.node.create_publisher(MachineState, "ik_node/machine_state", 1)
        server.node.create_service(Trigger, "ik_node/stop", lambda _, answer: answer)
        pages.probe.wait_for(lambda: link.identity, "ik_node")
        seen.add(link.identity)
        server.close()
        pages.probe.wait_for(lambda: link.identity == NOBODY, "its end")
    assert len(seen) == 2


def test_a_choice_that_is_none_is_not_taken(rig: PanelRig) -> None:
    taken: list[str] = []
    actions = {each: partial(taken.append, each) for each in ("save", "load")}
    rig.requests.buttons("choice", actions, of_any_page=("load",))
    group = rig.handle("choice")
    for value in ("save", "x" * 1000, "load"):
        rig.send(group, value)
    assert taken == ["save", "load"]
    assert rig.requests.refusal == f"nothing done: there is no choice '{'x' * 20}'"
    # What any page may do needs no controls.
    for value in ("save", "load"):
        rig.send(group, value, OTHER)
    assert taken == ["save", "load", "load"]
    assert "the controls are with page 1" in rig.requests.refusal
