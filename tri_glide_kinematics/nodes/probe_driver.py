"""Lets ik_node move the platform down to a plate and back, as a probe decides."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.task import Future
from std_msgs.msg import Bool

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.calibration.session import (
    LONGEST_WAIT,
    TWIST_PERIOD,
    HeightRecord,
    MachineView,
    Probe,
    ProbePhase,
    ProbeResult,
    ProbeSettings,
    ProbingError,
    RecordingError,
    Speed,
)
from tri_glide_kinematics.control import IDLE
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.messages import set_stamp
from tri_glide_kinematics.ros.outputs import cause_of, state_of
from tri_glide_kinematics.vectors import Vector3


class Resting:
    """Gives resting heights to those who wait for them."""

    def __init__(self, record: HeightRecord) -> None:
        """Look at a ``record`` of heights."""
        self._record = record
        self._waiting: list[tuple[float, Future]] = []

    def heights(self) -> Future:
        """Return what will hold the resting heights, or a RecordingError that says why not."""
        future = Future()
        self._waiting.append((time.monotonic() + LONGEST_WAIT, future))
        return future

    def step(self) -> None:
        """Answer those who can be answered; to be called again and again."""
        if not self._waiting:
            return
        now = time.monotonic()
        waiting, self._waiting = self._waiting, []
        try:
            heights = self._record.resting(now)
        except RecordingError as error:
            for end, future in waiting:
                if now < end:
                    self._waiting.append((end, future))
                else:
                    future.set_exception(error)
            return
        for _, future in waiting:
            future.set_result(heights)


NEWEST = QoSProfile(depth=1)
MACHINE_STATE = "ik_node/machine_state"
# None may be missing: a short one may be that of another's command.
ALL_STATES = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class ProbeDriver:
    """One probe at a time.

    Attributes:
        contacts: subscription that has to be looked at in each cycle.
    """

    def __init__(
        self,
        node: Node,
        base_frame: str,
        record: HeightRecord,
        place_of: Callable[[Vector3], Vector3],
        contact_delay: float,
    ) -> None:
        """Be ready to send twists in ``base_frame`` as a part of ``node``.

        Args:
            node: that talks with ik_node.
            base_frame: of twists.
            record: of reported heights.
            place_of: tells where the platform is at reported heights, and may raise a
                KinematicsError.
            contact_delay: time from a contact to its message [s].
        """
        self._contact_delay = contact_delay
        self._node = node
        self._base_frame = base_frame
        self._record = record
        self._place_of = place_of
        self._probe: Probe | None = None
        self._done: Future | None = None
        self._machine = MachineView()
        self._is_touched: bool | None = None
        self._heard = 0.0
        self._sent: Speed | None = None
        self._next = 0.0
        self._twists = node.create_publisher(TwistStamped, "target_twist", NEWEST)
        node.create_subscription(MachineState, MACHINE_STATE, self._on_machine, ALL_STATES)
        node.create_subscription(PoseStamped, "target_pose", self._on_pose, NEWEST)
        # rclpy's type hints know of no callback that gets to know when a message was sent.
        on_contact: Any = self._on_contact
        self.contacts = node.create_subscription(
            Bool, "contact", on_contact, qos_profile_sensor_data
        )

    @property
    def is_active(self) -> bool:
        """Whether a probe is under way."""
        return self._probe is not None

    @property
    def machine(self) -> MachineView:
        """What ik_node told last of itself."""
        return self._machine

    def begin(self, settings: ProbeSettings, heights: Vector3) -> Future:
        """Begin to move down, and return what will hold the ``ProbeResult``.

        The sliders rest at ``heights``, as reported. Shape (3,) [m].

        Raises:
            ProbingError: if that is not possible now.
            KinematicsError: if the measured heights are those of no place.
        """
        now = time.monotonic()
        if self._probe is not None:
            raise ProbingError("another probe is under way")
        self._check_contact(settings, now)
        if not self._node.count_publishers(MACHINE_STATE):
            raise ProbingError("there is no ik_node that could move the platform")
        if self._machine.state is not IDLE:
            raise ProbingError(str(self._machine))
        self._probe = Probe(settings, self._place_of(heights), now)
        self._probe.machine(self._machine, now)
        self._done = Future()
        self._sent = None
        return self._done

    def measured(self, heights: Vector3, now: float) -> None:
        """Take in reported heights [m], received ``now`` [s]."""
        if self._probe is None:
            return
        try:
            self._probe.measured(self._place_of(heights), now)
        except KinematicsError:
            # What has no place is no progress: the probe finds that out by itself.
            return

    def end(self, reason: str) -> None:
        """Send no more twists, so that ik_node stops."""
        if self._probe is not None:
            self._probe.other_command(reason, time.monotonic())

    def step(self) -> None:
        """Tell ik_node what it has to do now."""
        probe = self._probe
        if probe is None:
            return
        now = time.monotonic()
        if probe.phase is ProbePhase.STOPPING and self._is_resting(now):
            probe.at_rest(now)
        command = probe.step(now)
        if command is not None and (command != self._sent or now >= self._next):
            self._tell(command)
            self._sent, self._next = command, now + TWIST_PERIOD
        if probe.phase is ProbePhase.ENDED:
            self._end(probe)

    def _is_resting(self, now: float) -> bool:
        try:
            self._record.resting(now)
        except RecordingError:
            return False
        return True

    def _end(self, probe: Probe) -> None:
        self._probe = None
        heights, overrun, texts = None, 0.0, [probe.failure]
        if probe.contact_stamp is not None:
            try:
                heights = self._record.at(probe.contact_stamp)
                overrun = self._place_of(heights)[2] - probe.lowest
            except KinematicsError as error:
                texts.append(str(error))
        if self._is_touched and probe.failure is None:
            texts.append("the contact does not open again")
        assert self._done is not None
        self._done.set_result(ProbeResult(heights, overrun, "; ".join(filter(None, texts))))

    def _check_contact(self, settings: ProbeSettings, now: float) -> None:
        if self._is_touched is None:
            raise ProbingError("no message has come on the topic contact yet")
        if 0.0 < settings.contact_timeout < now - self._heard:
            raise ProbingError(f"contact is silent for {now - self._heard:.3g} s")
        if self._is_touched:
            raise ProbingError("the contact is closed already: move the platform up first")

    def _tell(self, command: Speed) -> None:
        message = TwistStamped()
        message.twist.linear.z = command.upwards
        message.header.frame_id = self._base_frame
        set_stamp(message.header.stamp, self._node.get_clock())
        self._twists.publish(message)

    def _on_contact(self, message: Bool, info: dict[str, Any]) -> None:
        now = time.monotonic()
        self._is_touched, self._heard = message.data, now
        if self._probe is not None:
            # A Bool has no time of its own: that at which it was sent comes nearest.
            stamp = 1e-9 * info["source_timestamp"] - self._contact_delay
            self._probe.contact(message.data, stamp, now)

    def _on_pose(self, _: PoseStamped) -> None:
        """Notice a command that our next twist takes the place of before it makes a state."""
        if self._probe is not None:
            self._probe.other_command("another node sends a target pose", time.monotonic())

    def _on_machine(self, message: MachineState) -> None:
        state, cause = state_of(message), cause_of(message)
        self._machine = MachineView(state, cause, message.reason, message.stops)
        if self._probe is not None:
            self._probe.machine(self._machine, time.monotonic())
