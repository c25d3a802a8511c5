"""The panel in a real browser: what is drawn, and what the controls do on the real topics."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from urllib.parse import urlsplit

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped
from rclpy.context import Context
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from testing.browser import PHONE, Browser, Page, Pixels, browser, find_browser
from testing.client import Client
from testing.panel import STOP, STRIP, Panel, button, difference, field, pad, tab
from testing.processes import launched
from tri_glide_kinematics.driving.drive_file import PathStep, load_drive

pytestmark = [
    # A browser without a graphics card needs all of the computer to be heard in time.
    pytest.mark.alone,
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no browser is installed"),
]

HOME = (0.0, 0.0, 0.25)
# Where the machine is drawn, and nothing lies above it.
SCENE = (slice(60, 340), slice(60, 470))
TWIST_TIMEOUT = 0.1  # s
# What a busy computer may add to that, and the ramp to rest [s].
SLACK = 0.5


@pytest.fixture(scope="module")
def panel(ros_context: Context, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Panel]:
    """Start one machine with its panel for all of these tests: a browser starts slowly here."""
    folder = tmp_path_factory.mktemp("panel")
    namespace = f"/panel_{os.getpid()}"
    client = Client(ros_context, namespace)
    with launched(folder, namespace) as launcher:
        yield Panel(client, launcher, folder)
    client.close()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as running:
        yield running


@pytest.fixture(scope="module")
def operator(panel: Panel, chromium: Browser) -> Page:
    """Return the first page, which has the controls."""
    return panel.open(chromium.page())


@pytest.fixture
def page(panel: Panel, operator: Page) -> Page:
    """Return the operator's page, with the machine at rest in its middle."""
    operator.click(tab("Drive"))
    panel.client.send_pose(HOME)
    panel.wait_until_at(HOME)
    panel.wait_for_state(operator, "idle")
    return operator


def scene_of(page: Page) -> Pixels:
    return page.pixels()[SCENE]


def still_scene_of(page: Page) -> Pixels:
    """Return the scene once it does not change any more: its parts come one by one."""
    end = time.monotonic() + 30.0
    last = scene_of(page)
    while True:
        time.sleep(0.5)
        last, before = scene_of(page), last
        if difference(before, last) < 3:
            return last
        assert time.monotonic() < end, "the scene changes all the time"


def test_the_machine_is_drawn_and_moves_by_a_target_of_a_topic(panel: Panel, page: Page) -> None:
    before = still_scene_of(page)
    dark = (before.max(axis=2) < 110).sum()
    assert dark > 500, "no arms, carriages and towers"
    panel.client.send_pose((0.06, 0.0, 0.32))
    panel.wait_until_at((0.06, 0.0, 0.32))
    end = time.monotonic() + 10.0
    while difference(before, scene_of(page)) < 15:
        assert time.monotonic() < end, "the drawn machine stays where it was"
        panel.spin()


def stop_on_the_way(panel: Panel, page: Page) -> None:
    """Press Stop on a ``page`` while the machine is on a slow way upwards."""
    panel.client.set_parameters("ik_node", {"speed_scale": 0.02})
    panel.client.send_pose((0.0, 0.0, 0.4))
    panel.wait_for_motion()
    page.click(STOP)
    panel.client.wait_for(lambda: panel.machine.reason == "at rest: stop was asked for", "the stop")
    assert panel.position[2] < 0.39
    panel.client.set_parameters("ik_node", {"speed_scale": 1.0})


def test_stop_brakes(panel: Panel, page: Page) -> None:
    stop_on_the_way(panel, page)


def test_escape_stops_too(panel: Panel, page: Page) -> None:
    before = page.evaluate("triGlide.stopped")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="Escape", windowsVirtualKeyCode=27)
    assert page.evaluate("triGlide.stopped") == before + 1


def test_a_held_button_jogs_until_it_is_released(panel: Panel, page: Page) -> None:
    place = page.press(pad("X+"))
    # A browser that draws by the processor may pause, and the jog with it.
    panel.client.wait_for(lambda: panel.position[0] > 0.006, "a jog for as long as it is held")
    page.release(place)
    assert panel.rest_after(time.monotonic()) < SLACK
    _, y, z = panel.position
    assert max(abs(y), abs(z - HOME[2])) < 1e-4


def test_a_short_press_does_not_jog(panel: Panel, page: Page) -> None:
    twists = panel.client.record(TwistStamped, "target_twist")
    page.evaluate(
        f"{{ const b = {pad('X+')}; viser = window.__viserMutable;"
        " viser.sendMessage({type: 'GuiButtonHoldMessage', uuid: b.dataset.hold, frequency: 30}); }"
    )
    panel.client.spin_for(0.3)
    assert not twists


def test_a_hidden_page_jogs_no_more(panel: Panel, page: Page, chromium: Browser) -> None:
    place = page.press(pad("Z+"))
    panel.wait_for_motion()
    begin = time.monotonic()
    other = chromium.new_page()
    page.wait_for("document.hidden", "the page to be hidden")
    assert panel.rest_after(begin) < TWIST_TIMEOUT + SLACK
    panel.client.spin_for(1.5)
    assert panel.is_at_rest, "a hidden page goes on now and then"
    other.call("Page.close")
    page.call("Page.bringToFront")
    page.release(place)


def choose_step(page: Page, size: str) -> None:
    page.click(button(size))
    page.wait_for(f"document.body.innerText.includes('each press moves by {size} mm')", size)


def test_steps_add_up(panel: Panel, page: Page) -> None:
    choose_step(page, "1")
    for _ in range(2):
        page.click(pad("Y+"))
    panel.wait_until_at((0.0, 0.002, 0.25))
    choose_step(page, "10")
    page.click(pad("Z−"))
    panel.wait_until_at((0.0, 0.002, 0.24))
    page.click(button("hold"))
    page.wait_for(f"{pad('X+')}?.dataset.hold", "buttons to hold")


def test_go_to_numbers_and_a_refusal_with_its_reason(panel: Panel, page: Page) -> None:
    for number, text in enumerate(("30", "-20", "300")):
        page.type(field("x, y, z", number), text)
    page.click(button("Go"))
    panel.wait_until_at((0.03, -0.02, 0.3))
    page.type(field("x, y, z", 0), "900")
    page.click(button("Go"))
    panel.wait_for_words(page, "outside the workspace", "refusal")
    assert panel.is_at_rest


def test_disable_and_enable(panel: Panel, page: Page) -> None:
    page.click(button("disable"))
    panel.machine.wait_for_state("disabled")
    panel.wait_for_state(page, "disabled")
    assert page.evaluate(f"{STRIP}.dataset.color") == "warning"
    page.click(button("enable"))
    panel.machine.wait_for_state("idle")


def test_speed_scale(panel: Panel, page: Page) -> None:
    page.type(field("Speed [%]", 0), "40")
    panel.client.wait_for(lambda: "speed_scale: 1 -> 0.4" in panel.machine.ik.output, "0.4")
    panel.client.set_parameters("ik_node", {"speed_scale": 1.0})
    page.wait_for(f"{field('Speed [%]', 0)}.value === '100'", "the scale that another has set")


def test_points_are_taught_driven_paused_and_saved(panel: Panel, page: Page) -> None:
    page.click(tab("Points"))
    places = [(0.03, 0.0, 0.25), (0.03, 0.03, 0.27)]
    for number, place in enumerate(places, 1):
        panel.client.send_pose(place)
        panel.wait_until_at(place)
        panel.client.spin_for(0.2)
        panel.client.wait_for(lambda: "is reached" in panel.machine.reason, "measured rest")
        panel.client.spin_for(0.2)
        page.click(button("Teach this position"))
        rows = (
            "[...document.querySelectorAll('.tri-glide-numbers tr')].filter((e) => e.offsetParent)"
        )
        page.wait_for(f"{rows}.length === {1 + number}", f"{number} points", spin=panel.spin)
    page.click(button("save"))
    panel.client.wait_for(panel.points_file.exists, "the file")
    panel.client.spin_for(0.1)
    (step,) = load_drive(panel.points_file).steps
    assert isinstance(step, PathStep)
    assert step.segments.numbers.reshape(-1, 3) == pytest.approx(np.array(places), abs=1e-4)
    panel.client.send_pose(HOME)
    panel.wait_until_at(HOME)
    panel.client.set_parameters("ik_node", {"speed_scale": 0.03})
    page.click(button("Drive through them"))
    panel.machine.wait_for_state("moving")
    page.click(tab("Drive"))
    page.click(button("pause"))
    panel.client.wait_for(lambda: "pause" in panel.machine.reason, "the pause")
    assert panel.rest_after(time.monotonic()) < 2.0
    panel.client.set_parameters("ik_node", {"speed_scale": 1.0})
    page.click(button("resume"))
    panel.wait_until_at(places[-1])


def test_the_handle_sends_a_target_when_it_is_released(panel: Panel, page: Page) -> None:
    drag = "viser = window.__viserMutable; for (const m of [{}]) viser.sendMessage(m);"
    send = lambda message: page.evaluate(drag.format(message))  # noqa: E731
    send("{type: 'TransformControlsDragStartMessage', name: '/go_to'}")
    send(
        "{type: 'TransformControlsUpdateMessage', name: '/go_to', wxyz: [1, 0, 0, 0],"
        " position: [0.02, 0.01, 0.26]}"
    )
    panel.client.spin_for(0.2)
    assert panel.is_at_rest
    send("{type: 'TransformControlsDragEndMessage', name: '/go_to'}")
    panel.wait_until_at((0.02, 0.01, 0.26))


def test_a_second_page_cannot_take_the_controls_unasked(
    panel: Panel, page: Page, chromium: Browser
) -> None:
    second = panel.open(chromium.new_page())
    panel.wait_for_words(second, "page 1 has the controls", "pages")
    before = panel.position
    # A page that was just opened does not hear each click.
    panel.click_for_words(second, button("disable"), "nothing done", "refusal")
    place = second.press(pad("X+"))
    panel.client.spin_for(0.4)
    second.release(place)
    second.click(button("take"))
    panel.wait_for_words(second, "asked for", "pages")
    assert panel.position == before
    assert panel.machine.state == "idle"
    # Stop is everybody's.
    stop_on_the_way(panel, second)
    # Only if the first one gives them up.
    page.call("Page.bringToFront")
    page.click(button("give up"))
    second.call("Page.bringToFront")
    panel.wait_for_words(second, "you have the controls", "pages")
    second.click(button("disable"))
    panel.machine.wait_for_state("disabled")
    second.click(button("enable"))
    panel.machine.wait_for_state("idle")
    # Who vanishes has them no more, and nobody gets them unasked.
    second.call("Page.close")
    page.call("Page.bringToFront")
    panel.wait_for_words(page, "nobody has the controls", "pages")
    page.click(button("take"))
    page.wait_for(f"!{STRIP}.querySelector('.pages').textContent", "the controls")


def test_sharing_is_refused(panel: Panel, page: Page) -> None:
    assert page.evaluate("!document.body.innerText.includes('Share')")
    page.evaluate("window.__viserMutable.sendMessage({type: 'ShareUrlRequest'})")
    panel.client.wait_for(lambda: "refused to share" in panel.node.output, "a refusal")
    assert "Share URL requested" not in panel.node.output


def test_pages_of_others_cannot_connect(panel: Panel, page: Page) -> None:
    address = panel.address.replace("http", "ws", 1)
    with connect(
        address, origin="http://elsewhere.example", subprotocols=["viser-v1.1.1"]
    ) as socket:
        with pytest.raises(ConnectionClosed):
            socket.recv(10.0)
    assert "it is not ours" in panel.node.output


def test_nothing_is_asked_of_other_hosts(panel: Panel, page: Page) -> None:
    addresses = page.requests()
    assert panel.address.replace("http", "ws", 1) in {a.rstrip("/") for a in addresses}
    here = urlsplit(panel.address).netloc
    others = [
        address
        for address in (each.removeprefix("blob:") for each in addresses)
        if not address.startswith("data:") and urlsplit(address).netloc != here
    ]
    assert not others


def test_a_narrow_page_has_state_stop_and_controls_in_sight(
    panel: Panel, page: Page, chromium: Browser
) -> None:
    narrow = panel.open(chromium.new_page(), PHONE)
    for element in (f"{STRIP}.querySelector('.state')", STOP, tab("Drive")):
        # Nothing lies above it, so that it can be pressed.
        x, y = narrow.middle_of(element)
        assert 0 <= x <= PHONE[0]
        assert 0 <= y <= PHONE[1]
    narrow.call("Page.close")
    page.call("Page.bringToFront")


def test_a_killed_browser_ends_its_jog(panel: Panel, page: Page) -> None:
    page.click(button("give up"))
    panel.wait_for_words(page, "nobody has the controls", "pages")
    with browser() as other:
        operator = panel.open(other.page())
        operator.click(button("take"))
        panel.wait_for_words(operator, "you have the controls", "pages")
        operator.press(pad("Y+"))
        panel.wait_for_motion()
        begin = time.monotonic()
        other.kill()
        assert panel.rest_after(begin) < TWIST_TIMEOUT + SLACK
    panel.wait_for_words(page, "nobody has the controls", "pages")
    page.click(button("take"))


def test_a_killed_panel_ends_its_jog_and_nothing_else(panel: Panel, page: Page) -> None:
    page.press(pad("X−"))
    panel.wait_for_motion()
    begin = time.monotonic()
    panel.node.signal(signal.SIGKILL)
    assert panel.rest_after(begin) < TWIST_TIMEOUT + SLACK
    panel.client.wait_for(lambda: panel.machine.state == "idle", "idle")
    panel.client.send_pose(HOME)
    panel.wait_until_at(HOME)
    page.wait_for(f"{STRIP}.querySelector('.state').textContent === 'no connection'", "the loss")
