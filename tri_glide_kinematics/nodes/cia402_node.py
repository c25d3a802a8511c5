"""Leads three drives on a CAN bus (CiA 402): setpoints in, measured heights out."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from tri_glide_interfaces.action import Home
from tri_glide_kinematics.control import Health, Level
from tri_glide_kinematics.drives import CanBus, DriveError, DriveGroup, GroupState, Setpoint
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.cdr import FIRST, SECOND, StampedTriples
from tri_glide_kinematics.ros.inputs import NODE_ENDS, SliderMeasurements
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle, steady_timer
from tri_glide_kinematics.ros.messages import RefusedMessageError
from tri_glide_kinematics.ros.outputs import DiagnosticsPublisher
from tri_glide_kinematics.ros.serving import CALLS, ActionServer, GoalEnd, PatientServices
from tri_glide_kinematics.ros.starting import FatalError
from tri_glide_kinematics.settings import CIA402_NODE, drive_group_settings_of

RELIABLE = QoSProfile(depth=10)
# Each setpoint counts, also after a stall: one that is displaced here would be missing on the way.
EACH_SETPOINT = QoSProfile(depth=1000)

# Period of looking for what people ask, who wait for drives anyway; of telling what changes while
# the drives are set up; and the longest time until a call is answered [s].
SERVING_PERIOD = 0.02
TELLING_PERIOD = 1.0
LONGEST_ANSWER = 5.0
# So long after a setpoint somebody leads the drives [s].
LED_FOR = 0.2

LEVELS = {
    GroupState.SILENT: Level.STALE,
    GroupState.ON: Level.OK,
    GroupState.FAULT: Level.ERROR,
    GroupState.BUS_LOST: Level.ERROR,
}
# The others lead to one of these, in which the drives stay.
LASTING = (
    GroupState.OFF,
    GroupState.ON,
    GroupState.HOLDING,
    GroupState.FAULT,
    GroupState.BUS_LOST,
)
# Nothing depends on the next SYNC.
NOT_HEARD = (GroupState.SILENT, GroupState.FAULT, GroupState.BUS_LOST)
ENDS = {Home.Result.SUCCEEDED: GoalEnd.SUCCEEDED, Home.Result.CANCELED: GoalEnd.CANCELED}


@dataclass(eq=False)
class _Homing:
    """A goal of ``~/home``: it goes on until it has a code."""

    code: int | None = None
    text: str = ""
    is_cancelled: bool = False


@contextmanager
def _ends_the_node() -> Iterator[None]:
    """Let any error end the node: something in here is broken."""
    try:
        yield
    except Exception as error:
        raise FatalError(f"{type(error).__name__}: {error}") from error


class Cia402Node(Node):
    """Turns messages into calls of the group of drives, and what it tells into messages."""

    def __init__(self) -> None:
        """Declare the parameters and open the bus.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with, or the bus cannot
                be opened.
        """
        super().__init__("cia402_node")
        values = LiveParameters(self, CIA402_NODE, drive_group_settings_of).values
        self._names = values["joint_names"]
        self._reader = SliderMeasurements(self._names)
        self._refused = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._bus = CanBus(
            values["interface"],
            values["channel"],
            values["bitrate"],
            values["node_ids"],
            values["own_node_id"],
        )
        self._group = DriveGroup(self._bus, drive_group_settings_of(values))
        self._told: tuple[GroupState | None, str] = None, ""
        self._told_at = self._served_at = self._heard_at = -math.inf
        self._homing = _Homing(Home.Result.CANCELED)
        self._ends = False
        self._now = self.get_clock().now
        self._synced = self._now().nanoseconds
        self._since = self._synced // 1_000_000_000
        message = JointState(name=self._names, position=FIRST, velocity=SECOND)
        self._message = StampedTriples(message, 2)
        self._measured = self.create_publisher(JointState, "joint_states", RELIABLE)
        commands = self.create_subscription(
            JointState, "joint_commands", self._on_command, EACH_SETPOINT, raw=True
        )
        # A call that waits for the drives keeps no other from its turn.
        group = ReentrantCallbackGroup()
        self.create_service(
            SetBool, "~/enable", self._on_enable, qos_profile=CALLS, callback_group=group
        )
        self.create_service(
            Trigger, "~/reset", self._on_reset, qos_profile=CALLS, callback_group=group
        )
        DiagnosticsPublisher(self, self._health)
        # To wait for a client is to be silent on the bus: never while drives listen.
        self._patient = PatientServices(self, lambda: self._group.state in NOT_HEARD)
        self._home = ActionServer(
            self,
            Home,
            "~/home",
            self._patient,
            begin=self._begin_homing,
            cancel=self._cancel_homing,
            end=lambda goal: None if goal.code is None else ENDS.get(goal.code, GoalEnd.ABORTED),
            result=self._homed,
            feedback=self._waiting,
        )
        steady_timer(self, 0.1, self._home.tell_progress)
        # Setpoints are read in the sleep, so that SYNC comes at its time.
        self.cycle = Cycle(
            (commands,),
            1.0 / values["rate"],
            self._cycle,
            early=(commands,),
            may_end=self._may_end,
            end=self._end,
        )

    def _cycle(self) -> None:
        """Lead the drives for a period, and after that do what people ask for.

        Raises:
            FatalError: if something in here is broken: the drives stop, as they hear nothing more.
        """
        now, synced = time.monotonic(), self._now().nanoseconds
        with _ends_the_node():
            self._group.step(now)
            heights, velocities = self._group.heights, self._group.velocities
            if heights is not None and velocities is not None:
                # The drives measure at SYNC, and tell it before the next one.
                stamp = divmod(self._synced, 1_000_000_000)
                self._measured.publish(self._message.at(*stamp, heights, velocities))
            if now >= self._served_at + SERVING_PERIOD:
                self._served_at = now
                self._serve(now)
        self._synced = synced

    def _serve(self, now: float) -> None:
        self._tell(now)
        self._look_at_homing()
        self._home.look()
        self._home.answer()
        self._home.publish()
        self._patient.try_soon()

    def _tell(self, now: float) -> None:
        """Log what the drives do, and why, if that is new."""
        state, text = told = self._group.state, self._text
        is_new = state is not self._told[0]
        if not is_new and (text == self._told[1] or now < self._told_at + TELLING_PERIOD):
            return
        self._told, self._told_at = told, now
        log = self.get_logger()
        if LEVELS.get(state) is Level.ERROR:
            log.error(text)
        else:
            log.info(text)
        if state is GroupState.OFF and self._group.remarks:
            log.warning("; ".join(self._group.remarks))

    @property
    def _text(self) -> str:
        """What the drives do, and why."""
        group = self._group
        is_known = group.is_homed or group.state not in (GroupState.OFF, GroupState.ON)
        texts = (group.state.value, group.message, "" if is_known else "not homed")
        return ": ".join(filter(None, texts))

    async def _on_enable(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        if request.data:
            return await self._answer(response, self._group.enable, GroupState.ON)
        return await self._answer(response, self._group.disable, GroupState.OFF)

    async def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return await self._answer(response, self._group.reset, GroupState.OFF)

    async def _answer(self, response: Any, ask: Callable[[float], None], wanted: GroupState) -> Any:
        """Ask the drives; answer once they are where they stay, or time is over.

        Raises:
            FatalError: if something in here is broken; the call would get no answer.
        """
        now = time.monotonic()
        with _ends_the_node():
            try:
                ask(now)
            except KinematicsError as error:
                response.message = str(error)
                return response
        end = now + LONGEST_ANSWER
        while self._group.state not in LASTING and time.monotonic() < end:
            await asyncio.sleep(0)
        state = self._group.state
        if state is GroupState.ENABLING:
            # Who was told that there is no torque does not get it later.
            self._group.disable(time.monotonic())
        response.success, response.message = state is wanted, self._text
        return response

    def _begin_homing(self, _: Home.Goal) -> _Homing:
        now = time.monotonic()
        try:
            if self._group.state is GroupState.ON and now < self._heard_at + LED_FOR:
                # Who sends them would be in fault, and take the torque away.
                raise DriveError("no homing while setpoints come: disable what sends them")
            self._group.home(now)
        except KinematicsError as error:
            return _Homing(Home.Result.REFUSED, str(error))
        self._homing = _Homing()
        return self._homing

    def _cancel_homing(self, goal: _Homing) -> None:
        goal.is_cancelled = True
        if self._group.state is GroupState.HOMING:
            self._group.cancel_home(time.monotonic())

    def _look_at_homing(self) -> None:
        """End the goal whose homing is over."""
        goal, group = self._homing, self._group
        if goal.code is None and group.state in LASTING and not self._ends:
            succeeded = group.is_homed and group.state is GroupState.ON
            failed = Home.Result.CANCELED if goal.is_cancelled else Home.Result.FAILED
            goal.code = Home.Result.SUCCEEDED if succeeded else failed
            goal.text = "homed" if succeeded else self._text

    def _homed(self, goal: _Homing) -> Home.Result:
        heights = self._group.heights if goal.code == Home.Result.SUCCEEDED else None
        return Home.Result(code=goal.code, text=goal.text, heights=heights or ())

    def _waiting(self, _: _Homing) -> Home.Feedback:
        return Home.Feedback(waiting=[self._names[axis] for axis in self._group.waiting_axes])

    def _on_command(self, data: bytes) -> None:
        try:
            reading = self._reader.read(data)
            if reading is None or self._ends:
                return
            if reading.velocities is None:
                raise RefusedMessageError("joint state lacks velocities")
            # Since a second of today: so a float tells a nanosecond.
            stamp = reading.seconds - self._since + 1e-9 * reading.nanoseconds
            setpoint = Setpoint(stamp, reading.heights, reading.velocities)
            self._heard_at = time.monotonic()
            self._group.put(setpoint, self._heard_at)
        except KinematicsError as error:
            self._refused.add(f"refused a setpoint: {error}")

    def _health(self) -> Health:
        group, refused = self._group, self._refused.end_of_second()
        values = {
            "state": group.state.value,
            "homed": group.is_homed,
            "delay of playing out [ms]": 1000.0 * group.delay,
            "bus load [%]": 100.0 * group.load,
            **dict(zip(self._names, group.axes)),
            "counts": group.counts,
            "remarks": "; ".join(group.remarks),
            "refused setpoints per second": refused,
            "last refusal": self._refused.last,
        }
        level = LEVELS.get(group.state, Level.WARN)
        return Health(max(level, Level.WARN) if refused else level, self._text, values)

    def _may_end(self) -> bool:
        """Bring the sliders to rest; the drives go on holding them when they hear nothing more."""
        if not self._ends:
            self._ends = True
            if self._group.state is GroupState.HOMING:
                # Nobody has cancelled the goal: that it is cancelled would be no end for it.
                self._group.cancel_home(time.monotonic())
        state = self._group.state
        if state is GroupState.ON:
            return not self._group.moves
        return state in LASTING or state is GroupState.SILENT

    def _end(self) -> None:
        self._tell(math.inf)
        if self._homing.code is None:
            self._homing.code, self._homing.text = Home.Result.SHUTDOWN, NODE_ENDS
        self._home.answer()
        self._patient.end()
        self._bus.close()
