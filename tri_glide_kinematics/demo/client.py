"""The client of a demonstration: it sends goals, and waits for what it is told."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from rclpy.time import Time
from rclpy.utilities import ok

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.demo.running import NAMESPACE, node_arguments
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.path import FlatPath
from tri_glide_kinematics.panel.link import NAMES, MachineFacts
from tri_glide_kinematics.ros.goal_sender import GoalSender, SentGoal
from tri_glide_kinematics.ros.loop import OtherTurns
from tri_glide_kinematics.ros.outputs import LATCHED
from tri_glide_kinematics.ros.starting import NodeProcesses, shut_down
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import Vector3

MACHINE = TriGlide(DEFAULT_GEOMETRY)
DEEP_QUEUE = QoSProfile(depth=5000)  # few commands may be lost: their differences are judged

START_TIMEOUT = 20.0  # s
MOVE_TIMEOUT = 60.0  # s
LOOK_PERIOD = 0.01  # s between two looks at what is waited for, and at goals and calls


class DemoError(KinematicsError):
    """The demonstration cannot go on; the text says why."""


def seconds(stamp: Any) -> float:
    """Return the time of a stamp [s]."""
    return 1e-9 * Time.from_msg(stamp).nanoseconds


class DemoNode(Node):
    """The node of a demonstration: it sends goals, and waits for what it is told.

    Attributes:
        calls: node of its own for goals and calls, which is looked at now and then.
        goals: to send.
        ik_parameters: those of ``ik_node``.
        state: that ``ik_node`` has told last; 0 before the first.
    """

    def __init__(self, name: str) -> None:
        """Join the machine of this demonstration."""
        super().__init__(name, namespace=NAMESPACE)
        self._executor = OtherTurns(self)
        # Of a node of their own, which is looked at now and then: a list of all that is waited for
        # is made anew for each message.
        self.calls = Node(f"{name}_calls", namespace=NAMESPACE)
        self.goals = GoalSender(self.calls)
        self.ik_parameters = AsyncParameterClient(self.calls, "ik_node")
        self.state = 0
        self.calls.create_subscription(
            MachineState, "ik_node/machine_state", self._take_state, LATCHED
        )
        self._calls_executor = OtherTurns(self.calls)

    def _take_state(self, message: MachineState) -> None:
        self.state = message.state

    def wait_for(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Spin until ``condition`` holds.

        Raises:
            DemoError: if it does not within ``timeout`` seconds.
        """
        end = time.monotonic() + timeout
        next_look = 0.0
        while (now := time.monotonic()) < end:
            # Not after each of a thousand messages a second, on a computer that is busy.
            if now >= next_look:
                self._calls_executor.spin_once(timeout_sec=0.0)
                if condition():
                    return
                next_look = now + LOOK_PERIOD
            self._executor.spin_once(timeout_sec=LOOK_PERIOD)
        raise DemoError(f"{what} took longer than {timeout:g} s")

    def wait_for_machine(self, also: Callable[[], object] = lambda: True) -> None:
        """Wait until ``ik_node`` leads the machine and takes goals, and for something else."""
        self.wait_for(
            lambda: bool(
                self.goals.is_ready
                and self.ik_parameters.services_are_ready()
                and self.state == MachineState.IDLE
                and also()
            ),
            START_TIMEOUT,
            "starting the machine",
        )

    def read_facts(self) -> MachineFacts:
        """Ask ``ik_node`` for its parameters."""
        answer = self.ik_parameters.get_parameters(list(NAMES))
        self.wait_for(answer.done, START_TIMEOUT, "reading the parameters of ik_node")
        return MachineFacts.of(answer.result().values)

    def go_to(self, position: Vector3) -> None:
        """Move the platform to where ``ik_node`` believes that ``position`` is [m].

        Raises:
            DemoError: if it does not get there.
        """
        self.wait_for_goal(self.goals.move_to(position), f"a motion to {position}")

    def follow(self, path: FlatPath) -> None:
        """Drive the platform along a ``path`` from where it is.

        Raises:
            DemoError: if it does not get to the end.
        """
        self.wait_for_goal(self.goals.follow(path), "a path")

    def wait_for_goal(self, goal: SentGoal, what: str) -> None:
        """Wait for the end of a ``goal``.

        Raises:
            DemoError: if it tells of another end than success.
        """
        self.wait_for(lambda: goal.result is not None, MOVE_TIMEOUT, what)
        if not goal.has_succeeded:
            raise DemoError(f"{what}: {goal.result.text}")


@contextmanager
def ros_that_ctrl_c_ends() -> Iterator[None]:
    """Use rclpy, and leave Ctrl-C to it: an exception raised within its C++ code may get lost.

    Raises:
        BaseException: what the handler that was there raises, if a signal came that ends this
            process, whatever else went wrong then.
    """
    came: list[int] = []
    # rclpy calls the handlers that it finds beside its own.
    before = {
        number: signal.signal(number, lambda number, _: came.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    rclpy.init()
    try:
        if came:
            # Too early for rclpy to hear it.
            shut_down()
        yield
    except Exception:
        if ok():
            raise
    finally:
        shut_down()
        for number, handler in before.items():
            signal.signal(number, handler)
        if came:
            os.kill(os.getpid(), came[0])


@contextmanager
def running_nodes(nodes: Mapping[str, Mapping[str, object]]) -> Iterator[NodeProcesses]:
    """Run nodes with these values of parameters, by their names, and use rclpy beside them."""
    with NodeProcesses() as processes:
        for name, values in nodes.items():
            processes.start(name, node_arguments(values))
        with ros_that_ctrl_c_ends():
            yield processes
