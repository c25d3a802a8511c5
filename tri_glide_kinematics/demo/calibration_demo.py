"""The command ``calibration_demo``: a simulated machine is wrong, and is calibrated.

The nodes believe the drawing; the simulator is another machine. The plate is probed, three
distances are measured, the machine is calibrated, and ik_node is started again with the result.
"""

from __future__ import annotations

import math
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.qos import qos_profile_sensor_data

from tri_glide_interfaces.srv import (
    ProbePlate,
    RecordDistanceEnd,
    SaveMeasurements,
    SolveCalibration,
)
from tri_glide_kinematics.calibration.fit import (
    Calibration,
    MachineParameters,
    Priors,
    load_measurements,
    plane_basis,
)
from tri_glide_kinematics.calibration.session import report, save_parameters, solved
from tri_glide_kinematics.demo.client import (
    MOVE_TIMEOUT,
    START_TIMEOUT,
    DemoError,
    DemoNode,
    ros_that_ctrl_c_ends,
)
from tri_glide_kinematics.demo.running import (
    in_millimetres,
    node_arguments,
    run_demo,
    save_page,
    say,
)
from tri_glide_kinematics.ros.messages import vector_of
from tri_glide_kinematics.ros.starting import NodeProcesses
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.quiver import Quiver

ANSWER_TIMEOUT = 60.0  # s; a probe answers when it is back
# The longest arrow of the picture, as a part of the radius.
ARROW = 0.35
# The simulated sliders follow late: they rest if poses one after the other agree [m].
RESTING_POSES = 20
RESTING = 1e-7


class CalibrationClient(DemoNode):
    """Moves, asks, and looks at the true pose, which no real machine publishes."""

    def __init__(self) -> None:
        """Join the machine of this demonstration."""
        super().__init__("tri_glide_calibration_demo")
        self._clients_of: dict[str, Any] = {}

    def wait_until_gone(self) -> None:
        """Wait until no ik_node is there any more."""
        self.wait_for(lambda: not self.goals.is_ready, START_TIMEOUT, "ending ik_node")
        # The last state of one that has ended is none of the next.
        self.state = 0

    def true_position(self) -> Vector3:
        """Return where the platform truly rests [m].

        Raises:
            DemoError: if it does not come to rest.
        """
        places: list[Vector3] = []

        def on_pose(message: PoseStamped) -> None:
            places.append(vector_of(message.pose.position))

        def is_resting() -> bool:
            newest = places[-RESTING_POSES:]
            return len(newest) == RESTING_POSES and all(
                max(values) - min(values) < RESTING for values in zip(*newest)
            )

        poses = self.create_subscription(PoseStamped, "true_pose", on_pose, qos_profile_sensor_data)
        try:
            self.wait_for(is_resting, MOVE_TIMEOUT, "coming to rest")
        finally:
            self.destroy_subscription(poses)
        return places[-1]

    def ask(self, kind: type, service: str, request: Any) -> Any:
        """Return the response of a service of calibration_node.

        Raises:
            DemoError: if it has no success.
        """
        if service not in self._clients_of:
            self._clients_of[service] = self.create_client(kind, f"calibration_node/{service}")
        client = self._clients_of[service]
        self.wait_for(client.service_is_ready, START_TIMEOUT, "starting calibration_node")
        future = client.call_async(request)
        self.wait_for(future.done, ANSWER_TIMEOUT, f"the answer to {service}")
        response = future.result()
        if not response.success:
            raise DemoError(f"{service}: {response.message}")
        return response


RADIUS = 0.12  # m, within which all happens
PLATE = 0.1  # m, true height of a level plate
ABOVE = 0.05  # m, over the plate is all that is not probed
# By how much a machine that is wrong may believe the plate higher than it is expected: before any
# touch, before a plane can be laid through three, and then (five standard deviations each) [m].
FIRST_START, START, NEAR = 0.0035, 0.0027, 0.001
# The switch is looked at every 2 ms: that leaves 3 µm.
PROBE_SPEED = 0.005  # m/s
CALLIPER = 5e-5  # m, standard deviation


@dataclass(frozen=True, eq=False)
class Judged:
    """The positions to which the platform was sent, and where it truly was. Shapes (n, 3) [m]."""

    targets: FloatArray
    places: FloatArray

    @property
    def errors(self) -> FloatArray:
        """Shape (n, 3) [m]."""
        return self.places - self.targets


def ring(radius: float, count: int, first: float = 0.0) -> list[tuple[float, float]]:
    """Return ``count`` places on a circle, from an angle on [rad]. Each x, y [m]."""
    angles = [first + math.tau * index / count for index in range(count)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


def touch_places(count: int) -> list[tuple[float, float]]:
    """Return ``count`` places to be probed: the centre, and up to two rings about it."""
    outer = min(count - 1, 6)
    return [(0.0, 0.0), *ring(RADIUS, outer, 0.5), *ring(RADIUS / 2.0, count - 1 - outer)]


def probe_start(found: Sequence[Vector3], x: float, y: float) -> float:
    """Return the height from which to probe at x, y, by where the plate was found before [m]."""
    if len(found) < 3:
        return found[-1][2] + START if found else PLATE + FIRST_START
    places = np.array(found)
    factors = np.column_stack((np.ones(len(found)), places[:, :2]))
    plane = np.linalg.lstsq(factors, places[:, 2], rcond=None)[0]
    return float(plane @ (1.0, x, y)) + NEAR


def judge(client: CalibrationClient) -> Judged:
    """Send the platform to places over the plate, and look where it truly is."""
    places = [(0.0, 0.0), *ring(0.95 * RADIUS, 5, 0.2)]
    targets = [(x, y, PLATE + ABOVE) for x, y in places]
    reached = []
    for target in targets:
        client.go_to(target)
        reached.append(client.true_position())
    return Judged(np.array(targets), np.array(reached))


def probe(client: CalibrationClient, count: int, believed: MachineParameters) -> None:
    """Touch the plate at ``count`` places.

    Raises:
        DemoError: if it is not found.
    """
    kinematics = TriGlide(believed.geometry)
    found: list[Vector3] = []
    for x, y in touch_places(count):
        client.go_to((x, y, probe_start(found, x, y)))
        answer = client.ask(ProbePlate, "probe", ProbePlate.Request(speed=PROBE_SPEED))
        place = kinematics.forward(tuple(answer.heights))
        found.append(place)
        say(
            f"touch {answer.number} at {in_millimetres(place)} mm, as the nodes believe; "
            f"overrun {1e6 * answer.overrun:.0f} µm"
        )


def measure_distances(client: CalibrationClient, rng: np.random.Generator) -> None:
    """Measure three distances with a simulated calliper: the true ones, with its error."""
    for x, y in ring(RADIUS, 3, 0.3):
        ends: list[Vector3] = [(x, y, PLATE + ABOVE), (-x, -y, PLATE + ABOVE)]
        client.go_to(ends[0])
        first = client.true_position()
        client.ask(RecordDistanceEnd, "record_distance_end", RecordDistanceEnd.Request())
        client.go_to(ends[1])
        distance = math.dist(first, client.true_position()) + CALLIPER * rng.standard_normal()
        request = RecordDistanceEnd.Request(distance=distance, standard_deviation=CALLIPER)
        client.ask(RecordDistanceEnd, "record_distance_end", request)
        say(f"distance {1e3 * distance:.3f} mm where {2e3 * RADIUS:g} mm were meant")


# Of all that is right, all but one in 16,000 lies within so many standard deviations.
WITHIN = 4.0
# By so much the sliders may be off that follow their commands, and the encoders that round [m].
SERVO = 3e-6
FOOTNOTE = "* without the shift in x and y and the turn about z that no such data can tell"


class Errors(NamedTuple):
    """Errors of the platform's position at some targets.

    Attributes:
        name: of them.
        values: Shape (n, 3) [m].
        predicted: standard deviations; None if none were. Shape (n, 3) [m].
    """

    name: str
    values: FloatArray
    predicted: FloatArray | None = None

    @property
    def is_good(self) -> bool:
        """Whether all are as small as predicted."""
        if self.predicted is None:
            return True
        return bool((np.abs(self.values) <= WITHIN * self.predicted + SERVO).all())


def verdict_of(before: Judged, after: Judged, calibration: Calibration) -> list[Errors]:
    """Return what a ``calibration`` has changed for the same targets.

    The last errors are without the shift in x and y and the turn about z that fit best.
    """
    predicted, aligned = (
        calibration.position_uncertainties(after.targets, aligned=each) for each in (False, True)
    )
    return [
        Errors("before", before.errors),
        Errors("after", after.errors, predicted),
        Errors("after, in itself*", without_plane_motion(after), aligned),
    ]


def without_plane_motion(judged: Judged) -> FloatArray:
    """Return errors less the shift in x and y and the turn about z that fit best. Shape (n, 3)."""
    basis = plane_basis(judged.targets, (0.0, 0.0)).reshape(-1, 3)
    errors = judged.errors.ravel()
    motion, *_ = np.linalg.lstsq(basis, errors, rcond=None)
    return (errors - basis @ motion).reshape(-1, 3)


def table(verdict: Sequence[Errors]) -> str:
    """Return the largest errors in each direction as a table."""
    columns: list[tuple[str, FloatArray]] = []
    for name, values, predicted in verdict:
        columns.append((name, values))
        if predicted is not None:
            columns.append(("predicted (1 sd)", predicted))
    lines = ["largest error [µm]" + "".join(f"{name:>20}" for name, _ in columns)]
    for axis, letter in enumerate("xyz"):
        numbers = (1e6 * float(np.abs(values[:, axis]).max()) for _, values in columns)
        lines.append(f"{letter:18}" + "".join(f"{number:20.1f}" for number in numbers))
    return "\n".join((*lines, FOOTNOTE))


NOMINAL = MachineParameters(DEFAULT_GEOMETRY)
# How far machines are from their drawing, and what is assumed of this one (standard deviations).
USUAL_ERRORS = Priors(5e-4, 3e-4, 1e-3, common_radius=0.0, common_arm_length=0.0)


def wrong_machine(seed: int) -> MachineParameters:
    """Return one of many machines that were all built to the drawing of the default one."""
    deviations = USUAL_ERRORS.deviations()
    change = deviations * np.random.default_rng(seed).standard_normal(len(deviations))
    return MachineParameters.from_vector(NOMINAL.vector + change)


MEASUREMENTS, TRUTH, CALIBRATED = "measurements.yaml", "true_machine.yaml", "calibrated.yaml"
# A busy computer may send twists late [s].
TWIST_TIMEOUT = 1.0
# The simulator looks at its switch 500 times a second [s].
CONTACT_DELAY = 0.001
# The fewest touches that tell of the plate's whole area, and all places there are.
FEWEST, MOST = 7, 13


def verdict_figure(targets: FloatArray, verdict: Sequence[Errors], radius: float) -> Figure:
    """Return a page with the errors at the ``targets``, shape (n, 3), within a ``radius`` [m]."""
    # Drawing is imported late: it takes as long as starting the nodes.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 8.5), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=(1.5, 1.0))
    # One scale of arrows for all maps.
    largest = max(float(np.linalg.norm(each.values[:, :2], axis=1).max()) for each in verdict)
    for column, errors in enumerate(verdict):
        axes = figure.add_subplot(grid[0, column])
        arrows = _draw_arrows(axes, targets, errors, radius, ARROW * radius / largest)
        if column == 0:
            axes.quiverkey(arrows, 0.25, 0.94, ARROW * radius / largest, "1 mm", labelpos="E")
    bars = None
    for axis in range(3):
        bars = figure.add_subplot(grid[1, axis], sharey=bars)
        _draw_bars(bars, verdict, axis)
    figure.suptitle("Position error of the platform")
    figure.supxlabel(FOOTNOTE, fontsize=9)
    return figure


def _draw_arrows(
    axes: Axes, targets: FloatArray, errors: Errors, radius: float, scale: float
) -> Quiver:
    """Draw errors in x and y as arrows, ``scale`` times as large, and write those in z."""
    x, y = 1e3 * targets[:, :2].T
    along_x, along_y = 1e3 * scale * errors.values[:, :2].T
    style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.008}
    arrows = axes.quiver(x, y, along_x, along_y, color="tab:red", **style)
    axes.scatter(x, y, s=12, color="black", zorder=3)
    for place_x, place_y, error in zip(x, y, errors.values[:, 2]):
        text = f"z {1e6 * error:+.3g}"
        axes.annotate(
            text, (place_x, place_y), (0, -12), textcoords="offset points", ha="center", fontsize=8
        )
    reach = 1e3 * radius * 1.35
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x [mm]", ylabel="y [mm]")
    axes.set_aspect("equal")
    longest = 1e6 * float(np.linalg.norm(errors.values[:, :2], axis=1).max())
    axes.set_title(f"{errors.name}\nlongest arrow {longest:.0f} µm; z in µm")
    return arrows


def _draw_bars(axes: Axes, verdict: Sequence[Errors], axis: int) -> None:
    """Draw the largest errors and what was predicted, on a scale of powers of ten."""
    for place, (_, errors, predicted) in enumerate(verdict):
        height = 1e6 * float(np.abs(errors[:, axis]).max())
        axes.bar(place, height, color="tab:blue", width=0.6)
        axes.text(place, height, f"{height:.3g}", ha="center", va="bottom", fontsize=9)
        if predicted is not None:
            expected = 2e6 * float(predicted[:, axis].max())
            axes.hlines(expected, place - 0.4, place + 0.4, color="tab:orange", linewidth=2.5)
    axes.plot([], [], color="tab:orange", linewidth=2.5, label="2 predicted standard deviations")
    axes.set_yscale("log")
    axes.margins(y=0.25)
    axes.set_xticks(range(len(verdict)), [each.name.replace(", ", ",\n") for each in verdict])
    axes.set_ylabel("µm")
    axes.set_title(f"largest error in {'xyz'[axis]}")
    if axis == 0:
        axes.legend(fontsize=8)


def demonstrate(output: Path, seed: int, touches: int) -> int:
    """Start the nodes, calibrate, judge, and return the exit code."""
    output.mkdir(parents=True, exist_ok=True)
    save_parameters(output / TRUTH, wrong_machine(seed))
    patient = {"twist_timeout": TWIST_TIMEOUT}
    plate = {**patient, "plate_height": PLATE}
    say(f"a machine that is wrong by {USUAL_ERRORS}")
    with NodeProcesses() as processes:
        say("starting simulator_node with that machine, the other nodes with its drawing")
        processes.start("simulator_node", node_arguments(plate, output / TRUTH))
        session = {"folder": output.resolve(), "contact_delay": CONTACT_DELAY, **_assumed()}
        processes.start("calibration_node", node_arguments({**plate, **session}))
        believing = processes.start("ik_node", node_arguments(patient))
        with ros_that_ctrl_c_ends():
            client = CalibrationClient()
            client.wait_for_machine()
            say("looking where it truly goes")
            before = judge(client)
            probe(client, touches, NOMINAL)
            measure_distances(client, np.random.default_rng(seed))
            measurements, calibrated = (output / name for name in (MEASUREMENTS, CALIBRATED))
            client.ask(SaveMeasurements, "save", SaveMeasurements.Request(file=MEASUREMENTS))
            request = SolveCalibration.Request(parameter_file=CALIBRATED)
            client.ask(SolveCalibration, "solve", request)
            say("starting ik_node again, with what was found out")
            believing.send_signal(signal.SIGINT)
            believing.wait()
            client.wait_until_gone()
            processes.start("ik_node", node_arguments(patient, calibrated))
            client.wait_for_machine()
            after = judge(client)
    calibration = solved(load_measurements(measurements))
    verdict = verdict_of(before, after, calibration)
    print(f"\n{report(calibration)}\n\n{table(verdict)}\n")
    save_page(output, "calibration_demo", verdict_figure(after.targets, verdict, RADIUS))
    say(f"measurements: {measurements}; to look at them: calibrate {measurements}")
    good = all(errors.is_good for errors in verdict)
    say("as right as predicted" if good else "FAILED: not as right as predicted")
    return 0 if good else 1


def _assumed() -> dict[str, float]:
    """Return the parameters that say how wrong the machine may be."""
    names = "anchors", "arm_lengths", "height_offsets", "common_radius", "common_arm_length"
    return {f"prior_{name}": getattr(USUAL_ERRORS, name) for name in names}


def main() -> int:
    """Run the demonstration from the command line."""
    return run_demo(
        "calibration_demo",
        __doc__,
        demonstrate,
        seed={"type": int, "default": 1, "help": "which of many wrong machines (default: 1)"},
        touches={
            "type": int,
            "choices": range(FEWEST, MOST + 1),
            "default": MOST,
            "metavar": "N",
            "help": f"how many places are probed, {FEWEST} to {MOST} (default: {MOST})",
        },
    )


if __name__ == "__main__":
    sys.exit(main())
