"""The command ``demo``: a simulated machine is driven over the topics, measured, and judged."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from numpy.typing import NDArray
from rclpy.time import Time
from sensor_msgs.msg import JointState

from tri_glide_kinematics.demo.client import (
    DEEP_QUEUE,
    MACHINE,
    MOVE_TIMEOUT,
    DemoNode,
    running_nodes,
)
from tri_glide_kinematics.demo.running import in_millimetres, run_demo, save_page, say
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.limit_use import LIMIT_TOLERANCE, CommandStream, LimitUse
from tri_glide_kinematics.motion.limits import QUANTITIES, SliderLimits
from tri_glide_kinematics.motion.path import FlatPath, PlatformPath, SegmentKind, polylines_of
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.ros.messages import vector_of
from tri_glide_kinematics.vectors import FloatArray, Vector3

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# The node of the demonstration, as a user would write it: it sends targets and listens.


@dataclass(frozen=True)
class Leg:
    """One target and what became of it.

    Attributes:
        name: of the target.
        target: position to be reached [m]; None for a jog, which has none.
        reached: measured position at the end [m].
        duration: from the command to the end [s].
        first: its first row in the stream of commands.
        end: the row after its last.
        deviation: largest distance of its setpoints from its path; 0 for a leg without one [m].
        tolerance: of that path [m].
    """

    name: str
    target: Vector3 | None
    reached: Vector3
    duration: float
    first: int
    end: int
    deviation: float = 0.0
    tolerance: float = 0.0

    @property
    def error(self) -> float:
        """Distance between target and measured position [m]; zero for a jog."""
        if self.target is None:
            return 0.0
        return float(np.linalg.norm(np.subtract(self.target, self.reached)))


TOLERANCE = 1e-4  # m between a target and the pose measured back
SETTLED_POSES = 10  # measured poses that have to agree
SETTLED = 5e-6  # m, within which they do
JOG_PERIOD = 0.02  # s between two renewals of the twist


class DemoClient(DemoNode):
    """Publishes targets, and collects commands and measured poses."""

    def __init__(self) -> None:
        """Join the machine of this demonstration."""
        super().__init__("tri_glide_demo")
        self.commands: list[JointState] = []
        self.path: list[Vector3] = []
        self._pose_target = self.create_publisher(PoseStamped, "target_pose", 10)
        self._twist_target = self.create_publisher(TwistStamped, "target_twist", 10)
        self.create_subscription(JointState, "joint_commands", self.commands.append, DEEP_QUEUE)
        self.create_subscription(PoseStamped, "platform_pose", self._on_pose, DEEP_QUEUE)

    def _on_pose(self, message: PoseStamped) -> None:
        self.path.append(vector_of(message.pose.position))

    def spin_for(self, duration: float) -> None:
        """Spin for ``duration`` seconds."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    @property
    def is_connected(self) -> bool:
        """Whether commands and poses flow, and our targets are listened to."""
        return bool(
            self.commands
            and self.path
            and self._pose_target.get_subscription_count()
            and self._twist_target.get_subscription_count()
        )

    def is_at_rest(self) -> bool:
        """Tell whether the newest command stands still."""
        return not any(self.commands[-1].velocity)

    def move(self, name: str, target: Vector3, frame: str) -> Leg:
        """Publish one pose and wait until it is measured back."""
        message = PoseStamped()
        message.header.frame_id = frame
        message.header.stamp = self.get_clock().now().to_msg()
        position = message.pose.position
        position.x, position.y, position.z = target

        def drive() -> Vector3:
            first = len(self.commands)
            self._pose_target.publish(message)

            def has_settled() -> bool:
                newest = np.array(self.path[-SETTLED_POSES:])
                return bool(
                    len(self.commands) > first + SETTLED_POSES
                    and self.is_at_rest()
                    and np.ptp(newest, axis=0).max() < SETTLED
                    and np.linalg.norm(newest[-1] - target) < TOLERANCE
                )

            self.wait_for(has_settled, MOVE_TIMEOUT, f"reaching {name}")
            return self.path[-1]

        return self._leg(name, target, drive)

    def drive_path(
        self, name: str, start: Vector3, segments: FlatPath, joints: tuple[str, ...]
    ) -> Leg:
        """Drive along a path by the action, and wait until it tells of the end.

        Setpoints are compared with the path, not measured poses: between two setpoints of which
        one is late, as this computer is busy, no machine stays on it.

        Raises:
            DemoError: if it tells of another end than success.
        """
        path = at_once(segments.path_from(start))

        def drive() -> Vector3:
            goal = self.goals.follow(segments)
            self.wait_for_goal(goal, f"driving {name}")
            self._catch_up()
            return vector_of(goal.result.position)

        leg = self._leg(name, path.end, drive)
        setpoints = MACHINE.forward_batch(self._heights(joints)[leg.first :])
        deviation = _largest_distance(setpoints, path)
        return replace(leg, deviation=deviation, tolerance=float(segments.tolerances.max()))

    def _leg(self, name: str, target: Vector3 | None, drive: Callable[[], Vector3]) -> Leg:
        """Return the leg to a ``target`` [m]; ``drive`` returns what was reached [m]."""
        self._catch_up()
        begin, first = time.monotonic(), len(self.commands)
        reached = drive()
        return Leg(name, target, reached, time.monotonic() - begin, first, len(self.commands))

    def _catch_up(self) -> None:
        """Wait for a command of this moment: those before it may still be in a queue."""
        now = self.get_clock().now()
        self.wait_for(
            lambda: Time.from_msg(self.commands[-1].header.stamp) >= now,
            MOVE_TIMEOUT,
            "listening to all commands",
        )

    def jog(self, velocity: Vector3, duration: float, frame: str) -> Leg:
        """Renew a twist for a while, then fall silent and wait for the stop."""
        message = TwistStamped()
        message.header.frame_id = frame
        linear = message.twist.linear
        linear.x, linear.y, linear.z = velocity

        def drive() -> Vector3:
            end = time.monotonic() + duration
            while time.monotonic() < end:
                message.header.stamp = self.get_clock().now().to_msg()
                self._twist_target.publish(message)
                self.spin_for(JOG_PERIOD)
            self._catch_up()
            self.wait_for(self.is_at_rest, MOVE_TIMEOUT, "stopping after the jog")
            return self.path[-1]

        return self._leg("jog", None, drive)

    def _heights(self, joints: tuple[str, ...]) -> list[list[float]]:
        """Return the heights of all commands so far, in the order of ``joints`` [m]."""
        rows = [dict(zip(command.name, command.position)) for command in self.commands]
        return [[row[joint] for joint in joints] for row in rows]

    def stream(self, facts: MachineFacts) -> tuple[CommandStream, NDArray[np.bool_]]:
        """Return all commands so far, and before which of them others were lost on the way."""
        period = 1.0 / facts.values["rate"]
        stream = CommandStream.from_heights(self._heights(facts.joints), period)
        published = np.array([command.velocity for command in self.commands])
        return stream, lost_before(stream, published, max(facts.limits.jerk), period)


def lost_before(
    stream: CommandStream, velocities: FloatArray, jerk: float, period: float
) -> NDArray[np.bool_]:
    """Tell before which rows of a ``stream`` others were lost.

    Args:
        stream: of n rows, each a ``period`` [s] after the last one unless others were lost.
        velocities: that were published with the heights. Shape (n, 3) [m/s].
        jerk: largest that a slider is allowed [m/s^3].
        period: between two commands [s].

    Returns:
        Shape (n,).
    """
    lost = np.zeros(len(velocities), dtype=bool)
    mean = (velocities[1:] + velocities[:-1]) / 2.0
    # Over one period the mean of both ends differs from the mean velocity by this at most: that is
    # the error of the trapezoidal rule for a velocity whose second derivative is the jerk.
    bound = jerk * period**2 / 12.0
    lost[1:] = np.any(np.abs(stream.velocities[1:] - mean) > 1.001 * bound + 1e-9, axis=1)
    return lost


def _largest_distance(places: FloatArray, path: PlatformPath) -> float:
    """Return how far the farthest of some places is from a path as programmed [m].

    Arcs count as their chords, which are some hundredths of a millimetre away.
    """
    corners = at_once(polylines_of(path.driven)).programmed
    steps = np.diff(corners, axis=0)
    offsets = places[:, np.newaxis] - corners[:-1]
    parts = np.einsum("ijk,jk->ij", offsets, steps) / np.einsum("jk,jk->j", steps, steps)
    away = offsets - np.clip(parts, 0.0, 1.0)[..., np.newaxis] * steps
    return float(np.linalg.norm(away, axis=2).min(axis=1).max())


POSES: tuple[tuple[str, Vector3], ...] = (
    ("A", (0.00, 0.00, 0.30)),
    ("B", (0.08, 0.00, 0.25)),
    ("C", (-0.04, 0.07, 0.22)),
    ("D", (-0.04, -0.07, 0.30)),
    ("E", (0.05, 0.05, 0.27)),
)
JOG_VELOCITY: Vector3 = (-0.10, -0.05, 0.02)  # m/s
JOG_TIME = 0.8  # s
# From home on: corners that are rounded, and an arc.
CORNER_TOLERANCE = 0.004  # m
PATH_SPEED = 0.25  # m/s
PATH = FlatPath.of(
    [SegmentKind.LINE, SegmentKind.LINE, SegmentKind.ARC_THROUGH, SegmentKind.LINE],
    [
        *(0.07, 0.00, 0.25),
        *(0.07, 0.05, 0.25),
        *(0.00, 0.10, 0.25, -0.07, 0.05, 0.25),
        *(-0.07, 0.00, 0.25),
    ],
    [CORNER_TOLERANCE],
    [PATH_SPEED],
    0.0,
)
HOME: tuple[str, Vector3] = ("home", (0.00, 0.00, 0.25))

MOST_LOST = 0.1  # part of the commands before which others were lost: with more, nothing is judged

TARGET_STYLE = {"marker": "o", "color": "tab:red", "markersize": 4}
START_STYLE = {"marker": "^", "color": "tab:green", "markersize": 7, "markerfacecolor": "none"}
END_STYLE = {"marker": "s", "color": "tab:green", "markersize": 6, "markerfacecolor": "none"}


def drive(client: DemoClient, legs: list[Leg]) -> MachineFacts:
    """Drive to all targets, and append each leg to ``legs`` as it ends.

    Raises:
        DemoError: if one is not reached.
    """
    client.wait_for_machine(lambda: client.is_connected)
    facts = client.read_facts()
    frame = facts.values["base_frame"]
    for name, target in POSES:
        say(f"pose {name} {in_millimetres(target)} mm")
        legs.append(client.move(name, target, frame))
    say(f"jog  {in_millimetres(JOG_VELOCITY)} mm/s for {JOG_TIME} s, then silence")
    legs.append(client.jog(JOG_VELOCITY, JOG_TIME, frame))
    say(f"pose {HOME[0]} {in_millimetres(HOME[1])} mm")
    legs.append(client.move(*HOME, frame))
    say(f"path of {len(PATH)} segments, corners rounded by {1e3 * CORNER_TOLERANCE:g} mm at most")
    legs.append(client.drive_path("path", HOME[1], PATH, facts.joints))
    say(f"path: setpoints at most {1e3 * legs[-1].deviation:.3f} mm from it as programmed")
    return facts


def is_good(leg: Leg, use: LimitUse, tolerance: float) -> bool:
    """Return whether a target was reached and a path kept to ``tolerance`` [m], and all limits."""
    is_there = leg.error < tolerance and leg.deviation < leg.tolerance + tolerance
    return is_there and use.part(leg.first, leg.end).is_within


def table(legs: Sequence[Leg], use: LimitUse, limits: SliderLimits) -> str:
    """Return one line for each leg: target, measured position, and what is nearest to a limit."""
    heads = "".join(f" {f'{quantity} [{unit}]':>21}" for quantity, unit in QUANTITIES)
    start = f"{'':5} {'target [mm]':27} {'reached [mm]':27} {'error':>9} {'time':>7}"
    return "\n".join([start + heads, *(_line(leg, use, limits) for leg in legs)])


def _line(leg: Leg, use: LimitUse, limits: SliderLimits) -> str:
    target = in_millimetres(leg.target) if leg.target else "(by twist)"
    line = f"{leg.name:5} {target:27} {in_millimetres(leg.reached):27}"
    line += f" {1e6 * leg.error:6.1f} µm" if leg.target else f" {'':9}"
    line += f" {leg.duration:5.2f} s"
    part = use.part(leg.first, leg.end)
    for index in range(len(QUANTITIES)):
        slider = int(part.parts[:, index].max(axis=0).argmax())
        limit = limits.table[index, slider]
        kept = part.largest[index] <= 1.0 + LIMIT_TOLERANCE
        line += f" {part.largest[index] * limit:9.3f} {'<' if kept else '>'} {limit:7.2f}  "
    return line


def picture(
    legs: Sequence[Leg], path: FloatArray, stream: CommandStream, facts: MachineFacts
) -> Figure:
    """Return a page with the motion; the ``path`` was measured. Shape (m, 3) [m]."""
    # Drawing is imported late: it takes as long as starting the nodes.
    from tri_glide_kinematics.figures import Mark, Span, motion_figure

    marks, spans = [], []
    for before, leg in zip((None, *legs), legs):
        if leg.target:
            marks.append(Mark(leg.name, leg.target, TARGET_STYLE))
        else:
            if before:
                marks.append(Mark(f"{leg.name} starts", before.reached, START_STYLE))
            marks.append(Mark(f"{leg.name} ends", leg.reached, END_STYLE))
        if leg.target is None or leg.tolerance:
            begin, *_, end = stream.times[leg.first : leg.end].tolist()
            spans.append(Span(leg.name, begin, end))
    return motion_figure(stream, path, facts.limits, facts.travel, marks, spans)


def demonstrate(output: Path) -> int:
    """Start the nodes, drive, and return the exit code."""
    legs: list[Leg] = []
    say("starting simulator_node, ik_node and fk_node as processes")
    with running_nodes({"simulator_node": {}, "ik_node": {}, "fk_node": {}}):
        client = DemoClient()
        facts = drive(client, legs)
        stream, lost = client.stream(facts)
    use = LimitUse.of(stream, facts.limits, lost)
    print(f"\n{table(legs, use, facts.limits)}\n")
    if lost.any():
        say(f"{lost.sum()} gaps in the stream of commands are not judged: this computer is busy")
    good = lost.mean() < MOST_LOST and all(is_good(leg, use, TOLERANCE) for leg in legs)
    save_page(output, "demo", picture(legs, np.array(client.path), stream, facts))
    say("every target reached, no limit broken" if good else "FAILED: see the table")
    return 0 if good else 1


def main() -> int:
    """Run the demonstration from the command line."""
    return run_demo("demo", __doc__, demonstrate)


if __name__ == "__main__":
    sys.exit(main())
