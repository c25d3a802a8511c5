"""Serves a page on this machine that shows the tri-glide live, and an operator's panel."""

from __future__ import annotations

import time
from pathlib import Path

import viser
from rclpy.node import Node

from tri_glide_kinematics.files import SETTINGS, state_folder
from tri_glide_kinematics.panel.admission import default_token_file, is_loopback, kept_token
from tri_glide_kinematics.panel.link import MachineLink
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.mechanisms import MechanismsTab
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.page import Page, PagesNews
from tri_glide_kinematics.panel.programs import ChosenProgram, ProgramFolder, Uploads
from tri_glide_kinematics.panel.status_strip import Notice, PagesBar, Strip, strip_of
from tri_glide_kinematics.panel.tabs import (
    DriveTab,
    LiveView,
    ManualControls,
    PointsTab,
    ProgramTab,
    Runs,
    SwingTab,
)
from tri_glide_kinematics.programs import default_kept_file, default_zeros_file
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import LONGEST_WAIT, Cycle
from tri_glide_kinematics.ros.serving import PatientServices
from tri_glide_kinematics.ros.starting import default_parameter_file
from tri_glide_kinematics.settings import PANEL_NODE, Values

POINTS_FILE = "taught_points.yaml"
PROGRAMS_FOLDER = "programs"
FRAMES = 30.0  # 1/s
STILL = 3  # frames of a machine at rest, of which one is drawn
# While nothing goes on, answers and states may wait so long [s]: a look at them takes time.
STILL_WAIT = 0.1


def given_path(values: Values, name: str) -> Path | None:
    """Return the path that the parameter ``name`` gives; None for an empty one."""
    return Path(values[name]) if values[name] else None


class PanelNode(Node):
    """Draws what it hears 30 times a second, and passes on what the operator wants."""

    def __init__(self) -> None:
        """Open the page.

        Raises:
            KinematicsError: if it cannot be opened, or a parameter has a value that has no meaning.
        """
        super().__init__("panel_node")
        values = LiveParameters(self, PANEL_NODE).values
        host = values["host"]
        token = kept_token(given_path(values, "token_file") or default_token_file())
        self._page = Page(host, values["port"], token, self.get_logger().warning)
        self._server = self._page.server
        if not is_loopback(host):
            self.get_logger().error(
                f"host {host}: the connection is not encrypted: anyone who can listen to the "
                "network can read the token and move the machine; 127.0.0.1 is for this computer "
                "alone"
            )
        self._frames = 0
        self._requests = OperatorRequests(MachineLink(self), self._server)
        self._machine = ShownMachine(self, self._requests)
        self._runs = Runs(self._requests)
        self._news = PagesNews(self._page)
        self._build(values)
        self.cycle = Cycle(
            self._machine.feeds.urgent,
            1.0 / FRAMES,
            self._frame,
            may_end=self._runs.may_end,
            end=self._end,
            own=self._machine.feeds.swing.own,
            patience=lambda: STILL_WAIT if self._is_still else LONGEST_WAIT,
        )
        PatientServices(self)
        # Not by the log, which goes to files and to all who listen to /rosout.
        print(f"the page: {self._page.address}", flush=True)

    def _build(self, values: Values) -> None:
        """Make all of the page that does not depend on the machine."""
        server, gui, requests = self._server, self._server.gui, self._requests
        machine, runs = self._machine, self._runs
        gui.set_panel_label("tri-glide")
        self._page.put_above(requests)
        PagesBar(requests)
        start_again = given_path(values, "start_again_file")
        self._notice = Notice(requests, given_path(values, "notice_file"), start_again)
        tabs = gui.add_tab_group()
        drive = tabs.add_tab("Drive")
        with drive:
            self._drive = DriveTab(requests, machine)
        with tabs.add_tab("Points"):
            PointsTab(requests, machine, Path(values["points_file"] or POINTS_FILE))
        uploads = self._uploads(given_path(values, "programs_folder"))
        self._chosen = ChosenProgram(
            uploads.folder,
            given_path(values, "program_settings") or default_parameter_file().with_name(SETTINGS),
            given_path(values, "work_zero_file") or default_zeros_file(self.get_namespace()),
            machine,
        )
        kept = given_path(values, "progress_file") or default_kept_file(self.get_namespace())
        with tabs.add_tab("Program"):
            self._program = ProgramTab(requests, machine, runs, uploads, self._chosen, kept)
        with drive:
            self._manual = ManualControls(requests, machine, runs, self._chosen)
        self._view = LiveView(
            tabs,
            requests,
            machine,
            self._drive.go_to,
            self._page.shows,
            given_path(values, "measurements_file"),
        )
        with tabs.add_tab("Swing"):
            self._swing = SwingTab(requests)
        with tabs.add_tab("Mechanisms"):
            # Its files lie beside the parameters.
            folder = default_parameter_file().parent
            self._mechanisms = MechanismsTab(gui, server.scene, folder)
        gui.main_panel.dock_right()
        server.on_client_connect(requests.opened)
        server.on_client_connect(self._greet)
        server.on_client_disconnect(requests.closed)
        self._page.on_presence = requests.answers

    def _uploads(self, folder: Path | None) -> Uploads:
        programs = ProgramFolder(folder or state_folder() / PROGRAMS_FOLDER)
        uploads = Uploads(programs, self._requests, self._page.ask_for_pieces)
        self._page.on_file = uploads.take
        self._server.on_client_disconnect(uploads.closed)
        return uploads

    def _end(self) -> None:
        self._chosen.close()
        self._server.stop()

    async def _greet(self, client: viser.ClientHandle) -> None:
        self._page.greet(client)

    def _frame(self) -> None:
        """Fulfil what is wished, and show where everything is."""
        self._requests.fulfil()
        self._notice.look()
        self._machine.step()
        self._view.step()
        self._program.step()
        self._runs.step()
        self._manual.step()
        swing = self._machine.feeds.swing
        clients = self._server.get_clients()
        if not clients or not self._page.shows("Swing"):
            swing.close()
        self._frames += 1
        if not clients or (self._is_still and self._frames % STILL):
            return
        self._mechanisms.step(time.monotonic())
        self._news.tell(clients, self._strip, self._requests.history)
        self._program.show()
        self._manual.show()
        if self._page.shows("Swing"):
            swing.listen()
            waits = self._machine.feeds.status.message.shaper_waits
            self._swing.show(self._machine.facts, waits=waits)
            self._swing.draw(swing)
        self._drive.show()
        self._view.draw()

    @property
    def _is_still(self) -> bool:
        """Whether nothing moves, and nothing is driven from here."""
        return not (self._machine.moves or self._runs.is_taken)

    def _strip(self, page: int) -> Strip:
        return strip_of(
            page,
            self._requests,
            self._machine,
            notice=self._notice.text,
            work=self._manual.work_zero.text,
            left=self._program.left,
        )
