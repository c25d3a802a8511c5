"""The course with the wrong machine: the points at which it is probed, measured and judged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tri_glide_interfaces.srv import ProbePlate, RecordDistanceEnd
from tri_glide_kinematics.calibration.fit import MachineParameters
from tri_glide_kinematics.demo.calibration.client import CalibrationClient
from tri_glide_kinematics.demo.report import in_millimetres, say
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3

RADIUS = 0.12  # m, within which all happens
PLATE = 0.1  # m, true height of a level plate
ABOVE = 0.05  # m, over the plate is all that is not probed
# By how much a machine that is wrong may believe the plate higher than it is expected: before any
# touch, before a plane can be laid through three, and then (five standard deviations each) [m].
FIRST_START, START, NEAR = 0.0035, 0.0027, 0.001
# The switch is looked at every 2 ms: that leaves 3 µm.
PROBE_SPEED = 0.005  # m/s
CALLIPER = 5e-5  # m, standard deviation


@dataclass(frozen=True)
class Judged:
    """The commanded and the true position of the platform.

    Attributes:
        targets: Shape (n, 3) [m].
        places: Shape (n, 3) [m].
    """

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
        client.move(target)
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
        client.move((x, y, probe_start(found, x, y)))
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
        client.move(ends[0])
        first = client.true_position()
        client.ask(RecordDistanceEnd, "record_distance_end", RecordDistanceEnd.Request())
        client.move(ends[1])
        distance = math.dist(first, client.true_position()) + CALLIPER * rng.standard_normal()
        request = RecordDistanceEnd.Request(distance=distance, standard_deviation=CALLIPER)
        client.ask(RecordDistanceEnd, "record_distance_end", request)
        say(f"distance {1e3 * distance:.3f} mm where {2e3 * RADIUS:g} mm were meant")
