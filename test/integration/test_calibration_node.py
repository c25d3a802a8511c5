"""calibration_node as a process, beside ik_node and a simulated machine with a plate.

What ends or refuses a probe, and when, test/calibration/session/test_led_probes.py shows.
"""

import re
import signal

import pytest
from geometry_msgs.msg import Point, PoseStamped
from shared_machine import shared_nodes
from std_srvs.srv import Trigger

from testing.commands import LIMITS, check, stream_of
from testing.machine import Machine
from tri_glide_interfaces.msg import MachineState
from tri_glide_interfaces.srv import (
    DropMeasurement,
    ListMeasurements,
    LoadMeasurements,
    ProbePlate,
    RecordDistanceEnd,
    RecordPosition,
    RecordTouch,
    SaveMeasurements,
    SolveCalibration,
)
from tri_glide_kinematics.calibration.fit import load_measurements
from tri_glide_kinematics.calibration.session import BACK_TOLERANCE
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide

MACHINE = TriGlide(DEFAULT_GEOMETRY)
STOPPING = MachineState.STOPPING
PLATE = 0.2
ABOVE = (0.03, -0.02, PLATE + 0.003)
# At 2 mm/s the platform moves by 8 µm from one measurement to the next.
EXACT = 2e-5
# A touch is as exact as that where heights are measured so often [1/s].
RATE = 250.0


class Calibration:
    """A client of calibration_node."""

    def __init__(self, machine, client, nodes):
        self.machine, self.client, self._nodes = machine, client, nodes

    def start(self, folder):
        self.folder = folder
        self.node = self._nodes.start("calibration_node", {"folder": str(folder)})
        rate = {"rate": RATE}
        self.machine.start({"twist_timeout": 1.0, **rate}, {"plate_height": PLATE, **rate})
        return self.wait_until_connected()

    def start_anew(self, parameters=None, number=signal.SIGINT):
        """End the node, and start another one with the same machine."""
        self.node.signal(number)
        self.client.wait_for(
            lambda: self.client.node.count_publishers("target_twist") == 1, "the end of the node"
        )
        self.node = self._nodes.start(
            "calibration_node", {"folder": str(self.folder), **(parameters or {})}
        )
        return self.wait_until_connected()

    def wait_until_connected(self):
        """Wait until it hears all that it needs."""
        self.client.wait_for(
            lambda: self.client.node.count_publishers("target_twist") == 2, "calibration_node"
        )
        self.client.wait_for(lambda: self.call(RecordTouch, "record_touch").success, "measurements")
        self.call(DropMeasurement, "drop")
        return self

    def call(self, kind, service, **fields):
        return self.client.call(kind, f"calibration_node/{service}", kind.Request(**fields))

    def probe(self):
        """Probe once and return the answer: a call that asks again would come to another probe."""
        client = self.client.node.create_client(ProbePlate, "calibration_node/probe")
        self.client.wait_for(client.service_is_ready, "the service")
        asked = client.call_async(ProbePlate.Request())
        self.client.wait_for(asked.done, "the end of the probe")
        return asked.result()

    @property
    def lines(self):
        return self.call(ListMeasurements, "list").measurements


@pytest.fixture(scope="class")
def shared_calibration(ros_domain, ros_context, tmp_path_factory):
    """Start one machine for all tests that leave it as it was."""
    with shared_nodes(ros_context, tmp_path_factory, "calibration") as (client, launcher):
        folder = tmp_path_factory.mktemp("files")
        yield Calibration(Machine(client, launcher), client, launcher).start(folder)


NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def assert_same_words(lines: list[str], others: list[str]) -> None:
    """Check that the words are the same, and the numbers but for rounding.

    A file has 12 digits of a number and a line 7: what is read may be rounded to the next one.
    """
    assert [NUMBER.sub("#", each) for each in lines] == [NUMBER.sub("#", each) for each in others]
    for line, other in zip(lines, others):
        ours, theirs = (list(map(float, NUMBER.findall(each))) for each in (line, other))
        assert ours == pytest.approx(theirs, rel=2e-6, abs=1e-9)


class TestOneMachine:
    """What leaves the machine as it was."""

    @pytest.fixture
    def started(self, shared_calibration):
        """Return one that has not measured yet, with its machine at rest."""
        shared_calibration.machine.wait_for_state("idle")
        shared_calibration.machine.forget()
        while shared_calibration.lines:
            assert shared_calibration.call(DropMeasurement, "drop").success
        return shared_calibration

    def test_a_probe_finds_the_plate_and_comes_back(self, started):
        calibration, machine, client = started, started.machine, started.client
        poses = client.record(PoseStamped, "true_pose")
        machine.move(ABOVE)
        first = len(machine.commands)
        answer = calibration.probe()
        assert answer.success, answer.message
        assert answer.number == 1
        x, y, z = MACHINE.forward(tuple(answer.heights))
        assert (x, y) == pytest.approx(ABOVE[:2], abs=EXACT)
        assert z == pytest.approx(PLATE, abs=EXACT)
        now = client.now()
        client.wait_for(lambda: client.time_of(poses[-1]) > now, "the newest pose")
        lowest = min(pose.pose.position.z for pose in poses)
        assert 0.0 < answer.overrun < 2e-4
        assert z - answer.overrun == pytest.approx(lowest, abs=EXACT)
        # Back where it began, and within all limits on the way.
        machine.wait_for_measured_rest()
        place = poses[-1].pose.position
        assert (place.x, place.y, place.z) == pytest.approx(ABOVE, abs=2.0 * BACK_TOLERANCE)
        check(stream_of(machine, first, 1.0 / RATE), LIMITS)
        assert calibration.lines[0].startswith("1: touch of plate 'bed' ±10 µm at heights")

    def test_requests_without_a_meaning_get_a_reason(self, started):
        calibration = started
        nan = float("nan")
        for kind, service, fields, words in (
            (RecordTouch, "record_touch", {"standard_deviation": nan}, "standard_deviation"),
            (RecordPosition, "record_position", {"position": Point(x=nan)}, "measured position"),
            (RecordDistanceEnd, "record_distance_end", {"distance": -0.1}, "at least 0"),
            (ProbePlate, "probe", {"depth": 10.0}, "depth = 10 m must be at most 1 m"),
            (DropMeasurement, "drop", {"number": 1}, "no measurement 1, only 0"),
            (SaveMeasurements, "save", {"file": "../../x"}, "'../../x' is no file in the folder"),
            (SaveMeasurements, "save", {"file": "no/x"}, "cannot be written"),
            (LoadMeasurements, "load", {"file": "/etc/passwd"}, "is no file in the folder"),
            (LoadMeasurements, "load", {"file": "none.yaml"}, "cannot be read"),
            (SolveCalibration, "solve", {}, "needed"),
        ):
            answer = calibration.call(kind, service, **fields)
            assert not answer.success
            assert words in answer.message, answer.message
        assert calibration.call(Trigger, "stop").message == "nothing is under way"
        assert calibration.lines == []
        assert "internal error" not in calibration.node.output

    def test_measurements_are_noted_listed_dropped_and_kept_though_the_node_is_killed(
        self, started
    ):
        calibration, machine, folder = started, started.machine, started.folder
        earlier = set(folder.glob("session_*.yaml"))
        machine.move((0.0, 0.0, 0.3))
        machine.wait_for_measured_rest()
        touch = calibration.call(
            RecordTouch, "record_touch", plate="glass", standard_deviation=3e-5
        )
        place = calibration.call(
            RecordPosition, "record_position", position=Point(x=1.0, y=2.0, z=3.0), frame="camera"
        )
        assert (touch.number, place.number) == (1, 2)
        assert calibration.call(RecordDistanceEnd, "record_distance_end").success
        listed = calibration.call(ListMeasurements, "list")
        assert listed.message == "missing: the second end of a distance"
        machine.move((0.1, 0.0, 0.3))
        machine.wait_for_measured_rest()
        end = calibration.call(RecordDistanceEnd, "record_distance_end", distance=0.1)
        assert (end.success, end.number) == (True, 3), end.message
        assert calibration.call(DropMeasurement, "drop", number=2).success
        before = list(calibration.lines)
        assert len(before) == 2

        # Each one is on the disk when its service has answered.
        calibration.start_anew(number=signal.SIGKILL)
        (kept,) = {
            file
            for file in set(folder.glob("session_*.yaml")) - earlier
            if load_measurements(file).distances
        }
        content = load_measurements(kept)
        assert content.touches[0].plate.height is None
        assert content.touches[0].standard_deviation == pytest.approx(3e-5)
        distance = content.distances[0]
        ends = [
            MACHINE.forward(heights) for heights in (distance.heights_from, distance.heights_to)
        ]
        assert ends[0] == pytest.approx((0.0, 0.0, 0.3), abs=EXACT)
        assert ends[1] == pytest.approx((0.1, 0.0, 0.3), abs=EXACT)
        loaded = calibration.call(LoadMeasurements, "load", file=kept.name)
        assert (loaded.success, loaded.count) == (True, 2), loaded.message
        assert_same_words(calibration.lines, before)
        machine.wait_for_measured_rest()
        assert calibration.call(RecordTouch, "record_touch").number == 3
        # It goes on in a file of its own.
        assert load_measurements(kept) == content
        assert calibration.call(SaveMeasurements, "save", file="all.yaml").success
        assert len(load_measurements(folder / "all.yaml").touches) == 2

    def test_no_parameter_file_is_written_of_what_contradicts_the_priors(self, started):
        """The plate is 10 mm lower than it is told to be, which is no error of the machine."""
        calibration, machine, folder = started, started.machine, started.folder
        calibration.start_anew({"plate_height": PLATE + 0.01, "prior_height_offsets": 0.001})
        for place in ((0.0, 0.1), (-0.09, -0.05), (0.09, -0.05), (0.0, 0.0)):
            machine.move((*place, PLATE))
            machine.wait_for_measured_rest()
            assert calibration.call(RecordTouch, "record_touch").success
        file = folder / "calibrated.yaml"
        answer = calibration.call(SolveCalibration, "solve", parameter_file="../calibrated.yaml")
        assert "is no file in the folder" in answer.message
        answer = calibration.call(SolveCalibration, "solve", parameter_file=str(file))
        assert not answer.success
        assert answer.message.startswith(
            "no parameter file: measurements and assumptions contradict"
        )
        assert "standard deviations from what was assumed" in answer.message
        assert not file.exists()
        # Without a file, all of it is told.
        answer = calibration.call(SolveCalibration, "solve")
        assert answer.success, answer.message
        assert "NOT VALID" in answer.message
        # Where the platform may be is saved, too: with it, no place outside is proposed.
        measurements = folder / "measurements.yaml"
        assert calibration.call(SaveMeasurements, "save", file=str(measurements)).success
        assert load_measurements(measurements).workspace.lower_heights == pytest.approx((0.3,) * 3)
