"""Lets ik_node make the moves of a search for modes, and listens to the swing behind them."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import Imu

from tri_glide_interfaces.action import MoveTo
from tri_glide_interfaces.msg import MotionState
from tri_glide_kinematics.calibration.ringdown import Quantity
from tri_glide_kinematics.calibration.session import (
    LARGEST_DELAY,
    LONGEST_ANSWER,
    LONGEST_END,
    MachineView,
    SwingingError,
    SwingMove,
    SwingPhase,
    SwingSearch,
    SwingSettings,
)
from tri_glide_kinematics.control import IDLE
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.goal_sender import GoalSender, SentGoal
from tri_glide_kinematics.ros.loop import UrgentInputs
from tri_glide_kinematics.ros.outputs import read_motion
from tri_glide_kinematics.settings import CALIBRATION_NODE, IK_NODE, Values
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text

ACCELEROMETER = "imu/data_raw"
MOTION = "ik_node/motion_state"
NEWEST = QoSProfile(depth=1)
# None may be missing between two looks, nor after a short stall: half a second at 1 kHz.
SAMPLES = QoSProfile(depth=500, reliability=ReliabilityPolicy.BEST_EFFORT)
# Looks for samples take no longer than this in a cycle [s].
LOOKING = 0.003

# What ik_node has to tell of itself: its geometry, its limits, its shaper.
_OF_BOTH = {entry.name for entry in CALIBRATION_NODE} | {"shaper"}
PARAMETERS = tuple(entry for entry in IK_NODE if entry.name in _OF_BOTH)

# REP 145: such an element says that a sensor does not measure this.
NOT_MEASURED = -1.0

# The setpoints have arrived; where the platform is measured is another matter.
ARRIVED = (MoveTo.Result.SUCCEEDED, MoveTo.Result.NOT_REACHED)


class SwingDriver:
    """One search at a time."""

    def __init__(
        self, node: Node, machine: Callable[[], MachineView], unusable: Callable[[str], None]
    ) -> None:
        """Be ready to send goals.

        Args:
            node: that talks with ik_node.
            machine: tells the state of ik_node.
            unusable: is told of messages that cannot be read.
        """
        self._node = node
        self._machine = machine
        self._unusable = unusable
        self._goals = GoalSender(node)
        self._parameters = AsyncParameterClient(node, "ik_node")
        self._asked: tuple[Future, float] | None = None
        self._search: SwingSearch | None = None
        self._done: Future | None = None
        self._goal: SentGoal | None = None
        # When a search has to be over that came to its end with a goal under way [s].
        self._deadline: float | None = None
        self._subscriptions: list[Any] = []
        self._inputs: UrgentInputs | None = None
        self._is_by_heights = False

    @property
    def is_active(self) -> bool:
        """Whether a search is under way."""
        return self._search is not None

    def parameters(self) -> Future:
        """Return what will hold the ``Values`` of ``PARAMETERS`` of ik_node, or an error.

        Raises:
            SwingingError: if ik_node is not there, does not rest, or somebody else asks.
        """
        self._check_machine()
        if self._asked is not None:
            raise SwingingError("another search for modes is about to begin")
        future = Future()
        self._asked = future, time.monotonic() + LONGEST_ANSWER
        names = [entry.name for entry in PARAMETERS]
        self._parameters.get_parameters(names).add_done_callback(
            lambda answer: self._on_parameters(future, answer)
        )
        return future

    def begin(
        self,
        moves: Sequence[SwingMove],
        settings: SwingSettings,
        slider_names: Sequence[str] | None,
    ) -> Future:
        """Begin with the first move, and return what will hold the ``SwingSearch`` at its end.

        With ``slider_names`` measured heights are recorded, else what an accelerometer tells.

        Raises:
            SwingingError: if that is not possible now.
        """
        self._check_machine()
        if self._search is not None:
            raise SwingingError("another search for modes is under way")
        self._is_by_heights = slider_names is not None
        topic = "joint_states" if self._is_by_heights else ACCELEROMETER
        topic = self._node.resolve_topic_name(topic)
        quantity = Quantity.POSITION if self._is_by_heights else Quantity.ACCELERATION
        names = tuple(slider_names or "xyz")
        now = time.monotonic()
        sensor, stops = (topic, quantity, names), self._machine().stops
        self._search = SwingSearch(moves, settings.duration, sensor, now, stops)
        self._goal = self._deadline = None
        self._done = Future()
        self._listen()
        return self._done

    def measured(self, heights: Vector3, stamp: float, sent: float, now: float) -> None:
        """Take in reported heights [m] with their stamp, sent and received when [s]."""
        if self._search is not None and self._is_by_heights and self._is_timely(sent):
            self._search.sample(heights, stamp, sent, now)

    def end(self, reason: str) -> None:
        """Let the platform come to rest, and make no further move."""
        if self._search is not None:
            self._search.end(reason)

    def step(self) -> None:
        """Do what is due; to be called again and again."""
        now = time.monotonic()
        if self._asked is not None and now > self._asked[1]:
            future, self._asked = self._asked[0], None
            text = f"ik_node has not told its parameters in {LONGEST_ANSWER:g} s"
            future.set_exception(SwingingError(text))
        search = self._search
        if search is None:
            return
        assert self._inputs is not None
        self._inputs.handle(now + LOOKING)
        now = time.monotonic()
        goal = self._goal
        if goal is not None and goal.result is not None:
            self._goal = None
            search.goal_ended(goal.result.code in ARRIVED, goal.result.text)
        move = search.step(self._machine(), now)
        if move is not None:
            self._goal = self._goals.move_to(move.target, kind="linear")
        if search.phase is SwingPhase.ENDED:
            self._finish(search, now)

    def _finish(self, search: SwingSearch, now: float) -> None:
        """End when nothing moves for this search any more, or nobody can tell."""
        if self._goal is not None and self._deadline is None:
            self._goal.cancel()
            self._deadline = now + LONGEST_END
        is_lost = not self._goals.is_ready or now > (self._deadline or 0.0)
        if self._goal is not None and not is_lost:
            return
        self._search = self._goal = None
        self._let_go()
        assert self._done is not None
        self._done.set_result(search)

    def _check_machine(self) -> None:
        if not (self._goals.is_ready and self._parameters.services_are_ready()):
            raise SwingingError(f"there is no {self._goals.server} that could move the platform")
        if self._machine().state is not IDLE:
            raise SwingingError(str(self._machine()))

    def _on_parameters(self, future: Future, answer: Any) -> None:
        if self._asked is None or self._asked[0] is not future:
            return
        self._asked = None
        try:
            future.set_result(_values(answer.result().values))
        except KinematicsError as error:
            future.set_exception(error)

    def _listen(self) -> None:
        """Subscribe: nobody is sent these messages all the time for a search now and then."""
        # rclpy's type hints know of no callback that gets to know when a message was sent.
        on_motion: Any = self._on_motion
        on_sample: Any = self._on_sample
        node = self._node
        self._subscriptions = [
            node.create_subscription(MotionState, MOTION, on_motion, NEWEST, raw=True)
        ]
        if not self._is_by_heights:
            self._subscriptions.append(
                node.create_subscription(Imu, ACCELEROMETER, on_sample, SAMPLES)
            )
        self._inputs = UrgentInputs(
            self._subscriptions,
            lambda error: self._unusable(f"unusable message: {type(error).__name__}: {error}"),
        )

    def _let_go(self) -> None:
        assert self._inputs is not None
        self._inputs.close()
        self._inputs = None
        for each in self._subscriptions:
            self._node.destroy_subscription(each)
        self._subscriptions = []

    def _on_motion(self, data: bytes, info: dict[str, Any]) -> None:
        search, sent = self._search, 1e-9 * info["source_timestamp"]
        if search is None or not self._is_timely(sent):
            return
        try:
            commanded = read_motion(data).commanded
        except struct.error:
            return
        heights, velocities, _ = commanded or (None, None, None)
        search.setpoints(heights, velocities, sent, time.monotonic())

    def _on_sample(self, message: Imu, info: dict[str, Any]) -> None:
        search, sent = self._search, 1e-9 * info["source_timestamp"]
        if search is None or not self._is_timely(sent):
            return
        if message.linear_acceleration_covariance[0] == NOT_MEASURED:
            search.end(f"the sensor on {ACCELEROMETER} measures no accelerations")
            return
        stamp, felt = message.header.stamp, message.linear_acceleration
        seconds = stamp.sec + 1e-9 * stamp.nanosec
        if seconds > 0.0:
            search.sample((felt.x, felt.y, felt.z), seconds, sent, time.monotonic())

    def _is_timely(self, sent: float) -> bool:
        """Return whether the sender has our clock; if not, the search ends."""
        delay = time.time() - sent
        if abs(delay) <= LARGEST_DELAY:
            return True
        self.end(
            f"a message came {number_text(delay, 3)} s after it was sent, at most "
            f"{LARGEST_DELAY:g} s can be: are the clocks of the computers set alike?"
        )
        return False


def _values(told: Sequence[Any]) -> Values:
    """Return the parameters that ik_node has told.

    Raises:
        KinematicsError: if it has told others, or values that it cannot have.
    """
    if len(told) != len(PARAMETERS):
        raise SwingingError(f"ik_node has told {len(told)} of {len(PARAMETERS)} parameters")
    return {
        entry.name: entry.checked(parameter_value_to_python(value))
        for entry, value in zip(PARAMETERS, told)
    }
