"""Faults that only real processes have, in every state: the documents tell what the machine did."""

import resource
import signal
from contextlib import contextmanager
from pathlib import Path

from rcl_interfaces.srv import ListParameters
from std_srvs.srv import Trigger

from testing.byte_fuzzing import Fuzzer
from testing.commands import PAUSE, assert_stretches_within_limits
from testing.held_client import CEASED, READY
from testing.machine import Machine
from tri_glide_interfaces.srv import RecordTouch, SaveMeasurements
from tri_glide_kinematics.calibration.fit import load_measurements

DOCUMENT = Path(__file__).parents[2] / "docs" / "faults.md"
HOME = (0.0, 0.0, 0.25)
FAR = (0.05, 0.03, 0.32)
SLOWLY = (0.005, 0.0, 0.0)
# What a client sends in turn to bring a machine into a state: where to, or how fast.
CLIENTS = {
    "moving": ("pose", FAR, HOME),
    "jogging": ("twist", SLOWLY, SLOWLY),
    "tracking": ("state", HOME, HOME),
    "path": ("path", FAR, HOME),
    "paused": ("tour", FAR, HOME),
}
STATES = ("waiting", "idle", *CLIENTS, "fault", "disabled")
NOT_LED = ("waiting", "fault", "disabled")
# None of them can be read as a request of any kind, not even as one that holds nothing.
UNREADABLE = (b"\0", b"\0\1\0\0", b"\0\7\0\0", b"\0\3\0\0\0", b"\xff" * 5)
SOME = 10  # commands
SILENCE = 0.6  # s, of a client that has let go
NOTHING = "-"  # there is nobody to kill, or nothing new in it


class Campaign:
    """A machine, one who commands it, and calibration_node, which writes files.

    Attributes:
        cells: what the machine did, by state and fault.
    """

    def __init__(self, client, nodes, folder):
        self.client, self.nodes, self.folder = client, nodes, folder
        self.machine = Machine(client, nodes)
        self.clients = {}
        self.cells = {}

    def start(self):
        """Start all but the simulator."""
        for state, (kind, *places) in CLIENTS.items():
            numbers = (str(number) for place in places for number in place)
            self.clients[state] = self.nodes.start_module(
                "testing.held_client", (kind, *numbers), "held_client"
            )
        silences = {"twist_timeout": SILENCE, "target_timeout": SILENCE}
        self.machine.start_ik({"speed_scale": 0.1, "measured_timeout": 0.5, **silences})
        self.files = self.nodes.start("calibration_node", {"folder": str(self.folder)})
        self.machine.wait_for_state("waiting")
        for each in self.clients.values():
            self.client.wait_for(lambda each=each: READY in each.output, READY)

    def enter(self, state):
        """Bring the machine into a ``state``, from rest."""
        machine = self.machine
        if state == "disabled":
            assert self.client.enable(False).success
        if state == "fault":
            self.kill_simulator()
        if state in CLIENTS:
            self.clients[state].process.send_signal(signal.SIGUSR1)
            machine.wait_for_state("moving" if state in ("paused", "path") else state)
        if state == "paused":
            self.call("pause")
            machine.wait_for_state("paused")

    def call(self, name):
        """Call a service of ik_node, as an operator does."""
        assert self.client.call(Trigger, f"ik_node/{name}", Trigger.Request()).success

    def record(self, state, fault, do):
        """Let something happen in a ``state``, and note what the machine did."""
        machine, count = self.machine, len(self.machine.states)
        first = machine.state
        do(state)
        self.client.wait_for(lambda: machine.state != "moving", "the end of a motion")
        self.client.wait_for(lambda: machine.state != "stopping", "the end of a stop")
        names = [first, *machine.states_since(count)]
        if machine.state in NOT_LED:
            self.client.wait_for(self.are_commands_over, "the last setpoint")
        else:
            machine.catch_up()
        led = "" if machine.state not in NOT_LED else ", no setpoints"
        self.cells[state, fault] = " → ".join(names) + led

    def are_commands_over(self):
        """Tell whether no setpoint has come for some time."""
        commands = self.machine.commands
        return not commands or self.client.now() - self.client.time_of(commands[-1]) > PAUSE

    def listed(self):
        """Let ik_node answer, after all that came before."""
        kind = ListParameters
        assert self.client.call(kind, "ik_node/list_parameters", kind.Request())

    def hear_some(self):
        """Wait for some more commands where the machine is led."""
        if self.machine.state not in NOT_LED:
            first = len(self.machine.commands)
            self.client.wait_for(lambda: len(self.machine.commands) > first + SOME, "commands")

    def send_bytes(self, _=None):
        """Send what cannot be read to all that ik_node listens to, but the setpoints."""
        # An answer waits for all clients to be known in full, and who only writes never is.
        fuzzer = Fuzzer(self.client, ["ik_node"], but=("joint_commands",))
        for each in fuzzer.inputs:
            for data in UNREADABLE:
                each.send(data)
        self.hear_some()
        fuzzer.close()
        self.listed()
        assert self.machine.ik.is_running

    def fill_disk(self, _=None):
        """Let no node write on, as if the disk were full, and ask for a file."""
        with full(self.machine.ik), full(self.files):
            answer = self.saved("full.yaml")
            assert not answer.success
            self.hear_some()
        if self.machine.state != "waiting":
            assert "cannot be written" in answer.message, answer.message

    def saved(self, name):
        kind = SaveMeasurements
        return self.client.call(kind, "calibration_node/save", kind.Request(file=name))

    def kill_client(self, state):
        self.clients.pop(state).signal(signal.SIGKILL)
        wanted = "paused" if self.machine.state == "paused" else "idle"
        self.machine.wait_for_state(wanted)

    def kill_simulator(self, _=None):
        self.machine.simulator.signal(signal.SIGKILL)
        if self.machine.state not in NOT_LED:
            self.machine.wait_for_state("fault")

    def rest(self, state):
        """Bring the machine to rest, which a client has brought into a ``state``."""
        machine = self.machine
        each = self.clients.get(state)
        if each is not None:
            each.forget_output()
            each.process.send_signal(signal.SIGUSR2)
            self.client.wait_for(lambda: CEASED in each.output, CEASED)
        let_go = self.client.now()
        if not machine.simulator.is_running:
            # After a fault it is heard again when it has let go.
            let_go += 2e9 * SILENCE
            machine.start_simulator()
        self.client.wait_for(lambda: self.client.enable().success, "the machine to be enabled")
        if machine.state == "paused":
            self.call("stop")
        machine.wait_for_state("idle")
        if state in ("jogging", "tracking"):
            self.client.wait_for(lambda: self.client.now() > let_go, "a client to let go")


@contextmanager
def full(node):
    """Let a ``node`` write no file, as if the disk were full."""
    before = resource.prlimit(node.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(node.pid, resource.RLIMIT_FSIZE, (0, before[1]))
    try:
        yield
    finally:
        resource.prlimit(node.pid, resource.RLIMIT_FSIZE, before)


FAULTS = {
    "bytes on all inputs": "send_bytes",
    "full disk": "fill_disk",
    "simulator killed": "kill_simulator",
    "client killed": "kill_client",
}


LEFT_OUT = {("fault", "kill_simulator")} | {
    (state, "kill_client") for state in STATES if state not in CLIENTS
}


def table(cells):
    """Return the lines of the table in the documents."""
    lines = ["| state | " + " | ".join(FAULTS) + " |", "|---" * (len(FAULTS) + 1) + "|"]
    for state in STATES:
        row = " | ".join(cells.get((state, fault), NOTHING) for fault in FAULTS)
        lines.append(f"| {state} | {row} |")
    return "\n".join(lines)


def test_every_fault_of_processes_in_every_state(client, nodes, tmp_path):
    campaign = Campaign(client, nodes, tmp_path)
    campaign.start()
    machine = campaign.machine
    for fault in ("bytes on all inputs", "full disk"):
        campaign.record("waiting", fault, getattr(campaign, FAULTS[fault]))
    machine.start_simulator()
    machine.wait_for_state("idle")
    kind = RecordTouch
    client.wait_for(
        lambda: client.call(kind, "calibration_node/record_touch", kind.Request()).success,
        "a measurement",
    )
    for state in STATES[1:]:
        for fault, name in FAULTS.items():
            if (state, name) in LEFT_OUT:
                continue
            campaign.enter(state)
            campaign.record(state, fault, getattr(campaign, name))
            campaign.rest(state)
    # Nothing is lost: there is room again.
    answer = campaign.saved("room.yaml")
    assert answer.success, answer.message
    assert len(load_measurements(tmp_path / "room.yaml").touches) == 1
    assert machine.ik.is_running
    assert_stretches_within_limits(machine)
    found = table(campaign.cells)
    print(found)
    assert found in DOCUMENT.read_text()
