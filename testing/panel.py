"""A machine, its panel and a browser that shows it, and what is needed to press its buttons."""

import json
import math
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from testing.browser import COARSE, SMALL, Page, Pixels
from testing.browser import TIMEOUT as PAGE_TIMEOUT
from testing.client import Client
from testing.commands import KINEMATICS
from testing.machine import Machine
from testing.processes import TIMEOUT, Launcher, RunningNode
from testing.text_page import TextPage
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Only the newest: a browser that draws by the processor leaves little time for anything else.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
# So often a button is clicked until it is heard.
CLICKS = 6
# A jog sends 30 twists in a second: where none has come for so long, none goes on [s].
QUIET = 0.5

HOME = (0.0, 0.0, 0.25)

CONFIG = Path(__file__).parents[1] / "config"

STOP = "document.querySelector('#tri-glide-stop')"
STRIP = "document.querySelector('#tri-glide-strip')"


def button(text: str) -> str:
    """Return an expression for a button of the panel."""
    return _found("button", text)


def tab(text: str) -> str:
    """Return an expression for a tab of the panel."""
    return _found("[role=tab]", text)


def pad(text: str) -> str:
    """Return an expression for a button of the pad, such as X+."""
    return _found(".tri-glide-pad button", text)


def field(label: str, number: int = 0) -> str:
    """Return an expression for a field of the panel, by its label and its place beside it."""
    return (
        "(() => { const label = [...document.querySelectorAll('label, .mantine-Text-root')]"
        f".find((e) => e.textContent.trim() === {json.dumps(label)} && e.offsetParent);"
        " let row = label; while (row && !row.querySelector('input')) row = row.parentElement;"
        " return row && [...row.querySelectorAll('input')].filter((e) => e.offsetParent)"
        f"[{number}]; }})()"
    )


def _found(selector: str, text: str) -> str:
    return (
        f"[...document.querySelectorAll({json.dumps(selector)})]"
        f".find((e) => e.textContent.trim() === {json.dumps(text)} && e.offsetParent)"
    )


class Panel:
    """A machine with a panel, seen by a client on the topics and by pages in a browser."""

    def __init__(
        self, client: Client, launcher: Launcher, folder: Path, rate: float = 200.0
    ) -> None:
        """Start simulator, ik_node and panel_node; all that is saved is in ``folder``.

        A ``rate`` [1/s] below that by default leaves more of the processor to the browser.
        """
        self.client = client
        self.machine = Machine(client, launcher, listen=False)
        self.points_file = folder / "points.yaml"
        self._commands = client.record(JointState, "joint_commands", NEWEST, keep=1)
        self._twists = client.record(TwistStamped, "target_twist")
        # An ik_node that is started anew needs them, too: with others it is another machine.
        self.parameters = {"rate": rate}
        self.machine.start_simulator(self.parameters)
        self.machine.start_ik(self.parameters)
        self.programs = folder / "programs"
        # In it, the zero of programs is that of the machine.
        (folder / "settings.yaml").write_text("unit: mm\noffsets: {G54: [0, 0, 0]}\n")
        files = {
            "program_settings": folder / "settings.yaml",
            "points_file": self.points_file,
            "token_file": folder / "token",
            "programs_folder": self.programs,
            "progress_file": folder / "progress.yaml",
            "work_zero_file": folder / "work_zero.yaml",
            "measurements_file": CONFIG / "measurements_example.yaml",
        }
        self._launcher = launcher
        self._arguments = [word for name in files for word in ("-p", f"{name}:={files[name]}")]
        self.start_node()
        self.machine.wait_for_state("idle")

    def start_node(self) -> None:
        """Start ``panel_node``, which has another address each time."""
        self.node: RunningNode = self._launcher.start(
            "panel_node", arguments=("-p", "port:=0", *self._arguments)
        )
        self.client.wait_for(lambda: "the page: " in self.node.output, "the panel")
        found = re.search(r"the page: (\S+)", self.node.output)
        assert found
        # With the token.
        self.address = found.group(1)
        self.origin = self.address.partition("/?")[0]

    def open(self, page: Page, size: tuple[int, int] = SMALL, scale: float = COARSE) -> Page:
        """Open the panel in a ``page`` and wait until it shows the machine."""
        page.open(self.address, size, scale)
        names = "Object.keys(window.__viserSceneTree.getState())"
        page.wait_for(f"{names}.includes('/measured/platform')", "the machine", spin=self.spin)
        # A browser that is started may leave the simulator too little time.
        self.recover()
        self.wait_for_state(page, "idle")
        return page

    def recover(self) -> None:
        """Enable the machine if something has ended in a fault, or with it disabled."""
        if self.machine.state in ("fault", "disabled"):
            self.client.wait_for(lambda: self.client.enable().success, "a machine that may move")

    def bring_home(self) -> None:
        """Let the machine rest in its middle, at full speed, whatever was before."""
        self.recover()
        self.client.set_parameters("ik_node", {"speed_scale": 1.0})
        # Of a pose that leads nowhere one could not tell when it is over.
        if not self._rests_at(HOME):
            # An ik_node that was killed is taken for a listener a while longer.
            self.machine.wait_until_targets_get_there()
            self.repeat_until(
                lambda: self.client.send_pose(HOME),
                lambda seconds: self.client.wait_for(
                    lambda: self._rests_at(HOME), "the middle", seconds
                ),
            )
        self.machine.wait_for_state("idle")

    def stop_on_the_way(self, press_stop: Callable[[], object]) -> None:
        """Press Stop while the machine is on a slow way upwards, and see it brake."""
        self.client.set_parameters("ik_node", {"speed_scale": 0.02})
        self.client.send_pose((0.0, 0.0, 0.4))
        self.wait_for_motion()
        press_stop()
        self.client.wait_for(
            lambda: (self.machine.state, self.machine.cause) == ("idle", Cause.STOP_ASKED),
            "the stop",
        )
        assert self.position[2] < 0.39

    def spin(self) -> None:
        """Let a moment pass."""
        self.client.spin_for(0.02)

    def wait_for_state(self, page: Page, state: str) -> None:
        """Wait until a ``page`` shows a state."""
        text = f"{STRIP}?.querySelector('.state').textContent === {json.dumps(state)}"
        try:
            page.wait_for(text, f"{state} on the page", spin=self.spin)
        except TimeoutError as error:
            raise TimeoutError(f"{error}: {page.evaluate(f'{STRIP}.innerText')!r}") from error

    def wait_for_words(self, page: Page, part: str, kind: str) -> None:
        """Wait until words of a kind on a ``page`` have a ``part``: refusal, reason or pages."""
        text = f"{STRIP}?.querySelector('.{kind}').textContent.includes({json.dumps(part)})"
        page.wait_for(text, f"{part!r} on the page", spin=self.spin)

    def read_until(self, page: TextPage, words: str, timeout: float = TIMEOUT) -> None:
        """Wait until these ``words`` are read on a ``page`` without a browser."""

        def are_read() -> bool:
            # To look after each of the many setpoints would take longer than to wait.
            self.spin()
            return words in page.text

        try:
            self.client.wait_for(are_read, repr(words), timeout)
        except TimeoutError as error:
            raise TimeoutError(f"{error}: {page.text}") from error

    def click_until(self, page: Page, element: str, wait: Callable[[float], None]) -> None:
        """Click on an element of a ``page``, again if need be.

        A click may do nothing for now: the panel knows some time later what the machine does.
        """
        self.repeat_until(lambda: page.click(element), wait)

    def repeat_until(self, act: Callable[[], object], wait: Callable[[float], None]) -> None:
        """Do something, and again if need be.

        Args:
            act: does it.
            wait: for what is to come of it, for so many seconds.
        """
        for _ in range(CLICKS - 1):
            act()
            with suppress(TimeoutError):
                wait(PAGE_TIMEOUT / CLICKS)
                return
        act()
        wait(PAGE_TIMEOUT)

    def click_choice(self, page: Page, label: str, choice: str) -> None:
        """Open the list with a ``label`` on a ``page``, and click on a ``choice`` of it."""
        options = "[...document.querySelectorAll('[role=option]')].filter((e) => e.offsetParent)"
        option = f"{options}.find((e) => e.textContent === {json.dumps(choice)})"
        # A list may close when the page draws anew.
        self.click_until(
            page,
            field(label),
            lambda seconds: page.wait_for(f"{option} !== undefined", choice, seconds, self.spin),
        )
        page.evaluate(f"{option}.click()")

    def wait_until_at(self, position: Sequence[float]) -> None:
        """Wait until the platform is commanded to rest at a ``position`` [m]."""
        self.client.wait_for(lambda: self._rests_at(position), f"rest at {position}")

    def _rests_at(self, position: Sequence[float]) -> bool:
        return self.is_at_rest and math.dist(self.position, position) < 2e-5

    @property
    def position(self) -> Vector3:
        """Where the platform is commanded to be [m]."""
        return self._place_of(self.newest)

    @property
    def newest(self) -> Any:
        """The newest command."""
        self.client.wait_for(lambda: self._commands, "a command")
        return self._commands[-1]

    @property
    def is_at_rest(self) -> bool:
        """Whether the newest command is at rest."""
        return not any(self.newest.velocity)

    def wait_for_end_of_jog(self) -> None:
        """Wait until the machine rests and no twists come any more.

        On a busy computer many may be on their way. A jog without an end sends them forever.
        """

        def is_over() -> bool:
            self._twists.clear()
            self._commands.clear()
            self.client.spin_for(QUIET)
            return not self._twists and self.is_at_rest

        self.client.wait_for(is_over, "the end of the jog")

    def wait_for_motion(self) -> None:
        """Wait until the machine is commanded to move."""
        self.client.wait_for(lambda: not self.is_at_rest, "motion", longest_nap=0.01)

    def _place_of(self, message: JointState) -> Vector3:
        return KINEMATICS.forward(self.machine.heights(message))


def difference(first: Pixels, second: Pixels) -> int:
    """Return in how many squares of 10 pixels two pictures differ clearly.

    viser draws with fewer pixels where drawing is slow, so single ones say nothing.
    """
    return int((np.abs(_squares(first) - _squares(second)).max(axis=2) > 12.0).sum())


def _squares(picture: Pixels) -> FloatArray:
    """Return the mean colours of squares. Shape (height / 10, width / 10, 3)."""
    height, width = (10 * (size // 10) for size in picture.shape[:2])
    cut: FloatArray = picture[:height, :width].astype(np.float64)
    return cut.reshape(height // 10, 10, width // 10, 10, 3).mean(axis=(1, 3))
