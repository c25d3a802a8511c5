"""The mechanisms tab and the curves in a real browser: what a person sees of them."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from mechanisms_rig import NAP, Rig, page_server

from testing.browser import DESKTOP, PHONE, browser, find_browser
from tri_glide_kinematics.mechanisms.pictures import BLUE, GREEN, ORANGE
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine_scene import light_plainly
from tri_glide_kinematics.panel.mechanisms.tab import PALE, rgb
from tri_glide_kinematics.panel.tabs import Curves
from tri_glide_kinematics.settings import IK_NODE

pytestmark = [
    # It starts none, but a browser is as much to do as they are.
    pytest.mark.nodes,
    pytest.mark.slow,
    pytest.mark.skipif(find_browser() is None, reason="no browser is installed"),
]

FACTS = MachineFacts({parameter.name: parameter.default for parameter in IK_NODE})
SAME = 25  # of 255, between a colour and one that counts as it
SCENE_WIDTH = 950  # pixels, of a wide window; beside it are the controls
CHOICE = "[...document.querySelectorAll('input')].find((e) => e.offsetWidth > 100)"


def option(text):
    return (
        "[...document.querySelectorAll('[role=option]')]"
        f".find((e) => e.textContent.trim() === '{text}' && e.offsetWidth)"
    )


class Screen:
    """One page that shows the tab and the curves, while somebody steps both."""

    def __init__(self, rig, page):
        self.rig = rig
        self.page = page
        with rig.server.gui.add_folder("Curves"):
            self.curves = Curves(rig.server.gui)

    def spin(self):
        now = time.monotonic()
        self.rig.tab.step(now)
        heights = (0.5 + 0.1 * math.sin(3.0 * now), 0.6, 0.7)
        motion = SliderState(heights, (0.3, 0.0, -0.3), (3.0, 0.0, -3.0))
        self.curves.take([(now, motion)])
        self.curves.draw(now, FACTS)
        time.sleep(NAP)

    def open(self):
        self.page.open(f"http://127.0.0.1:{self.rig.server.get_port()}", DESKTOP)
        self.wait_for("document.readyState === 'complete'", "the page")
        self.wait_for(CHOICE, "the choice of a mechanism")

    def wait_for(self, expression, what):
        self.page.wait_for(f"!!({expression})", what, spin=self.spin)

    def pixels(self):
        """Return what is drawn of the scene: not the controls, nor what viser says of this GPU."""
        pixels = self.page.pixels()[:, :SCENE_WIDTH].astype(int)
        pixels[:150, :320] = 255
        return pixels

    def wait_for_pixels(self, condition, what, timeout=30.0):
        end = time.monotonic() + timeout
        while not condition(pixels := self.pixels()):
            assert time.monotonic() < end, f"waited {timeout:g} s in vain for {what}"
            self.spin_for(0.2)
        return pixels

    def choose(self, name):
        """Choose a file, and open the list again if the page was still arranging itself."""
        if self.rig.tab.choice.value == name:
            return
        end = time.monotonic() + 20.0
        while not self.page.evaluate(f"!!({option(name)})"):
            assert time.monotonic() < end, f"there is no {name} to be chosen"
            self.page.click(CHOICE)
            self.spin_for(1.0)
        self.page.click(option(name))
        self.rig.wait_for(lambda: self.rig.tab.choice.value == name, f"{name} to be chosen")

    def spin_for(self, duration):
        end = time.monotonic() + duration
        while time.monotonic() < end:
            self.spin()

    def text_appears(self, text):
        self.wait_for(f"document.body.innerText.includes({text!r})", text)


@pytest.fixture(scope="module")
def screen():
    with (
        page_server() as server,
        browser() as running,
    ):
        server.gui.main_panel.dock_right()
        light_plainly(server.scene)
        rig = Rig(server)
        screen = Screen(rig, running.page())
        screen.open()
        yield screen


def places(pixels, colour):
    """Return where a colour is. Shape (n, 2), rows and columns."""
    away = np.abs(pixels - rgb(colour)).max(axis=2)
    return np.argwhere(away < SAME)


def test_a_chosen_mechanism_is_drawn_beside_the_machine(screen):
    screen.choose("none")
    screen.wait_for_pixels(lambda now: len(places(now, PALE)) < 20, "an empty scene")
    screen.choose("f_mechanism_example_2")

    def is_beside_the_machine(now):
        # The camera moves to its place after the first picture, so the place is waited for.
        blue, green, orange, pale = (places(now, c) for c in (BLUE, GREEN, ORANGE, PALE))
        if not (len(blue) > 1000 and min(len(green), len(orange)) > 150 and len(pale) > 400):
            return False
        (first_row, first_column), (last_row, last_column) = green.min(axis=0), green.max(axis=0)
        width = now.shape[1]
        # The machine is to its left.
        across = 0.45 * width < first_column and last_column < 0.98 * width
        return across and 100 < first_row and last_row < 700

    screen.wait_for_pixels(is_beside_the_machine, "the drawing beside the machine")
    screen.text_appears("The cranks turn fully on this branch.")


def test_curves_are_drawn_and_go_on(screen):
    canvas = "document.querySelector('.uplot canvas')"
    screen.wait_for(canvas, "a plot")
    # As data, as the canvas lies partly below the window.
    drawn = f"{canvas}.toDataURL()"
    before = screen.page.evaluate(drawn)
    screen.wait_for(f"{drawn} !== {before!r}", "the curves to go on")
    count = screen.page.evaluate("document.querySelectorAll('.uplot canvas').length")
    assert count == 3


@pytest.fixture
def phone(screen):
    """Return the page as it is on a phone."""
    resize(screen, PHONE)
    yield screen
    resize(screen, DESKTOP)


def resize(screen, size):
    screen.page.resize(size, 1.0)
    is_narrow = size == PHONE
    (client,) = screen.rig.server.get_clients().values()
    screen.rig.wait_for(lambda: (client.camera.aspect < 0.5) == is_narrow, "the page to tell it")


def test_on_a_phone_the_drawing_lies_above_the_controls(phone):
    phone.choose("none")
    phone.choose("four_bar_textbook")

    def lies_above_the_controls(now):
        # The camera moves to its place after the first picture, so the place is waited for.
        drawn = places(now[:480], BLUE)
        if len(drawn) <= 100:
            return False
        (first_row, first_column), (_, last_column) = drawn.min(axis=0), drawn.max(axis=0)
        return first_row > 150 and 195 < first_column and last_column < 385

    phone.wait_for_pixels(lies_above_the_controls, "the drawing above the controls")
