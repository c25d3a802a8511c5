"""A demonstration: a simulated machine is driven over the topics, measured, and judged."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from rclpy.utilities import ok
from sensor_msgs.msg import JointState

from tri_glide_kinematics.motion.command_stream import CommandStream
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.ros.processes import NodeProcesses, default_parameter_file
from tri_glide_kinematics.ros.run import shut_down
from tri_glide_kinematics.ros.transport import COMPUTER, TransportError, choose_transport

Position = tuple[float, float, float]

POSES: tuple[tuple[str, Position], ...] = (
    ("A", (0.00, 0.00, 0.30)),
    ("B", (0.08, 0.00, 0.25)),
    ("C", (-0.04, 0.07, 0.22)),
    ("D", (-0.04, -0.07, 0.30)),
    ("E", (0.05, 0.05, 0.27)),
)
JOG_VELOCITY: Position = (-0.10, -0.05, 0.02)  # m/s
JOG_TIME = 0.8  # s
JOG_PERIOD = 0.02  # s between two renewals of the twist
HOME: tuple[str, Position] = ("home", (0.00, 0.00, 0.25))

# A busy computer may let the simulated machine wait for longer than a real one ever falls silent.
PATIENCE = ("-p", "measured_timeout:=2.0")

TOLERANCE = 1e-4  # m between a target and the pose measured back
SETTLED_POSES = 10  # measured poses that have to agree
SETTLED = 5e-6  # m, within which they do
START_TIMEOUT = 20.0  # s
MOVE_TIMEOUT = 15.0  # s
DEEP_QUEUE = QoSProfile(depth=5000)  # no command may be lost: their differences are judged

# Finite differences may exceed a limit by rounding only.
RATIO_TOLERANCE = {"velocity": 1e-6, "acceleration": 1e-6, "jerk": 1e-3}


class DemoError(Exception):
    """The demonstration cannot go on; the text says why."""


@dataclass(frozen=True)
class Leg:
    """One target of the demonstration and what became of it."""

    name: str
    target: Position | None  # m; None for a jog, which has no position to reach
    reached: Position  # m, measured
    duration: float  # s
    first: int  # its first row in the stream of commands
    end: int  # the row after its last

    @property
    def error(self) -> float:
        """Distance between target and measured position [m]; zero for a jog."""
        return (
            0.0
            if self.target is None
            else float(np.linalg.norm(np.subtract(self.target, self.reached)))
        )


@dataclass(frozen=True)
class Settings:
    """What the running ``ik_node`` says of itself."""

    period: float  # s
    limits: SliderLimits
    travel: tuple[Position, Position]  # m
    joints: tuple[str, ...]
    base_frame: str


class DemoClient(Node):
    """Another node, as a user would write it: it publishes targets and listens to the machine."""

    def __init__(self, namespace: str) -> None:
        """Join the machine in ``namespace``."""
        super().__init__("tri_glide_demo", namespace=namespace)
        self.commands: list[JointState] = []
        self.path: list[Position] = []
        self._pose_target = self.create_publisher(PoseStamped, "target_pose", 10)
        self._twist_target = self.create_publisher(TwistStamped, "target_twist", 10)
        self.create_subscription(JointState, "joint_commands", self.commands.append, DEEP_QUEUE)
        self.create_subscription(PoseStamped, "platform_pose", self._on_pose, DEEP_QUEUE)
        self._ik_parameters = AsyncParameterClient(self, "ik_node")

    def _on_pose(self, message: PoseStamped) -> None:
        position = message.pose.position
        self.path.append((position.x, position.y, position.z))

    def wait_for(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Spin until ``condition`` holds.

        Raises:
            DemoError: if it does not within ``timeout`` seconds.
        """
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise DemoError(f"{what} took longer than {timeout:g} s")
            rclpy.spin_once(self, timeout_sec=0.05)

    def spin_for(self, duration: float) -> None:
        """Spin for ``duration`` seconds."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0.0:
            rclpy.spin_once(self, timeout_sec=left)

    def read_settings(self) -> Settings:
        """Ask ``ik_node`` for its parameters."""
        self.wait_for(self._ik_parameters.services_are_ready, START_TIMEOUT, "starting ik_node")
        names = [
            "rate",
            "velocity_limits",
            "acceleration_limits",
            "jerk_limits",
            "lower_heights",
            "upper_heights",
            "joint_names",
            "base_frame",
        ]
        answer = self._ik_parameters.get_parameters(names)
        self.wait_for(answer.done, START_TIMEOUT, "reading the parameters of ik_node")
        value = dict(zip(names, map(parameter_value_to_python, answer.result().values)))
        return Settings(
            1.0 / value["rate"],
            SliderLimits(
                value["velocity_limits"], value["acceleration_limits"], value["jerk_limits"]
            ),
            (tuple(value["lower_heights"]), tuple(value["upper_heights"])),
            tuple(value["joint_names"]),
            value["base_frame"],
        )

    def wait_for_machine(self) -> None:
        """Wait until commands and poses flow, and our targets are listened to."""
        self.wait_for(
            lambda: bool(
                self.commands
                and self.path
                and self._pose_target.get_subscription_count()
                and self._twist_target.get_subscription_count()
            ),
            START_TIMEOUT,
            "starting the machine",
        )

    def is_at_rest(self) -> bool:
        """Tell whether the newest command stands still."""
        return not any(self.commands[-1].velocity)

    def move(self, name: str, target: Position, frame: str) -> Leg:
        """Publish one pose and wait until it is measured back."""
        message = PoseStamped()
        message.header.frame_id = frame
        message.header.stamp = self.get_clock().now().to_msg()
        position = message.pose.position
        position.x, position.y, position.z = target
        begin, first = time.monotonic(), len(self.commands)
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
        return Leg(name, target, self.path[-1], time.monotonic() - begin, first, len(self.commands))

    def jog(self, velocity: Position, duration: float, frame: str) -> Leg:
        """Renew a twist for a while, then fall silent and wait for the stop."""
        message = TwistStamped()
        message.header.frame_id = frame
        linear = message.twist.linear
        linear.x, linear.y, linear.z = velocity
        begin, first = time.monotonic(), len(self.commands)
        while time.monotonic() - begin < duration:
            message.header.stamp = self.get_clock().now().to_msg()
            self._twist_target.publish(message)
            self.spin_for(JOG_PERIOD)
        self.wait_for(self.is_at_rest, MOVE_TIMEOUT, "stopping after the jog")
        return Leg("jog", None, self.path[-1], time.monotonic() - begin, first, len(self.commands))

    def stream(self, settings: Settings) -> CommandStream:
        """Return all commands so far.

        Raises:
            DemoError: if commands were lost on the way, so that their differences mean nothing.
        """
        rows = []
        for command in self.commands:
            by_name = dict(zip(command.name, command.position))
            rows.append([by_name[joint] for joint in settings.joints])
        stream = CommandStream.from_heights(rows, settings.period)
        published = np.array([command.velocity for command in self.commands])
        mean = (published[1:] + published[:-1]) / 2.0
        # Within one period the two differ by the jerk alone; a lost command differs far more.
        bound = max(settings.limits.jerk) * settings.period**2
        lost = int(np.sum(np.any(np.abs(stream.velocities[1:] - mean) > bound, axis=1)))
        if lost:
            raise DemoError(f"{lost} gaps in the stream of commands: this computer is too busy")
        return stream


def run(client: DemoClient, legs: list[Leg]) -> Settings:
    """Drive through all targets, and append each leg to ``legs`` as it ends."""
    client.wait_for_machine()
    settings = client.read_settings()
    frame = settings.base_frame
    for name, target in POSES:
        say(f"pose {name} {in_millimetres(target)} mm")
        legs.append(client.move(name, target, frame))
    say(f"jog  {in_millimetres(JOG_VELOCITY)} mm/s for {JOG_TIME} s, then silence")
    legs.append(client.jog(JOG_VELOCITY, JOG_TIME, frame))
    say(f"pose {HOME[0]} {in_millimetres(HOME[1])} mm")
    legs.append(client.move(*HOME, frame))
    return settings


def say(text: str) -> None:
    """Print one line of progress at once."""
    print(f"demo: {text}", flush=True)


def in_millimetres(vector: Position) -> str:
    """Return a vector [m] as text [mm]."""
    return "(" + ", ".join(f"{1000.0 * value:7.2f}" for value in vector) + ")"


def report(legs: list[Leg], stream: CommandStream, limits: SliderLimits) -> bool:
    """Print the table and return whether every target was reached and no limit was broken."""
    bounds = {
        "velocity": (stream.velocities, limits.velocity, "m/s"),
        "acceleration": (stream.accelerations, limits.acceleration, "m/s²"),
        "jerk": (stream.jerks, limits.jerk, "m/s³"),
    }
    heads = [f"{name} [{unit}]" for name, (_, _, unit) in bounds.items()]
    print(
        f"\n{'':5} {'target [mm]':27} {'reached [mm]':27} {'error':>9} {'time':>7}"
        + "".join(f" {head:>21}" for head in heads)
    )
    good = True
    for leg in legs:
        target = in_millimetres(leg.target) if leg.target else "(by twist)"
        line = f"{leg.name:5} {target:27} {in_millimetres(leg.reached):27}"
        line += f" {1e6 * leg.error:6.1f} µm" if leg.target else f" {'':9}"
        line += f" {leg.duration:5.2f} s"
        good = good and leg.error < TOLERANCE
        for name, (values, limit, _) in bounds.items():
            largest = np.abs(values[leg.first : leg.end]).max(axis=0)
            slider = int(np.argmax(largest / limit))
            broken = largest[slider] > limit[slider] * (1.0 + RATIO_TOLERANCE[name])
            good = good and not broken
            line += f" {largest[slider]:9.3f} {'>' if broken else '<'} {limit[slider]:7.2f}  "
        print(line)
    print()
    return good


def save_picture(
    folder: Path, legs: list[Leg], client: DemoClient, stream: CommandStream, settings: Settings
) -> Path:
    """Draw the motion and return the path of the picture."""
    # Drawing is imported late: it takes as long as starting the nodes.
    from tri_glide_kinematics.figures.motion import motion_figure

    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / "demo.png"
    stops = [(leg.name, leg.target) for leg in legs if leg.target]
    figure = motion_figure(stream, np.array(client.path), settings.limits, settings.travel, stops)
    figure.savefig(picture, dpi=110)
    return picture


@contextmanager
def ros_that_ctrl_c_ends() -> Iterator[None]:
    """Use rclpy, and leave Ctrl-C to it: an exception raised within its C++ code may get lost.

    Raises:
        KeyboardInterrupt: if the signal came, whatever else went wrong then.
    """
    # rclpy calls the handler that it finds beside its own.
    before = signal.signal(signal.SIGINT, lambda *_: None)
    rclpy.init()
    try:
        yield
    except Exception:
        if ok():
            raise
    finally:
        interrupted = not ok()
        shut_down()
        signal.signal(signal.SIGINT, before)
    if interrupted:
        raise KeyboardInterrupt


def demonstrate(folder: Path) -> int:
    """Start the nodes, drive, and return the exit code."""
    # A namespace of its own keeps the demonstration away from a machine on this computer.
    namespace = f"/tri_glide_demo_{os.getpid()}"
    arguments = ["--params-file", str(default_parameter_file()), "-r", f"__ns:={namespace}"]
    legs: list[Leg] = []
    with NodeProcesses() as processes:
        say("starting simulator_node, ik_node and fk_node as processes")
        for name in ("simulator_node", "ik_node", "fk_node"):
            processes.start(name, [*arguments, *PATIENCE, "--log-level", "WARN"])
        with ros_that_ctrl_c_ends():
            client = DemoClient(namespace)
            settings = run(client, legs)
            stream = client.stream(settings)
    good = report(legs, stream, settings.limits)
    picture = save_picture(folder, legs, client, stream, settings)
    say(f"picture: {picture}")
    say("every target reached, no limit broken" if good else "FAILED: see the table")
    return 0 if good else 1


def main() -> int:
    """Run the demonstration from the command line."""
    parser = argparse.ArgumentParser(prog="demo", description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out"), help="folder of the picture")
    folder = parser.parse_args().output
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        # For this process and the nodes that it starts.
        say(choose_transport(COMPUTER).text)
        return demonstrate(folder)
    except KeyboardInterrupt:
        say("interrupted; all nodes are stopped")
        return 128 + signal.SIGINT
    except (DemoError, TransportError, OSError) as error:
        print(f"demo: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
