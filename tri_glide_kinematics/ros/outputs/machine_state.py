"""What a node does and how well: its state as it changes, and its health once a second.

The state and its reason are those of ``ik_node``, told in the log and as latched messages; any node
tells its health on /diagnostics.
"""

from __future__ import annotations

import math
import secrets
import time
from collections import deque
from collections.abc import Callable
from struct import Struct

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Vector3
from rclpy.clock import Clock
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import (
    FAULT,
    JOGGING,
    TRACKING,
    Cause,
    ControllerStatus,
    Health,
    MotionProgress,
    OperatingState,
    line_of,
    status_of,
)
from tri_glide_kinematics.reason_log import ReasonLog, RefusalLog
from tri_glide_kinematics.ros.loop import steady_timer
from tri_glide_kinematics.ros.messages import set_stamp
from tri_glide_kinematics.wording import number_text

HARDWARE_ID = "tri_glide"


def status_message(name: str, health: Health) -> DiagnosticStatus:
    """Return ``health`` as a message from the node with this full name, without the first slash.

    Its namespace tells its machine from others, here and in ``hardware_id``.
    """
    namespace, slash, _ = name.rpartition("/")
    return DiagnosticStatus(
        level=bytes([health.level]),
        name=name,
        message=health.message,
        hardware_id=f"{namespace}{slash}{HARDWARE_ID}",
        values=[KeyValue(key=key, value=_text(value)) for key, value in health.values.items()],
    )


class DiagnosticsPublisher:
    """Asks a node for its health once a second, by a steady clock."""

    def __init__(self, node: Node, health: Callable[[], Health]) -> None:
        """Publish what ``health`` returns under the full name of ``node``."""
        self._node = node
        self._health = health
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        steady_timer(node, 1.0, self._publish)

    def _publish(self) -> None:
        message = DiagnosticArray()
        set_stamp(message.header.stamp, self._node.get_clock())
        name = self._node.get_fully_qualified_name()[1:]
        message.status = [status_message(name, self._health())]
        self._publisher.publish(message)


def _text(value: object) -> str:
    return number_text(value, 6) if isinstance(value, float) else str(value)


TOPIC = "~/machine_state"

NUMBERS: dict[OperatingState, int] = {
    state: getattr(MachineState, state.name) for state in OperatingState
}
STATES = {number: state for state, number in NUMBERS.items()}
NO_SPEED_LIMIT = 0.0  # what the message has where no limit is set [m/s]
CAUSES = {cause.value: cause for cause in Cause}


def machine_state(
    status: ControllerStatus,
    progress: MotionProgress,
    refused: RefusalLog,
    remark: str,
    frame: str,
    clock: Clock,
) -> MachineState:
    """Return the message about a ``status`` and the ``progress``, and what was ``refused``.

    The ``remark`` is something beside the state that somebody should know; empty for none.
    """
    distance, speed_limit = status.target_distance, status.platform_speed_limit
    message = MachineState(
        state=NUMBERS[status.state],
        sends_setpoints=status.leads,
        cause=int(status.reason.cause),
        reason=status.reason.text,
        target_kind=int(status.target_kind or MachineState.TARGET_NONE),
        target_reached=status.target_reached,
        target_distance=math.nan if distance is None else distance,
        target_text=status.newest_target,
        speed=progress.speed,
        segment=progress.segment,
        way_remaining=progress.way_remaining,
        time_remaining=progress.time_remaining,
        speed_scale=status.speed_scale,
        path_speed_scale=status.path_speed_scale,
        shaper_waits=status.shaper_waits,
        teach_mode=status.is_teaching,
        platform_speed_limit=speed_limit if math.isfinite(speed_limit) else NO_SPEED_LIMIT,
        refused=refused.total,
        refusal=int(refused.refusal),
        refusal_text=refused.last,
        remark=remark,
        stops=status.stops,
    )
    message.header.frame_id = frame
    set_stamp(message.header.stamp, clock)
    _write(progress.position, message.position)
    _write(status.target_position, message.target)
    _write(status.target_velocity, message.target_velocity)
    return message


def state_of(message: MachineState) -> OperatingState | None:
    """Return the state that a message tells; None if it is none that is known here."""
    return STATES.get(message.state)


def cause_of(message: MachineState) -> Cause | None:
    """Return the cause that a message tells; None if it is none that is known here."""
    return CAUSES.get(message.cause)


def _write(values: tuple[float, float, float] | None, part: Point | Vector3) -> None:
    part.x, part.y, part.z = values or (math.nan, math.nan, math.nan)


LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

# A state that does not change is told again after this, as a sign of life [s].
RENEWAL = 0.5

# At the end of the node one waits for this long for those who listen [s].
FAREWELL = 0.2

# A MotionProgress.
PROGRESS = Struct("4dI2d")

# Motions that change with each message that renews them.
RENEWED = (JOGGING, TRACKING)


class StateReports:
    """Keeps new states until there is time to tell of them.

    Attributes:
        remark: something beside the state that somebody should know; empty for none.
        progress: returns where the setpoints are, and what is left of the motion.
    """

    def __init__(self, node: Node, refused: RefusalLog, frame: str) -> None:
        """Publish on ``~/status`` and ``~/machine_state`` of ``node``, and what was ``refused``."""
        self.remark = ""
        self.progress: Callable[[], MotionProgress] = MotionProgress
        self._frame = frame
        self._clock = node.get_clock()
        self._name = node.get_fully_qualified_name()[1:]
        self._logger = node.get_logger()
        self._refused = refused
        self._changes: deque[ControllerStatus] = deque()
        # Each place that logs has one severity, as rclpy refuses another one: this one is its own.
        self._states = ReasonLog(lambda text: self._logger.info(text), lines_per_second=5)
        # The count of stops begins at a random number, so that a node that is started anew has
        # another.
        self._first_stop = secrets.randbits(31)
        self._told: tuple[ControllerStatus, bytes, int, str] | None = None
        self._told_at = -math.inf
        self._health: Health | None = None
        self._logged: ControllerStatus | None = None
        self._machine_states = node.create_publisher(MachineState, TOPIC, LATCHED)
        self._publisher = node.create_publisher(DiagnosticStatus, "~/status", LATCHED)

    def add(self, status: ControllerStatus) -> None:
        """Keep a new state."""
        self._changes.append(status)

    def tell(self) -> None:
        """Log and publish new states: before a service answers, but after the first command.

        That need not wait for it, as it takes 0.1 ms.
        """
        while self._changes:
            status = self._changes.popleft()
            # A joystick gives another twist all the time; that is told now and then.
            if self._is_new(status):
                self._log(status)
                self.publish(status)

    def publish(self, status: ControllerStatus) -> None:
        """Publish a status, unless that is told already, and not long ago."""
        progress = self.progress()
        # As bytes, as NaN is not equal to itself.
        row = PROGRESS.pack(*progress.position, *progress[1:])
        told = status, row, self._refused.total, self.remark
        now = time.monotonic()
        if told == self._told and now - self._told_at < RENEWAL:
            return
        self._told, self._told_at = told, now
        message = machine_state(
            status, progress, self._refused, self.remark, self._frame, self._clock
        )
        message.stops += self._first_stop
        self._machine_states.publish(message)
        health = status_of(status, self._refused, self.remark)
        if health != self._health:
            self._health = health
            self._publisher.publish(status_message(self._name, health))

    def wait_until_read(self) -> None:
        """Wait for those who listen to have the last state, as the node ends after this."""
        end = time.monotonic() + FAREWELL
        for publisher in (self._machine_states, self._publisher):
            # The middleware waits by a clock that may be set back.
            while not publisher.wait_for_all_acked(Duration()) and time.monotonic() < end:
                time.sleep(FAREWELL / 100)

    def end_of_second(self) -> None:
        """Log how many states were left out in the last second."""
        self._states.end_of_second()

    def _is_new(self, status: ControllerStatus) -> bool:
        """Return whether this is more than the same jog or tracking, renewed."""
        last, self._logged = self._logged, status
        if last is None or last.state is not status.state or status.state not in RENEWED:
            return True
        return last.held_at_edge != status.held_at_edge

    def _log(self, status: ControllerStatus) -> None:
        text = line_of(status)
        # Each place that logs has one severity: rclpy refuses another one.
        if status.state is FAULT:
            self._logger.error(text)
        elif status.target_missed:
            self._logger.warning(text)
        else:
            self._states.add(text)
