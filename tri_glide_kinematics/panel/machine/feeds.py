"""The messages of the machine to the panel."""

from __future__ import annotations

import struct
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu
from visualization_msgs.msg import Marker, MarkerArray

from tri_glide_interfaces.msg import MachineState, MotionState
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.panel.machine.status import MachineStatus
from tri_glide_kinematics.ros.cdr import STAMP_END, STAMP_OFFSET, byte_order
from tri_glide_kinematics.ros.loop import UrgentInputs
from tri_glide_kinematics.ros.outputs import (
    DRIVEN,
    LATCHED,
    PROGRAMMED,
    TARGET,
    Motion,
    read_motion,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3

# As many as come in some frames at the usual rate: the curves show every one.
SOME = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)

# A reading that is older than this no longer tells where the machine is [s].
SILENCE = 0.5
# While it moves, ik_node tells its state every 0.1 s: after this it is not heard any more [s].
STATE_SILENCE = 1.0
# A slower platform is shown as 0.0 mm/s [m/s].
STANDSTILL = 5e-5
# A stamp that is older than this on arrival is of another clock [s].
LARGEST_LAG = 1.0

LATE = "late cycles in the last second"
LATE_SINCE_START = "late cycles"


class MotionFeed:
    """The topic on which ``ik_node`` tells how the sliders move.

    Attributes:
        subscription: of the topic; its messages are taken once for each frame.
        unseen: what has come since the curves were last drawn, oldest first.
    """

    def __init__(self, node: Node) -> None:
        """Subscribe as a part of ``node``."""
        self.unseen: deque[Motion] = deque(maxlen=SOME.depth)
        self._newest: Motion | None = None
        self._time = 0.0
        self.subscription = node.create_subscription(
            MotionState, "ik_node/motion_state", self._take, SOME, raw=True
        )

    def forget(self) -> None:
        """Know nothing, as it was told by another ``ik_node``."""
        self._newest = None
        self.unseen.clear()

    @property
    def commanded(self) -> SliderState | None:
        """Commanded heights of the sliders; None if they are old or not known."""
        return self._newest.commanded if self._newest and self._is_fresh() else None

    @property
    def measured(self) -> Vector3 | None:
        """Measured heights of the sliders [m]; None if they are old or not known."""
        return self._newest.measured if self._newest and self._is_fresh() else None

    def _is_fresh(self) -> bool:
        return time.monotonic() - self._time < SILENCE

    def _take(self, data: bytes) -> None:
        self._newest, self._time = read_motion(data), time.monotonic()
        self.unseen.append(self._newest)


# The queue holds the messages of three frames of the page, from a sensor with 1 kHz.
SWING_QUEUE = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
# Of a frame, what may be spent on taking messages [s].
TAKING = 0.008

# By the order of bytes: the stamp with the size of the frame's name, and the acceleration, which
# stands behind an orientation and an angular velocity with their covariances.
IMU_HEADS = {order: struct.Struct(f"{order}iII") for order in "<>"}
IMU_ACCELERATIONS = {order: struct.Struct(f"{order}200x3d") for order in "<>"}


def read_acceleration(data: bytes) -> tuple[float, float, float, float]:
    """Return stamp [s] and acceleration [m/s^2] of a ``sensor_msgs/Imu`` by its bytes.

    Raises:
        struct.error: if they end before that.
    """
    order = byte_order(data)
    seconds, nanoseconds, name = IMU_HEADS[order].unpack_from(data, STAMP_OFFSET)
    end_of_name = STAMP_END + 4 + name
    begin = end_of_name + (STAMP_OFFSET - end_of_name) % 8
    x, y, z = IMU_ACCELERATIONS[order].unpack_from(data, begin)
    return seconds + 1e-9 * nanoseconds, x, y, z


class SwingFeed:
    """What an accelerometer on the platform tells, which is listened to while a page is there.

    Attributes:
        own: the subscription, if there is one: its messages are taken here and by nobody else.
    """

    def __init__(self, node: Node) -> None:
        """Be ready to listen as a part of ``node``."""
        self.own: set[Subscription] = set()
        self._node = node
        self._inputs: UrgentInputs | None = None
        self._samples: list[tuple[float, float, float, float]] = []

    def listen(self) -> None:
        """Listen from now on."""
        if self._inputs is None:
            subscription = self._node.create_subscription(
                Imu, "imu/data_raw", self._take, SWING_QUEUE, raw=True
            )
            self.own.add(subscription)
            self._inputs = UrgentInputs((subscription,), _raise)

    def close(self) -> None:
        """Listen no more: so nothing is sent, and an accelerometer may be silent."""
        if self._inputs is not None:
            self._inputs.close()
            self._inputs = None
            self._node.destroy_subscription(self.own.pop())

    def take(self) -> FloatArray:
        """Return what has come in: stamps [s] and accelerations [m/s^2]. Shape (n, 4)."""
        if self._inputs is not None:
            self._inputs.handle(time.monotonic() + TAKING)
        samples, self._samples = self._samples, []
        return np.array(samples).reshape(-1, 4)

    def _take(self, data: bytes) -> None:
        # Bytes that are no such message tell nothing.
        with suppress(struct.error):
            self._samples.append(read_acceleration(data))


def _raise(error: Exception) -> None:
    raise error


class SteadyTimes:
    """Places what another clock has stamped on the steady clock of this computer.

    What is late by itself makes no step, as its stamp counts.
    """

    def __init__(self) -> None:
        """Know nothing of the other clock."""
        self._offset = 0.0

    def offset(self, stamp: float, now: float) -> float:
        """Return what is to be added to stamps [s].

        Args:
            stamp: the newest one [s].
            now: time.monotonic() [s].
        """
        # A clock that is set begins anew.
        if not -LARGEST_LAG <= stamp + self._offset - now <= 0.0:
            self._offset = now - stamp
        return self._offset


class Feeds:
    """All topics that the panel listens to.

    Attributes:
        motion: where the sliders are and where they are to be.
        status: what ``ik_node`` says about itself.
        target: where the machine goes, None for nowhere [m].
        late: what ``ik_node`` says about its cycles.
        swing: what an accelerometer tells.
    """

    def __init__(
        self, node: Node, server: str, on_lines: Callable[[str, FloatArray], None]
    ) -> None:
        """Listen as a part of ``node`` to the ``ik_node`` with the full name ``server``.

        ``on_lines`` gets a line that has changed, by name. Shape (n, 3) [m].
        """
        self.motion = MotionFeed(node)
        self.status = MachineStatus()
        self._status_at = 0.0
        self.target: Vector3 | None = None
        self.late = "not known"
        self.swing = SwingFeed(node)
        self._server = server[1:]
        self._on_lines = on_lines
        node.create_subscription(MachineState, "ik_node/machine_state", self._on_state, LATCHED)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        node.create_subscription(MarkerArray, "markers", self._on_markers, LATCHED)

    @property
    def urgent(self) -> tuple[Any, ...]:
        """What is taken once for each frame."""
        return (self.motion.subscription,)

    @property
    def is_silent(self) -> bool:
        """Tell whether the machine moved when its state was heard last, long ago."""
        age = time.monotonic() - self._status_at
        return self.status.message.speed > STANDSTILL and age > STATE_SILENCE

    def _on_state(self, message: MachineState) -> None:
        self.status, self._status_at = MachineStatus(message), time.monotonic()

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
