"""Serves a page on this machine that shows the tri-glide live, and an operator's panel."""

from __future__ import annotations

import math
import time
from contextlib import suppress
from pathlib import Path

import viser
from rcl_interfaces.msg import ParameterEvent
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.files import SETTINGS, state_folder
from tri_glide_kinematics.panel.admission import default_token_file, is_loopback, kept_token
from tri_glide_kinematics.panel.link import (
    NAMES,
    NOBODY,
    Feeds,
    Identity,
    MachineFacts,
    MachineLink,
)
from tri_glide_kinematics.panel.machine import JogWatch, Steps
from tri_glide_kinematics.panel.mechanisms import MechanismsTab
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.page import Page
from tri_glide_kinematics.panel.programs import ProgramFolder, Uploads
from tri_glide_kinematics.panel.status_strip import PagesBar, Strip, pages_text
from tri_glide_kinematics.panel.tabs import (
    DriveTab,
    LiveView,
    ManualControls,
    PointsTab,
    ProgramTab,
    SwingTab,
    pose_of,
)
from tri_glide_kinematics.panel.words import FAULT, READY, WARNING, outside_text, position_text
from tri_glide_kinematics.programs import default_kept_file, default_zeros_file
from tri_glide_kinematics.ros.goal_sender import ProgramLink
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import LONGEST_WAIT, Cycle
from tri_glide_kinematics.ros.serving import PatientServices
from tri_glide_kinematics.ros.starting import default_parameter_file
from tri_glide_kinematics.settings import PANEL_NODE, Values
from tri_glide_kinematics.vectors import Vector3

POINTS_FILE = "taught_points.yaml"
PROGRAMS_FOLDER = "programs"
FRAMES = 30.0  # 1/s
STILL = 3  # frames of a machine at rest, of which one is drawn
# While nothing goes on, answers and states may wait so long [s]: a look at them takes time.
STILL_WAIT = 0.1
LOOK_PERIOD = 0.5  # s between two looks whether ik_node is there
PATIENCE = 5.0  # s after which it is asked again
LONGEST_NOTICE = 500  # characters
# Refusals that are about the place that was asked for.
PLACE_REFUSALS = (MachineState.REFUSAL_UNREACHABLE, MachineState.REFUSAL_OUTSIDE_WORKSPACE)
TELL_PERIOD = 0.1  # s between two looks at what pages are told
HISTORY_PERIOD = 0.5  # s between two lists of what was told
SIGN_PERIOD = 1.0  # s after which a page is told that nothing has changed


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
        self._facts: MachineFacts | None = None
        self._identity = NOBODY
        self._asked_at = -math.inf
        self._jog_watch = JogWatch()
        self._steps = Steps()
        self._notice_file = given_path(values, "notice_file")
        self._notice = ""
        self._start_again_file = given_path(values, "start_again_file")
        # By page, with the tab that it had open: one that has begun anew knows nothing.
        self._told: dict[int, tuple[tuple[Strip, str], float]] = {}
        self._told_at = 0.0
        self._frames = 0
        # By page, how much of the history it has.
        self._told_history: dict[int, int] = {}
        self._history_at = 0.0
        self._state: object = None
        self._refused = 0
        link = MachineLink(self, lambda reason: self._requests.refuse(reason))
        self._requests = OperatorRequests(link, self._on_stop)
        self._link = self._requests.link
        self._feeds = Feeds(self, self._link.server, lambda *lines: self._view.show_lines(*lines))
        self._build(values)
        self.create_subscription(ParameterEvent, "/parameter_events", self._on_parameters, 100)
        self.create_timer(LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.cycle = Cycle(
            self._feeds.urgent,
            1.0 / FRAMES,
            self._frame,
            # Both are ended, one beside the other.
            may_end=lambda: self._program.may_end() & self._manual.may_end(),
            end=self._end,
            own=self._feeds.swing.own,
            patience=lambda: STILL_WAIT if self._is_still else LONGEST_WAIT,
        )
        PatientServices(self)
        # Not by the log, which goes to files and to all who listen to /rosout.
        print(f"the page: {self._page.address}", flush=True)

    def _build(self, values: Values) -> None:
        """Make all of the page that does not depend on the machine."""
        points_file = Path(values["points_file"] or POINTS_FILE)
        server, gui, requests = self._server, self._server.gui, self._requests
        gui.set_panel_label("tri-glide")
        stop = gui.add_button("Stop", visible=False)
        stop.on_click(requests.stop)
        release = gui.add_button("Release", visible=False)
        release.on_click(requests.release)
        leave = gui.add_button("Leave", visible=False)
        leave.on_click(requests.leave)
        self._page.put_above(stop, release, leave)
        PagesBar(gui, requests)
        self._start_again = gui.add_button(
            "Start again what has ended", color="orange", icon=viser.Icon.REFRESH, visible=False
        )
        self._start_again.on_click(requests.on(lambda _: self._ask_to_start_again()))
        tabs = gui.add_tab_group()
        drive = tabs.add_tab("Drive")
        with drive:
            self._drive = DriveTab(gui, requests, self._move_to, self._move_by)
        with tabs.add_tab("Points"):
            PointsTab(
                gui, requests, points_file, self._measured_position, self._follow, self._move_to
            )
        with tabs.add_tab("Program"):
            self._program = self._program_tab(values)
        with drive:
            self._manual = ManualControls(gui, requests, self._feeds, self._program, self._place)
        self._view = LiveView(
            server,
            tabs,
            requests,
            lambda place: self._move_to(place, self._drive.go_speed),
            self._page.shows,
            given_path(values, "measurements_file"),
        )
        with tabs.add_tab("Swing"):
            self._swing = SwingTab(gui, requests)
        with tabs.add_tab("Mechanisms"):
            # Its files lie beside the parameters.
            folder = default_parameter_file().parent
            self._mechanisms = MechanismsTab(gui, server.scene, folder)
        gui.main_panel.dock_right()
        server.on_client_connect(requests.opened)
        server.on_client_connect(self._greet)
        server.on_client_disconnect(requests.closed)
        self._page.on_presence = requests.answers

    def _program_tab(self, values: Values) -> ProgramTab:
        uploads = Uploads(
            ProgramFolder(
                given_path(values, "programs_folder") or state_folder() / PROGRAMS_FOLDER
            ),
            self._requests,
            self._page.ask_for_pieces,
        )
        self._page.on_file = uploads.take
        self._server.on_client_disconnect(uploads.closed)
        return ProgramTab(
            self._server,
            self._requests,
            ProgramLink(self),
            uploads,
            given_path(values, "program_settings") or default_parameter_file().with_name(SETTINGS),
            given_path(values, "work_zero_file") or default_zeros_file(self.get_namespace()),
            given_path(values, "progress_file") or default_kept_file(self.get_namespace()),
            self._commanded_position,
        )

    def _end(self) -> None:
        self._program.chosen.close()
        self._server.stop()

    async def _greet(self, client: viser.ClientHandle) -> None:
        self._page.greet(client)

    def _look(self) -> None:
        """Ask for the machine when it appears, and forget it when it is gone or another one."""
        self._read_notice()
        identity = self._link.identity
        if identity != self._identity:
            self._identity = identity
            self._forget()
        if identity and self._facts is None and time.monotonic() - self._asked_at > PATIENCE:
            self._asked_at = time.monotonic()
            self._link.ask_for_facts(lambda facts: self._take_facts(facts, identity))

    def _read_notice(self) -> None:
        if self._notice_file is not None:
            # Nobody has anything to say before it is there.
            with suppress(OSError):
                text = self._notice_file.read_text(encoding="utf-8", errors="replace")
                self._take_notice(text[:LONGEST_NOTICE].strip())

    def _take_notice(self, notice: str) -> None:
        if notice != self._notice:
            self._notice = notice
            self._requests.history.add(WARNING, notice or "all nodes run again")
            self._start_again.visible = bool(notice) and self._start_again_file is not None

    def _ask_to_start_again(self) -> None:
        if self._start_again_file is None:
            return
        try:
            self._start_again_file.touch()
        except OSError as error:
            self._requests.refuse(f"nothing started: {error.strerror or error}")

    def _forget(self) -> None:
        self._facts, self._asked_at = None, -math.inf
        self._feeds.motion.forget()
        self._steps.drop()
        self._link.forget()
        self._requests.end_hold()

    def _is_known(self) -> bool:
        """Tell whether the machine is the one that is shown, and say so if not."""
        self._look()
        if self._facts is None:
            self._requests.refuse(f"nothing done: {self._link.server} has not told its target yet")
        return self._facts is not None

    def _take_facts(self, facts: MachineFacts, identity: Identity) -> None:
        if identity != self._identity:
            return
        self._facts = facts.with_teach_mode(self._feeds.status.message.teach_mode)
        self._requests.follow_twist_timeout(facts.values["twist_timeout"])
        self._view.show_machine(self._facts)

    def _on_parameters(self, event: ParameterEvent) -> None:
        if self._facts is None or event.node != self._link.server:
            return
        changed = {
            each.name: parameter_value_to_python(each.value)
            for each in event.changed_parameters
            if each.name in NAMES
        }
        self._facts = self._facts.with_changes(changed)
        self._requests.follow_twist_timeout(self._facts.values["twist_timeout"])
        self._view.show_machine(self._facts)

    def _frame(self) -> None:
        """Fulfil what is wished, and show where everything is."""
        self._requests.fulfil()
        self._look_for_refusals()
        self._look_for_ends()
        self._look_for_teach_mode()
        self._program.step(self._facts)
        self._manual.step(self._facts)
        clients = self._server.get_clients()
        if not clients or not self._page.shows("Swing"):
            self._feeds.swing.close()
        self._frames += 1
        if not clients or (self._is_still and self._frames % STILL):
            return
        self._mechanisms.step(time.monotonic())
        self._tell(clients)
        self._program.show()
        self._manual.show()
        if self._page.shows("Swing"):
            self._feeds.swing.listen()
            self._swing.show(self._facts, waits=self._feeds.status.message.shaper_waits)
            self._swing.draw(self._feeds.swing)
        if self._facts is not None:
            self._drive.show(self._facts, self._commanded_position(), self._feeds.status.state)
            self._view.draw(self._facts, self._feeds)

    @property
    def _is_still(self) -> bool:
        """Whether nothing moves, and nothing is driven from here."""
        setpoint, told = self._feeds.motion.commanded, self._feeds.status.message
        moves = told.speed > 0.0 or (setpoint is not None and any(setpoint.velocities))
        return not (moves or self._program.is_running or self._program.is_taken())

    def _look_for_refusals(self) -> None:
        # A goal that is looked at tells how it has ended.
        _ = self._link.goal
        status = self._feeds.status
        message = status.message
        if message.refused > self._refused:
            self._requests.refuse(self._place_words() or status.refusal, message.refusal_text)
            self._requests.end_hold()
        self._refused = message.refused

    def _place_words(self) -> str | None:
        """Return why the place cannot be that was asked for here, if that was refused."""
        asked, self._link.asked = self._link.asked, None
        if self._facts is None or asked is None:
            return None
        if self._feeds.status.message.refusal not in PLACE_REFUSALS:
            return None
        return outside_text(self._facts.workspace, asked)

    def _look_for_ends(self) -> None:
        """Let nothing go on by itself that has ended."""
        status = self._feeds.status
        if self._jog_watch.has_ended(status.state, status.cause):
            self._requests.end_hold()
        self._steps.look(status.state)
        state = (status.state, status.cause)
        if self._facts is not None and status.state is not None and state != self._state:
            self._state = state
            text = ": ".join(filter(None, (status.word, self._reason())))
            self._requests.history.add(status.color, text, status.message.reason)

    def _look_for_teach_mode(self) -> None:
        """Take it over as the machine tells it, whoever has switched it."""
        is_teaching = self._feeds.status.message.teach_mode
        if self._facts is not None and is_teaching != self._facts.is_teaching:
            self._facts = self._facts.with_teach_mode(is_teaching)
            self._view.show_machine(self._facts)
            color, words = (WARNING, "on") if is_teaching else (READY, "off")
            self._requests.history.add(color, f"the teach mode is {words}")

    def _on_stop(self) -> None:
        self._steps.drop()
        self._link.cancel()
        self._program.stop()
        self._manual.stop()

    def _tell(self, clients: dict[int, viser.ClientHandle]) -> None:
        """Tell each page what stands above it, if that is new; now and then that it is not."""
        now = time.monotonic()
        if now - self._told_at < TELL_PERIOD:
            return
        self._told_at = now
        for number, tab in tuple(self._page.open_tabs.items()):
            client = clients.get(number)
            if client is None:
                continue
            news = self._strip(number), tab
            told, at = self._told.get(number, (None, 0.0))
            if news != told or now - at > SIGN_PERIOD:
                self._told[number] = news, now
                self._page.show(client, news[0] if news != told else None)
        for number in self._told.keys() - clients.keys():
            del self._told[number]
            self._told_history.pop(number, None)
        self._tell_history(clients, now)

    def _tell_history(self, clients: dict[int, viser.ClientHandle], now: float) -> None:
        """Tell each page what was told, not too often."""
        history = self._requests.history
        if now - self._history_at < HISTORY_PERIOD:
            return
        for number, client in clients.items():
            if number in self._told and self._told_history.get(number) != history.changes:
                self._told_history[number] = history.changes
                self._history_at = now
                self._page.show_history(client, tuple(history))

    def _strip(self, page: int) -> Strip:
        controls = self._requests.controls
        refusal, pages = self._requests.refusal, pages_text(controls, page)
        has_controls = controls.holder == page
        server, status = self._link.server, self._feeds.status
        if self._facts is None or self._feeds.is_silent:
            state, reason = "not heard", f"{server} was {status.word} and tells no more"
            if self._facts is None:
                state, reason = "no machine", f"nobody answers as {server}"
            reason = self._with_notice(reason)
            return Strip(
                *(WARNING, state, reason, refusal, pages, "not heard"),
                position=self._measured_text() + self._manual.work_text,
                controls=has_controls,
            )
        color = WARNING if self._notice and status.color != FAULT else status.color
        return Strip(
            color,
            status.word,
            self._with_notice(self._reason()),
            refusal,
            pages,
            "ramps to rest (Esc)",
            (status.position or self._measured_text()) + self._manual.work_text,
            status.speed,
            self._program.left or status.left,
            status.speed_limit,
            has_controls,
        )

    def _reason(self) -> str:
        return self._feeds.status.reason(self._facts.values if self._facts is not None else {})

    def _with_notice(self, reason: str) -> str:
        return "; ".join(filter(None, (self._notice, reason)))

    def _position(self, heights: Vector3 | None) -> Vector3 | None:
        pose = pose_of(heights, self._facts) if self._facts is not None else None
        return pose.position if pose is not None else None

    def _measured_position(self) -> Vector3 | None:
        return self._position(self._feeds.motion.measured)

    def _place(self) -> Vector3 | None:
        """Return where the platform is led, or else measured; None if nobody tells it now [m]."""
        if self._facts is None or self._feeds.is_silent:
            return None
        return self._feeds.status.place or self._measured_position()

    def _measured_text(self) -> str:
        """Return where the platform is measured, or was, where no setpoint says where it is led."""
        motion = self._feeds.motion
        position = self._position(motion.measured_last)
        if position is None:
            return ""
        return (
            f"{position_text(position)} {'measured' if motion.measured else 'when last measured'}"
        )

    def _commanded_position(self) -> Vector3 | None:
        setpoint = self._feeds.motion.commanded
        return self._position(setpoint.heights if setpoint is not None else None)

    def _move_to(self, position: Vector3, speed: float) -> None:
        self._steps.drop()
        if self._is_known():
            self._link.move_to(position, speed)

    def _move_by(self, step: Vector3, speed: float) -> None:
        """Go on by a step, from where the last one leads to if it is not there yet."""
        if not self._is_known():
            return
        target = self._steps.go_on(
            step,
            self._commanded_position(),
            self._feeds.status.state,
            is_on_way=self._link.goal is not None,
            now=time.monotonic(),
        )
        if target is None:
            self._requests.refuse("no step: the position of the platform is not known")
        else:
            self._link.move_to(target, speed)

    def _follow(self, points: list[Vector3], tolerance: float, speed: float) -> None:
        self._steps.drop()
        if self._is_known():
            self._link.follow(points, tolerance, speed)
