"""The machine of the page: what is known of it, where it is, and where the operator sends it."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import IDLE, JOGGING, MOVING, Cause
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.panel.link import NAMES, NOBODY, Feeds, MachineFacts
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.words import READY, WARNING, outside_text, place_text, position_text
from tri_glide_kinematics.ros.goal_sender import SentGoal
from tri_glide_kinematics.ros.messages import vector_of
from tri_glide_kinematics.vectors import Vector3, plus


@dataclass(frozen=True)
class Pose:
    """The heights of a machine's carriages and the position of its platform. Shapes (3,) [m]."""

    heights: Vector3
    position: Vector3


@lru_cache(maxsize=4)
def pose_of(heights: Vector3 | None, facts: MachineFacts) -> Pose | None:
    """Return where a machine is by its true heights [m]; None if that is not known."""
    if heights is None:
        return None
    try:
        return Pose(heights, facts.machine.forward(heights))
    except KinematicsError:
        return None


# Until a step that was sent is seen as a motion [s].
STEP_PATIENCE = 0.5
LOOK_PERIOD = 0.5  # s between two looks whether ik_node is there
PATIENCE = 5.0  # s after which it is asked again
# Refusals that are about the place that was asked for.
PLACE_REFUSALS = (MachineState.REFUSAL_UNREACHABLE, MachineState.REFUSAL_OUTSIDE_WORKSPACE)


class ShownMachine:
    """The machine that the page shows and drives.

    Attributes:
        link: to it.
        feeds: what it tells.
        facts: what its parameters tell; None while no machine is known. Others are another object.
    """

    def __init__(self, node: Node, requests: OperatorRequests) -> None:
        """Hear it as a part of ``node``; it is known some time later."""
        self.link = requests.link
        self.feeds = Feeds(node, self.link.server)
        self.facts: MachineFacts | None = None
        self._requests = requests
        self._identity = NOBODY
        self._look_pace, self._ask_pace = Pace(LOOK_PERIOD), Pace(PATIENCE)
        self._has_jogged = False
        # Where the last step leads to, None if that counts no more [m], and when it was sent [s].
        self._step_to: Vector3 | None = None
        self._stepped_at = -math.inf
        # The newest goal that was sent and has not ended, and its place; None for that of a path.
        self._goal: SentGoal | None = None
        self._asked: Vector3 | None = None
        self._state: object = None
        self._refused = 0
        requests.on_stop.append(self.stop)
        node.create_subscription(ParameterEvent, "/parameter_events", self._on_parameters, 100)

    def step(self) -> None:
        """Take in what it has told since the last frame."""
        if self._look_pace.is_due():
            self._look()
        self._look_for_refusals()
        self._look_for_ends()
        self._look_for_teach_mode()

    def stop(self) -> None:
        """Go on with nothing: the machine was told to stop."""
        self._step_to = None
        if self._goal is not None and self._goal.result is None:
            self._goal.cancel()

    # What is known of it

    def _look(self) -> None:
        """Ask for the machine when it appears, and forget it when it is gone or another one."""
        identity = self.link.identity
        if identity != self._identity:
            self._identity = identity
            self._forget()
        if identity and self.facts is None and self._ask_pace.is_due():
            self.link.ask_for_facts(
                lambda facts: self._take(facts) if identity == self._identity else None
            )

    def _forget(self) -> None:
        self.facts = None
        self._ask_pace.hurry()
        self.feeds.motion.forget()
        self._step_to = self._goal = None
        self._requests.end_hold()

    def _take(self, facts: MachineFacts) -> None:
        self.facts = facts.with_teach_mode(self.feeds.status.message.teach_mode)
        self._requests.follow_twist_timeout(facts.values["twist_timeout"])

    def _on_parameters(self, event: ParameterEvent) -> None:
        if self.facts is not None and event.node == self.link.server:
            changed = {
                each.name: parameter_value_to_python(each.value)
                for each in event.changed_parameters
                if each.name in NAMES
            }
            self.facts = self.facts.with_changes(changed)
            self._requests.follow_twist_timeout(self.facts.values["twist_timeout"])

    def _look_for_refusals(self) -> None:
        if self._goal is not None and (result := self._goal.result) is not None:
            self._goal = None
            if result.code == GoalCode.NOT_REACHED:
                measured = place_text(vector_of(result.position))
                self._requests.refuse(f"not reached: the platform is measured at {measured}")
        status = self.feeds.status
        message = status.message
        if message.refused > self._refused:
            self._requests.refuse(self._place_words() or status.refusal, message.refusal_text)
            self._requests.end_hold()
        self._refused = message.refused

    def _place_words(self) -> str | None:
        """Return why the place cannot be that was asked for here, if that was refused."""
        asked, self._asked = self._asked, None
        if self.facts is None or asked is None:
            return None
        if self.feeds.status.message.refusal not in PLACE_REFUSALS:
            return None
        return outside_text(self.facts.workspace, asked)

    def _look_for_ends(self) -> None:
        """Let nothing go on by itself that somebody else has ended.

        A jog whose messages were late for a moment, as a busy browser sends them, was not ended.
        One that was released has ended, too, but by then another button may be held.
        """
        status = self.feeds.status
        if status.state is JOGGING:
            self._has_jogged = True
        elif self._has_jogged and status.cause not in (Cause.TWISTS_SILENT, Cause.RELEASED):
            self._has_jogged = False
            self._requests.end_hold()
        if status.state not in (IDLE, MOVING):
            self._step_to = None
        state = (status.state, status.cause)
        if self.facts is not None and status.state is not None and state != self._state:
            self._state = state
            text = ": ".join(filter(None, (status.word, self.reason)))
            self._requests.history.add(status.color, text, status.message.reason)

    def _look_for_teach_mode(self) -> None:
        """Take it over as the machine tells it, whoever has switched it."""
        is_teaching = self.feeds.status.message.teach_mode
        if self.facts is not None and is_teaching != self.facts.is_teaching:
            self.facts = self.facts.with_teach_mode(is_teaching)
            color, words = (WARNING, "on") if is_teaching else (READY, "off")
            self._requests.history.add(color, f"the teach mode is {words}")

    # What it does, and where it is

    @property
    def is_heard(self) -> bool:
        """Whether it is known what it does now."""
        return self.facts is not None and not self.feeds.is_silent

    @property
    def moves(self) -> bool:
        """Whether it is commanded to move."""
        setpoint = self.feeds.motion.commanded
        is_moving = self.feeds.status.message.speed > 0.0
        return is_moving or (setpoint is not None and any(setpoint.velocities))

    @property
    def reason(self) -> str:
        """Why it is in its state, in words."""
        return self.feeds.status.reason(self.facts.values if self.facts is not None else {})

    @property
    def place(self) -> Vector3 | None:
        """Where the platform is led, or else measured; None if nobody tells it now [m]."""
        return (self.feeds.status.place or self.measured_position) if self.is_heard else None

    @property
    def measured_position(self) -> Vector3 | None:
        """Where the platform is measured; None if that is not known [m]."""
        return self._position(self.feeds.motion.measured)

    @property
    def commanded_position(self) -> Vector3 | None:
        """Where the platform is commanded to be; None if that is not known [m]."""
        setpoint = self.feeds.motion.commanded
        return self._position(setpoint.heights if setpoint is not None else None)

    @property
    def measured_text(self) -> str:
        """Where the platform is measured, or was, where no setpoint says where it is led."""
        motion = self.feeds.motion
        position = self._position(motion.measured_last)
        if position is None:
            return ""
        when = "measured" if motion.measured else "when last measured"
        return f"{position_text(position)} {when}"

    def _position(self, heights: Vector3 | None) -> Vector3 | None:
        pose = pose_of(heights, self.facts) if self.facts is not None else None
        return pose.position if pose is not None else None

    # Where it is sent

    def move_to(self, position: Vector3, speed: float) -> None:
        """Go to a ``position`` [m], at a ``speed`` [m/s], 0 for what the sliders can do.

        Raises:
            KinematicsError: if it is not known which machine this is, as of all that sends it.
        """
        self._check_known()
        self._go(position, speed)

    def move_by(self, step: Vector3, speed: float) -> None:
        """Go on by a step [m], from where the last one leads to if it is not there yet.

        If something else has come in between, the step begins where the platform is: it must not
        lead to where nobody wants it to go any more.
        """
        last = self._step_to
        self._check_known()
        is_on_way = self._goal is not None and self._goal.result is None
        is_seen = self.feeds.status.state is MOVING
        is_new = time.monotonic() - self._stepped_at < STEP_PATIENCE
        start = last if is_on_way and (is_seen or is_new) else None
        start = start or self.commanded_position
        if start is None:
            raise KinematicsError("no step: the position of the platform is not known")
        self._step_to, self._stepped_at = plus(start, step), time.monotonic()
        self._go(self._step_to, speed)

    def follow(self, points: Sequence[Vector3], tolerance: float, speed: float) -> None:
        """Go through ``points``, at corners within a ``tolerance`` [m], at a ``speed`` [m/s]."""
        self._check_known()
        numbers = [number for point in points for number in point]
        path = FlatPath.of([SegmentKind.LINE] * len(points), numbers, [], [speed], tolerance)
        self._goal, self._asked = self.link.programs.follow(path), None

    def _go(self, position: Vector3, speed: float) -> None:
        self._goal = self.link.programs.move_to(position, speed=speed)
        self._asked = position

    def _check_known(self) -> None:
        """Check that the machine is the one that is shown; the last step counts no more."""
        self._step_to = None
        self._look()
        if self.facts is None:
            raise KinematicsError(f"nothing done: {self.link.server} has not told its target yet")
