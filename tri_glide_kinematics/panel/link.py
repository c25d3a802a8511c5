"""The machine of the panel: what its parameters and messages tell, and what is sent to it.

``stop`` and ``jog`` of ``MachineLink`` are called by the thread that hears the page, and wait for
nobody. All else is called where the node spins.
"""

from __future__ import annotations

import struct
import time
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from rcl_interfaces.msg import ParameterValue
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

from tri_glide_interfaces.msg import MachineState, MotionState, PickState
from tri_glide_interfaces.msg import Output as OutputMessage
from tri_glide_kinematics.control import in_teach_mode
from tri_glide_kinematics.motion.limits import SliderLimits, SliderState
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.panel.words import MachineStatus
from tri_glide_kinematics.ros.cdr import STAMP_END, STAMP_OFFSET, byte_order
from tri_glide_kinematics.ros.goal_sender import ProgramLink
from tri_glide_kinematics.ros.loop import UrgentInputs
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS
from tri_glide_kinematics.ros.outputs import (
    DRIVEN,
    LATCHED,
    PROGRAMMED,
    TARGET,
    Motion,
    read_motion,
)
from tri_glide_kinematics.settings import (
    IK_NODE,
    Values,
    limits_of,
    machine_of,
    motion_limits_of,
    shaper_of,
    true_travel_of,
    workspace_limits_of,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace

# The facts of the machine that the parameters of the running ``ik_node`` tell.

# Parameters of ik_node that the panel asks for.
TABLE = {parameter.name: parameter for parameter in IK_NODE}
NAMES = tuple(TABLE)


class Bounds(NamedTuple):
    """What bounds the motion of a machine, and may be changed while it runs.

    Attributes:
        limits: of its sliders, scaled, with what bounds all motion besides.
        shaper: None without one.
    """

    limits: SliderLimits
    shaper: Shaping | None


@dataclass(frozen=True, eq=False)
class MachineFacts:
    """A machine as its ``ik_node`` knows it.

    Attributes:
        values: of its parameters.
        is_teaching: whether the teach mode is switched on.
    """

    values: Values
    is_teaching: bool = False

    @classmethod
    def of(cls, answer: Iterable[ParameterValue]) -> MachineFacts:
        """Read the values of all ``NAMES``, as the node has answered."""
        values = {}
        for name, told in zip(NAMES, answer):
            value = parameter_value_to_python(told)
            values[name] = TABLE[name].checked(tuple(value) if TABLE[name].is_array else value)
        return cls(values)

    @cached_property
    def machine(self) -> TriGlide:
        """Its kinematics."""
        return machine_of(self.values)

    @cached_property
    def workspace(self) -> Workspace:
        """Where it may be."""
        return Workspace(self.machine, workspace_limits_of(self.values))

    @cached_property
    def limits(self) -> SliderLimits:
        """Of its sliders, before they are scaled."""
        return limits_of(self.values)

    @cached_property
    def bounds(self) -> Bounds:
        """What the proof of a program depends on, besides the workspace."""
        limits = motion_limits_of(self.values, self.machine)
        if self.is_teaching:
            limits = in_teach_mode(limits, self.machine)
        return Bounds(limits.with_velocity_scaled(self.speed_scale), shaper_of(self.values))

    @property
    def travel(self) -> tuple[Vector3, Vector3]:
        """True heights of the lower and of the upper ends, each of shape (3,) [m]."""
        return true_travel_of(self.values)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the sliders."""
        return tuple(self.values["joint_names"])

    @property
    def speed_scale(self) -> float:
        """Factor by which the velocity limits are reduced."""
        return float(self.values["speed_scale"])

    def with_changes(self, changes: Values) -> MachineFacts:
        """Return the facts after some parameters have changed."""
        return replace(self, values={**self.values, **changes})

    def with_teach_mode(self, on: bool) -> MachineFacts:
        """Return the facts after the teach mode was switched ``on`` or off."""
        return replace(self, is_teaching=on)

    def is_same_machine(self, other: MachineFacts) -> bool:
        """Tell whether the other one looks alike."""
        return all(
            self.values[name] == other.values[name] for name in NAMES if name not in LIVE_NAMES
        )


LIVE_NAMES = frozenset(parameter.name for parameter in IK_NODE if parameter.live)


# A twist that is lost is renewed by the next one.
LATEST_ONLY = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
AT_REST = (0.0, 0.0, 0.0)

# Identifiers of those that publish the state.
Identity = frozenset[bytes]
NOBODY: Identity = frozenset()

Say = Callable[[str], object]


class MachineLink:
    """Clients and publishers of the panel, all made at its start: a new client is slow.

    What ``ik_node`` refuses and counts in its state is told from there, in the words of the page.

    Attributes:
        server: full name of ``ik_node``.
        programs: runs them, and sends all other goals.
        on_refusal: gets what is not done, and why.
        on_resume: is asked first whether something goes on by itself when ``resume`` is pressed.
    """

    def __init__(self, node: Node) -> None:
        """Send as a part of ``node``."""
        self.on_refusal: Say = lambda _: None
        self._twist = TwistStamped()
        self._twists = node.create_publisher(TwistStamped, "target_twist", LATEST_ONLY)
        self._triggers = {
            name: node.create_client(Trigger, f"ik_node/{name}")
            for name in ("stop", "pause", "resume")
        }
        self._enable = node.create_client(SetBool, "ik_node/enable")
        self._teach_mode = node.create_client(SetBool, "ik_node/teach_mode")
        self._parameters = AsyncParameterClient(node, "ik_node")
        self.programs = ProgramLink(node)
        self.server = self.programs.server
        self.on_resume: Callable[[], bool] = lambda: False

    @property
    def identity(self) -> Identity:
        """Which ``ik_node`` it is, empty if there is none that can be stopped."""
        can_stop = self._triggers["stop"].service_is_ready()
        return self.programs.identities if can_stop else NOBODY

    def stop(self) -> None:
        """Ask for a stop, from any thread."""
        self._triggers["stop"].call_async(Trigger.Request())

    def jog(self, velocity: Vector3 = AT_REST) -> None:
        """Send a twist [m/s], from any thread."""
        linear = self._twist.twist.linear
        linear.x, linear.y, linear.z = velocity
        self._twists.publish(self._twist)

    def trigger(self, name: str) -> None:
        """Ask for ``pause`` or ``resume``."""
        if name != "resume" or not self.on_resume():
            self._call(name, self._triggers[name], Trigger.Request())

    def enable(self, data: bool) -> None:
        """Enable or disable the machine."""
        self._call("enable" if data else "disable", self._enable, SetBool.Request(data=data))

    def set_teach_mode(self, on: bool) -> None:
        """Switch the teach mode ``on`` or off."""
        self._call("teach mode", self._teach_mode, SetBool.Request(data=on))

    def set_parameters(
        self, what: str, values: Values, then: Callable[[bool], None] = lambda _: None
    ) -> bool:
        """Ask ``ik_node`` to set all of these parameters or none; return whether it is there.

        A refusal calls them ``what``. Once there is an answer, ``then`` gets whether they are set.
        """
        if not self._parameters.services_are_ready():
            self.on_refusal(f"{what}: nobody answers as {self.server}")
            return False

        def take(future: Any) -> None:
            result = future.result().result
            if not result.successful:
                self.on_refusal(f"{what}: {result.reason}")
            then(result.successful)

        parameters = [Parameter(name, value=value) for name, value in values.items()]
        self._parameters.set_parameters_atomically(parameters).add_done_callback(take)
        return True

    def ask_for_facts(self, on_answer: Callable[[MachineFacts], None]) -> None:
        """Ask ``ik_node`` for its parameters."""

        def take(future: Any) -> None:
            on_answer(MachineFacts.of(future.result().values))

        self._parameters.get_parameters(list(NAMES)).add_done_callback(take)

    def _call(self, what: str, client: Any, request: Any) -> None:
        if not client.service_is_ready():
            self.on_refusal(f"{what}: nobody answers as {self.server}")
            return

        def take(future: Any) -> None:
            # A refusal to enable is counted.
            if not future.result().success and client is not self._enable:
                self.on_refusal(f"{what}: {future.result().message}")

        client.call_async(request).add_done_callback(take)


# The messages of the machine to the panel.

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
        measured_last: heights of the sliders, however old; None if they were never known [m].
    """

    def __init__(self, node: Node) -> None:
        """Subscribe as a part of ``node``."""
        self.unseen: deque[Motion] = deque(maxlen=SOME.depth)
        self.measured_last: Vector3 | None = None
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
        # In a fault, ik_node tells none that are old.
        self.measured_last = self._newest.measured or self.measured_last
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
        lines: polylines by their names: the path as ``programmed`` and as ``driven``. Shapes
            (n, 3) [m].
        late: what ``ik_node`` says about its cycles.
        outputs: that anybody has changed: when, by the sender, and to which value.
        swing: what an accelerometer tells.
        picking: what a ``pick_node`` told last; None without one.
    """

    def __init__(self, node: Node, server: str) -> None:
        """Listen as a part of ``node`` to the ``ik_node`` with the full name ``server``."""
        self.motion = MotionFeed(node)
        self.status = MachineStatus()
        self._status_at = 0.0
        self.target: Vector3 | None = None
        self.lines: dict[str, FloatArray] = {}
        self.late = "not known"
        self.outputs: dict[tuple[str, int], tuple[int, float]] = {}
        self.swing = SwingFeed(node)
        self._server = server[1:]
        node.create_subscription(MachineState, "ik_node/machine_state", self._on_state, LATCHED)
        on_output: Any = self._on_output
        node.create_subscription(OutputMessage, "outputs", on_output, LATEST_OUTPUTS)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        node.create_subscription(MarkerArray, "markers", self._on_markers, LATCHED)
        self.picking: PickState | None = None
        node.create_subscription(PickState, "pick_node/pick_state", self._on_picking, LATCHED)

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

    def _on_picking(self, message: PickState) -> None:
        self.picking = message

    def _on_output(self, told: OutputMessage, info: dict[str, int]) -> None:
        key, stamp = (told.name, told.number), info["source_timestamp"]
        # Of several senders that are found one after the other, the newest counts.
        if stamp >= self.outputs.get(key, (stamp, 0.0))[0]:
            self.outputs[key] = stamp, told.value

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
                self.lines[shown[marker.ns]] = _points(marker) if is_there else np.empty((0, 3))
            elif marker.ns == TARGET.name:
                place = marker.pose.position
                self.target = (place.x, place.y, place.z) if is_there else None


def _points(marker: Marker) -> FloatArray:
    return np.array([(point.x, point.y, point.z) for point in marker.points]).reshape(-1, 3)
