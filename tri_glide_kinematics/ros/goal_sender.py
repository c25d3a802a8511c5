"""The machine of an ``ik_node``, as who sends it goals sees it, and as programs run on it."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from time import monotonic
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.node import Node

from tri_glide_interfaces.action import FollowPath, MoveTo
from tri_glide_interfaces.msg import MachineState
from tri_glide_interfaces.msg import Output as OutputMessage
from tri_glide_interfaces.msg import ProgramRun as RunMessage
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.motion.path import FlatPath
from tri_glide_kinematics.programs import (
    GoalEnd,
    GoalProgress,
    KeptLine,
    MachineNow,
    Output,
    RunNews,
    RunState,
)
from tri_glide_kinematics.ros.cdr import read_kinds_within_bytes
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS, vector_of
from tri_glide_kinematics.ros.outputs import LATCHED, state_of
from tri_glide_kinematics.vectors import Vector3


class SentGoal:
    """A goal that was sent, and what has been told about it so far.

    Attributes:
        feedback: the newest; None before the first.
        result: None until it is there.
        status: of ``GoalStatus``, when the result is there.
    """

    def __init__(self, client: ActionClient, goal: Any) -> None:
        """Send a ``goal``."""
        self.feedback: Any = None
        self.result: Any = None
        self.status = GoalStatus.STATUS_UNKNOWN
        self._handle: Any = None
        self._is_cancelled = False
        client.send_goal_async(goal, self._on_feedback).add_done_callback(self._on_answer)

    @property
    def has_succeeded(self) -> bool:
        """Whether it has ended as it should."""
        return bool(self.status == GoalStatus.STATUS_SUCCEEDED)

    @property
    def progress(self) -> GoalProgress | None:
        """The newest feedback as numbers; None before the first."""
        told = self.feedback
        if told is None:
            return None
        progress = GoalProgress(vector_of(told.position), told.way_remaining, told.time_remaining)
        if isinstance(told, FollowPath.Feedback):
            progress = progress._replace(way=told.way, segment=told.segment)
        return progress

    @property
    def end(self) -> GoalEnd | None:
        """The result as numbers; None until it is there."""
        result = self.result
        if result is None:
            return None
        end = GoalEnd(GoalCode(result.code), result.text, vector_of(result.position))
        if isinstance(result, FollowPath.Result):
            end = end._replace(deviation=result.largest_deviation)
        return end

    def cancel(self) -> None:
        """Ask for a stop; the result tells when the platform rests."""
        self._is_cancelled = True
        if self._handle is not None:
            self._handle.cancel_goal_async()

    def _on_feedback(self, message: Any) -> None:
        self.feedback = message.feedback

    def _on_answer(self, future: Any) -> None:
        # A goal that cannot be is accepted and aborted with the reason: there is always a result.
        self._handle = future.result()
        self._handle.get_result_async().add_done_callback(self._on_result)
        if self._is_cancelled:
            self.cancel()

    def _on_result(self, future: Any) -> None:
        response = future.result()
        self.status, self.result = response.status, response.result


class GoalSender:
    """Sends goals to the ``ik_node`` in the namespace of a node.

    Attributes:
        server: full name of that ``ik_node``.
    """

    def __init__(self, node: Node) -> None:
        """Look for the actions as a part of ``node``."""
        self.server = node.get_namespace().rstrip("/") + "/ik_node"
        self._node = node
        for made_of in (MoveTo.Impl, FollowPath.Impl):
            services = made_of.SendGoalService, made_of.CancelGoalService, made_of.GetResultService
            read_kinds_within_bytes(service.Response for service in services)
        self._move_to = ActionClient(node, MoveTo, "ik_node/move_to")
        self._follow_path = ActionClient(node, FollowPath, "ik_node/follow_path")

    @property
    def is_ready(self) -> bool:
        """Whether there is somebody who offers the actions."""
        return self._move_to.server_is_ready() and self._follow_path.server_is_ready()

    @property
    def identities(self) -> frozenset[bytes]:
        """Identifiers of those that publish the state of ``ik_node``.

        One that was started anew is another one. One that was killed is seen for a while beside it.
        """
        publishers = self._node.get_publishers_info_by_topic("ik_node/machine_state")
        return frozenset(bytes(each.endpoint_gid) for each in publishers)

    def move_to(
        self, position: Vector3, frame: str = "", speed: float = 0.0, kind: str = ""
    ) -> SentGoal:
        """Go to a ``position`` [m]; in the frame of the machine, if none is named.

        With a ``speed`` [m/s], the platform goes there on a straight line, no faster than that. The
        ``kind`` is "linear" or "slider"; empty for that of ``ik_node``.
        """
        goal = MoveTo.Goal(speed=speed, kind=kind)
        goal.pose.header.frame_id = frame
        point = goal.pose.pose.position
        point.x, point.y, point.z = position
        return SentGoal(self._move_to, goal)

    def follow(self, path: FlatPath, frame: str = "", outputs: Sequence[Output] = ()) -> SentGoal:
        """Go along a ``path`` from where the platform is; ``outputs`` change at its joints."""
        goal = FollowPath.Goal()
        goal.header.frame_id = frame
        goal.kinds = array("B", path.kinds.tobytes())
        goal.numbers = array("d", path.numbers.tobytes())
        goal.tolerances = array("d", path.tolerances.tobytes())
        goal.speeds = array("d", np.where(np.isfinite(path.speeds), path.speeds, 0.0).tobytes())
        goal.output_segments = [output.joint for output in outputs]
        goal.outputs = [output_message(output) for output in outputs]
        return SentGoal(self._follow_path, goal)


def output_message(output: Output) -> OutputMessage:
    """Return the message of an ``output`` that changes."""
    return OutputMessage(name=output.name, number=output.number, value=float(output.value))


# After this time without a word a run is shown as gone [s].
GONE = 1.0

RUN_STATES = {
    RunState.RUNNING: RunMessage.RUNNING,
    RunState.WAITING: RunMessage.WAITING,
    RunState.STOPPING: RunMessage.STOPPING,
    RunState.ENDED: RunMessage.ENDED,
}


class ProgramLink(GoalSender):
    """A ``ProgramMachine``: goals, outputs, and the state of the machine; made once for a node.

    Attributes:
        machine: its newest state; None before the first.
        other: what was told last of a run that somebody else drives, or drove until that was gone;
            None if there is none.
    """

    def __init__(self, node: Node) -> None:
        """Run programs as a part of ``node``."""
        super().__init__(node)
        self.machine: MachineState | None = None
        self.other: RunMessage | None = None
        self._heard_at, self._own_run = 0.0, 0
        self._runs = node.create_publisher(RunMessage, "program_run", 10)
        node.create_subscription(RunMessage, "program_run", self._take_run, 10)
        self._outputs = node.create_publisher(OutputMessage, "outputs", LATEST_OUTPUTS)
        node.create_subscription(MachineState, "ik_node/machine_state", self._take, LATCHED)

    @property
    def now(self) -> MachineNow | None:
        """What the machine does; None before it has told it."""
        told = self.machine
        if told is None:
            return None
        place = vector_of(told.position)
        return MachineNow(state_of(told), told.stops, told.speed, place, told.segment)

    @property
    def has_delivered(self) -> bool:
        """Whether all outputs and news have arrived."""
        return all(each.wait_for_all_acked(Duration()) for each in (self._outputs, self._runs))

    @property
    def other_goes_on(self) -> bool:
        """Whether somebody else drives a run now."""
        return self.other is not None and monotonic() - self._heard_at <= GONE

    @property
    def taken_by(self) -> str:
        """Which run somebody else drives now, in words; empty if there is none."""
        other = self.other
        if other is None or not self.other_goes_on:
            return ""
        return f"{other.driver} runs {other.file}"

    def find(self, kept: KeptLine) -> None:
        """Take up a run that was kept: it may go on if it was not kept as one that has ended."""
        if kept.state is not RunState.ENDED:
            self.other = RunMessage(driver="another node", file=kept.program, line=kept.line)
            self._heard_at = monotonic()

    def tell(self, news: RunNews) -> None:
        """Tell all who listen what a run does."""
        self._own_run = news.number
        if not self.other_goes_on:
            self.other = None
        message = RunMessage(
            run=news.number,
            driver=self._node.get_name(),
            file=news.file,
            line=news.line,
            lines=news.lines,
            state=RUN_STATES[news.state],
            doing=news.doing,
            safe_outputs=[output_message(output) for output in news.safe_outputs],
        )
        self._runs.publish(message)

    def put_out(self, output: Output) -> None:
        """Change an output, now."""
        self._outputs.publish(output_message(output))

    def _take(self, message: MachineState) -> None:
        self.machine = message

    def _take_run(self, message: RunMessage) -> None:
        if message.run != self._own_run:
            has_ended = message.state == RunMessage.ENDED
            self.other, self._heard_at = None if has_ended else message, monotonic()
