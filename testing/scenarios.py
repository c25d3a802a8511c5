"""Rough treatment of a running machine, for as long as one likes."""

import math
import random
import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile

from testing.commands import KINEMATICS, LIMITS
from testing.held_client import KINDS
from testing.machine import PATIENCE, Machine

HOME = (0.0, 0.0, 0.25)
HEALTHY = {
    "lag": 0.005,
    "encoder_resolution": 1e-6,
    "drop_out": 0.0,
    "frozen_encoders": [False] * 3,
    "encoder_offsets": [0.0] * 3,
    "stuck_sliders": [False] * 3,
}

LIVE_VALUES: dict[str, Callable[[random.Random], Any]] = {
    "velocity_limits": lambda source: _three(source, 1e-3, LIMITS.velocity[0]),
    "acceleration_limits": lambda source: _three(source, 2.0, LIMITS.acceleration[0]),
    "jerk_limits": lambda source: _three(source, 50.0, LIMITS.jerk[0]),
    "speed_scale": lambda source: source.uniform(0.05, 1.0),
    "platform_speed_limit": lambda source: 10.0 ** source.uniform(-4.0, 0.0),
}
NORMAL_VALUES = {
    "velocity_limits": list(LIMITS.velocity),
    "acceleration_limits": list(LIMITS.acceleration),
    "jerk_limits": list(LIMITS.jerk),
    "speed_scale": 1.0,
    "platform_speed_limit": 0.0,
    "twist_timeout": 0.1,
    **PATIENCE,
}


def assert_normal_target_is_reached(machine: Machine) -> None:
    """Enable the machine as long as it needs that, and move it."""
    client = machine.client
    client.wait_for(lambda: client.enable().success, "the machine to be enabled")
    machine.wait_for_state("idle")
    machine.move(HOME)
    expected = KINEMATICS.inverse(HOME)
    assert max(abs(a - b) for a, b in zip(machine.heights(), expected)) < 1e-5


def flood(machine: Machine, rate: float, number: int, kind: str) -> None:
    """Publish a ``number`` of targets, ``rate`` a second; two in three are impossible.

    It takes longer on a busy computer.
    """
    client, source = machine.client, random.Random(1)
    topic, message_type = KINDS[kind]
    publisher = client.publisher(message_type, topic, QoSProfile(depth=1000))
    client.wait_for_subscribers(publisher)
    messages = [_target(message_type(), source) for _ in range(1000)]
    begin, count = time.monotonic(), 0
    while count < number:
        due = min(rate * (time.monotonic() - begin), number)
        stamp = client.node.get_clock().now().to_msg()
        while count < due:
            message = messages[count % len(messages)]
            message.header.stamp = stamp
            publisher.publish(message)
            count += 1
        client.spin_once(0.0)
    client.node.destroy_publisher(publisher)


def parameter_storm(machine: Machine, duration: float, least: int = 1) -> int:
    """Set live parameters of ik_node, valid and not, while it moves; return how many were set.

    It lasts for a ``duration`` [s], and until the ``least`` number has been set.
    """
    client = machine.client
    source = random.Random(3)
    end = time.monotonic() + duration
    count = 0
    targets = [(0.08, 0.03, 0.35), (-0.06, 0.05, 0.22), HOME]
    while count < least or time.monotonic() < end:
        if count % 10 == 0:
            client.send_pose(targets[count // 10 % len(targets)])
        names = source.sample(sorted(LIVE_VALUES), source.randint(1, 4))
        values = {name: LIVE_VALUES[name](source) for name in names}
        spoilt = source.random() < 0.3
        if spoilt:
            values[names[0]] = source.choice([-1.0, [0.1], "fast", [float("nan")] * 3, True])
        assert client.set_parameters("ik_node", values).successful is not spoilt
        count += 1
    return count


def _three(source: random.Random, low: float, high: float) -> list[float]:
    return [low * (high / low) ** source.random() for _ in range(3)]


def _target(message: Any, source: random.Random) -> Any:
    """Return a ``message`` with numbers of its own."""
    if isinstance(message, TwistStamped):
        linear = message.twist.linear
        linear.x, linear.y = source.uniform(-0.2, 0.2), source.uniform(-0.2, 0.2)
        linear.z = source.choice((source.uniform(-0.2, 0.2), math.inf, math.nan))
        return message
    pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
    point = pose.position
    point.x, point.y = source.uniform(-0.08, 0.08), source.uniform(-0.08, 0.08)
    point.z = source.choice((source.uniform(0.2, 0.4), 2.0, math.nan))
    if isinstance(message, Odometry):
        message.twist.twist.linear.x = source.uniform(-1.0, 1.0)
    return message
