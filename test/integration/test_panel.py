"""The panel in a real browser: what is drawn, and what the controls do on the real topics."""

import json
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped
from numpy.typing import NDArray

from testing.browser import DESKTOP, SMALL, Browser, Page, Pixels, find_browser
from testing.page_attack import go_to
from testing.page_reader import PROTOCOL
from testing.panel import HOME, STOP, STRIP, Panel, button, difference, field, pad, tab
from testing.text_page import TextPage
from testing.waiting import wait_until
from tri_glide_kinematics.control import LEAST_PAUSE
from tri_glide_kinematics.mechanisms.pictures import BLUE, GREEN, ORANGE
from tri_glide_kinematics.panel.page import PING_PERIOD, SILENT_PERIODS
from tri_glide_kinematics.panel.programs import NO_FILE

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no browser is installed"),
]

# Where the machine is drawn, and nothing lies above it.
SCENE = (slice(60, 340), slice(60, 470))
# First row of the scene that no words lie above.
BELOW_WORDS = 160
PAGES = f"{STRIP}.querySelector('.pages').textContent"
# A machine that is driven has moved after this [s].
LONG_ENOUGH = 0.7
# A page that does not answer is taken for gone after this [s].
SILENCE = PING_PERIOD * (SILENT_PERIODS + 1)


@pytest.fixture(scope="module")
def operator(panel: Panel, chromium: Browser) -> Page:
    """Return the first page, which has the controls."""
    return panel.open(chromium.page())


@pytest.fixture
def page(panel: Panel, operator: Page) -> Page:
    """Return the operator's page, which has the controls, with the machine at rest in its middle.

    This holds whatever a test before this one has left.
    """
    operator.resize(SMALL)
    operator.release()
    take_back(panel, operator)
    operator.click(tab("Drive"))
    panel.bring_home()
    panel.wait_for_state(operator, "idle")
    return operator


@pytest.fixture
def drawn(page: Page) -> Page:
    """Return the operator's page, drawn in full."""
    page.resize(SMALL, 1.0)
    return page


def scene_of(page: Page) -> Pixels:
    return page.pixels()[SCENE]


def still_scene_of(page: Page) -> Pixels:
    """Return the scene once it does not change any more: its parts come one by one."""
    last = scene_of(page)

    def is_still() -> bool:
        nonlocal last
        time.sleep(0.5)
        last, before = scene_of(page), last
        return difference(before, last) < 3

    wait_until(is_still, "a scene that does not change")
    return last


def test_the_machine_is_drawn_and_moves_by_a_target_of_a_topic(panel: Panel, drawn: Page) -> None:
    before = still_scene_of(drawn)
    dark = (before.max(axis=2) < 110).sum()
    assert dark > 500, "no arms, carriages and towers"
    panel.client.send_pose((0.06, 0.0, 0.32))
    panel.wait_until_at((0.06, 0.0, 0.32))
    panel.client.wait_for(
        lambda: difference(before, scene_of(drawn)) >= 15, "the drawn machine to move"
    )


def test_stop_brakes(panel: Panel, page: Page) -> None:
    panel.stop_on_the_way(lambda: page.click(STOP))


def test_escape_stops_too(panel: Panel, page: Page) -> None:
    before = page.evaluate("triGlide.stopped")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="Escape", windowsVirtualKeyCode=27)
    assert page.evaluate("triGlide.stopped") == before + 1


def test_a_held_button_jogs_until_it_is_released(panel: Panel, page: Page) -> None:
    page.press(pad("X+"))
    # A browser that draws by the processor may pause, and the jog with it.
    panel.client.wait_for(lambda: panel.position[0] > 0.006, "a jog for as long as it is held")
    page.release()
    panel.wait_for_end_of_jog()
    _, y, z = panel.position
    assert max(abs(y), abs(z - HOME[2])) < 1e-4


def test_a_hidden_page_jogs_no_more(panel: Panel, page: Page, chromium: Browser) -> None:
    page.press(pad("Z+"))
    panel.wait_for_motion()
    other = chromium.new_page()
    try:
        page.wait_for("document.hidden", "the page to be hidden")
        panel.wait_for_end_of_jog()
        panel.client.spin_for(SILENCE)
        assert panel.is_at_rest, "a hidden page goes on now and then"
    finally:
        other.call("Page.close")
        page.call("Page.bringToFront")
    page.release()
    # It was never taken for gone.
    assert page.evaluate(PAGES) == ""


@pytest.fixture
def keys(panel: Panel, page: Page) -> Iterator[Page]:
    """Return the operator's page, on which keys and gamepad jog."""
    switch = field("Keys, gamepad")
    page.click(switch)
    page.wait_for(
        "document.querySelector('[data-key=ArrowRight]') !== null", "the keys", spin=panel.spin
    )
    yield page
    key(page, "keyUp", "PageUp")
    page.evaluate("window.pad = null")
    page.click(switch)
    page.wait_for("!document.querySelector('[data-key]')", "no keys", spin=panel.spin)


def key(page: Page, kind: str, name: str, *, repeats: bool = False) -> None:
    """Press or release a key."""
    page.call("Input.dispatchKeyEvent", type=kind, key=name, code=name, autoRepeat=repeats)


def jog_until(panel: Panel, z: float, press: Callable[[], None]) -> None:
    """Jog along +z above a height [m], and along nothing else.

    A browser that draws by the processor may pause for so long that its jog ends: whoever has
    pressed something has to press it again.
    """
    what = "a jog for as long as it is held"
    panel.repeat_until(
        press, lambda seconds: panel.client.wait_for(lambda: panel.position[2] > z, what, seconds)
    )
    assert max(map(abs, panel.position[:2])) < 1e-4


def test_a_held_key_jogs_until_it_is_released(panel: Panel, keys: Page) -> None:
    def press() -> None:
        key(keys, "keyUp", "PageUp")
        key(keys, "keyDown", "PageUp")

    jog_until(panel, HOME[2] + 0.006, press)
    key(keys, "keyUp", "PageUp")
    panel.wait_for_end_of_jog()


KEYS = "document.querySelector('[data-keys]').textContent"


def test_who_rolls_from_one_key_to_another_jogs_by_the_other(panel: Panel, keys: Page) -> None:
    # After a click on a tab, too, and the page says so.
    keys.click(field("x [mm]"))
    keys.wait_for(f"{KEYS}.includes('a field or a tab has the focus')", "no keys", spin=panel.spin)
    keys.click(tab("Drive"))
    keys.wait_for(f"{KEYS} === 'keys move the machine'", "the keys", spin=panel.spin)

    def roll() -> None:
        for name in ("ArrowRight", "PageUp"):
            key(keys, "keyUp", name)
        # A browser that draws by the processor may pause between both.
        for _ in range(5):
            key(keys, "keyDown", "ArrowRight")
            panel.client.spin_for(0.15)
            key(keys, "keyDown", "PageUp")
            key(keys, "keyUp", "ArrowRight")

    panel.repeat_until(
        roll,
        lambda seconds: panel.client.wait_for(
            lambda: panel.position[0] > 1e-4 and panel.position[2] > HOME[2] + 0.006,
            "both jogs",
            seconds,
        ),
    )
    key(keys, "keyUp", "PageUp")
    panel.wait_for_end_of_jog()


def test_a_key_that_is_held_through_a_stop_or_without_the_focus_jogs_no_more(
    panel: Panel, keys: Page
) -> None:
    for end in (
        lambda: key(keys, "keyDown", "Escape"),
        lambda: keys.evaluate("window.dispatchEvent(new Event('blur'))"),
    ):
        key(keys, "keyDown", "PageUp")
        panel.wait_for_motion()
        end()
        panel.wait_for_end_of_jog()
        for _ in range(5):
            key(keys, "keyDown", "PageUp", repeats=True)
        # So long it needs to be released before it jogs again.
        panel.client.spin_for(LEAST_PAUSE + 0.1)
        assert panel.is_at_rest
        key(keys, "keyUp", "PageUp")


def test_who_types_or_has_not_switched_keys_on_moves_nothing(panel: Panel, page: Page) -> None:
    twists = panel.client.record(TwistStamped, "target_twist")
    key(page, "keyDown", "PageUp")
    panel.client.spin_for(0.3)
    key(page, "keyUp", "PageUp")
    page.click(field("Keys, gamepad"))
    page.wait_for(
        "document.querySelector('[data-key=PageUp]') !== null", "the keys", spin=panel.spin
    )
    page.click(field("x [mm]"))
    key(page, "keyDown", "ArrowUp")
    panel.client.spin_for(0.3)
    key(page, "keyUp", "ArrowUp")
    page.click(field("Keys, gamepad"))
    page.wait_for("!document.querySelector('[data-key]')", "no keys", spin=panel.spin)
    assert not twists
    assert panel.is_at_rest


# A gamepad as a browser shows it: window.pad tells what is pressed, and where its sticks are.
PAD = """
window.pad = {buttons: [], axes: [0, 0, 0, 0]};
Object.defineProperty(navigator, "getGamepads", {configurable: true, value: () => {
  window.looks++;
  return [window.pad && {
    connected: true, mapping: "standard", axes: window.pad.axes,
    buttons: Array.from({length: 17}, (_, n) => ({pressed: window.pad.buttons.includes(n)})),
  }, null];
}});
"""
DEAD_MAN = 5


def hold_pad(page: Page, buttons: list[int], right_stick: float) -> None:
    told = json.dumps({"buttons": buttons, "axes": [0.0, 0.1, 0.0, right_stick]})
    page.evaluate(f"window.pad = {told}; window.looks = 0")
    # A page that is drawn by the processor may look at it much later.
    page.wait_for("window.looks > 1", "the page to look at the gamepad")


def test_a_gamepad_jogs_while_its_dead_man_button_is_held(panel: Panel, keys: Page) -> None:
    twists = panel.client.record(TwistStamped, "target_twist")
    keys.evaluate(PAD)
    # A stick alone, one that is hardly pushed, and a button alone move nothing.
    for buttons, stick in (([], -1.0), ([DEAD_MAN], -0.3), ([DEAD_MAN], 0.0)):
        hold_pad(keys, buttons, stick)
        panel.client.spin_for(0.2)
    assert not twists

    def press() -> None:
        hold_pad(keys, [], 0.0)
        hold_pad(keys, [DEAD_MAN], -1.0)

    for end in (
        lambda: hold_pad(keys, [], -1.0),
        lambda: hold_pad(keys, [DEAD_MAN], 0.0),
        lambda: keys.evaluate("window.pad = null"),
        # It holds the button through the stop.
        lambda: key(keys, "keyDown", "Escape"),
    ):
        jog_until(panel, panel.position[2] + 0.003, press)
        end()
        panel.wait_for_end_of_jog()
        # ik_node would not move by it: the page does not hold anything, either.
        assert keys.evaluate("document.querySelector('.held') === null")
    hold_pad(keys, [], 0.0)


# Several fields and a button, one at once after the other.
AT_ONCE = """
(async () => {
  const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set;
  for (const [field, text] of [FIELDS]) {
    set.call(field, text);
    field.dispatchEvent(new Event('input', {bubbles: true}));
    await Promise.resolve();
  }
  BUTTON.click();
})()
"""


def test_what_is_typed_just_before_go_counts(panel: Panel, page: Page) -> None:
    places = (("x", 21), ("y", -12), ("z", 266))
    fields = ", ".join(f"[{field(f'{axis} [mm]')}, '{number}']" for axis, number in places)
    page.evaluate(AT_ONCE.replace("FIELDS", fields).replace("BUTTON", button("Go")))
    panel.wait_until_at((0.021, -0.012, 0.266))


def is_on(words: str) -> str:
    return f"{button(words)}?.getAttribute('aria-pressed') === 'true'"


def test_disable_and_enable(panel: Panel, page: Page) -> None:
    page.wait_for(f"{is_on('enable')} && {is_on('hold')}", "what is on", spin=panel.spin)
    page.click(button("disable"))
    page.wait_for(f"{is_on('disable')} && !({is_on('enable')})", "disabled", spin=panel.spin)
    panel.machine.wait_for_state("disabled")
    panel.wait_for_state(page, "disabled")
    panel.wait_for_words(page, " mm measured", "position")
    assert page.evaluate(f"{STRIP}.dataset.color") == "warning"
    page.click(button("enable"))
    panel.machine.wait_for_state("idle")


def test_speed_scale(panel: Panel, page: Page) -> None:
    # The box beside a slider takes no digits: they are those of the slider, which a key changes.
    page.type(field("Speed [%]", 0), "40")
    thumb = "[...document.querySelectorAll('[role=slider]')].find((e) => e.offsetParent)"
    assert page.evaluate(f"{thumb}.getAttribute('aria-valuenow')") == "100"
    page.evaluate(f"{thumb}.focus()")
    key(page, "keyDown", "Home")
    panel.client.wait_for(lambda: "speed_scale: 1 -> 0.01" in panel.machine.ik.output, "0.01")
    panel.client.set_parameters("ik_node", {"speed_scale": 1.0})
    page.wait_for(f"{field('Speed [%]', 0)}.value === '100'", "the scale that another has set")


def test_nothing_is_asked_of_other_hosts(panel: Panel, page: Page) -> None:
    assert page.evaluate("!document.body.innerText.includes('Share')")
    addresses = page.requests()
    assert panel.origin.replace("http", "ws", 1) in {a.rstrip("/") for a in addresses}
    here = urlsplit(panel.address).netloc
    others = [
        address
        for address in (each.removeprefix("blob:") for each in addresses)
        if not address.startswith("data:") and urlsplit(address).netloc != here
    ]
    assert not others


# Sends all as soon as it is connected, and tells whether it ever was.
FOREIGN_PAGE = """<!doctype html><script>
window.tries = Promise.all(ADDRESSES.map((address) => new Promise((done) => {
  const socket = new WebSocket(address, [PROTOCOL]);
  socket.onopen = () => {
    for (const bytes of MESSAGES) socket.send(new Uint8Array(bytes));
    setTimeout(() => done("connected"), 500);
  };
  socket.onerror = () => done("refused");
})));
</script>"""


def test_a_foreign_page_in_a_browser_that_knows_the_token_moves_nothing(
    panel: Panel, page: Page, chromium: Browser
) -> None:
    """That such messages of the page itself do move the machine, test_page_admission.py shows."""
    hosts, port = ("127.0.0.1", "localhost"), urlsplit(panel.address).port
    before = panel.position
    messages = json.dumps([list(each) for each in go_to((0.04, 0.02, 0.3))])
    addresses = json.dumps([f"ws://{host}:{port}" for host in hosts])
    text = FOREIGN_PAGE.replace("ADDRESSES", addresses).replace("MESSAGES", messages)
    text = text.replace("PROTOCOL", json.dumps(PROTOCOL))
    other = chromium.new_page()
    try:
        with foreign_server(text) as foreign:
            for host in hosts:
                other.open(panel.address.replace("127.0.0.1", host))
                # The browser has gone on to the page itself, with its cookie.
                is_there = f"location.href === 'http://{host}:{port}/'"
                other.wait_for(f"{is_there} && document.title === 'Viser'", "the page")
                assert other.evaluate("document.cookie") == ""
            # Cookies are those of all ports of a host.
            for host in hosts:
                other.open(f"http://{host}:{foreign}/")
                other.wait_for("window.tries", "the foreign page", spin=panel.spin)
                assert other.evaluate("tries") == ["refused", "refused"]
                panel.client.spin_for(LONG_ENOUGH)
                assert panel.is_at_rest and panel.position == before
    finally:
        other.call("Page.close")
        page.call("Page.bringToFront")


def test_what_runs_is_in_sight_on_each_tab_and_kept_with_its_time(panel: Panel, page: Page) -> None:
    panel.client.set_parameters("ik_node", {"speed_scale": 0.02})
    for axis, text in zip("xyz", ("0", "0", "400")):
        page.type(field(f"{axis} [mm]"), text)
    page.click(button("Go"))
    panel.wait_for_state(page, "moving")
    for name in ("Points", "Mechanisms"):
        page.click(tab(name))
        panel.wait_for_words(page, "(0, 0, 400) mm", "reason")
        panel.wait_for_words(page, " left", "left")
        panel.wait_for_words(page, " mm/s · speed 2 %", "speed")
        shown = page.evaluate(f"{STRIP}.querySelector('.position').textContent")
        x, y, z = (float(each) for each in shown.split()[1:-1:2])
        assert (x, y) == (0.0, 0.0)
        assert 250.0 < z < 400.0
    page.click(STOP)
    panel.wait_for_state(page, "idle")
    page.click(f"{STRIP}.querySelector('.more')")
    # On a busy computer something else may be told right after it.
    entry = (
        f"[...{STRIP}.querySelectorAll('.history li')].slice(0, 3).map((each) => each.innerText)"
        ".find((text) => text.includes('a stop was asked for'))"
    )
    told = page.wait_for(entry, "the stop", spin=panel.spin)
    assert re.match(r"\d\d:\d\d:\d\d", told)
    # The button of a recording opens the tab that draws it.
    entry = {"time": "", "color": "fault", "text": "", "log": "", "count": 1, "press": "nothing"}
    page.evaluate(f"window.triGlide.history([{json.dumps(entry)}])")
    page.click(f"{STRIP}.querySelector('.history button')")
    page.wait_for(f"{tab('Curves')}.ariaSelected === 'true'", "the curves", spin=panel.spin)
    page.click(f"{STRIP}.querySelector('.more')")
    page.click(tab("Drive"))


def test_a_page_is_dark_where_its_browser_asks_for_it(panel: Panel, drawn: Page) -> None:
    page = drawn

    def background() -> float:
        return float(page.pixels()[-30:, -30:].mean())

    light = background()
    try:
        features = [{"name": "prefers-color-scheme", "value": "dark"}]
        page.call("Emulation.setEmulatedMedia", features=features)
        dark = "document.documentElement.dataset.mantineColorScheme === 'dark'"
        page.wait_for(dark, "the colours", spin=panel.spin)
        assert background() < 100.0 < light
    finally:
        page.call("Emulation.setEmulatedMedia", features=[])
    page.wait_for(f"!({dark})", "the colours of before", spin=panel.spin)


def test_viser_has_what_the_script_of_the_page_takes(page: Page) -> None:
    names = ("sendMessage", "requestRender", "messageQueue", "drainMessageQueue")
    missing = f"{json.dumps(names)}.filter((each) => !(each in (window.__viserMutable ?? {{}})))"
    assert page.evaluate(missing) == [], "another version of viser: page.js needs these"


TABS = ("Drive", "Points", "Program", "Numbers", "Curves", "Swing", "Mechanisms")
# The smallest phones, and the smallest windows of both layouts: in larger ones there is more room.
SIZES = [(360, 640), (640, 480), SMALL]
# axe-core comes in this package, of which nothing else is used.
AXE = find_spec("axe_playwright_python")
VIOLATIONS = """axe.run(document, {resultTypes: ["violations"], runOnly: {type: "tag", values:
  ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}}).then((found) => found.violations.map(
  ({id, nodes}) =>
    [id, ...nodes.map((node) => `${node.html.slice(0, 200)} ${node.failureSummary}`)]))"""
# Words that do not fit, and what lies above a button or a field once it was scrolled into sight.
# What viser says of a computer without a graphics card may be covered.
HIDDEN = """{
const hides = (each) => {
  if (!each.offsetParent || each.type === "file") return false;
  if (each.closest(".mantine-Notification-root")) return false;
  const isCut = each.scrollWidth > each.clientWidth + 1 && each.clientWidth > 0 &&
    getComputedStyle(each).overflowX !== "visible";
  if (isCut || !each.matches("button, input, [role=tab]")) return isCut;
  each.scrollIntoView({block: "center"});
  const {x, y, width, height} = each.getBoundingClientRect();
  const above = document.elementFromPoint(x + width / 2, y + height / 2);
  return width && (x < -1 || x + width > innerWidth + 1 || !each.parentElement.contains(above));
};
[...document.querySelectorAll("button, input, label, [role=tab], span, p, td")].filter(hides)
  .map((each) => each.outerHTML.slice(0, 200)) }"""


def test_nothing_is_hidden_and_axe_finds_no_violation_of_wcag(page: Page) -> None:
    """The second part needs axe-core: pip install --no-deps axe-playwright-python."""
    if AXE and AXE.origin:
        script = Path(AXE.origin).with_name("axe.min.js")
        page.evaluate(f"{script.read_text(encoding='utf-8')};0")
    named = "![...document.querySelectorAll('input, button')].some((each) => each.offsetParent"
    named += " && !each.labels?.length && !each.ariaLabel && !each.textContent)"
    try:
        for size in SIZES:
            scheme = "dark" if size == SIZES[0] else "light"
            page.resize(size)
            features = [{"name": "prefers-color-scheme", "value": scheme}]
            page.call("Emulation.setEmulatedMedia", features=features)
            is_shown = f"document.documentElement.dataset.mantineColorScheme === '{scheme}'"
            page.wait_for(f"{is_shown} && innerWidth === {size[0]}", scheme)
            for name in TABS:
                page.click(tab(name))
                page.wait_for(named, "names of all controls")
                # Its parts take their places one by one.
                # Sizes change what fits, and hardly a colour.
                looks = [HIDDEN, VIOLATIONS] if AXE and size != SIZES[1] else [HIDDEN]
                for look in looks:
                    wait_until(
                        lambda look=look: page.evaluate(look) == [],
                        lambda look=look: f"{name}, {scheme}, {size}: {page.evaluate(look)}",  # noqa: B023
                        0.1,
                    )
    finally:
        page.call("Emulation.setEmulatedMedia", features=[])


LONG_WORDS = "slider_2 is measured 12.345678 mm away from where it is commanded to be; " * 6
# Shows words, and returns where they and the buttons then are: left, top, right, bottom.
SHOW = """(() => {
  triGlide.show(WORDS);
  const strip = STRIP, stop = STOP, words = strip.querySelector(".words");
  const box = (each) => {
    const place = each.getBoundingClientRect();
    return [place.left, place.top, place.right, place.bottom];
  };
  words.scrollTop = 1e6;
  const others = [...document.querySelectorAll("button")].filter((each) => each !== stop);
  return {
    stop: box(stop), state: box(strip.querySelector(".state")), words: box(words),
    limit: box(strip.querySelector(".limit")), last: box(strip.querySelector(".pages")),
    others: others.map(box),
  };
})()"""

# Returns what was found if Stop is at least twice as large as each other button.
IS_LARGE = """(found) => {
  const area = ([left, top, right, bottom]) => (right - left) * (bottom - top);
  return Math.max(...found.others.map(area)) < 0.5 * area(found.stop) ? found : null;
}"""

Box = tuple[float, float, float, float]


def lie_apart(first: Box, second: Box) -> bool:
    return (
        first[2] <= second[0]
        or second[2] <= first[0]
        or first[3] <= second[1]
        or second[3] <= first[1]
    )


def test_long_words_hide_neither_stop_nor_their_own_end(page: Page) -> None:
    words = dict.fromkeys(("reason", "refusal", "pages"), LONG_WORDS)
    words |= {
        "state": "stopping",
        "stop": "ramps to rest",
        "limit": "teach mode · at most 250 mm/s",
    }
    told = json.dumps({"color": "fault", **words})
    show = SHOW.replace("WORDS", told).replace("STRIP", STRIP).replace("STOP", STOP)
    for size in SIZES:
        page.resize(size)
        # While the page goes over to another size, Stop is small for a moment.
        laid_out = f"innerWidth === {size[0]} && ({IS_LARGE})({show})"
        found = page.wait_for(laid_out, "the page in its new size, Stop larger than all buttons")
        stop, state, place = found["stop"], found["state"], found["words"]
        for box in (stop, state, place, found["limit"]):
            assert box[0] >= 0 and box[1] >= 0 and box[2] <= size[0] and box[3] <= size[1], size
            assert box is stop or lie_apart(stop, box), size
        assert lie_apart(state, place), size
        # What does not fit is scrolled into sight.
        assert found["last"][3] <= place[3] + 1.0, size
    # With another tab, the page is told again what holds.
    page.click(tab("Points"))


MAP = "Object.keys(window.__viserSceneTree.getState()).includes('/map')"
LEGEND = "document.querySelector('.tri-glide-legend')"


def test_a_map_is_a_coloured_plane_with_a_legend(panel: Panel, drawn: Page) -> None:
    page = drawn
    before = still_scene_of(page)
    page.click(tab("Numbers"))
    panel.click_choice(page, "Show", "force")
    page.wait_for(f"{MAP} && {LEGEND} !== null", "the map", spin=panel.spin)
    assert page.evaluate(f"{LEGEND}.innerText.includes(' N')")
    after = still_scene_of(page)
    changed = (np.abs(after.astype(int) - before).max(axis=2) > 60).sum(axis=1)
    # Where the arms reach, the level is a triangle with a corner behind and a side in front: it
    # gets wider from its upper end on. Words above it may have come or gone meanwhile.
    changed = changed[BELOW_WORDS:]
    upper_end = int((changed > 40).argmax())
    assert changed.argmax() > upper_end + 25
    panel.click_choice(page, "Show", "calibration")
    page.wait_for(f"{LEGEND}.innerText.includes(' µm')", "its uncertainty", spin=panel.spin)
    panel.click_choice(page, "Show", "none")
    page.wait_for(f"!({MAP}) && {LEGEND} === null", "no map", spin=panel.spin)


def places(pixels: Pixels, colour: str) -> NDArray[np.intp]:
    """Return where a colour, #RRGGBB, is. Shape (n, 2), rows and columns."""
    wanted = tuple(bytes.fromhex(colour[1:]))
    return np.argwhere(np.abs(pixels.astype(int) - wanted).max(axis=2) < 25)


def test_a_mechanism_is_drawn_beside_the_machine(panel: Panel, page: Page) -> None:
    page.resize(DESKTOP, 1.0)
    page.click(tab("Mechanisms"))
    panel.click_choice(page, "Mechanism", "f_mechanism_example_2")
    words = "document.body.innerText.includes('The cranks turn fully on this branch.')"
    page.wait_for(words, "what is told of it", spin=panel.spin)

    def is_beside_the_machine() -> bool:
        # Not the controls.
        now = page.pixels()[:, :950]
        found = [places(now, each) for each in (BLUE, GREEN, ORANGE)]
        if min(map(len, found)) < 150:
            return False
        (first_row, first_column), (last_row, last_column) = found[1].min(0), found[1].max(0)
        # The camera moves to its place after the first picture.
        across = 0.45 * 950 < first_column and last_column < 0.98 * 950
        return bool(across and 100 < first_row and last_row < 700)

    wait_until(is_beside_the_machine, "the drawing beside the machine", 0.2)
    panel.click_choice(page, "Mechanism", "none")


def test_curves_are_drawn_and_go_on(panel: Panel, page: Page) -> None:
    page.click(tab("Curves"))
    canvas = "document.querySelector('.uplot canvas')"
    page.wait_for(f"{canvas} !== null", "a plot", spin=panel.spin)
    # As data, as the canvas lies partly below the window.
    before = page.evaluate(f"{canvas}.toDataURL()")
    panel.client.send_pose((0.03, 0.0, 0.3))
    page.wait_for(f"{canvas}.toDataURL() !== {before!r}", "the curves to go on", spin=panel.spin)


def test_keys_of_a_page_without_the_controls_are_not_even_sent(panel: Panel, keys: Page) -> None:
    keys.click(button("give up"))
    panel.wait_for_words(keys, "nobody has the controls", "pages")
    sent = "window.sent = 0; const viser = window.__viserMutable, send = viser.sendMessage;"
    keys.evaluate(f"{{ {sent} viser.sendMessage = (m) => {{ window.sent += 1; send(m); }}; }}")
    key(keys, "keyDown", "PageUp")
    panel.client.spin_for(0.3)
    key(keys, "keyUp", "PageUp")
    assert keys.evaluate("window.sent") == 0
    assert panel.is_at_rest
    keys.click(button("take"))
    panel.client.wait_for(lambda: keys.evaluate("window.sent") > 0, "what is sent to be counted")


def take_back(panel: Panel, page: Page) -> None:
    """Let a page have the controls, which no other page has for long."""
    page.wait_for(f"!{PAGES}.includes('you are')", "controls that are free", spin=panel.spin)
    nobody = f"{PAGES}.includes('nobody')"
    if page.evaluate(nobody):
        page.click(button("take"))
        page.wait_for(f"!{nobody}", "the controls", spin=panel.spin)


def test_a_frozen_browser_ends_its_jog_and_loses_the_controls(
    panel: Panel, page: Page, chromium: Browser
) -> None:
    with closing(TextPage(panel.address)) as other:
        page.press(pad("Y+"))
        panel.wait_for_motion()
        chromium.signal(signal.SIGSTOP)
        try:
            panel.wait_for_end_of_jog()
            panel.read_until(other, "nobody has the controls")
        finally:
            chromium.signal(signal.SIGCONT)
        # It comes back, with its button pressed, and moves nothing.
        panel.wait_for_words(page, "nobody has the controls", "pages")
        assert panel.is_at_rest


def test_a_page_that_is_opened_anew_in_its_tab_can_take_the_controls(
    panel: Panel, page: Page
) -> None:
    """The browser may keep what was there before, with its connection."""
    panel.open(page)
    take_back(panel, page)
    page.press(pad("Y+"))
    panel.wait_for_motion()
    page.release()


PIXELS = "!!window.__viserMutable?.nodeRefFromName?.['/program']"


def test_a_program_is_uploaded_and_seen(panel: Panel, page: Page, tmp_path: Path) -> None:
    page.click(tab("Program"))

    def upload(name: str, end: int) -> None:
        file = tmp_path / name
        file.write_text(f"G21 G90 G17\nG0 X0 Y0 Z260\nG1 X-20 F6000\nG1 X{end} F600\nM2\n")
        page.choose_file("[data-upload]", file)

    def wait_for_text(words: str) -> None:
        found = f"document.body.innerText.includes({json.dumps(words)})"
        page.wait_for(found, repr(words), spin=panel.spin)

    upload("square.ngc", 60)
    wait_for_text("-20 to 60 mm")
    page.wait_for(PIXELS, "the path", spin=panel.spin)
    # A file that is called like the choice of none ends no page.
    upload(NO_FILE, 70)
    wait_for_text("no file can be called")
    (panel.programs / NO_FILE).write_bytes((tmp_path / NO_FILE).read_bytes())
    upload("after.ngc", 80)
    wait_for_text("-20 to 80 mm")
    (panel.programs / "after.ngc").unlink()
    wait_for_text("after.ngc is no longer in the folder")


def test_a_killed_panel_ends_its_jog_and_nothing_else(panel: Panel, page: Page) -> None:
    page.press(pad("X−"))
    panel.wait_for_motion()
    panel.node.signal(signal.SIGKILL)
    panel.wait_for_end_of_jog()
    panel.client.wait_for(lambda: panel.machine.state == "idle", "idle")
    panel.client.send_pose(HOME)
    panel.wait_until_at(HOME)
    page.wait_for(f"{STRIP}.querySelector('.state').textContent === 'no connection'", "the loss")


@contextmanager
def foreign_server(text: str) -> Iterator[int]:
    """Serve a page of somebody else on another port of this computer."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(text.encode())

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()
