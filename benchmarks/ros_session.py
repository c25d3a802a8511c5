"""A ROS domain of its own with processes in it, and a node that probes them."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.context import Context

from benchmarks.harness import NoAnswerError
from testing.client import LATCHED, Probe
from testing.domain import own_context, own_domain
from testing.processes import Launcher, RunningNode
from tri_glide_kinematics.ros.starting import COMPUTER, choose_transport

TIMEOUT = 90.0  # s
STATUS_TIMEOUT = 5.0  # s, for the latched status of a node, once something went wrong
QUIET = ("--log-level", "ERROR")


def pose_at(position: Sequence[float]) -> PoseStamped:
    """Return the message of a position [m]."""
    message = PoseStamped()
    point = message.pose.position
    point.x, point.y, point.z = position
    return message


class Session(Probe):
    """Processes in one domain, and a node beside them, which probes."""

    def __init__(self, context: Context) -> None:
        """Join the domain."""
        super().__init__(context, "/")
        self._launcher = Launcher()

    def start_node(self, name: str, namespace: str, **parameters: object) -> int:
        """Start an installed executable of this project and return its process id."""
        return self._launcher.start(name, parameters, namespace=namespace, arguments=QUIET).pid

    def start_bare(
        self, role: str, namespace: str, rate: float = 0.0, remaps: Sequence[str] = ()
    ) -> int:
        """Start a node of ``bare_nodes`` and return its process id."""
        arguments = [role, str(rate)]
        return self.start_module("benchmarks.bare_nodes", arguments, role, namespace, remaps)

    def start_module(
        self,
        module: str,
        arguments: Sequence[str],
        name: str,
        namespace: str,
        remaps: Sequence[str] = (),
        **parameters: object,
    ) -> int:
        """Start a Python module, which is the node ``name``, as a process and return its id."""
        ros_arguments = [*QUIET, *(word for remap in remaps for word in ("-r", remap))]
        return self._launcher.start_module(
            module, arguments, name, parameters, namespace=namespace, arguments=ros_arguments
        ).pid

    def spin_until(self, condition: Callable[[], Any], what: str, longest_nap: float = 0.1) -> None:
        """Spin until ``condition`` holds.

        Args:
            condition: is looked at after each message.
            what: is waited for.
            longest_nap: time after which it is looked at without a message, too [s].

        Raises:
            NoAnswerError: if it does not; the text says how each process is.
        """
        try:
            self.wait_for(condition, what, TIMEOUT, longest_nap)
        except TimeoutError as error:
            raise self.no_answer(str(error)) from None

    def no_answer(self, reason: str) -> NoAnswerError:
        """Return an error with a ``reason``, and how each process is."""
        states = "; ".join(map(self._state_of, self._launcher.started))
        return NoAnswerError(f"{reason}: {states}")

    def _state_of(self, node: RunningNode) -> str:
        """Tell whether a process runs, and what ``ik_node`` says of itself."""
        place = f"{node.name} in {node.namespace}"
        if not node.is_running:
            return f"{place} ended with exit code {node.process.returncode}"
        if node.name != "ik_node":
            return f"{place} is running"
        # It is latched, so it can be listened to when it is needed.
        topic = f"{node.namespace.rstrip('/')}/ik_node/status"
        statuses = self.record(DiagnosticStatus, topic, LATCHED)
        with suppress(TimeoutError):
            self.wait_for(lambda: statuses, "a status", STATUS_TIMEOUT)
        return f"{place} is running, {statuses[-1].message if statuses else 'without a status'}"

    def stop(self) -> None:
        """End all processes that were started and not yet ended."""
        self._launcher.stop()

    def close(self) -> None:
        """End all processes, and the probe."""
        self.stop()
        super().close()


@contextmanager
def session() -> Iterator[Session]:
    """Give a session in a domain of its own.

    By default on the loopback address alone; what is set in the environment is used instead.
    """
    with own_domain():
        choose_transport(COMPUTER)
        with own_context() as context:
            running = Session(context)
            try:
                yield running
            finally:
                running.close()
