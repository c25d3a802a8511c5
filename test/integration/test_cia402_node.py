"""cia402_node between ik_node and simulated drives, on a bus behind a pseudo-terminal.

What a fault of one drive does to all, test/drives/test_group.py shows.
"""

import itertools
import math
import re
import signal
import subprocess
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.action import ActionClient
from sensor_msgs.msg import JointState
from shared_machine import shared_nodes
from std_srvs.srv import SetBool, Trigger

from testing.commands import KINEMATICS
from testing.goals import GoalClient, SentGoal
from testing.machine import JOINTS, Machine
from testing.processes import TIMEOUT
from tri_glide_interfaces.action import Home
from tri_glide_kinematics.ros.starting import executable

pytest.importorskip("canopen")

# Setpoints and heartbeats may come late on a computer with other work to do [s].
DELAY, HEARTBEAT = 0.45, 0.6
PERIOD = 0.01  # s, of setpoints
CAN = {
    "rate": 2.0 / PERIOD,
    "playout_delay": DELAY,
    "heartbeat_timeout": HEARTBEAT,
    "homing_speed": 0.3,
    "homing_acceleration": 5.0,
}
IK = {"drives_enable": "cia402_node/enable", "drive_delay": DELAY, "start_disabled": True}
COUNT = 1e-6  # m
HEIGHTS = ("0.86", "0.87", "0.88")  # m
NEAR, FAR = (0.0, 0.0, 0.5), (0.0, 0.0, 0.3)
TOLD = re.compile(r"^([\d.]+) drive (\d): (.*)$", re.MULTILINE)
ENABLED, STOPPED, OFF = "OPERATION ENABLED", "QUICK STOP ACTIVE", "SWITCH ON DISABLED"


class Drives:
    """Three simulated drives, and what they tell."""

    def __init__(self, link, log):
        self._log = log
        with log.open("ab") as output:
            self._process = subprocess.Popen(
                [executable("simulated_drives"), "--link", link, "--heights", *HEIGHTS],
                stdin=subprocess.PIPE,
                stdout=output,
            )

    def obey(self, line):
        """Have something wrong with a drive."""
        self._process.stdin.write(f"{line}\n".encode())
        self._process.stdin.flush()

    def told(self, since=0.0):
        """Return what the drives have told: times by their clock [s], nodes, texts."""
        found = TOLD.findall(self._log.read_text())
        return [(float(at), int(node), text) for at, node, text in found if float(at) > since]

    def which_told(self, text, since=0.0):
        """Return which drives have told a ``text``, and when they did so last."""
        return {node: at for at, node, said in self.told(since) if said == text}

    def all_told(self, text, since=0.0):
        return self.which_told(text, since).keys() == {1, 2, 3}

    def end(self):
        self._process.kill()
        self._process.wait(TIMEOUT)
        self._process.stdin.close()


class CanMachine(Machine):
    """ik_node, cia402_node and the drives."""

    def __init__(self, client, launcher, folder):
        super().__init__(client, launcher)
        self.link, self._log = folder / "can", folder / "drives.log"
        self._home = ActionClient(client.node, Home, "cia402_node/home")
        self.diagnostics = client.record(DiagnosticArray, "/diagnostics")

    def start_drives(self):
        self._log.write_text("")
        self.drives = Drives(self.link, self._log)
        self.client.wait_for(self.link.exists, "the adapter")

    def start_cia(self):
        self.is_homed = False
        self.cia = self._launcher.start("cia402_node", {**CAN, "channel": self.link})
        self.wait_until_told("off: not homed", "has stopped before")

    def wait_until_told(self, *texts):
        self.client.wait_for(
            lambda: any(text in self.cia.output for text in texts), f"cia402_node to tell {texts}"
        )

    def wait_until_drives_tell(self, text, since):
        """Wait until each has; what a process tells may be read after what another one tells."""
        self.client.wait_for(lambda: self.drives.all_told(text, since), f"{text} of all drives")

    def goal(self):
        self.client.wait_for(self._home.server_is_ready, "~/home")
        return SentGoal(self.client, self._home, Home.Goal())

    def home(self):
        result = self.goal().result()
        assert result.code == Home.Result.SUCCEEDED, result.text
        self.is_homed = True
        return result

    def reset(self):
        return self.client.call(Trigger, "cia402_node/reset", Trigger.Request())

    def enable(self):
        """Enable, once what goes on has come to its end."""
        self.client.wait_for(lambda: self.client.enable().success, "a machine that may move")
        self.wait_for_state("idle")

    def disable(self):
        """Disable, and wait until there is no torque."""
        before = time.monotonic()
        self.cia.forget_output()
        assert self.client.enable(False).success
        self.wait_until_told("]: off")
        self.wait_until_drives_tell(OFF, before)

    def ready(self):
        """Be homed, enabled and idle near the top, whatever was before."""
        if not self.cia.is_running:
            self.start_cia()
        # Refused where nothing is wrong.
        self.reset()
        if not self.is_homed:
            # An answer comes in 5 s, be it that a busy computer sets the drives up still.
            self.wait_until_told("]: off")
            self.home()
        if self.state != "idle":
            self.enable()
        self.cia.forget_output()
        self.move(NEAR)
        return time.monotonic()

    def wait_for_rest(self):
        """Wait until the drives are measured at one place for some time from now on."""
        first = len(self.measured)
        self.client.wait_for(
            lambda: (
                len(self.measured) > first + 20
                and len({tuple(each.position) for each in self.measured[-20:]}) == 1
            ),
            "rest",
        )

    def get_sliders_going(self):
        """Send a target and wait until the sliders move, some time after the setpoints."""
        self.get_going(FAR, 0.3)
        self.client.wait_for(lambda: any(self.measured[-1].velocity), "sliders that move")


@pytest.fixture(scope="module")
def machine(ros_context, tmp_path_factory):
    folder = tmp_path_factory.mktemp("can")
    with shared_nodes(ros_context, tmp_path_factory, "cia402") as (client, launcher):
        machine = CanMachine(client, launcher, folder)
        machine.start_drives()
        machine.start_cia()
        machine.start_ik(IK)
        yield machine
        machine.drives.end()


def test_from_homing_to_a_stop(machine):
    client, drives = machine.client, machine.drives
    assert not machine.measured
    assert not client.enable().success
    assert not drives.all_told(ENABLED)
    top = (0.9, 0.9, 0.9)
    assert machine.home().heights == pytest.approx(top, abs=1e-3)
    machine.wait_for_rest()
    assert machine.heights(machine.measured[-1]) == pytest.approx(top, abs=1e-4)
    machine.enable()
    machine.wait_until_targets_get_there()
    for target in ((0.0, 0.0, 0.5), (0.05, -0.03, 0.4)):
        machine.move(target)
        assert machine.heights(machine.measured[-1]) == pytest.approx(
            KINEMATICS.inverse(target), abs=5 * COUNT
        )
    goals = GoalClient(client)
    assert goals.follow([(0.0, 0.0, 0.4), (0.0, 0.05, 0.45)]).result().code == 0
    goals.close()
    machine.wait_for_new_state("jogging", lambda: client.send_twist((0.0, 0.0, -0.05)))
    machine.wait_for_state("idle")
    machine.get_going(FAR, 0.2)
    assert client.stop().success
    machine.wait_for_state("idle")
    machine.wait_for_rest()
    machine.disable()
    before = time.monotonic()
    machine.enable()
    machine.wait_until_drives_tell(ENABLED, before)


def test_homing_that_is_cancelled_leaves_no_heights(machine):
    machine.ready()
    machine.move(FAR)
    # It would be in fault, and take the torque away.
    refused = machine.goal().result()
    assert refused.code == Home.Result.REFUSED
    assert "setpoints come" in refused.text
    machine.disable()
    goal = machine.goal().wait_until_accepted()
    machine.client.wait_for(
        lambda: list(JOINTS) in [list(each.waiting) for each in goal.feedback], "the homing"
    )
    goal.cancel()
    assert goal.result().code == Home.Result.CANCELED
    machine.is_homed = False
    assert not goal.response.result.heights
    machine.wait_until_told("holding: ")
    count = len(machine.measured)
    machine.client.spin_for(10 * PERIOD)
    assert len(machine.measured) == count


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_drives_stop_by_themselves(machine, number):
    start = machine.ready()
    machine.get_sliders_going()
    machine.cia.process.send_signal(number)
    end = time.monotonic()
    machine.wait_until_drives_tell(STOPPED, start)
    stops = machine.drives.which_told(STOPPED, start).values()
    print(f"{number.name}: quick stop after {max(stops) - end:.3f} s, at most {HEARTBEAT + PERIOD}")
    assert max(stops) - min(stops) <= PERIOD
    machine.wait_for_state("fault")
    if number is signal.SIGSTOP:
        machine.cia.process.send_signal(signal.SIGCONT)
        machine.wait_until_told("this computer was away")
        # With torque, until a reset.
        assert not machine.drives.all_told(OFF, start)


def test_ctrl_c_leaves_drives_at_rest_that_hold(machine):
    start = machine.ready()
    machine.get_sliders_going()
    assert machine.cia.signal(signal.SIGINT) == 0
    machine.wait_until_drives_tell(STOPPED, start)
    assert not machine.drives.all_told(OFF, start)
    # The drives are a little behind the last target; without a ramp it would be 20 mm.
    heights = [each.position[0] for each in machine.measured[-3:]]
    assert max(heights) - min(heights) < 2e-3
    machine.wait_for_state("fault")


def test_the_node_ends_in_a_homing(machine):
    machine.ready()
    machine.disable()
    start, goal = time.monotonic(), machine.goal()
    machine.wait_until_drives_tell(ENABLED, start)
    assert machine.cia.signal(signal.SIGTERM) == 0
    assert goal.result().code == Home.Result.SHUTDOWN
    machine.wait_until_drives_tell(STOPPED, start)


def test_an_adapter_that_is_unplugged(machine):
    machine.ready()
    machine.get_going(FAR, 0.3)
    machine.drives.end()
    machine.client.wait_for(
        lambda: any(
            "bus lost: " in status.message
            for status in machine.client.statuses(machine.diagnostics, "cia402_node")
        ),
        "the loss in the diagnostics",
    )
    machine.wait_for_state("fault")
    assert not machine.client.enable(node="cia402_node").success
    machine.start_drives()
    # The bus is tried again now and then; drives that had no power have no home.
    machine.cia.forget_output()
    machine.client.wait_for(
        lambda: machine.reset().success or "]: off" in machine.cia.output, "drives"
    )
    machine.home()


def test_commands_are_read_by_name_and_checked(machine):
    machine.ready()
    assert machine.ik.signal(signal.SIGINT) == 0
    client = machine.client
    publisher = client.publisher(JointState, "joint_commands")
    client.wait_for_subscribers(publisher)
    held = machine.heights(machine.measured[-1])
    begin, heights = client.now(), (held[0] + 5e-4, *held[1:])
    stamps = itertools.count(1)

    def send(heights, velocity=(0.0, 0.0, 0.0)):
        """Send the next setpoint, in another order of names."""
        message = JointState(name=JOINTS[::-1], position=heights[::-1], velocity=velocity)
        stamp = begin + round(1e9 * next(stamps) * PERIOD)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        publisher.publish(message)

    for bad, reason in ((((math.nan, *held[1:]),), "nan"), ((held, ()), "lacks velocities")):

        def told(bad=bad, reason=reason):
            send(*bad)
            return reason in machine.cia.output

        client.wait_for(told, f"the reason {reason!r}")

    def arrived():
        send(heights)
        return machine.heights(machine.measured[-1]) == pytest.approx(heights, abs=2 * COUNT)

    client.wait_for(arrived, "slider 1 to be higher")
    machine.client.call(SetBool, "cia402_node/enable", SetBool.Request(data=False))
