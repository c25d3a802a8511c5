"""Picks parts from a belt and places them: belt and pictures in, transfers of ik_node out."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import Point
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from tri_glide_interfaces.action import Pick, Transfer
from tri_glide_interfaces.msg import (
    MachineState,
    MotionState,
    Output,
    PickState,
    SeenParts,
    StationState,
    TransferStation,
)
from tri_glide_interfaces.msg import PartEvent as PartEventMessage
from tri_glide_interfaces.srv import TeachPick
from tri_glide_kinematics.checks import finite, finite_vector
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode, Station
from tri_glide_kinematics.motion.engine import Transfer as TransferCommand
from tri_glide_kinematics.picking import (
    GivingUp,
    Lessons,
    Machine,
    Observed,
    PartEvent,
    PartOutcome,
    Renewal,
    RunEnd,
    Scene,
    Sighting,
    View,
)
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.goal_sender import SentGoal
from tri_glide_kinematics.ros.inputs import NODE_ENDS
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle, steady_timer
from tri_glide_kinematics.ros.messages import (
    LATEST_OUTPUTS,
    RefusedMessageError,
    ahead_of_steady,
    has_stamp,
    steady_time,
    vector_of,
)
from tri_glide_kinematics.ros.outputs import LATCHED, Motion, read_motion
from tri_glide_kinematics.ros.serving import CALLS, ActionServer, GoalEnd, PatientServices
from tri_glide_kinematics.settings import (
    PICK_NODE,
    Values,
    keep_taught,
    machine_of,
    picker_of,
    taught_file_of,
    taught_in,
    taught_of,
    taught_values,
)
from tri_glide_kinematics.vectors import Vector3, combined, three
from tri_glide_kinematics.wording import number_text

RELIABLE = QoSProfile(depth=10)

# Period of looking what is to be done, and of telling what is known [s].
PERIOD, TELLING_PERIOD = 0.005, 0.1

# A run ends if the state of the machine is not told for so long [s].
LONGEST_SILENCE = 2.0

# States in which the machine takes commands; and those in which the platform rests: of a machine
# that is disabled, where somebody has moved it.
ACCEPTING = (MachineState.IDLE, MachineState.MOVING)
RESTING = (MachineState.IDLE, MachineState.DISABLED)

# What comes in was made so long before or ahead of now at most; a camera that is not taught yet may
# be late by that [s].
OLDEST, AHEAD = 5.0, 1.0

# More parts in a picture would keep the node from its other work for too long.
MOST_PARTS = 100

UNKNOWN: Vector3 = (math.nan, math.nan, math.nan)

ENDS = {Pick.Result.SUCCEEDED: GoalEnd.SUCCEEDED, Pick.Result.CANCELED: GoalEnd.CANCELED}
# All others are a failure.
CODES = {
    RunEnd.ALL_PLACED: Pick.Result.SUCCEEDED,
    RunEnd.PLACES_FULL: Pick.Result.SUCCEEDED,
    RunEnd.CANCELED: Pick.Result.CANCELED,
    RunEnd.STOPPED: Pick.Result.STOPPED,
    RunEnd.SHUTDOWN: Pick.Result.SHUTDOWN,
}
# As results, feedback and states name them.
COUNTED = {outcome: outcome.name.lower() for outcome in PartOutcome}


@dataclass(eq=False)
class _Run:
    """A goal of ``~/run``: it goes on until it has a code.

    Attributes:
        before: counts of outcomes at its begin.
    """

    before: dict[str, int]
    code: int | None = None
    text: str = ""


class PickNode(Node):
    """Turns messages into calls of the picker, and what that wants into goals of ``ik_node``."""

    def __init__(self) -> None:
        """Declare the parameters and wait for a run.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with.
        """
        super().__init__("pick_node")
        told = LiveParameters(self, PICK_NODE, _check).values
        self._file = taught_file_of(told, self.get_namespace())
        taught = taught_in(self._file)
        if taught:
            text = ", ".join(f"{name} {value}" for name, value in taught.items())
            self.get_logger().info(f"taught, from {self._file}: {text}")
        self._use({**told, **taught})
        self._unusable = ReasonLog(self.get_logger().warning, lines_per_second=1)
        steady_timer(self, 1.0, self._unusable.end_of_second)
        self._counts = dict.fromkeys(COUNTED.values(), 0)
        self._run = _Run(dict(self._counts), Pick.Result.STOPPED, "no run has begun")
        self._kinematics = machine_of(told)
        self._machine: MachineState | None = None
        self._motion: Motion | None = None
        self._heard_at = self._told_at = -math.inf
        # By how much the clock of this node is ahead of time.monotonic(), as of this cycle [s].
        self._ahead = ahead_of_steady(self.get_clock())
        self._holds: bool | None = False if self._values["has_sensor"] else None
        self._goal: SentGoal | None = None
        self._transfer: TransferCommand | None = None
        # What the gripper was told since the last cycle: to close, or to open.
        self._passed: list[bool] = []
        self._lessons = Lessons()
        self._has_ended = False
        self._transfers = ActionClient(self, Transfer, "ik_node/transfer")
        self._stations = self.create_publisher(StationState, "station_state", RELIABLE)
        self._events = self.create_publisher(PartEventMessage, "~/part_events", RELIABLE)
        self._states = self.create_publisher(PickState, "~/pick_state", LATCHED)
        belts = self.create_subscription(
            JointState, "belt_states", self._on_belt, qos_profile_sensor_data
        )
        parts = self.create_subscription(SeenParts, "seen_parts", self._on_parts, RELIABLE)
        motions = self.create_subscription(
            MotionState, "ik_node/motion_state", self._on_motion, QoSProfile(depth=1), raw=True
        )
        outputs = self.create_subscription(Output, "outputs", self._on_output, LATEST_OUTPUTS)
        self.create_subscription(MachineState, "ik_node/machine_state", self._on_machine, LATCHED)
        urgent = [belts, parts, motions, outputs]
        if self._values["has_sensor"]:
            urgent.append(self.create_subscription(Bool, "part_held", self._on_held, RELIABLE))
        stop = self.create_service(Trigger, "~/stop", self._on_stop, qos_profile=CALLS)
        self.create_service(TeachPick, "~/teach", self._on_teach, qos_profile=CALLS)
        self._patient = PatientServices(self, lambda: True)
        self._server = ActionServer(
            self,
            Pick,
            "~/run",
            self._patient,
            begin=self._begin,
            # Only a goal that goes on is cancelled, and no two do.
            cancel=lambda _: self._picker.finish(RunEnd.CANCELED),
            end=lambda run: None if run.code is None else ENDS.get(run.code, GoalEnd.ABORTED),
            result=lambda run: Pick.Result(code=run.code, text=run.text, **self._counted(run)),
            feedback=lambda run: Pick.Feedback(**self._counted(run)),
        )
        self.cycle = Cycle(
            (*urgent, stop), PERIOD, self._cycle, may_end=self._may_end, end=self._end
        )

    def _use(self, values: Values) -> None:
        """Pick by these ``values`` from now on.

        Raises:
            KinematicsError: if they do not fit together.
        """
        self._values = values
        self._taught = taught_of(values)
        self._picker = picker_of(values)

    def _cycle(self) -> None:
        now, self._ahead = time.monotonic(), ahead_of_steady(self.get_clock())
        goal, transfer = self._goal, self._transfer
        if transfer is not None and transfer.outcome is None and goal is not None and goal.result:
            transfer.end(GoalCode(goal.result.code), goal.result.text)
        self._carry_out(self._picker.step(now, self._machine_now(now)))
        self._passed.clear()
        for event in self._picker.events:
            self._tell_event(event, now)
        self._picker.events.clear()
        self._look_at_run()
        self._server.look()
        self._server.answer()
        self._server.publish()
        self._patient.try_soon()
        if now >= self._told_at + TELLING_PERIOD:
            self._told_at = now
            self._tell(now)
            self._server.tell_progress()

    def _machine_now(self, now: float) -> Machine:
        """Return what the machine says of itself."""
        told, goal, passed = self._machine, self._goal, tuple(self._passed)
        if told is None or now > self._heard_at + LONGEST_SILENCE:
            return Machine(UNKNOWN, accepts=False, passed=passed)
        arrivals: tuple[float, ...] = ()
        if goal is not None and goal.feedback is not None and self._transfer is not None:
            arrivals = tuple(
                steady_time(stamp, self._ahead) - now if has_stamp(stamp) else math.inf
                for stamp in goal.feedback.arrivals
            )
        accepts = told.state in ACCEPTING
        position = self._position(now)
        return Machine(position, accepts, told.stops, arrivals, passed, self._holds)

    def _position(self, now: float) -> Vector3:
        """Return where the setpoints lead the platform now, as late as its drives are [m].

        NaN where that is not known.
        """
        motion = self._motion
        if motion is None or motion.commanded is None:
            return UNKNOWN
        dt = now + self._ahead - motion.stamp - self._values["drive_delay"]
        heights = (h + (v + a * dt / 2.0) * dt for h, v, a in zip(*motion.commanded))
        with suppress(KinematicsError):
            return self._kinematics.forward(three(heights))
        return UNKNOWN

    def _carry_out(self, wanted: TransferCommand | Renewal | GivingUp | None) -> None:
        """Do what the picker wants."""
        if isinstance(wanted, Renewal):
            message = StationState()
            self._stamp(message.header, wanted.seen)
            _write_motion(message, wanted.motion)
            self._stations.publish(message)
            self._picker.renewed(wanted)
        elif isinstance(wanted, GivingUp):
            if self._goal is not None:
                self._goal.cancel()
        elif wanted is not None:
            if not self._transfers.server_is_ready():
                wanted.end(GoalCode.SHUTDOWN, "ik_node does not offer transfers")
                return
            self._send(wanted)

    def _send(self, transfer: TransferCommand) -> None:
        """Send a ``transfer`` to ``ik_node``."""
        goal = Transfer.Goal(
            height=transfer.height,
            tolerance=transfer.tolerance,
            allowed=transfer.allowed,
            lifts=transfer.lifts,
        )
        self._stamp(goal.header, transfer.seen)
        if math.isfinite(transfer.leave_at):
            goal.leave_at = self._stamp_of(transfer.leave_at)
        for station in transfer.stations:
            told = TransferStation(dwell=station.dwell)
            _write_motion(told, station)
            for after, closes in station.outputs:
                told.output_times.append(after)
                told.outputs.append(self._output(closes=closes))
            goal.stations.append(told)
        self._transfer = transfer
        self._goal = SentGoal(self._transfers, goal)

    def _output(self, *, closes: bool) -> Output:
        values = self._values
        return Output(
            name=values["gripper_output"], number=values["gripper_number"], value=float(closes)
        )

    def _stamp(self, header: Any, then: float) -> None:
        header.frame_id = self._values["base_frame"]
        header.stamp = self._stamp_of(then)

    def _stamp_of(self, then: float) -> Any:
        """Return the time of the node's clock at a ``then`` of time.monotonic() [s]."""
        return Time(nanoseconds=max(round(1e9 * (then + self._ahead)), 1)).to_msg()

    def _made_at(self, header: Any) -> float:
        """Return when a message was made, by time.monotonic() [s].

        Raises:
            RefusedMessageError: if no clock is that wrong. A report of the belt from the future
                would hide all that come until then.
        """
        now = time.monotonic()
        if not has_stamp(header.stamp):
            return now
        made = steady_time(header.stamp, self._ahead)
        if -AHEAD <= now - made <= OLDEST:
            return made
        relation, most = ("behind", OLDEST) if made < now else ("ahead of", AHEAD)
        raise RefusedMessageError(
            f"the stamp is {number_text(abs(now - made))} s {relation} the clock of this "
            f"node, it must be at most {number_text(most)} s: are the clocks set alike?"
        )

    @contextmanager
    def _if_usable(self, what: str) -> Iterator[None]:
        """Log why a message cannot be used."""
        try:
            yield
        except KinematicsError as error:
            self._unusable.add(f"{what}: {error}")

    def _on_motion(self, data: bytes) -> None:
        self._motion = read_motion(data)

    def _on_belt(self, message: JointState) -> None:
        name = self._values["belt_joint"]
        with self._if_usable("belt_states"):
            positions = dict(zip(message.name, message.position))
            if name not in positions:
                raise RefusedMessageError(f"there is no position of the joint {name!r}")
            made, each = self._made_at(message.header), self._values["metres_per_count"]
            self._picker.report(made, each * positions[name])

    def _on_parts(self, message: SeenParts) -> None:
        name, count = message.header.frame_id, len(message.parts)
        with self._if_usable("seen_parts"):
            camera = self._taught.cameras.get(name)
            if camera is None:
                names = " or ".join(map(repr, self._taught.cameras))
                raise RefusedMessageError(f"they are in the frame {name!r}, it must be {names}")
            made = self._made_at(message.header)
            self._keep_view(message, made)
            if count > MOST_PARTS:
                self._unusable.add(f"{count} parts in a picture: the first {MOST_PARTS} count")
            then = made - camera.latency
            for part in message.parts[:MOST_PARTS]:
                with self._if_usable("a part of seen_parts"):
                    seen = three(finite_vector("place", vector_of(part.position), 3))
                    angle, place = finite("angle", part.angle), camera.place_of(seen)
                    self._picker.see(Sighting(then, place, part.kind, part.id, angle, name))

    def _keep_view(self, message: SeenParts, then: float) -> None:
        """Keep a picture with one part ``then`` [s], as that may be taught by."""
        belt = self._picker.belt_at(then)
        if belt is not None and len(message.parts) == 1:
            each = self._values["metres_per_count"]
            place = vector_of(message.parts[0].position)
            observed = Observed(place, belt.position / each, belt.velocity / each)
            self._lessons.see(View(message.header.frame_id, then, observed))

    def _on_output(self, message: Output) -> None:
        values = self._values
        if (message.name, message.number) == (values["gripper_output"], values["gripper_number"]):
            self._passed.append(message.value != 0.0)

    def _on_machine(self, message: MachineState) -> None:
        self._machine, self._heard_at = message, time.monotonic()

    def _on_held(self, message: Bool) -> None:
        self._holds = message.data

    def _on_stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        response.message = "begins no other part" if self._picker.is_running else "no run goes on"
        if self._run.code is None:
            self._picker.finish(RunEnd.STOPPED)
        return response

    def _on_teach(
        self, request: TeachPick.Request, response: TeachPick.Response
    ) -> TeachPick.Response:
        try:
            response.message = self._teach(request)
            response.success = True
        except (KinematicsError, OSError) as error:
            response.message = str(error)
        return response

    def _teach(self, request: TeachPick.Request) -> str:
        """Take one more lesson, use and keep what is known by it, and return that in words.

        Raises:
            KinematicsError: if it is not enough yet, does not fit, or cannot be just now.
        """
        if self._run.code is None:
            raise RefusedMessageError("nothing is taught while a run goes on")
        machine, now = self._machine, time.monotonic()
        platform = None
        if machine is not None and machine.state in RESTING:
            platform = vector_of(machine.position)
        scene = Scene(now, platform, self._picker.belt_at(now), vector_of(request.mark))
        taught, text = self._lessons.teach(request.what, self._taught, scene)
        if taught is not self._taught:
            self._use({**self._values, **taught_values(taught)})
            keep_taught(self._values, self._file)
        return text

    def _begin(self, request: Pick.Goal) -> _Run:
        before = dict(self._counts)
        if self._has_ended:
            return _Run(before, Pick.Result.SHUTDOWN, NODE_ENDS)
        if self._run.code is None or self._picker.is_running:
            return _Run(before, Pick.Result.REFUSED, "a run goes on already")
        now, told = time.monotonic(), self._machine
        if not self._machine_now(now).accepts:
            text = "the machine takes no commands"
            if told is None or now > self._heard_at + LONGEST_SILENCE:
                text = f"no machine_state was heard for {LONGEST_SILENCE:g} s"
            return _Run(before, Pick.Result.REFUSED, text)
        try:
            self._picker.run(is_emptied=request.is_emptied, count=request.count)
        except KinematicsError as error:
            return _Run(before, Pick.Result.REFUSED, str(error))
        self._run = _Run(before)
        return self._run

    def _look_at_run(self) -> None:
        """End the run that is over."""
        run, end = self._run, self._picker.end
        if run.code is None and end is not None:
            run.code, run.text = CODES.get(end, Pick.Result.FAILED), self._picker.text

    def _counted(self, run: _Run) -> dict[str, int]:
        return {name: count - run.before[name] for name, count in self._counts.items()}

    def _tell_event(self, event: PartEvent, now: float) -> None:
        part = event.part
        assert part.outcome is not None
        self._counts[COUNTED[part.outcome]] += 1
        message = PartEventMessage(
            part=part.number,
            kind=part.kind,
            outcome=int(part.outcome),
            text=part.text,
            grip_error=event.error,
        )
        self._stamp(message.header, now)
        message.seen = self._stamp_of(part.views[0].time)
        if math.isfinite(event.gripped):
            message.gripped = self._stamp_of(event.gripped)
        if part.outcome is PartOutcome.PLACED:
            message.placed = message.header.stamp
        self._events.publish(message)
        self.get_logger().info(f"part {part.number}: {part.text}")

    def _tell(self, now: float) -> None:
        """Tell what is done, and what is known."""
        message = PickState(
            running=self._picker.is_running,
            doing=self._picker.text,
            target=self._picker.target,
            **self._counts,
        )
        self._stamp(message.header, now)
        belt = self._picker.belt_at(now)
        if belt is not None:
            message.belt_position, message.belt_velocity = belt.position, belt.velocity
            for part in self._picker.parts_on_belt:
                x, y, z = combined(1.0, part.position, belt.position, self._taught.belt.direction)
                message.parts.append(part.number)
                message.positions.append(Point(x=x, y=y, z=z))
        self._states.publish(message)

    def _may_end(self) -> bool:
        """End the run; what is on its way to its place is placed."""
        if not self._has_ended:
            self._has_ended = True
            self._picker.finish(RunEnd.SHUTDOWN)
        return not self._picker.is_running

    def _end(self) -> None:
        if self._run.code is None:
            self._run.code, self._run.text = Pick.Result.SHUTDOWN, NODE_ENDS
        self._server.answer()
        self._patient.end()


def _check(values: Values) -> None:
    machine_of(values)
    taught_of(values)
    picker_of(values)


def _write_motion(message: Any, motion: Station) -> None:
    """Write a place, and how it moves, into a message."""
    for vector, numbers in (
        (message.position, motion.position),
        (message.velocity, motion.velocity),
        (message.acceleration, motion.acceleration),
    ):
        vector.x, vector.y, vector.z = numbers
