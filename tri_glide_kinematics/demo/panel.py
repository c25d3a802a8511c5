"""The command ``panel``: a simulated machine, and the page that shows it."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tri_glide_kinematics.demo.running import PATIENCE, parameter_arguments, run_command, say
from tri_glide_kinematics.files import state_folder
from tri_glide_kinematics.ros.starting import NodeProcesses, Process, default_parameter_file, ending

NODES = ("simulator_node", "ik_node", "fk_node", "mechanism_node")
PAGE = "panel_node"
# It keeps the simulated machine away from one on this computer.
OWN_NAMESPACE = f"/tri_glide_panel_{os.getpid()}"
LOOK_PERIOD = 0.2  # s between two looks whether all of them run
LAST_LINES = 5  # of a node that has ended are repeated


class ShownNode:
    """A node as a process, whose output is shown here, too.

    Attributes:
        name: of the node.
        process: the newest one.
        end: how it has ended by itself, in words; empty while it runs.
    """

    def __init__(self, name: str, log: Path, start: Callable[[], Process]) -> None:
        """Begin by ``start`` a process, which writes into its ``log``, and show what it writes."""
        self.name, self.process = name, start()
        self.end = ""
        self._start = start
        self._log, self._shown = log, 0
        self._last_lines: list[str] = []

    def start_again(self) -> None:
        """Begin another process if the last one has ended."""
        if self.end:
            self.end = ""
            self._last_lines = []
            self.process = self._start()

    def show(self) -> None:
        """Show what it has written since it was shown last."""
        with self._log.open("rb") as stream:
            stream.seek(self._shown)
            data = stream.read()
        self._shown += len(data)
        if data:
            text = data.decode(errors="replace")
            print(text, end="", flush=True)
            self._last_lines = [*self._last_lines, *text.splitlines()][-LAST_LINES:]

    @property
    def last_lines(self) -> str:
        """Its last lines, to be read behind the reason for its end."""
        if not self._last_lines:
            return "it has logged nothing"
        return "\n  | ".join(("its last lines:", *self._last_lines))


def serve(port: int, points_file: str, namespace: str, endings: list[str]) -> None:
    """Start the nodes and the page in a ``namespace``, and go on until the page has ended.

    ``endings`` gets a line for each node that has ended by itself.
    """
    space = ["-r", f"__ns:={namespace}"]
    quiet = ["--log-level", "WARN"]
    file = ["--params-file", str(default_parameter_file())]
    # Their output goes to files, where nodes see no terminal.
    colors = {"RCUTILS_COLORIZED_OUTPUT": "1"} if sys.stdout.isatty() else {}
    with tempfile.TemporaryDirectory(prefix="panel_") as name, NodeProcesses(colors) as processes:
        folder = Path(name)
        notice, wish = folder / "notice", folder / "start_again"
        nodes: list[ShownNode] = []

        def start(name: str, arguments: list[str]) -> None:
            log = folder / f"{name}.log"
            begin = partial(processes.start, name, [*space, *arguments], log)
            nodes.append(ShownNode(name, log, begin))

        for name in NODES:
            # The last file wins; mechanism_node has no parameters.
            parameters = file if name != "mechanism_node" else ()
            patience = PATIENCE if name == "ik_node" else ()
            start(name, [*quiet, *parameters, *patience])
        values = {
            "port": port,
            "points_file": points_file,
            "notice_file": notice,
            "start_again_file": wish,
        }
        if namespace == OWN_NAMESPACE:
            # It is another one at the next start.
            values["progress_file"] = state_folder() / "program_progress_panel.yaml"
            values["work_zero_file"] = state_folder() / "work_zero_panel.yaml"
        start(PAGE, parameter_arguments(values))
        page = nodes[-1]
        while not page.end:
            time.sleep(LOOK_PERIOD)
            look(nodes, endings, notice)
            start_again(nodes, wish, notice)


def look(nodes: list[ShownNode], endings: list[str], notice: Path) -> None:
    """Show what ``nodes`` have written, and tell here and on the page which have ended."""
    for node in nodes:
        code = node.process.poll()
        node.show()
        if code is None or node.end:
            continue
        node.end = f"{node.name} has ended: {ending(code)}"
        endings.append(node.end)
        print(f"panel: {node.end}; {node.last_lines}", file=sys.stderr, flush=True)
        if node.name != PAGE:
            print("panel: the page stays; Ctrl-C ends it", file=sys.stderr, flush=True)
            tell(nodes, notice)


def start_again(nodes: list[ShownNode], wish: Path, notice: Path) -> None:
    """Start what has ended if the page has put a ``wish`` there."""
    if not wish.exists():
        return
    wish.unlink()
    for node in nodes:
        if node.end:
            say(f"{node.name} is started again", "panel")
            node.start_again()
    tell(nodes, notice)


def tell(nodes: list[ShownNode], notice: Path) -> None:
    """Tell the page which nodes have ended; it never reads half of it."""
    part = notice.with_suffix(".part")
    part.write_text("; ".join(filter(None, (node.end for node in nodes))), encoding="utf-8")
    part.replace(notice)


def main() -> int:
    """Run until Ctrl-C."""
    parser = argparse.ArgumentParser(prog="panel", description=__doc__)
    parser.add_argument("--port", type=int, default=8080, help="of the page on this computer")
    parser.add_argument(
        "--points", default="taught_points.yaml", help="file in which taught points are saved"
    )
    parser.add_argument(
        "--namespace",
        default=OWN_NAMESPACE,
        help="of all nodes; / lets other programs reach the simulated machine (default: its own)",
    )
    options = parser.parse_args()
    endings: list[str] = []

    def run() -> int:
        serve(options.port, options.points, options.namespace, endings)
        return 1

    code = run_command("panel", run)
    return 1 if endings else code


if __name__ == "__main__":
    sys.exit(main())
