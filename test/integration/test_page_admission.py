"""Who may drive by the page: connections of others move nothing, however early they send.

A foreign page in a browser is in ``test_panel.py``.
"""

import math
import re
import time
from collections.abc import Iterator
from urllib.parse import parse_qs, urlsplit

import pytest
from geometry_msgs.msg import PoseStamped

from testing.client import Client
from testing.page_attack import CLOSE, Attack, PageFuzz, answer, frame, go_to, request, upgrade
from testing.panel import Panel
from testing.processes import Launcher

pytest.importorskip("viser")

HOME, PLACE = (0.0, 0.0, 0.25), (0.04, 0.02, 0.3)
# A machine that is driven has moved by so much after so long [m, s].
MOVED, LONG_ENOUGH = 1e-3, 0.7
# Connections by chance; ``make soak`` has more.
REFUSED, ADMITTED = 400, 20

RESTING = 1e-10


class Watched:
    """A panel without a page, and where its machine truly is."""

    def __init__(self, panel: Panel) -> None:
        self.panel = panel
        parts = urlsplit(panel.address)
        self.here = parts.netloc
        self.port = int(parts.port or 80)
        self.token = parse_qs(parts.query).get("token", [""])[0]
        self._poses = panel.client.record(PoseStamped, "true_pose", keep=1)

    def place(self) -> tuple[float, float, float]:
        """Return where the simulator has the platform at this moment [m]."""
        self._poses.clear()
        self.panel.client.wait_for(lambda: self._poses, "the true pose")
        position = self._poses[-1].pose.position
        return position.x, position.y, position.z

    def cookie(self, token: str) -> tuple[str, str]:
        return "Cookie", f"tri_glide_panel_{self.port}={token}"

    def as_page(self) -> list[tuple[str, str]]:
        """Return the headers of the page itself."""
        origin = f"http://{self.here}"
        return [("Host", self.here), ("Origin", origin), self.cookie(self.token)]

    def at_home(self) -> tuple[float, float, float]:
        """Return where the platform is, which is driven home if it is elsewhere [m]."""
        if math.dist(self.place(), HOME) > MOVED:
            self.drive(HOME)
        # The drives lag behind the setpoints; two places in turn may be one on a busy computer.
        self.panel.client.wait_for(lambda: math.dist(self.place(), HOME) < RESTING, "rest")
        return HOME

    def drive(self, position: tuple[float, float, float]) -> None:
        """Drive as the page does; again, as the panel may not know its machine yet."""
        client = self.panel.client

        def is_driven() -> bool:
            attack = Attack(self.port, upgrade(self.as_page()) + drag_to(position))
            assert attack.status() == 101
            client.spin_for(LONG_ENOUGH)
            attack.close()
            return math.dist(self.place(), position) < MOVED

        client.wait_for(is_driven, "motion")


@pytest.fixture(scope="module")
def watched(panel: Panel) -> Iterator[Watched]:
    started = Watched(panel)
    # What is refused below would be heard.
    started.drive(HOME)
    yield started
    started.drive(PLACE)


def drag_to(position: tuple[float, float, float]) -> bytes:
    return b"".join(map(frame, go_to(position)))


# Origin, host and token of those who have no right to drive.
FOREIGN = [
    ("http://elsewhere.example", None, "right"),
    ("http://127.0.0.1:1", None, "right"),
    ("null", None, "right"),
    (None, "rebound.example:8080", "right"),
    ("http://rebound.example", "rebound.example", "right"),
    ("own", None, None),
    ("own", None, "x" * 43),
    (None, None, None),
    (None, None, "x" * 43),
]


def test_what_is_sent_at_once_moves_nothing(watched: Watched) -> None:
    before = watched.at_home()
    attacks = []
    for origin, host, token in FOREIGN:
        headers = [("Host", host or watched.here)]
        if origin is not None:
            headers.append(("Origin", f"http://{watched.here}" if origin == "own" else origin))
        if token is not None:
            headers.append(watched.cookie(watched.token if token == "right" else token))
        attack = Attack(watched.port, upgrade(headers) + drag_to(PLACE))
        assert attack.status() == 403, (origin, host, token)
        # Somebody who says goodbye may be heard to the end.
        attack.send(frame(b"", CLOSE))
        attacks.append(attack)
    watched.panel.client.spin_for(LONG_ENOUGH)
    assert watched.place() == pytest.approx(before, abs=1e-9)
    for attack in attacks:
        attack.close()


def test_connections_by_chance_move_nothing_end_nothing_and_fill_no_log(watched: Watched) -> None:
    before, begin = watched.at_home(), time.monotonic()
    node = watched.panel.node
    node.forget_output()
    fuzz = PageFuzz(watched.port, watched.token, seed=23)
    for _ in range(REFUSED):
        status, data = fuzz.refused()
        assert status in (None, 400, 403, 404, 500), data[:500]
    watched.panel.client.spin_for(LONG_ENOUGH)
    assert watched.place() == pytest.approx(before, abs=1e-9)
    # Those who are let in may say nonsense; here nothing that moves the machine.
    for _ in range(ADMITTED):
        assert fuzz.admitted(50, identities=("x", "/refusal")) == 101
    watched.panel.client.spin_for(LONG_ENOUGH)
    assert watched.place() == pytest.approx(before, abs=1e-9)
    assert node.is_running
    assert "Traceback" not in node.output
    assert len(node.output.splitlines()) < 2.0 * (time.monotonic() - begin) + 10.0
    assert max(map(len, node.output.splitlines())) < 400


def test_a_page_for_other_computers_asks_for_the_token_and_says_that_it_is_not_encrypted(
    client: Client, nodes: Launcher
) -> None:
    node = nodes.start("panel_node", arguments=("-p", "port:=0", "-p", "host:=0.0.0.0"))
    client.wait_for(lambda: "the page: " in node.output, "the page")
    (address,) = re.findall(r"the page: (\S+)", node.output)
    parts = urlsplit(address)
    assert parts.port
    assert answer(parts.port, request([("Host", parts.netloc)])) == 403
    assert answer(parts.port, request([("Host", parts.netloc)], f"/?{parts.query}")) == 200
    (line,) = (line for line in node.output.splitlines() if "host 0.0.0.0: " in line)
    assert "not encrypted" in line
    # The log goes to files and over the network.
    assert node.output.count(parts.query) == 1
    assert [line for line in node.output.splitlines() if line == f"the page: {address}"]
