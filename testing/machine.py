"""The simulator and ik_node of one namespace, and what a client hears of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from sensor_msgs.msg import JointState

from testing.client import LATCHED, Client
from testing.processes import TIMEOUT, Launcher, RunningNode
from testing.taking import taken_as_sent
from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import Cause
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.ros.outputs import STATES

JOINTS = ("slider_1", "slider_2", "slider_3")
# A computer that runs other things too may keep the simulator waiting for longer than a machine
# should be silent; then its sliders are late, and jump.
PATIENCE = {"measured_timeout": 1.0, "jump_limit": 0.1, "tracking_error_limit": 0.3}
# Below that by default: most of the processor is left to what is tested [1/s].
RATE = 50.0


class Machine:
    """The simulator and ik_node of one namespace, and what the client hears of them."""

    def __init__(
        self,
        client: Client,
        launcher: Launcher,
        namespace: str | None = None,
        *,
        listen: bool = True,
    ) -> None:
        """Listen to the state, and unless ``listen`` is false to commands and measurements."""
        self.client = client
        self.namespace = namespace or client.namespace
        self._launcher = launcher
        self._listen = listen
        self.commands: list[JointState] = []
        self.measured: list[JointState] = []
        if listen:
            self.commands = client.record(
                JointState, f"{self.namespace}/joint_commands", take=taken_as_sent
            )
            self.measured = client.record(JointState, f"{self.namespace}/joint_states")
        topic = f"{self.namespace}/ik_node/machine_state"
        self.states: list[MachineState] = client.record(MachineState, topic, LATCHED)

    def start_simulator(
        self, parameters: dict[str, Any] | None = None, prefix: Sequence[str] = ()
    ) -> RunningNode:
        """Start its sliders."""
        self.simulator = self._launcher.start(
            "simulator_node",
            {"rate": RATE, **(parameters or {})},
            namespace=self.namespace,
            prefix=prefix,
        )
        return self.simulator

    def start_ik(
        self, parameters: dict[str, Any] | None = None, prefix: Sequence[str] = ()
    ) -> RunningNode:
        """Start ik_node, more patient than by default."""
        parameters = {"rate": RATE, **PATIENCE, **(parameters or {})}
        self.ik = self._launcher.start(
            "ik_node", parameters, namespace=self.namespace, prefix=prefix
        )
        return self.ik

    def start(
        self,
        parameters: dict[str, Any] | None = None,
        simulator_parameters: dict[str, Any] | None = None,
        prefix: Sequence[str] = (),
    ) -> Machine:
        """Start both and wait until setpoints come."""
        self.start_simulator(simulator_parameters, prefix)
        self.start_ik(parameters, prefix)
        self.wait_until_connected()
        return self

    def heard_by(self, client: Client) -> Machine:
        """Return this running machine as another ``client`` in its namespace hears it, idle.

        What the nodes have written so far is forgotten.
        """
        other = Machine(client, self._launcher)
        other.simulator, other.ik = self.simulator, self.ik
        other.simulator.forget_output()
        other.ik.forget_output()
        client.wait_for(lambda: other.states, "a state")
        if other.state in ("fault", "disabled"):
            client.wait_for(lambda: client.enable().success, "a machine that may move")
        other.wait_until_connected()
        return other

    def wait_until_connected(self) -> None:
        """Wait until the machine is idle, commands come, and targets get there."""
        self.wait_for_state("idle")
        if self._listen:
            self.client.wait_for(lambda: self.commands and self.measured, "joint commands")
        if self.namespace == self.client.namespace:
            self.wait_until_targets_get_there()

    def wait_until_targets_get_there(self) -> None:
        """Send targets that are refused until both refusals have come.

        A publisher may know of a subscription before that knows of it, and what it publishes
        meanwhile is lost.
        """

        def connected() -> bool:
            refused = [f"refused a target {kind}: " in self.ik.output for kind in ("pose", "twist")]
            if not refused[0]:
                self.client.send_pose((0.0, 0.0, 0.0), "connecting")
            if not refused[1]:
                self.client.send_twist((0.0, 0.0, 0.0), "connecting")
            return all(refused)

        self.client.wait_for(connected, "ik_node to hear targets")

    @property
    def state(self) -> str:
        """Name of the latest state; empty before the first."""
        return name_of(self.states[-1]) if self.states else ""

    @property
    def cause(self) -> Cause | None:
        """Cause of the latest state; None before the first."""
        return Cause(self.states[-1].cause) if self.states else None

    @property
    def reason(self) -> str:
        """Reason of the latest state, as people read it."""
        return self.states[-1].reason if self.states else ""

    def wait_for_refusal(self, refusal: Refusal, action: Callable[[], Any] = lambda: None) -> None:
        """Do something and wait until it is told that a command was refused in this way."""
        count = self.states[-1].refused

        def told() -> bool:
            return self.states[-1].refused > count and self.states[-1].refusal == refusal

        action()
        self.client.wait_for(told, f"a refusal: {refusal.name}")

    def wait_for_state(self, state: str, timeout: float = TIMEOUT) -> None:
        """Wait until this is the latest state, or was one since the call.

        On a busy computer several states come at once.
        """
        first = max(len(self.states) - 1, 0)
        self.client.wait_for(
            lambda: state in map(name_of, self.states[first:]), f"state {state}", timeout
        )

    def wait_for_new_state(self, state: str, action: Callable[[], Any]) -> None:
        """Do something and wait until the machine has gone over to the state once more."""
        count = len(self.states)
        action()
        self.client.wait_for(lambda: state in self.states_since(count), f"state {state}")

    def states_since(self, count: int) -> list[str]:
        """Return the names of the states that the machine went over to after ``count`` messages.

        A message that only tells another reason or a refusal is left out.
        """
        names = [name_of(state) for state in self.states[max(count - 1, 0) :]]
        before = names[:1] if count else [""]
        names = names[1:] if count else names
        return [name for last, name in zip([*before, *names], names) if name != last]

    def move(self, position: Sequence[float]) -> None:
        """Send a target and wait until the sliders are at rest there."""
        self.wait_for_new_state("idle", lambda: self.client.send_pose(position))
        self.catch_up()

    def get_going(self, position: Sequence[float], speed: float) -> None:
        """Send a target and wait until a slider is commanded to move faster than ``speed``.

        All setpoints since then are looked at: on a busy computer many come at once.
        """
        looked_at = len(self.commands)
        self.client.send_pose(position)

        def is_fast() -> bool:
            nonlocal looked_at
            new, looked_at = self.commands[looked_at:], len(self.commands)
            return any(max(map(abs, each.velocity)) > speed for each in new)

        self.client.wait_for(is_fast, "full motion")

    def forget(self) -> None:
        """Forget what was heard so far, but for the latest state, and what the nodes have written.

        So a machine that others have used is as good as a new one.
        """
        self.catch_up()
        del self.commands[:-1], self.measured[:-1], self.states[:-1]
        self.ik.forget_output()
        self.simulator.forget_output()

    def catch_up(self) -> None:
        """Wait until a command of this moment is here: messages wait in a queue before that."""
        now = self.client.now()
        self.client.wait_for(
            lambda: self.client.time_of(self.commands[-1]) >= now, "a command of this moment"
        )

    def commands_since(self, time: int) -> list[JointState]:
        """Return the commands that were sent after ``time`` [ns]."""
        return [message for message in self.commands if self.client.time_of(message) > time]

    def wait_for_measured_rest(self) -> None:
        """Wait until the sliders are measured to stand still, from this moment on."""
        now = self.client.now()

        def resting() -> bool:
            message = self.measured[-1]
            slow = max(map(abs, message.velocity)) < 1e-6
            return slow and self.client.time_of(message) > now

        self.client.wait_for(resting, "the sliders to stand still")

    def wait_until_measurements_are_read(self) -> None:
        """Wait until ik_node, too, has what is measured now: each reads its own messages."""
        count = len(self.measured)
        self.client.wait_for(lambda: len(self.measured) > count + 20, "newer measurements")

    def heights(self, message: JointState | None = None) -> tuple[float, ...]:
        """Return the heights of a message, in the order of the sliders; of the latest command."""
        message = message or self.commands[-1]
        return tuple(message.position[message.name.index(name)] for name in JOINTS)


def name_of(message: MachineState) -> str:
    """Return the name of a state, in small letters."""
    return STATES[message.state].name.lower()
