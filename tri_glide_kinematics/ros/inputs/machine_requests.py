"""Requests to a node that moves a machine, by services or actions."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from geometry_msgs.msg import Point
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidServiceNameException
from rclpy.node import Node
from rclpy.time import Time
from std_srvs.srv import SetBool, Trigger

from tri_glide_interfaces.action import FollowPath, MoveTo, Transfer
from tri_glide_kinematics.checks import finite
from tri_glide_kinematics.control import CommandRefusedError, MotionController
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, Refusal
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine import Command, Follow, GoalCode
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.motion.path import (
    LARGEST_SPEED,
    LEAST_SPEED,
    SHORTEST,
    FlatPath,
    PlatformPath,
    SegmentKind,
    polyline_from,
)
from tri_glide_kinematics.reason_log import RefusalLog
from tri_glide_kinematics.ros.inputs.path_messages import flat_path, path_outputs, path_points
from tri_glide_kinematics.ros.inputs.transfer_messages import arrival_stamps, transfer_of
from tri_glide_kinematics.ros.messages import pose_numbers, target_position
from tri_glide_kinematics.ros.outputs import StateReports
from tri_glide_kinematics.ros.serving import CALLS, ActionServer, GoalEnd, PatientServices
from tri_glide_kinematics.tri_glide import NoPoseError, TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text, vector_text

# The enable service of the drives: asked first when the machine is enabled, and last afterwards.
#
# It is never waited for in the cycle: who waits is a coroutine, which the executor goes on with in
# its turns (a sleep of no time is all that it knows of asyncio).

# The drives answer within 5 s, or say why they do not do it [s].
ANSWER_TIME = 6.0
# Once they have torque, heights are measured within this time [s].
HEIGHTS_TIME = 2.0


class DrivesRefusedError(KinematicsError):
    """The drives do not do what they are asked for."""


class DrivesEnable:
    """Gives the drives torque and takes it away, by their service.

    Attributes:
        group: of callbacks that may wait for an answer while others run.
    """

    def __init__(self, node: Node, name: str, tell: Callable[[str], object]) -> None:
        """Ask the service with this ``name``; ``tell`` gets why torque was not taken away.

        Raises:
            DrivesRefusedError: if no service can have this name.
        """
        self.group = ReentrantCallbackGroup()
        self._name = name
        self._tell = tell
        try:
            self._client = node.create_client(SetBool, name, callback_group=self.group)
        except InvalidServiceNameException as error:
            # Its other lines point at the place.
            reason = str(error).split("\n", 1)[0].rstrip(":")
            raise DrivesRefusedError(f"drives_enable = {name!r}: {reason}") from None
        self._is_enabling = self._is_given_up = self._has_torque = False
        self._letting_go: tuple[Any, float] | None = None

    async def enable(self, lead: Callable[[], str]) -> str:
        """Give torque, and ``lead`` the machine once heights are measured; return that in words.

        Raises:
            KinematicsError: with the reason, if the machine is not led; then it has no torque.
        """
        if self._is_enabling:
            raise CommandRefusedError("the drives are being enabled already", Refusal.WAITING)
        self._is_enabling, self._is_given_up = True, False
        try:
            told = await self._asked_for_torque()
            end = time.monotonic() + HEIGHTS_TIME
            while not self._is_given_up:
                try:
                    return f"{lead()}; drives: {told}"
                except CommandRefusedError as error:
                    if error.refusal is not Refusal.NO_MEASUREMENT or time.monotonic() > end:
                        raise
                await asyncio.sleep(0)
            raise DrivesRefusedError("disabled before it was enabled")
        except Exception:
            self.let_go()
            raise
        finally:
            self._is_enabling = False

    async def _asked_for_torque(self) -> str:
        """Return what the drives say once they have torque.

        Raises:
            DrivesRefusedError: if they do not get it in time.
        """
        if not self._client.service_is_ready():
            raise DrivesRefusedError(f"there is no service {self._name} of the drives")
        self._has_torque, self._letting_go = True, None
        future = self._client.call_async(SetBool.Request(data=True))
        end = time.monotonic() + ANSWER_TIME
        while not future.done():
            if time.monotonic() > end:
                future.cancel()
                raise DrivesRefusedError(f"{self._name} has not answered in {ANSWER_TIME:g} s")
            await asyncio.sleep(0)
        answer = future.result()
        if not answer.success:
            raise DrivesRefusedError(f"the drives are not enabled: {answer.message}")
        return str(answer.message)

    def give_up(self) -> None:
        """Let an enabling that goes on lead to nothing; torque is taken away, whoever gave it."""
        self._is_given_up = self._has_torque = True

    def look(self, leads: bool) -> None:
        """Take torque away once the machine is not led any more; to be called in each cycle."""
        if self._letting_go is not None:
            future, end = self._letting_go
            answer = future.result() if future.done() else None
            if answer is not None or time.monotonic() > end:
                self._letting_go = None
                if answer is None or not answer.success:
                    why = "no answer" if answer is None else answer.message
                    self._tell(f"the drives may have torque still: {self._name}: {why}")
        if self._has_torque and not leads and not self._is_enabling:
            self.let_go()

    def let_go(self) -> None:
        """Take torque away."""
        if self._has_torque:
            self._has_torque = False
            future = self._client.call_async(SetBool.Request(data=False))
            self._letting_go = future, time.monotonic() + ANSWER_TIME


class MachineServices:
    """``~/stop``, ``~/pause``, ``~/resume``, ``~/enable`` and ``~/teach_mode``.

    Attributes:
        urgent: those that are looked at in each cycle.
    """

    def __init__(
        self,
        node: Node,
        controller: MotionController,
        reports: StateReports,
        refused: RefusalLog,
        look_for_others: Callable[[], None],
        drives: str,
    ) -> None:
        """Offer them as a part of ``node``.

        ``reports`` tell of new states before an answer is given; ``look_for_others`` looks who else
        moves the machine, before it is enabled. ``drives`` is their enable service; empty for none.
        """
        self._controller = controller
        self._reports = reports
        self._refused = refused
        self._look_for_others = look_for_others
        self._drives: DrivesEnable | None = None
        enable, group = self._on_enable, None
        if drives:
            self._drives = DrivesEnable(
                node, drives, lambda text: refused.refuse(text, Refusal.OTHER)
            )
            enable, group = self._on_enable_with_drives, self._drives.group
        node.create_service(SetBool, "~/enable", enable, qos_profile=CALLS, callback_group=group)
        node.create_service(SetBool, "~/teach_mode", self._on_teach_mode, qos_profile=CALLS)
        self.urgent = (
            node.create_service(Trigger, "~/stop", self._on_stop, qos_profile=CALLS),
            node.create_service(Trigger, "~/pause", self._on_pause, qos_profile=CALLS),
            node.create_service(Trigger, "~/resume", self._on_resume, qos_profile=CALLS),
        )

    def _on_stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self._controller.stop()
        response.success = True
        self._reports.tell()
        # A stop while nothing moved makes no new state, but counts as one stop more.
        self._reports.publish(self._controller.status)
        return response

    def _on_pause(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._asked(self._controller.pause, response)

    def _on_resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._asked(self._controller.resume, response)

    def _asked(self, ask: Callable[[], str], response: Trigger.Response) -> Trigger.Response:
        """Answer that something is done, or why it is not."""
        try:
            response.message = ask()
            response.success = True
        except KinematicsError as error:
            response.message = str(error)
        self._reports.tell()
        return response

    def look(self) -> None:
        """Take torque from the drives behind the machine; to be called in each cycle."""
        if self._drives is not None:
            self._drives.look(self._controller.leads)

    def _on_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        with self._told_in(request, response):
            response.message = self._enable() if request.data else self._controller.disable()
        return response

    async def _on_enable_with_drives(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        assert self._drives is not None
        with self._told_in(request, response):
            if request.data and not self._controller.leads:
                self._look_for_others()
                self._controller.check_free()
                response.message = await self._drives.enable(self._enable)
            elif request.data:
                response.message = self._enable()
            else:
                self._drives.give_up()
                response.message = f"{self._controller.disable()}; the drives let go at rest"
        return response

    def _enable(self) -> str:
        self._look_for_others()
        return self._controller.enable(time.monotonic())

    @contextmanager
    def _told_in(self, request: SetBool.Request, response: SetBool.Response) -> Iterator[None]:
        """Tell in the response whether the body has done what was requested."""
        try:
            yield
            response.success = True
        except KinematicsError as error:
            response.message = str(error)
            what = "enable" if request.data else "disable"
            self._refused.refuse(f"refused to {what}: {error}", error.refusal)
        self._reports.tell()

    def _on_teach_mode(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        response.message = self._controller.set_teach_mode(request.data)
        response.success = True
        return response


NODE_ENDS = "the node ends"

# At the end of the node one waits for this long for those who want a result [s].
FAREWELL = 0.2

ENDS = {GoalCode.SUCCEEDED: GoalEnd.SUCCEEDED, GoalCode.CANCELED: GoalEnd.CANCELED}

UNKNOWN = (math.nan, math.nan, math.nan)


class MotionActions:
    """``~/move_to``, ``~/follow_path`` and ``~/transfer``, served from the control cycle.

    Attributes:
        path_tolerance: of paths that give none [m].
    """

    def __init__(
        self,
        node: Node,
        controller: MotionController,
        machine: TriGlide,
        base_frame: str,
        kind: MotionKind,
        refused: RefusalLog,
        patient: PatientServices,
        path_tolerance: float,
    ) -> None:
        """Offer the actions as a part of ``node``; the ``controller`` carries them out.

        ``kind`` and ``path_tolerance`` [m] are those of goals that ask for none.
        """
        self.path_tolerance = path_tolerance
        self._controller = controller
        self._machine = machine
        self._base_frame = base_frame
        self._kind = kind
        self._refused = refused
        self._patient = patient
        self._clock = node.get_clock()
        self._has_ended = False
        # Whether something was asked for when it was last looked at.
        self._has_found = False
        self._servers = tuple(
            ActionServer(
                node,
                kind,
                name,
                patient,
                begin=partial(self._begun, begin),
                cancel=controller.cancel,
                end=_end_of,
                result=result,
                feedback=feedback,
            )
            for kind, name, begin, result, feedback in (
                (MoveTo, "~/move_to", self._move_to, self._moved, self._moving),
                (FollowPath, "~/follow_path", self._follow_path, self._followed, self._following),
                (Transfer, "~/transfer", self._transfer, self._transferred, self._transferring),
            )
        )

    def look(self) -> None:
        """Take in what has been asked for; to be called before the setpoint of a cycle."""
        found = [server.look() for server in self._servers]
        self._has_found = any(found)

    def answer(self, until: float) -> None:
        """Give the answers and results that are known; to be called after the setpoint.

        Of what was asked for at once, more is taken here, so that the last is answered sooner. What
        is left at the time.monotonic() ``until`` waits for the next cycle.
        """
        self._answer()
        while self._has_found and time.monotonic() < until:
            self.look()
            self._answer()
        for server in self._servers:
            server.publish()
        if time.monotonic() < until:
            self._patient.try_soon()

    def tell_progress(self) -> None:
        """Let the feedback of the goals that go on be published, one in a cycle."""
        for server in self._servers:
            server.tell_progress()

    def end(self) -> None:
        """Tell all who wait that the node ends; who was just accepted may not have asked yet."""
        self._has_ended = True
        self._controller.end(NODE_ENDS)
        self.answer(until=0.0)
        end = time.monotonic() + FAREWELL
        while time.monotonic() < end and not self._all_is_told:
            time.sleep(FAREWELL / 100)
            self.look()
            self.answer(until=0.0)
            self._patient.send_kept()
        self._patient.end()

    def _answer(self) -> None:
        for server in self._servers:
            server.answer()

    @property
    def _all_is_told(self) -> bool:
        asked = all(server.is_asked_for_all for server in self._servers)
        return asked and not self._patient.keeps_any

    def _begun(self, begin: Callable[[Any], Command], request: Any) -> Command:
        """Return the goal that is begun, or one that has ended as it is refused."""
        if self._has_ended:
            return _ended(GoalCode.SHUTDOWN, NODE_ENDS)
        try:
            return begin(request)
        except KinematicsError as error:
            self._refused.refuse(f"refused a goal: {error}", error.refusal)
            return _ended(GoalCode.REFUSED, str(error))

    def _move_to(self, request: Any) -> Command:
        position = target_position(pose_numbers(request.pose), self._base_frame)
        kind = self._kind_of(request)
        if request.speed == 0.0 and kind is self._kind:
            return self._controller.pursue_position(position)
        _check_speed(request.speed)
        line = FlatPath.of((SegmentKind.LINE,), position, (0.0,), (request.speed,), 0.0)
        if self._is_at(position):
            return self._controller.pursue_position(position)
        name = f"target {vector_text(position, 6)} m on a line"
        path = Follow.made(lambda _: line.path_from(self._commanded_position()), name)
        return self._controller.pursue(path)

    def _kind_of(self, request: Any) -> MotionKind:
        """Return how the platform is to go to its target.

        Raises:
            CommandRefusedError: if it cannot go so.
        """
        kinds = {kind.value: kind for kind in MotionKind}
        default = MotionKind.LINEAR if request.speed != 0.0 else self._kind
        kind = kinds.get(request.kind) if request.kind else default
        if kind is None:
            names = ", ".join(sorted(kinds))
            text = f"kind = {request.kind!r} must be one of {names}, or empty"
            raise CommandRefusedError(text, Refusal.OUT_OF_BOUNDS)
        if kind is MotionKind.SLIDER and request.speed != 0.0:
            speed = number_text(request.speed, 3)
            text = f"speed = {speed} m/s must be 0 for a move of kind 'slider'"
            raise CommandRefusedError(text, Refusal.OUT_OF_BOUNDS)
        if kind is MotionKind.SLIDER and self._kind is not kind:
            text = "kind = 'slider' must be 'linear', as that is the parameter motion of this node"
            raise CommandRefusedError(text, Refusal.UNSUPPORTED)
        return kind

    def _is_at(self, position: Vector3) -> bool:
        """Tell whether the platform is commanded to be at a ``position`` [m] already."""
        return math.dist(position, self._commanded_position()) <= SHORTEST

    def _moved(self, goal: Command) -> Any:
        return self._with_outcome(MoveTo.Result(), goal)

    def _moving(self, goal: Command) -> Any:
        if not self._controller.leads_to(goal):
            return None
        position = self._position()
        feedback = MoveTo.Feedback()
        if goal.destination is not None:
            feedback.way_remaining = math.dist(position, goal.destination)
            remaining = self._controller.remaining
            feedback.time_remaining = remaining if math.isfinite(remaining) else math.nan
        elif (progress := self._controller.path_progress) is not None:
            feedback.way_remaining = max(progress.way_remaining, 0.0)
            feedback.time_remaining = progress.time_remaining
        else:
            return None
        _write(position, feedback.position)
        return feedback

    def _follow_path(self, request: Any) -> Command:
        segments = flat_path(request, self._base_frame, self.path_tolerance)
        count = len(segments)
        return self._controller.pursue(
            Follow.made(
                lambda end: segments.path_from(end or self._commanded_position()),
                f"path of {count} segment{'' if count == 1 else 's'}",
                request.append,
                path_outputs(request, count),
            )
        )

    def follow_points(self, data: bytes) -> None:
        """Follow a serialized nav_msgs/Path from where the platform is through all its points.

        Raises:
            KinematicsError: if it is refused at once.
        """
        self._controller.follow(
            Follow.made(
                lambda _: self._path_through(data), f"path in a message of {len(data)} bytes"
            )
        )

    def _path_through(self, data: bytes) -> Interruptible[PlatformPath]:
        points = yield from path_points(data, self._base_frame)
        tolerance = self.path_tolerance
        return (yield from polyline_from(self._commanded_position(), points, tolerance))

    def _followed(self, goal: Follow) -> Any:
        result = self._with_outcome(FollowPath.Result(), goal)
        progress = self._controller.path_progress
        if result.code == GoalCode.SUCCEEDED and progress is not None:
            goal.deviation = progress.deviation
        result.largest_deviation = goal.deviation
        return result

    def _following(self, goal: Follow) -> Any:
        progress = self._controller.path_progress
        if progress is None or not self._controller.leads_to(goal):
            return None
        goal.deviation = progress.deviation
        feedback = FollowPath.Feedback()
        feedback.segment = progress.segment
        feedback.way = progress.way
        feedback.way_remaining = max(progress.way_remaining, 0.0)
        feedback.time_remaining = progress.time_remaining
        _write(self._position(), feedback.position)
        return feedback

    def _transfer(self, request: Any) -> Command:
        return self._controller.pursue(transfer_of(request, self._base_frame, self._clock))

    def _transferred(self, goal: Command) -> Any:
        return self._with_outcome(Transfer.Result(), goal)

    def _transferring(self, goal: Command) -> Any:
        progress = self._controller.transfer_progress
        if progress is None or not self._controller.leads_to(goal):
            return None
        feedback = Transfer.Feedback()
        delay = self._controller.drive_delay
        for nanoseconds in arrival_stamps(progress, delay, self._clock):
            feedback.arrivals.append(Time(nanoseconds=nanoseconds).to_msg())
        return feedback

    def _with_outcome(self, result: Any, goal: Command) -> Any:
        """Return a ``result`` with what all results have."""
        assert goal.outcome is not None
        result.code, result.text = int(goal.outcome.code), goal.outcome.text
        _write(self._position(), result.position)
        return result

    def _commanded_position(self) -> Vector3:
        """Return where the platform is commanded to be [m].

        Raises:
            KinematicsError: if it is not commanded to be anywhere.
        """
        return self._machine.forward(self._controller.commanded_heights)

    def _position(self) -> Vector3:
        """Return where the platform is measured to be [m]; NaN if that is not known."""
        heights = self._controller.measured_heights
        if heights is None:
            return UNKNOWN
        try:
            return self._machine.forward(heights)
        except NoPoseError:
            return UNKNOWN


def _check_speed(speed: float) -> None:
    """Check the largest speed that a move may have [m/s]; 0 leaves it to the limits.

    Raises:
        NotFiniteError: if it is NaN or infinite.
        OutOfBoundsError: if it is negative, too small or too large.
    """
    if finite("speed", speed) != 0.0 and not LEAST_SPEED <= speed <= LARGEST_SPEED:
        bound = f"0, or {LEAST_SPEED:g} to {LARGEST_SPEED:g}"
        raise OutOfBoundsError("speed", speed, bound, "m/s")


def _ended(code: GoalCode, text: str) -> Command:
    """Return a goal that has ended before it was one; ``text`` says why."""
    goal = Follow(None, "nothing")
    goal.end(code, text)
    return goal


def _end_of(goal: Command) -> GoalEnd | None:
    """Return how a ``goal`` ended, as all actions tell it; None as long as it goes on."""
    if goal.outcome is None:
        return None
    return ENDS.get(goal.outcome.code, GoalEnd.ABORTED)


def _write(position: Vector3, point: Point) -> None:
    point.x, point.y, point.z = position
