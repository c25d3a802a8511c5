"""Chromium without a window, driven over its DevTools protocol as a person would use it."""

import base64
import io
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome")
# The page is drawn by the processor: machines that run tests have nothing else.
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # Only the scene is drawn by WebGL: to put the page together by it takes more than the scene.
    "--disable-gpu-compositing",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--mute-audio",
    # A browser that was frozen, or gets no time of a busy computer, is not to be taken for broken.
    "--disable-gpu-watchdog",
    "--disable-hang-monitor",
    "--remote-debugging-port=0",
)
TIMEOUT = 60.0  # s, for what takes a fraction of this unless the computer is very busy
# So many pixels are drawn for each one of the page where nobody looks at them: the processor draws
# them all, and a page shows what it was told with its next frame.
COARSE = 0.25
# Pause of what draws all the time after a frame [ms]: the processor would do nothing else.
FRAME_PAUSE = 300
FEWER_FRAMES = f"""
const next = window.requestAnimationFrame.bind(window), drawn = new WeakSet();
window.requestAnimationFrame = (draw) => {{
  const pause = drawn.has(draw) ? {FRAME_PAUSE} : 0;
  drawn.add(draw);
  return setTimeout(() => next(draw), pause);
}};
window.cancelAnimationFrame = clearTimeout;
"""
# What stays where it is for so long does not move [s].
STEADY = 0.1
DESKTOP = (1280, 720)
# Drawn by the processor in a third of the time.
SMALL = (800, 500)

Pixels = NDArray[np.uint8]


class BrowserError(Exception):
    """The browser does not do what it is told."""


def find_browser() -> str | None:
    """Return the path of a browser, None if there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Page:
    """A tab of the browser."""

    def __init__(self, address: str, target: str) -> None:
        """Connect to a tab by the ``address`` of its debugger."""
        self.target = target
        # Behind events that nobody reads, no goodbye of the browser is ever heard.
        self._socket = connect(
            address, max_size=None, open_timeout=TIMEOUT, ping_interval=None, close_timeout=0.1
        )
        self._number = 0
        self._events: list[dict[str, Any]] = []
        self._pressed: tuple[float, float] | None = None
        for domain in ("Page", "Runtime", "Network"):
            self.call(f"{domain}.enable")
        self.call("Page.addScriptToEvaluateOnNewDocument", source=FEWER_FRAMES)
        # Workers ask for things, too: each waits until we listen.
        self.call(
            "Target.setAutoAttach", autoAttach=True, waitForDebuggerOnStart=True, flatten=True
        )

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result.

        Raises:
            BrowserError: if it fails.
        """
        number = self.send(method, **parameters)
        end = time.monotonic() + TIMEOUT
        while True:
            answer = self._receive(end - time.monotonic())
            if answer.get("id") == number:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']}")
                return dict(answer["result"])

    def send(self, method: str, session: str | None = None, **parameters: Any) -> int:
        """Call a method of the page, or of a worker's ``session``, and do not wait for it."""
        self._number += 1
        call: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if session is not None:
            call["sessionId"] = session
        self._socket.send(json.dumps(call))
        return self._number

    def _receive(self, timeout: float) -> dict[str, Any]:
        if timeout <= 0.0:
            raise BrowserError(f"no answer within {TIMEOUT:g} s")
        message: dict[str, Any] = json.loads(self._socket.recv(timeout))
        if "method" in message:
            self._events.append(message)
        if message.get("method") == "Target.attachedToTarget":
            session = message["params"]["sessionId"]
            for method in ("Network.enable", "Runtime.runIfWaitingForDebugger"):
                self.send(method, session)
        return message

    def events(self, method: str) -> list[dict[str, Any]]:
        """Return what has been told by events of a kind so far."""
        self.evaluate("0")
        return [event["params"] for event in self._events if event["method"] == method]

    def open(self, address: str, size: tuple[int, int] = DESKTOP, scale: float = 1.0) -> None:
        """Open an address in a window of a ``size`` in pixels, drawn to a ``scale``."""
        self.resize(size, scale)
        self.call("Page.navigate", url=address)

    def resize(self, size: tuple[int, int], scale: float = COARSE) -> None:
        """Give the window another ``size`` in pixels, or ``scale``; what is open stays so."""
        width, height = size
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=scale,
            mobile=False,
        )

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression in JavaScript.

        Raises:
            BrowserError: if it throws.
        """
        result = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in result:
            raise BrowserError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait_for(
        self,
        expression: str,
        what: str,
        timeout: float = TIMEOUT,
        spin: Callable[[], object] = lambda: time.sleep(0.02),
    ) -> Any:
        """Wait until an expression is true, and return it.

        Raises:
            TimeoutError: if it is not in time.
        """
        end = time.monotonic() + timeout
        while True:
            # While a page is opened, none is there.
            with suppress(BrowserError):
                if value := self.evaluate(expression):
                    return value
            if time.monotonic() > end:
                raise TimeoutError(f"waited {timeout:g} s in vain for {what}")
            spin()

    def middle_of(self, element: str) -> tuple[float, float]:
        """Return where the middle of an element is, which an expression names, once it rests."""
        place = self._middle_of(element)
        while True:
            # A page that was just opened still moves its parts.
            time.sleep(STEADY)
            place, before = self._middle_of(element), place
            if place == before:
                return place

    def _middle_of(self, element: str) -> tuple[float, float]:
        place = self.wait_for(
            f"(() => {{ const e = {element}; if (!e) return null;"
            " e.scrollIntoView?.({block: 'nearest'}); const r = e.getBoundingClientRect();"
            " const x = r.x + r.width / 2, y = r.y + r.height / 2;"
            # What lies above it would be pressed in its place.
            " return e.contains(document.elementFromPoint(x, y)) && [x, y]; })()",
            element,
        )
        return float(place[0]), float(place[1])

    def press(self, element: str) -> None:
        """Press the button of the mouse on an element, and hold it."""
        place = self.middle_of(element)
        self.mouse("mouseMoved", place, buttons=0)
        self._pressed = place
        self.mouse("mousePressed", place)

    def release(self) -> None:
        """Release the button of the mouse, if it is pressed."""
        if self._pressed is not None:
            self.mouse("mouseReleased", self._pressed, buttons=0)
            self._pressed = None

    def click(self, element: str) -> None:
        """Click on an element."""
        self.press(element)
        self.release()

    def mouse(self, kind: str, place: tuple[float, float], buttons: int = 1) -> None:
        """Do something with the mouse."""
        button = "none" if kind == "mouseMoved" and not buttons else "left"
        self.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=place[0],
            y=place[1],
            button=button,
            buttons=buttons,
            clickCount=1,
        )

    def type(self, element: str, text: str) -> None:
        """Replace what stands in a field, and press Enter."""
        self.click(element)
        self.evaluate(f"{element}.select()")
        self.call("Input.insertText", text=text)
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key="Enter",
                code="Enter",
                windowsVirtualKeyCode=13,
            )

    def choose_file(self, selector: str, file: Path) -> None:
        """Choose a ``file`` in the input that a ``selector`` finds, as in the dialog for it."""
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self.call("DOM.setFileInputFiles", nodeId=node, files=[str(file)])

    def screenshot(self) -> bytes:
        """Return a picture of the page as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def pixels(self) -> Pixels:
        """Return a picture of the page. Shape (height, width, 3)."""
        return np.asarray(Image.open(io.BytesIO(self.screenshot())).convert("RGB"))

    def requests(self) -> list[str]:
        """Return the addresses of all that the page has asked for."""
        made = [event["request"]["url"] for event in self.events("Network.requestWillBeSent")]
        return made + [event["url"] for event in self.events("Network.webSocketCreated")]

    def close(self) -> None:
        """Be connected no more; the tab stays."""
        self._socket.close()


class Browser:
    """A browser of its own, with nothing kept from other ones."""

    def __init__(self, path: str) -> None:
        """Start the browser that lies at a ``path``.

        Raises:
            BrowserError: if it does not start.
        """
        self._folder = tempfile.TemporaryDirectory(prefix="browser_", ignore_cleanup_errors=True)
        self._log = Path(self._folder.name, "log")
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [path, *OPTIONS, f"--user-data-dir={self._folder.name}", "about:blank"],
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self._port = self._wait_for_port()
        self._pages: list[Page] = []

    def _wait_for_port(self) -> int:
        file = Path(self._folder.name, "DevToolsActivePort")
        end = time.monotonic() + TIMEOUT
        while not (file.is_file() and (lines := file.read_text().splitlines())):
            if time.monotonic() > end or self.process.poll() is not None:
                raise BrowserError(f"no browser: {self._log.read_text(errors='replace')[-2000:]}")
            time.sleep(0.02)
        return int(lines[0])

    def page(self) -> Page:
        """Return the first tab, which is empty."""
        (first, *_) = self._targets()
        return self._connected(first)

    def new_page(self) -> Page:
        """Open another tab, in front of the others, and return it."""
        known = {target["id"] for target in self._targets()}
        assert self._pages
        self._pages[0].call("Target.createTarget", url="about:blank")
        (new,) = [target for target in self._targets() if target["id"] not in known]
        return self._connected(new)

    def _connected(self, target: dict[str, Any]) -> Page:
        page = Page(target["webSocketDebuggerUrl"], target["id"])
        self._pages.append(page)
        return page

    def _targets(self) -> Sequence[dict[str, Any]]:
        with urlopen(f"http://127.0.0.1:{self._port}/json/list", timeout=TIMEOUT) as answer:
            targets = json.load(answer)
        return [target for target in targets if target["type"] == "page"]

    def kill(self) -> None:
        """End it at once, as a crash would."""
        with suppress(ProcessLookupError):
            self.signal(signal.SIGKILL)
        self.process.wait()

    def signal(self, number: int) -> None:
        """Send a signal to all of its processes."""
        os.killpg(self.process.pid, number)

    def close(self) -> None:
        """End it."""
        for page in self._pages:
            with suppress(ConnectionClosed, OSError):
                page.close()
        self.kill()
        self._folder.cleanup()


@contextmanager
def browser() -> Iterator[Browser]:
    """Run a browser.

    Raises:
        BrowserError: if there is none, or it does not start.
    """
    path = find_browser()
    if path is None:
        raise BrowserError(f"none of {', '.join(NAMES)} is installed")
    with closing(Browser(path)) as running:
        yield running
