"""What the panel hears of the machine."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.status_words import MachineStatus
from tri_glide_kinematics.ros.markers import DRIVEN, PROGRAMMED, TARGET
from tri_glide_kinematics.ros.slider_measurements import SliderMeasurements, StampedReading
from tri_glide_kinematics.vectors import FloatArray, Vector3

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
# As many commands as come in two frames at 1 kHz: the curves show every one.
SOME = QoSProfile(depth=64, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

# What is older than this is no longer where the machine is [s].
SILENCE = 0.5

LATE = "late cycles in the last second"
LATE_SINCE_START = "late cycles"


class Feed:
    """One topic of joint states, of which a message is only read when it is wanted.

    Attributes:
        subscription: of the topic; its messages are taken once for each frame.
        readings: those that have come since they were last looked at.
    """

    def __init__(self, node: Node, topic: str, qos: QoSProfile) -> None:
        """Subscribe to a ``topic``."""
        self.readings: deque[StampedReading] = deque(maxlen=qos.depth)
        self._reader: SliderMeasurements | None = None
        self._newest: StampedReading | None = None
        self._time = 0.0
        self.subscription = node.create_subscription(JointState, topic, self._take, qos, raw=True)

    def look_for(self, joints: tuple[str, ...], height_offsets: Vector3) -> None:
        """Read these joints from now on, and add to their heights what makes them true ones [m]."""
        self._reader = SliderMeasurements(joints, height_offsets)
        self._newest = None

    @property
    def newest(self) -> StampedReading | None:
        """What came last, None if that is long ago."""
        return self._newest if time.monotonic() - self._time < SILENCE else None

    def _take(self, data: bytes) -> None:
        if self._reader is None:
            return
        try:
            reading = self._reader.read(data)
        except KinematicsError:
            return
        if reading is not None and all(map(np.isfinite, reading.heights)):
            self.readings.append(reading)
            self._newest, self._time = reading, time.monotonic()


class Feeds:
    """All topics that the panel listens to.

    Attributes:
        measured: where the sliders are.
        commanded: where they are told to be.
        status: what ``ik_node`` says about itself.
        target: where the machine goes, None for nowhere [m].
        late: what ``ik_node`` says about its cycles.
    """

    def __init__(
        self, node: Node, server: str, on_lines: Callable[[str, FloatArray], None]
    ) -> None:
        """Listen as a part of ``node``.

        Args:
            node: of the panel.
            server: full name of ``ik_node``.
            on_lines: gets a line that has changed, by name. Shape (n, 3) [m].
        """
        self.measured = Feed(node, "joint_states", NEWEST)
        self.commanded = Feed(node, "joint_commands", SOME)
        self.status = MachineStatus()
        self.target: Vector3 | None = None
        self.late = "not known"
        self._server = server[1:]
        self._on_lines = on_lines
        node.create_subscription(DiagnosticStatus, "ik_node/status", self._on_status, LATCHED)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        node.create_subscription(MarkerArray, "markers", self._on_markers, LATCHED)

    @property
    def urgent(self) -> tuple[Any, ...]:
        """What is taken once for each frame."""
        return self.measured.subscription, self.commanded.subscription

    def _on_status(self, message: DiagnosticStatus) -> None:
        self.status = MachineStatus.of({entry.key: entry.value for entry in message.values})

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == self._server:
                values = {entry.key: entry.value for entry in status.values}
                now, all_of_them = values.get(LATE, "?"), values.get(LATE_SINCE_START, "?")
                self.late = f"{now} in a second, {all_of_them} in all"

    def _on_markers(self, message: MarkerArray) -> None:
        shown = {PROGRAMMED.name: "programmed", DRIVEN.name: "driven"}
        for marker in message.markers:
            is_there = marker.action != Marker.DELETE
            if marker.ns in shown:
                self._on_lines(shown[marker.ns], _points(marker) if is_there else np.empty((0, 3)))
            elif marker.ns == TARGET.name:
                place = marker.pose.position
                self.target = (place.x, place.y, place.z) if is_there else None


def _points(marker: Marker) -> FloatArray:
    return np.array([(point.x, point.y, point.z) for point in marker.points]).reshape(-1, 3)
