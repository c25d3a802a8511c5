"""Serves an action from a control cycle: it is asked in each cycle, and never waits.

rclpy's own action server runs each goal as a coroutine of an executor, has no place where answers
can wait for clients that are not fully discovered, and with each step of a goal it tells the states
of all goals of the last 15 minutes. What is the same: names, messages, states.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from time import monotonic
from typing import Any, TypeVar

from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_action_status_default
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.type_support import check_for_type_support

from tri_glide_kinematics.ros.cdr import read_kinds_within_bytes
from tri_glide_kinematics.ros.loop import ErrorLog
from tri_glide_kinematics.ros.serving.patient_services import CALLS, PatientServices

# How long [s], and how many.
KEPT = 900.0
MOST = 2000


class OldResults:
    """The newest results, by the identifiers of their goals.

    They are kept as bytes. As messages, 2000 of them are so many objects that the collector of
    garbage, which looks at them all now and then, takes several cycles for it.
    """

    def __init__(self, kind: Any) -> None:
        """Keep none yet.

        Args:
            kind: of message.
        """
        self._kind = kind
        self._kept: dict[bytes, bytes] = {}
        # When each was added, by time.monotonic() [s].
        self._added: dict[bytes, float] = {}

    def add(self, key: bytes, result: Any) -> None:
        """Keep the ``result`` of the goal with the identifier ``key``."""
        self._kept[key] = serialize_message(result)
        self._added[key] = time.monotonic()

    def get(self, key: bytes) -> Any:
        """Return the result of a goal; None if it is not kept."""
        data = self._kept.get(key)
        return None if data is None else deserialize_message(data, self._kind)

    def __contains__(self, key: bytes) -> bool:
        """Tell whether the result of a goal is kept."""
        return key in self._kept

    def forget(self) -> None:
        """Forget those that are too old or too many."""
        oldest = time.monotonic() - KEPT
        while self._added:
            key, added = next(iter(self._added.items()))
            if added >= oldest and len(self._added) <= MOST:
                return
            del self._added[key], self._kept[key]


# How long the state of a goal that has ended is told with those of the others [s]. It is told when
# it ends, and for this time again with each change of another, as a message may be lost. All of
# them are in each message, and a client in Python takes 0.03 ms for each.
STATE_TOLD = 0.25

# A goal as the caller of a server knows it.
Goal = TypeVar("Goal")

FEEDBACK = QoSProfile(depth=10)

GoalEvent = rclpy_implementation.GoalEvent


class GoalEnd(Enum):
    """How a goal ended, as all actions tell it."""

    SUCCEEDED = GoalEvent.SUCCEED
    CANCELED = GoalEvent.CANCELED
    ABORTED = GoalEvent.ABORT


@dataclass(eq=False)
class _Accepted:
    """A goal, until its state is told no more.

    Attributes:
        info: identifier and time of acceptance.
        handle: its state in the middleware.
        goal: as the caller of the server knows it.
        answer: its result, once that is known.
        askers: who wait for the result, and since when at most [s of time.monotonic].
        was_asked_for: whether somebody has asked for the result.
    """

    info: GoalInfo
    handle: Any
    goal: Any
    answer: Any = None
    askers: list[tuple[Any, float]] = field(default_factory=list)
    was_asked_for: bool = False


class ActionServer:
    """An action of a node: ``look``, ``answer``, ``publish`` and ``tell_progress`` serve it."""

    def __init__(
        self,
        node: Node,
        kind: Any,
        name: str,
        patient: PatientServices,
        *,
        begin: Callable[[Any], Goal],
        cancel: Callable[[Goal], None],
        end: Callable[[Goal], GoalEnd | None],
        result: Callable[[Any], Any],
        feedback: Callable[[Any], Any],
    ) -> None:
        """Serve an action.

        Args:
            node: that offers it.
            kind: of action.
            name: of the action.
            patient: sends answers.
            begin: makes a goal of what was asked for, which has ended already if it cannot be.
            cancel: sees to it that a goal ends soon.
            end: tells how a goal ended; None as long as it goes on.
            result: makes the message of a goal that has ended.
            feedback: makes the message of a goal that goes on; None if there is nothing to tell.
        """
        check_for_type_support(kind)
        self._node = node
        self._impl = kind.Impl
        self._patient = patient
        self._errors = ErrorLog(node)
        self._begin = begin
        self._cancel = cancel
        self._end = end
        self._result = result
        self._feedback = feedback
        services = CALLS.get_c_qos_profile()
        with node.handle, node.get_clock().handle:
            self._handle = rclpy_implementation.ActionServer(
                node.handle,
                node.get_clock().handle,
                kind,
                name,
                services,
                services,
                services,
                FEEDBACK.get_c_qos_profile(),
                qos_profile_action_status_default.get_c_qos_profile(),
                STATE_TOLD,
            )
        self._names = {
            service: node.resolve_service_name(f"{name}/_action/{service}")
            for service in ("send_goal", "cancel_goal", "get_result")
        }
        self._accepted: dict[bytes, _Accepted] = {}
        self._old = OldResults(self._impl.GetResultService.Response)
        self._active: list[_Accepted] = []
        self._answers: list[tuple[str, Callable[[], object], float]] = []
        self._to_be_told: deque[_Accepted] = deque()
        self._is_status_new = False
        # How many goals that have ended are told of.
        self._told = 0
        self._takers: tuple[tuple[Any, type, Callable[[Any, Any, float], None]], ...] = (
            (self._handle.take_goal_request, self._impl.SendGoalService.Request, self._on_goal),
            (
                self._handle.take_cancel_request,
                self._impl.CancelGoalService.Request,
                self._on_cancel,
            ),
            (
                self._handle.take_result_request,
                self._impl.GetResultService.Request,
                self._on_result_wanted,
            ),
        )
        read_kinds_within_bytes(request for _, request, _ in self._takers)
        # When there was last no request of each kind [s of time.monotonic].
        self._none_at = [0.0 for _ in self._takers]

    def look(self) -> bool:
        """Take one request of each kind and act on them; return whether there were any.

        Answers wait.
        """
        found = False
        for index, (take, kind, handle) in enumerate(self._takers):
            try:
                now = monotonic()
                header, request = take(kind)
                if header is None:
                    self._none_at[index] = now
                else:
                    found = True
                    handle(header, request, self._none_at[index])
            except Exception as error:
                # The sender's mistake must not stop a machine.
                self._errors.add(error)
        return found

    def answer(self) -> None:
        """Give all answers, and the results of the goals that have ended."""
        if self._active or self._answers:
            self._give_answers()
            self._end_goals()
            self._give_answers()

    def publish(self) -> None:
        """Publish the states of the goals if there are new ones, and feedback of one goal.

        To be called once in a cycle: the states of all goals take a client longer to read than an
        answer does.
        """
        if self._is_status_new:
            self._is_status_new = False
            self._handle.publish_status()
        if self._to_be_told:
            self._tell_next()

    @property
    def is_asked_for_all(self) -> bool:
        """Whether somebody has asked for the result of each goal whose state is told."""
        return all(accepted.was_asked_for for accepted in self._accepted.values())

    def tell_progress(self) -> None:
        """Let the feedback of all goals that go on be published, and forget old results."""
        if not self._to_be_told:
            self._to_be_told.extend(self._active)
        self._forget()

    def _tell_next(self) -> None:
        """Publish the feedback of one goal: of many at once it would hold the cycle."""
        accepted = self._to_be_told.popleft()
        feedback = self._feedback(accepted.goal) if self._end(accepted.goal) is None else None
        if feedback is not None:
            message = self._impl.FeedbackMessage(goal_id=accepted.info.goal_id, feedback=feedback)
            self._handle.publish_feedback(message)

    def _on_goal(self, header: Any, request: Any, since: float) -> None:
        # A goal is rejected only if it is known already. One that cannot be carried out is told by
        # a result, as a rejection has no place for a reason.
        info = GoalInfo(goal_id=request.goal_id)
        key = bytes(info.goal_id.uuid)
        accepted = key not in self._accepted and key not in self._old
        if accepted:
            info.stamp = self._node.get_clock().now().to_msg()
            try:
                self._accept(info, self._begin(request.goal))
            except Exception as error:
                self._errors.add(error)
                accepted = False
        # A client that sends goals will soon ask for results.
        self._patient.expect(self._names["get_result"])
        response = self._impl.SendGoalService.Response(accepted=accepted, stamp=info.stamp)
        self._put("send_goal", self._handle.send_goal_response, header, since, response)

    def _accept(self, info: GoalInfo, goal: Any) -> None:
        handle = rclpy_implementation.ActionGoalHandle(self._handle, info)
        handle.update_goal_state(GoalEvent.EXECUTE)
        accepted = _Accepted(info, handle, goal)
        self._accepted[bytes(info.goal_id.uuid)] = accepted
        self._active.append(accepted)
        self._is_status_new = True

    def _on_cancel(self, header: Any, request: Any, since: float) -> None:
        response = self._handle.process_cancel_request(
            request, self._impl.CancelGoalService.Response
        )
        canceling = []
        for info in response.goals_canceling:
            accepted = self._accepted[bytes(info.goal_id.uuid)]
            if self._end(accepted.goal) is None:
                canceling.append(info)
                accepted.handle.update_goal_state(GoalEvent.CANCEL_GOAL)
                self._cancel(accepted.goal)
        if response.goals_canceling and not canceling:
            response.return_code = CancelGoal.Response.ERROR_GOAL_TERMINATED
        response.goals_canceling = canceling
        self._is_status_new = bool(canceling) or self._is_status_new
        self._put("cancel_goal", self._handle.send_cancel_response, header, since, response)

    def _on_result_wanted(self, header: Any, request: Any, since: float) -> None:
        key = bytes(request.goal_id.uuid)
        accepted = self._accepted.get(key)
        if accepted is None:
            unknown = self._impl.GetResultService.Response(status=GoalStatus.STATUS_UNKNOWN)
            answer = self._old.get(key) or unknown
        else:
            accepted.was_asked_for = True
            answer = accepted.answer
            if answer is None:
                accepted.askers.append((header, since))
                self._patient.expect(self._names["get_result"])
                return
        self._put("get_result", self._handle.send_result_response, header, since, answer)

    def _end_goals(self) -> None:
        ends = [(accepted, self._end(accepted.goal)) for accepted in self._active]
        ended = [(accepted, end) for accepted, end in ends if end is not None]
        if not ended:
            return
        self._active = [accepted for accepted, end in ends if end is None]
        self._told += len(ended)
        for accepted, end in ended:
            accepted.handle.update_goal_state(end.value)
            accepted.answer = self._impl.GetResultService.Response(
                status=accepted.handle.get_status(), result=self._result(accepted.goal)
            )
            for header, since in accepted.askers:
                send = self._handle.send_result_response
                self._put("get_result", send, header, since, accepted.answer)
            accepted.askers.clear()
        self._handle.notify_goal_done()
        self._is_status_new = True

    def _give_answers(self) -> None:
        answers, self._answers = self._answers, []
        known: dict[str, bool] = {}
        for service, give, since in answers:
            try:
                self._patient.send(service, give, since, known)
            except Exception as error:
                self._errors.add(error)

    def _forget(self) -> None:
        """Tell no more of goals that ended some time ago, and forget old results."""
        if self._told:
            for info in self._handle.expire_goals(self._told):
                key = bytes(info.goal_id.uuid)
                expired = self._accepted.pop(key)
                expired.handle.destroy_when_not_in_use()
                self._old.add(key, expired.answer)
                self._told -= 1
        self._old.forget()

    def _put(
        self,
        service: str,
        send: Callable[[Any, Any], None],
        header: Any,
        since: float,
        response: Any,
    ) -> None:
        """Let an answer wait until there is time for it."""
        self._answers.append((self._names[service], partial(send, header, response), since))
