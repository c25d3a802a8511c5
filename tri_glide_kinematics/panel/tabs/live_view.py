"""The view of the machine as it moves."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import viser

from tri_glide_kinematics.control import IDLE
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import (
    LARGEST_LAG,
    Feeds,
    MachineFacts,
    MotionFeed,
    SteadyTimes,
)
from tri_glide_kinematics.panel.machine import Pose, ShownMachine, pose_of
from tri_glide_kinematics.panel.machine_scene import Scene, view_of
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.tabs.fault_curves import FaultCurves
from tri_glide_kinematics.panel.tabs.machine_map import MachineMap
from tri_glide_kinematics.panel.tabs.pick_view import PickView
from tri_glide_kinematics.panel.words import bar, note, table
from tri_glide_kinematics.vectors import FloatArray, Vector3, three
from tri_glide_kinematics.workspace import edge_rings

# A handle that is nobody's follows the machine in steps of this [m].
HANDLE_STEP = 0.001


class GoToHandle:
    """The handle: it sends a target when it is released, and says beside it if that is refused.

    A page with the controls drags it. What others do to it does not count.
    """

    def __init__(
        self,
        requests: OperatorRequests,
        size: float,
        move_to: Callable[[Vector3], None],
    ) -> None:
        """Put it into the scene, hidden before it has a place; its arrows have a ``size`` [m]."""
        server = requests.server
        self._requests = requests
        self._move_to = move_to
        # Where it belongs [m], and the page that drags it.
        self._place: Vector3 = (0.0, 0.0, 0.0)
        self._page: int | None = None
        self._asked: Vector3 | None = None
        self._handle = server.scene.add_transform_controls(
            "/go_to", scale=size, disable_rotations=True, depth_test=False, visible=False
        )
        self._handle.on_update(self._on_update)
        self._label = server.scene.add_label("/refusal", "", visible=False)

    def remove(self) -> None:
        """Remove it."""
        self._handle.remove()
        self._label.remove()

    def follow(self, position: Vector3 | None) -> None:
        """Follow the machine at rest, and show why the last target was refused [m]."""
        refusal = self._requests.refusal if self._asked is not None else ""
        if self._label.visible != bool(refusal) or (refusal and self._label.text != refusal):
            self._label.text = refusal
            self._label.position = self._asked or (0.0, 0.0, 0.0)
            self._label.visible = bool(refusal)
        if position is None or self._page is not None or refusal:
            return
        if math.dist(self._handle.position, position) > HANDLE_STEP:
            self._place = self._handle.position = position
        self._handle.visible = True

    async def _on_update(self, event: Any) -> None:
        # viser tells of the end of a drag when a page vanishes, too: that is no wish to move.
        page = event.client_id
        is_there = page in self._requests.server.get_clients()
        if event.phase == "end" or not is_there:
            target = self._place if page == self._page else None
            if target is not None:
                self._page = None
            if is_there and self._requests.may(page) and target is not None:
                self._requests.wish(partial(self._go, target))
        elif self._requests.controls.holder != page:
            self._handle.position = self._place
        elif event.phase == "start":
            self._page = page
            self._asked = None
        elif page == self._page:
            self._place = three(self._handle.position)

    def _go(self, position: Vector3) -> None:
        self._asked = position
        self._requests.refusal = ""
        self._move_to(position)


# A bar is coloured from this part of its limit on.
MUCH = 0.9

# How far the edge is looked for [m].
FARTHEST = 10.0

DIRECTIONS: dict[str, Vector3] = {
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}

# A row has a name, a value, and a bar or a word beside it.
Row = tuple[str, str, str]


def edge_distance(facts: MachineFacts, position: Vector3) -> tuple[float, str]:
    """Return how far the nearest edge of the workspace is along the axes, and in which direction.

    The distance is in [m], and 0 outside. This takes milliseconds.
    """
    exit_distance = facts.workspace.exit_distance
    distances = [exit_distance(position, axis, FARTHEST) for axis in DIRECTIONS.values()]
    nearest = min(range(len(DIRECTIONS)), key=distances.__getitem__)
    return distances[nearest], tuple(DIRECTIONS)[nearest]


def edge_row(facts: MachineFacts, position: Vector3) -> Row:
    """Return how far the edge is, as a row of the table."""
    distance, direction = edge_distance(facts, position)
    return "edge", f"{1000.0 * distance:.1f} mm", direction


def numbers_table(
    facts: MachineFacts,
    pose: Pose,
    edge: Row,
    velocities: Sequence[float] | None,
    late_cycles: str,
) -> str:
    """Return the numbers as a table for the page.

    The ``pose`` is measured; the ``velocities`` are commanded, None if not known [m/s]. The row
    ``edge`` tells how far it is to the edge.
    """
    rows = [(axis, f"{1000.0 * part:.2f} mm", "") for axis, part in zip("xyz", pose.position)]
    lower, upper = facts.travel
    scaled = [facts.speed_scale * limit for limit in facts.limits.velocity]
    for index, name in enumerate(facts.joints):
        height = pose.heights[index]
        part = (height - lower[index]) / (upper[index] - lower[index])
        rows.append((f"{name} height", f"{1000.0 * height:.2f} mm", bar(part)))
        if velocities is not None:
            part = abs(velocities[index]) / scaled[index]
            rows.append(
                (
                    f"{name} velocity",
                    # A zero has no sign.
                    f"{round(1000.0 * velocities[index], 1) + 0.0:.1f} mm/s",
                    bar(part, is_much=part > MUCH),
                )
            )
    try:
        condition = facts.machine.condition_number(pose.position)
        limit = facts.values["max_condition_number"]
        used = bar(condition / limit, is_much=condition > MUCH * limit)
        rows.append(("condition number", f"{condition:.2f}", used))
    except KinematicsError as error:
        rows.append(("condition number", "", str(error)))
    rows.append(edge)
    rows.append(("speed scale", f"{100.0 * facts.speed_scale:.0f} %", ""))
    rows.append(("late cycles", late_cycles, ""))
    return table(rows)


NUMBERS_PERIOD = 0.5  # s
# The edge is looked for in six directions, which takes some milliseconds [s].
EDGE_PERIOD = 1.0
TRACE_PERIOD = 0.2  # s
FAULTS_PERIOD = 1.0  # s between two looks for recordings of faults
# Of a frame, what may be spent on the shape of the workspace [s].
PIECE = 0.004

# The trace: its points, and how far the platform moves from one to the next [m].
TRACE_POINTS = 1500
TRACE_STEP = 0.001

# The handle, as a part of the longest arm.
HANDLE_SIZE = 0.35


class LiveView:
    """The scene, the curves and the numbers of a machine."""

    def __init__(
        self,
        tabs: viser.GuiTabGroupHandle,
        requests: OperatorRequests,
        machine: ShownMachine,
        move_to: Callable[[Vector3], None],
        shows: Callable[[str], bool],
        measurements: Path | None,
    ) -> None:
        """Add the tabs with numbers and curves.

        Args:
            tabs: to which they are added.
            requests: of the operator.
            machine: that is shown.
            move_to: goes to a position [m].
            shows: tells whether any page has a tab open.
            measurements: file with those of a calibration; None for none.
        """
        server = requests.server
        self._requests = requests
        self._machine = machine
        self._move_to = move_to
        self._shows = shows
        # Facts that are shown, and those of the machine that is drawn.
        self._facts: MachineFacts | None = None
        self._drawn: MachineFacts | None = None
        self._scene: Scene | None = None
        self._handle: GoToHandle | None = None
        self._shaping: Any = None
        self._times = SteadyTimes()
        self._curves_at = 0.0
        self._trace: deque[Vector3] = deque(maxlen=TRACE_POINTS)
        self._is_traced = True
        self._lines: dict[str, FloatArray] = {}
        self._numbers_pace, self._edge_pace = Pace(NUMBERS_PERIOD), Pace(EDGE_PERIOD)
        self._trace_pace, self._faults_pace = Pace(TRACE_PERIOD), Pace(FAULTS_PERIOD)
        self._edge: Row = ("edge", "", "")
        with tabs.add_tab("Numbers"):
            self._numbers = server.gui.add_html(note("no machine yet"))
            self._picking = PickView(server)
            self._map = MachineMap(requests, measurements)
        with tabs.add_tab("Curves"):
            self._faults = FaultCurves(requests)
        self._curves = self._faults.curves

    def step(self) -> None:
        """Follow the facts of the machine: a page that is opened begins with them."""
        facts = self._machine.facts
        if facts is not None and facts is not self._facts:
            self._facts = facts
            self._show_machine(facts)

    def _show_machine(self, facts: MachineFacts) -> None:
        """Put a machine into the scene, if another one or none is there."""
        self._map.show_machine(facts)
        if self._drawn is not None and self._drawn.is_same_machine(facts):
            return
        self._drawn = facts
        if self._scene is not None and self._handle is not None:
            self._scene.remove()
            self._handle.remove()
        camera = self._requests.server.initial_camera
        camera.position, camera.look_at = map(np.array, view_of(facts))
        self._scene = Scene(self._requests.server.scene, facts)
        self._lines = {}
        size = HANDLE_SIZE * max(facts.machine.geometry.arm_lengths)
        self._handle = GoToHandle(self._requests, size, self._move_to)
        self._shaping = edge_rings(facts.workspace)

    def draw(self) -> None:
        """Show where everything is by now, if a machine was ever known.

        One that has gone is nowhere, and its curves go on.
        """
        facts, feeds = self._facts, self._machine.feeds
        scene, handle = self._scene, self._handle
        if facts is None or scene is None or handle is None:
            return
        setpoint, heights = feeds.motion.commanded, feeds.motion.measured
        if self._machine.facts is None:
            setpoint = heights = None
        measured = pose_of(heights, facts)
        commanded = pose_of(setpoint.heights if setpoint is not None else None, facts)
        machines = ((scene.measured, measured), (scene.commanded, commanded))
        # viser looks for what there is to be sent at the end of each block.
        if any(drawn.differs(pose) for drawn, pose in machines):
            with self._requests.server.atomic():
                for drawn, pose in machines:
                    drawn.show(pose)
        scene.show_target(feeds.target)
        for name, points in feeds.lines.items():
            if points is not self._lines.get(name):
                self._lines[name] = points
                scene.show_lines(name, points)
        self._picking.draw(feeds.picking)
        is_idle = feeds.status.state is IDLE
        handle.follow(commanded.position if is_idle and commanded else feeds.target)
        self._draw_curves(facts, feeds.motion)
        if measured is None:
            self._numbers.content = note("no heights of the sliders are measured")
        else:
            self._draw_trace(scene, measured.position)
            self._draw_numbers(facts, measured, feeds)
        self._shape(scene)
        self._map.draw()

    def _draw_curves(self, facts: MachineFacts, feed: MotionFeed) -> None:
        now = time.monotonic()
        samples = []
        for motion in feed.unseen:
            moment = motion.stamp + self._times.offset(motion.stamp, now)
            if motion.commanded is not None and moment > self._curves_at:
                self._curves_at = moment
                samples.append((moment, motion.commanded))
        self._curves.take(samples)
        feed.unseen.clear()
        # In silence they go on, too.
        if now - self._curves_at > LARGEST_LAG:
            self._curves_at = now
        if self._faults_pace.is_due():
            self._faults.look(facts.values["height_offsets"])
        self._faults.step()
        if self._shows("Curves"):
            self._curves.draw(self._curves_at, facts)

    def _draw_trace(self, scene: Scene, position: Vector3) -> None:
        if not self._trace or math.dist(self._trace[-1], position) > TRACE_STEP:
            self._trace.append(position)
            self._is_traced = False
        if not self._is_traced and self._trace_pace.is_due():
            self._is_traced = True
            scene.show_lines("trace", np.array(self._trace))

    def _draw_numbers(self, facts: MachineFacts, pose: Pose, feeds: Feeds) -> None:
        if self._shows("Numbers") and self._numbers_pace.is_due():
            setpoint = feeds.motion.commanded
            velocities = setpoint.velocities if setpoint is not None else None
            if self._edge_pace.is_due():
                self._edge = edge_row(facts, pose.position)
            self._numbers.content = numbers_table(facts, pose, self._edge, velocities, feeds.late)

    def _shape(self, scene: Scene) -> None:
        """Go on for a moment to find the edge of the workspace, and show it when it is found."""
        end = time.monotonic() + PIECE
        while self._shaping is not None and time.monotonic() < end:
            try:
                next(self._shaping)
            except StopIteration as found:
                self._shaping = None
                scene.show_workspace(found.value)
