"""calibration_node finds the modes of a simulated machine, or says why it does not.

What ends or refuses a search, and when, test/calibration/session/test_led_searches.py shows.
"""

import signal
from pathlib import Path

import pytest
import yaml
from geometry_msgs.msg import Vector3
from shared_machine import shared_nodes

from testing.client import Client
from testing.commands import KINEMATICS, assert_within_limits
from testing.machine import Machine
from tri_glide_interfaces.srv import FindModes, ListMeasurements
from tri_glide_kinematics.calibration.ringdown import find_modes, load_recording

PLACE = (0.0, 0.0, 0.3)
FREQUENCIES, DAMPINGS = (15.0, 22.0, 22.0), (0.03, 0.02, 0.02)
# Two modes: those along y and z are one to a shaper.
SWINGING = {
    "swing_frequencies": FREQUENCIES,
    "swing_dampings": DAMPINGS,
    "accelerometer_noise": 0.02,
}
# Promised: of a frequency as a part of it, of a damping.
FREQUENCY, DAMPING = 0.01, 0.01
ALONG_X = [Vector3(x=1.0)]
PATIENCE = 60.0
COMMAND = "tri_glide_kinematics.commands.ringdown"
EXAMPLE = Path(__file__).parents[2] / "config" / "ringdown_example.csv"


class Searching:
    """A client of calibration_node beside a machine that swings."""

    def __init__(self, machine: Machine, client: Client, nodes, folder):
        self.machine, self.client, self.nodes, self.folder = machine, client, nodes, folder
        self.start_node()
        self.asking = client.node.create_client(FindModes, "calibration_node/find_modes")

    def start_node(self):
        self.node = self.nodes.start("calibration_node", {"folder": str(self.folder)})

    def command(self):
        """Start the command that lets the machine swing."""
        return self.nodes.start_module(COMMAND, ["--machine"], "ringdown", {})

    def ask(self, **fields):
        """Ask for a search, and return the future of its answer."""
        self.client.wait_for(self.asking.service_is_ready, "the service")
        # The node knows this client when it has answered it.
        self.client.call(ListMeasurements, "calibration_node/list", ListMeasurements.Request())
        return self.asking.call_async(FindModes.Request(**fields))

    def get_going(self, **fields):
        """Ask until the platform moves, and return the future of the answer.

        A node that has just started may not have heard the machine yet, and refuses.
        """
        asked, count = self.ask(**fields), len(self.machine.states)

        def is_moving():
            nonlocal asked
            if asked.done():
                asked = self.ask(**fields)
            return "moving" in self.machine.states_since(count)

        self.client.wait_for(is_moving, "a search that moves the platform", PATIENCE)
        return asked

    def answer(self, asked):
        self.client.wait_for(asked.done, "the modes", PATIENCE)
        return asked.result()

    def find(self, **fields):
        return self.answer(self.ask(**fields))


@pytest.fixture(scope="class")
def shared_searching(ros_domain, ros_context, tmp_path_factory):
    """Start one machine for all tests that leave it as it was."""
    with shared_nodes(ros_context, tmp_path_factory, "modes") as (client, launcher):
        folder = tmp_path_factory.mktemp("files")
        machine = Machine(client, launcher)
        started = Searching(machine, client, launcher, folder)
        machine.start(None, SWINGING)
        yield started


class TestOneMachine:
    """What leaves the machine as it was."""

    @pytest.fixture
    def started(self, shared_searching):
        machine = shared_searching.machine
        machine.wait_for_state("idle")
        machine.move(PLACE)
        machine.wait_for_measured_rest()
        machine.forget()
        return shared_searching

    def test_the_modes_are_those_of_the_simulated_machine(self, started):
        first = len(started.machine.commands)
        for fields in ({"recordings": "../x"}, {"parameter_file": "/etc/passwd"}):
            assert "is no file in the folder" in started.find(**fields).message
        answer = started.find(
            directions=ALONG_X,
            recordings="swing",
            parameter_file="modes.yaml",
            shaper="zvd",
            duration=1.0,
        )
        assert answer.success, answer.message
        assert answer.reason == FindModes.Response.NONE
        assert answer.swings == 3
        place = min(
            range(len(answer.frequencies)),
            key=lambda i: abs(answer.frequencies[i] - FREQUENCIES[0]),
        )
        assert answer.frequencies[place] == pytest.approx(FREQUENCIES[0], rel=FREQUENCY)
        assert answer.dampings[place] == pytest.approx(DAMPINGS[0], abs=DAMPING)
        assert 0.0 < answer.frequency_deviations[place] < FREQUENCY * FREQUENCIES[0]
        assert 0.0 < answer.damping_deviations[place] < DAMPING
        assert answer.seen[place] == 3
        # The platform is back, and kept all limits.
        assert KINEMATICS.forward(started.machine.heights()) == pytest.approx(PLACE, abs=1e-5)
        assert_within_limits(started.machine, first)
        # The command ringdown reads what was recorded.
        swings = (find_modes(load_recording(started.folder / f"swing_{i}.csv")) for i in (1, 2, 3))
        lowest = min(mode.frequency for found in swings for mode in found.modes)
        assert lowest == pytest.approx(15.0, rel=FREQUENCY)
        written = yaml.safe_load((started.folder / "modes.yaml").read_text())
        values = written["ik_node"]["ros__parameters"]
        assert values["shaper"] == "zvd"
        assert values["mode_frequencies"] == pytest.approx(list(answer.frequencies), abs=1e-5)

    def test_ctrl_c_of_the_command_stops_the_machine(self, started):
        command = started.command()
        command.exit_codes = (130,)
        started.machine.wait_for_new_state("moving", lambda: None)
        command.process.send_signal(signal.SIGINT)
        assert command.process.wait(PATIENCE) == 130
        assert "ringdown: interrupted" in command.output
        assert "Traceback" not in command.output
        assert_nothing_moves_on(started.machine)

    def test_ctrl_c_ends_the_search_and_the_motion(self, started):
        asked = started.get_going(duration=1.0)
        started.node.process.send_signal(signal.SIGINT)
        answer = started.answer(asked)
        assert (answer.success, answer.message) == (False, "calibration_node ends")
        assert started.node.process.wait(PATIENCE) == 0
        assert_nothing_moves_on(started.machine)
        started.start_node()
        # Before that, Ctrl-C at the end of all tests would find no node that handles it.
        started.client.wait_for(lambda: "TRI_GLIDE_TRANSPORT" in started.node.output, "the node")


def test_the_command_reads_the_recordings_of_which_it_is_told(client, nodes, tmp_path):
    """Here the test answers, without a search: the machine swings in the tests above."""
    asked = []

    def answer(request, response):
        asked.append((request.recordings, request.source))
        response.files = [str(EXAMPLE)]
        return response

    client.node.create_service(FindModes, "calibration_node/find_modes", answer)
    modes = tmp_path / "modes.yaml"
    options = ["--machine", "--heights", "--write", str(modes)]
    command = nodes.start_module(COMMAND, options, "ringdown", {})
    client.wait_for(lambda: not command.is_running, "the end of the command")
    assert command.process.returncode == 0, command.output
    assert asked == [("swing", FindModes.Request.MEASURED_HEIGHTS)]
    assert "Mode 2: frequency 23.9" in command.output
    values = yaml.safe_load(modes.read_text())["ik_node"]["ros__parameters"]
    assert len(values["mode_frequencies"]) == 2


def assert_nothing_moves_on(machine):
    """Assert that the setpoints rest, for longer than a move begins after another command."""
    machine.wait_for_state("idle")
    machine.catch_up()
    first = len(machine.commands)
    machine.client.wait_for(lambda: len(machine.commands) > first + 50, "setpoints")
    assert len({machine.heights(message) for message in machine.commands[first:]}) == 1
