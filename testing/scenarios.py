"""Rough treatment of a running machine, for as long as one likes."""

import random
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import SetParameters
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from testing.commands import FOREIGN_FRAME, KINEMATICS, LIMITS
from testing.hostile_messages import joint_states, parameters, poses, target_states, twists
from testing.machine import JOINTS, PATIENCE, Machine

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


def bring_home(machine: Machine) -> None:
    """Move the simulated sliders as a person would, from wherever they were left."""
    client = machine.client
    publisher = client.publisher(JointState, "joint_commands")
    home = KINEMATICS.inverse(HOME)
    message = JointState(name=JOINTS, position=home)
    message.header.frame_id = FOREIGN_FRAME

    def is_home() -> bool:
        publisher.publish(message)
        heights = machine.measured[-1].position
        return len(heights) == 3 and max(abs(a - b) for a, b in zip(heights, home)) < 1e-4

    client.wait_for(lambda: client.enable(False).success, "the machine to be disabled")
    machine.wait_for_state("disabled")
    client.wait_for(is_home, "the sliders to be home")
    client.node.destroy_publisher(publisher)


def assert_normal_target_is_reached(machine: Machine) -> None:
    """Enable the machine as long as it needs that, and move it."""
    client = machine.client
    client.wait_for(lambda: client.enable().success, "the machine to be enabled")
    machine.wait_for_state("idle")
    machine.move(HOME)
    expected = KINEMATICS.inverse(HOME)
    assert max(abs(a - b) for a, b in zip(machine.heights(), expected)) < 1e-5


def flood(machine: Machine, rate: float, number: int, kind: str = "pose") -> None:
    """Publish a ``number`` of targets of a ``kind``, ``rate`` a second, from another process."""
    script = Path(__file__).with_name("flood.py")
    arguments = [sys.executable, str(script), machine.namespace, kind, str(rate), str(number)]
    with subprocess.Popen(arguments) as process:
        machine.client.wait_for(
            lambda: process.poll() is not None, "the flood to end", 10.0 * number / rate + 60.0
        )
    assert process.returncode == 0


def hostility(machine: Machine, duration: float) -> None:
    """Send random messages to every input of ik_node and simulator_node; then set both right.

    Commands to the simulator come in the second half only: ik_node does not lead a machine that
    gets commands from somebody else.
    """
    send_at_random(machine, duration / 2.0, commands=False)
    send_at_random(machine, duration / 2.0, commands=True)
    # On simulated time that nobody publishes, all stamps would be zero.
    for node, values in (("simulator_node", HEALTHY), ("ik_node", NORMAL_VALUES)):
        assert machine.client.set_parameters(node, {**values, "use_sim_time": False}).successful
    bring_home(machine)


def send_at_random(machine: Machine, duration: float, *, commands: bool) -> None:
    """Send random messages for a while, with or without ``commands`` to the simulator."""
    client = machine.client
    publishers = {
        "pose": client.publisher(PoseStamped, "target_pose"),
        "twist": client.publisher(TwistStamped, "target_twist"),
        "state": client.publisher(Odometry, "target_state"),
        "measured": client.publisher(JointState, "joint_states"),
    }
    if commands:
        publishers["command"] = client.publisher(JointState, "joint_commands")
    services = {
        "enable": client.node.create_client(SetBool, "ik_node/enable"),
        "stop": client.node.create_client(Trigger, "ik_node/stop"),
        "ik_node": client.node.create_client(SetParameters, "ik_node/set_parameters"),
        "simulator_node": client.node.create_client(SetParameters, "simulator_node/set_parameters"),
    }
    client.wait_for(
        lambda: all(service.service_is_ready() for service in services.values()), "all services"
    )
    inputs = st.one_of(
        st.tuples(st.just("pose"), poses()),
        st.tuples(st.just("twist"), twists()),
        st.tuples(st.just("state"), target_states(lambda: client.node.get_clock().now().to_msg())),
        st.tuples(st.just("measured"), joint_states()),
        *([st.tuples(st.just("command"), joint_states())] if commands else []),
        st.tuples(st.just("enable"), st.builds(SetBool.Request, data=st.booleans())),
        st.tuples(st.just("enable"), st.just(SetBool.Request(data=True))),
        st.tuples(st.just("stop"), st.just(Trigger.Request())),
        *(
            st.tuples(
                st.just(node),
                st.builds(
                    lambda values: SetParameters.Request(parameters=values),
                    st.lists(parameters(node), max_size=3),
                ),
            )
            for node in ("ik_node", "simulator_node")
        ),
    )
    end = time.monotonic() + duration
    for number in range(1_000_000):
        if time.monotonic() > end:
            break

        @seed(number)
        @settings(
            max_examples=200,
            deadline=None,
            database=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(inputs)
        def send(drawn: tuple[str, Any]) -> None:
            if time.monotonic() > end:
                return
            name, message = drawn
            if name == "command":
                # Marks what was recorded of the topic, but did not come from ik_node.
                message.header.frame_id = FOREIGN_FRAME
            if name in publishers:
                publishers[name].publish(message)
            else:
                services[name].call_async(message)
            # More than comes in meanwhile, so that no recorded message waits until it is dropped.
            for _ in range(4):
                client.spin_once()

        send()
    for service in services.values():
        client.node.destroy_client(service)
    for publisher in publishers.values():
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
