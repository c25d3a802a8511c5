"""Soak of the panel's page: connections and messages by chance.

Run it as ``python -m benchmarks.soak_page``; it exits with 1 if one was let in without the token,
if one of these moved the machine, if ``panel_node`` ended or wrote a traceback, or if its log grew
by more than its two lines a second.
"""

import sys
import tempfile
import time
from pathlib import Path

from geometry_msgs.msg import PoseStamped

from benchmarks.command_line import numbers
from benchmarks.soak_nodes import context_in_own_domain, say, session, verdict
from testing.page_attack import PageFuzz, controls
from testing.panel import Panel
from tri_glide_kinematics.panel.admission import kept_token

ROUND = 1000  # connections between two looks at the machine
FRAMES = 50  # of a connection that is let in
MOVED = 1e-9  # m
LINES, MORE_LINES = 3.0, 20.0  # a second, and at the start


class Soak:
    """A machine with its panel, attacked."""

    def __init__(self, panel: Panel, folder: Path, seed: int) -> None:
        """Listen to where the machine truly is."""
        self._panel = panel
        port = int(panel.origin.rpartition(":")[2])
        self._fuzz = PageFuzz(port, kept_token(folder / "token"), seed)
        self._poses = panel.client.record(PoseStamped, "true_pose", keep=1)
        self._begin = time.monotonic()
        self.faults: list[str] = []

    def refused(self, count: int) -> None:
        """Ask for connections in wrong ways; none may move the machine."""
        before = self._place()
        let_in = 0
        for number in range(count):
            status, data = self._fuzz.refused()
            if status in (101, 200):
                let_in += 1
                self.faults.append(f"let in: {data[:300]!r}")
            if number % ROUND == ROUND - 1 or number == count - 1:
                self._panel.client.spin_for(1.0)
                if max(abs(a - b) for a, b in zip(before, self._place())) > MOVED:
                    self.faults.append(f"the machine moved before connection {number}")
        say(f"{count} connections without the right to it: {let_in} let in")

    def admitted(self, count: int) -> None:
        """Send nonsense to all controls, as a page that is let in; it may well move the machine."""
        identities = controls(self._panel.address)
        for _ in range(count):
            if (status := self._fuzz.admitted(FRAMES, identities)) != 101:
                self.faults.append(f"not let in: {status}")
        say(f"{count} pages with {FRAMES} messages each to {len(identities)} controls")

    def look(self) -> bool:
        """Say what was found, and return whether nothing was."""
        node = self._panel.node
        lines = node.output.splitlines()
        for line in sorted({line.split(": ", 1)[-1] for line in lines}):
            say(f"  {line[:150]}")
        say(f"panel_node has written {len(lines)} lines, {len(node.output)} bytes")
        if not node.is_running:
            self.faults.append("panel_node has ended")
        if "Traceback" in node.output:
            self.faults.append(f"a traceback: {node.output[:2000]}")
        if len(lines) > LINES * (time.monotonic() - self._begin) + MORE_LINES:
            self.faults.append("the log grows too fast")
        for fault in self.faults[:10]:
            say(fault)
        return not self.faults

    def _place(self) -> tuple[float, float, float]:
        self._poses.clear()
        self._panel.client.wait_for(lambda: self._poses, "the true pose")
        position = self._poses[-1].pose.position
        return position.x, position.y, position.z


def main() -> int:
    """Run the soak from the command line."""
    arguments = numbers(
        __doc__,
        refused=(100_000, "wrong connections"),
        admitted=(500, "pages that send nonsense"),
        seed=(1, "of all that is sent"),
    )
    with (
        context_in_own_domain() as context,
        tempfile.TemporaryDirectory() as name,
        session(context, "page") as (client, launcher),
    ):
        soak = Soak(Panel(client, launcher, Path(name), 500.0), Path(name), arguments.seed)
        soak.refused(arguments.refused)
        soak.admitted(arguments.admitted)
        passed = soak.look()
    return verdict(passed)


if __name__ == "__main__":
    sys.exit(main())
