"""Serves a page on this machine that shows the tri-glide live, and an operator's panel."""

from __future__ import annotations

import math
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import viser
from rcl_interfaces.msg import ParameterEvent
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.curves.limits import CurveLimits
from tri_glide_kinematics.panel.curves.plots import Curves
from tri_glide_kinematics.panel.desk import Desk
from tri_glide_kinematics.panel.drive_tab import DriveTab
from tri_glide_kinematics.panel.feeds import Feed, Feeds
from tri_glide_kinematics.panel.go_to_handle import GoToHandle
from tri_glide_kinematics.panel.machine_facts import NAMES, MachineFacts
from tri_glide_kinematics.panel.machine_link import MachineLink
from tri_glide_kinematics.panel.markup import note
from tri_glide_kinematics.panel.mechanisms.requests import MechanismRequests
from tri_glide_kinematics.panel.mechanisms.tab import MechanismsTab
from tri_glide_kinematics.panel.numbers import numbers_table
from tri_glide_kinematics.panel.page import Page, Strip, is_loopback
from tri_glide_kinematics.panel.pages_bar import PagesBar, pages_text
from tri_glide_kinematics.panel.points_tab import PointsTab
from tri_glide_kinematics.panel.scene import Pose, Scene, view_of
from tri_glide_kinematics.panel.status_words import WARNING
from tri_glide_kinematics.ros.cycle_loop import Cycle
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.parameters import PANEL_NODE
from tri_glide_kinematics.ros.processes import default_parameter_file
from tri_glide_kinematics.ros.slider_measurements import StampedReading
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace.outline import edge_rings

FRAMES = 30.0  # 1/s
LOOK_PERIOD = 0.5  # s between two looks whether ik_node is there
NUMBERS_PERIOD = 0.2  # s
TRACE_PERIOD = 0.2  # s
STRIP_PERIOD = 0.5  # s after which a page is told again what it knows
# Of a frame, what may be spent on the shape of the workspace [s].
PIECE = 0.004

# Of the commands that come in a frame, the curves show each of so many.
CURVE_STEP = 5

# The trace: its points, and how far the platform moves from one to the next [m].
TRACE_POINTS = 1500
TRACE_STEP = 0.001


class PanelNode(Node):
    """Draws what it hears 30 times a second, and passes on what the operator wants.

    Attributes:
        cycle: what it does again and again.
    """

    def __init__(self) -> None:
        """Open the page.

        Raises:
            KinematicsError: if it cannot be opened, or a parameter has a value that has no meaning.
        """
        super().__init__("panel_node")
        values = LiveParameters(self, PANEL_NODE).values
        host = values["host"]
        self._page = Page(host, values["port"], self.get_logger().warning)
        self._server = self._page.server
        if not is_loopback(host):
            self.get_logger().error(
                f"host {host}: everybody who can reach this computer can move the machine, without "
                "a password and unencrypted; 127.0.0.1 is for this computer alone"
            )
        self._facts: MachineFacts | None = None
        self._is_asking = False
        self._scene: Scene | None = None
        self._shaping: Any = None
        self._trace: deque[Vector3] = deque(maxlen=TRACE_POINTS)
        self._is_traced = True
        self._step_target: Vector3 | None = None
        self._curves: Curves | None = None
        self._handle: GoToHandle | None = None
        self._told: dict[int, tuple[Strip, float]] = {}
        self._due = dict.fromkeys(("numbers", "trace"), 0.0)
        link = MachineLink(self, lambda reason: self._desk.refuse(reason))
        self._desk = Desk(link)
        self._feeds = Feeds(self, link.server, self._on_lines)
        self._refused = 0
        self._build(Path(values["points_file"]))
        self.create_subscription(ParameterEvent, "/parameter_events", self._on_parameters, 100)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(LOOK_PERIOD, self._look, clock=steady)
        self.cycle = Cycle(self._feeds.urgent, 1.0 / FRAMES, self._draw, end=self._server.stop)
        self.get_logger().info(f"the page: {self._page.address}")

    def _build(self, points_file: Path) -> None:
        """Make all of the page that does not depend on the machine."""
        gui, desk = self._server.gui, self._desk
        gui.set_panel_label("tri-glide")
        stop = gui.add_button("Stop", visible=False)
        stop.on_click(desk.stop)
        release = gui.add_button("Release", visible=False)
        release.on_click(desk.release)
        self._page.put_above(stop, release)
        PagesBar(gui, desk)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Drive"):
            self._drive = DriveTab(gui, desk, self._move_to, self._move_by)
        with tabs.add_tab("Points"):
            PointsTab(gui, desk, points_file, self._measured_position, self._follow)
        with tabs.add_tab("Numbers"):
            self._numbers = gui.add_html(note("no machine yet"))
        self._curves_tab = tabs.add_tab("Curves")
        with tabs.add_tab("Mechanisms"):
            # Its files lie beside the parameters.
            folder = default_parameter_file().parent
            requests = MechanismRequests(self)
            self._mechanisms = MechanismsTab(gui, self._server.scene, requests, folder)
        gui.main_panel.dock_right()
        self._server.on_client_connect(desk.opened)
        self._server.on_client_connect(self._greet)
        self._server.on_client_disconnect(desk.closed)

    async def _greet(self, client: viser.ClientHandle) -> None:
        self._page.greet(client)

    def _look(self) -> None:
        """Ask for the machine when it appears, and forget it when it is gone."""
        if not self._desk.link.is_ready:
            self._facts = None
        elif self._facts is None and not self._is_asking:
            self._is_asking = True
            self._desk.link.ask_for_facts(self._take_facts)

    def _take_facts(self, facts: MachineFacts) -> None:
        self._is_asking = False
        self._facts = facts
        for feed in (self._feeds.measured, self._feeds.commanded):
            feed.look_for(facts.joints)
        self._server.initial_camera.position, self._server.initial_camera.look_at = view_of(facts)
        if self._scene is not None:
            self._scene.remove()
        if self._handle is not None:
            self._handle.remove()
        self._scene = Scene(self._server.scene, facts)
        size = 0.35 * max(facts.machine.geometry.arm_lengths)
        self._handle = GoToHandle(self._server, self._desk, size, self._move_to)
        with self._curves_tab:
            if self._curves is None:
                self._curves = Curves(self._server.gui, _curve_limits(facts))
            else:
                self._curves.set_limits(_curve_limits(facts))
        self._shaping = edge_rings(facts.workspace)

    def _on_parameters(self, event: ParameterEvent) -> None:
        if self._facts is None or event.node != self._desk.link.server:
            return
        changed = {
            each.name: parameter_value_to_python(each.value)
            for each in event.changed_parameters
            if each.name in NAMES
        }
        self._facts = self._facts.with_changes(changed)

    def _on_lines(self, name: str, points: FloatArray) -> None:
        if self._scene is not None:
            self._scene.show_lines(name, points)

    def _draw(self) -> None:
        """Fulfil what is wished, and show where everything is."""
        self._desk.fulfil()
        clients = self._server.get_clients()
        if clients:
            self._mechanisms.step(time.monotonic())
        self._look_for_refusals()
        self._tell(clients)
        facts, scene = self._facts, self._scene
        if not clients or facts is None or scene is None:
            return
        measured = self._pose_of(self._feeds.measured, facts)
        commanded = self._pose_of(self._feeds.commanded, facts)
        with self._server.atomic():
            for drawn, pose in ((scene.measured, measured), (scene.commanded, commanded)):
                if pose is None:
                    drawn.hide()
                else:
                    drawn.move(pose)
            scene.show_target(self._feeds.target)
            self._drive.show(facts, commanded.position if commanded else None)
            if self._handle is not None:
                self._handle.follow(self._resting_place(commanded))
            self._draw_curves()
            if measured is not None:
                self._draw_trace(scene, measured.position)
                self._draw_numbers(facts, measured)
        self._shape(scene)

    def _pose_of(self, feed: Feed, facts: MachineFacts) -> Pose | None:
        reading = feed.newest
        if reading is None:
            return None
        try:
            return Pose(reading.heights, facts.machine.forward(reading.heights))
        except KinematicsError:
            return None

    def _draw_trace(self, scene: Scene, position: Vector3) -> None:
        if not self._trace or math.dist(self._trace[-1], position) > TRACE_STEP:
            self._trace.append(position)
            self._is_traced = False
        if not self._is_traced and self._is_due("trace", TRACE_PERIOD):
            self._is_traced = True
            scene.show_lines("trace", np.array(self._trace))

    def _draw_curves(self) -> None:
        now = time.monotonic()
        readings = self._feeds.commanded.readings
        if self._curves is None or not readings:
            return
        newest = _seconds(readings[-1])
        for reading in (*list(readings)[:-1:CURVE_STEP], readings[-1]):
            if reading.velocities is not None:
                # By their own stamps, so that what is late by itself makes no step.
                moment = now - (newest - _seconds(reading))
                self._curves.add(moment, reading.heights, reading.velocities)
        readings.clear()
        self._curves.draw(now)

    def _resting_place(self, commanded: Pose | None) -> Vector3 | None:
        """Return where the platform rests, or is on its way to."""
        if self._feeds.status.state == "idle" and commanded is not None:
            return commanded.position
        return self._feeds.target

    def _draw_numbers(self, facts: MachineFacts, pose: Pose) -> None:
        if self._is_due("numbers", NUMBERS_PERIOD):
            command = self._feeds.commanded.newest
            velocities = command.velocities if command else None
            self._numbers.content = numbers_table(facts, pose, velocities, self._feeds.late)

    def _shape(self, scene: Scene) -> None:
        """Go on for a moment to find the edge of the workspace, and show it when it is found."""
        end = time.monotonic() + PIECE
        while self._shaping is not None and time.monotonic() < end:
            try:
                next(self._shaping)
            except StopIteration as found:
                self._shaping = None
                scene.show_workspace(found.value)

    def _is_due(self, name: str, period: float) -> bool:
        now = time.monotonic()
        if now < self._due[name]:
            return False
        self._due[name] = now + period
        return True

    def _look_for_refusals(self) -> None:
        # A goal that is looked at tells how it has ended.
        _ = self._desk.link.goal
        status = self._feeds.status
        if status.refused > self._refused:
            self._desk.refuse(status.last_refusal)
        self._refused = status.refused

    def _tell(self, clients: dict[int, viser.ClientHandle]) -> None:
        """Tell each page what stands above it, if that is new or was told a while ago."""
        now = time.monotonic()
        for number, client in clients.items():
            strip = self._strip(number)
            told, at = self._told.get(number, (None, 0.0))
            if strip != told or now - at > STRIP_PERIOD:
                self._told[number] = strip, now
                self._page.show(client, strip)
        for number in self._told.keys() - clients.keys():
            del self._told[number]

    def _strip(self, page: int) -> Strip:
        pages = pages_text(self._desk.controls, page)
        if self._facts is None:
            reason = f"nobody answers as {self._desk.link.server}"
            return Strip(WARNING, "no machine", reason, self._desk.refusal, pages, "not heard")
        status = self._feeds.status
        return Strip(
            status.color,
            status.state,
            status.reason,
            self._desk.refusal,
            pages,
            "ramps to rest (Esc)",
        )

    def _measured_position(self) -> Vector3 | None:
        pose = self._facts and self._pose_of(self._feeds.measured, self._facts)
        return pose.position if pose else None

    def _commanded_position(self) -> Vector3 | None:
        pose = self._facts and self._pose_of(self._feeds.commanded, self._facts)
        return pose.position if pose else None

    def _move_to(self, position: Vector3) -> None:
        self._step_target = None
        self._desk.link.move_to(position)

    def _move_by(self, step: Vector3) -> None:
        """Go on by a step, from where the last one leads to if it is not there yet."""
        start = self._step_target if self._desk.link.goal is not None else None
        start = start or self._commanded_position()
        if start is None:
            self._desk.refuse("no step: it is not known where the platform is")
            return
        x, y, z = start
        self._step_target = target = (x + step[0], y + step[1], z + step[2])
        self._desk.link.move_to(target)

    def _follow(self, points: list[Vector3], tolerance: float, speed: float) -> None:
        self._step_target = None
        self._desk.link.follow(points, tolerance, speed)


def _curve_limits(facts: MachineFacts) -> CurveLimits:
    return CurveLimits(*facts.travel, facts.limits.velocity, facts.limits.acceleration)


def _seconds(reading: StampedReading) -> float:
    return reading.seconds + 1e-9 * reading.nanoseconds
