"""How often the truth lies inside the 95 % intervals that calibrations tell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from testing.wrong_machines import NOMINAL, RADIUS, WRONG_BY, WrongMachine, ring
from tri_glide_kinematics.calibration.fit import (
    Calibration,
    Distance,
    MachineParameters,
    MeasuredPosition,
    Measurement,
    Priors,
    Region,
    Touch,
    calibrate,
    positions_of,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray

Measure = Callable[[WrongMachine, np.random.Generator], list[Measurement]]
# Of a normal distribution 95 % lie within so many standard deviations.
INTERVAL = 1.959964
SEVEN = ((0.0, 0.0), *ring(RADIUS, 6))
PLACE = np.array([(-0.08, 0.0, 0.15)])
DISC = np.array([(x, y, 0.0) for x, y, _ in Region.disc((0.0, 0.0), RADIUS, 2).places])


@dataclass(frozen=True)
class Case:
    """Machines, what is measured of them, and where their errors are compared with what is told.

    Attributes:
        name: in words.
        machine: as it is, of those at random.
        measure: what is measured of it.
        priors: that are assumed.
        places: of the platform. Shape (n, 3) [m].
        axes: of these places that the measurements determine.
    """

    name: str
    machine: Callable[[np.random.Generator], WrongMachine]
    measure: Measure
    priors: Priors | None
    places: FloatArray
    axes: Sequence[int] = (2,)


@dataclass(frozen=True)
class Coverage:
    """What many calibrations of a case come to.

    Attributes:
        inside: part of the errors inside their 95 % interval.
        dropped: calibrations that leave out a measurement, all of which are good.
        refused: calibrations that are not valid.
    """

    inside: float
    dropped: int
    refused: int


def usual(rng: np.random.Generator) -> WrongMachine:
    """Return a machine as most are."""
    return WrongMachine.random(rng)


def changed(radius: float = 0.0, arms: float = 0.0) -> WrongMachine:
    """Return a machine with another radius and other arms than on its drawing [m]."""
    numbers = NOMINAL.vector
    anchors = numbers[:6].reshape(3, 2)
    numbers[:6] += (radius * anchors / np.linalg.norm(anchors, axis=1, keepdims=True)).ravel()
    numbers[6:9] += arms
    return WrongMachine(MachineParameters.from_vector(numbers))


def nearer(rng: np.random.Generator) -> WrongMachine:
    """Return a machine whose towers all stand 1.5 to 2 mm nearer than told."""
    return changed(radius=-rng.uniform(1.5e-3, 2e-3))


def shorter(rng: np.random.Generator) -> WrongMachine:
    """Return a machine whose arms are all 3.2 mm shorter than told."""
    return changed(arms=-3.2e-3)


def positions(machine: WrongMachine, rng: np.random.Generator) -> list[Measurement]:
    """Measure twelve positions in the frame of the machine."""
    places = np.column_stack((rng.uniform(-0.1, 0.1, (12, 2)), rng.uniform(0.0, 0.2, 12)))
    return [machine.position(place, rng) for place in places.tolist()]


def seven_touches(machine: WrongMachine, rng: np.random.Generator) -> list[Measurement]:
    """Touch a level plate in the middle and six times on the rim."""
    return [*machine.touches(rng, SEVEN)]


def touches_and_prints(machine: WrongMachine, rng: np.random.Generator) -> list[Measurement]:
    """Touch a level plate seven times, and measure twelve distances of printed parts."""
    ends = [(*ring(r, 6, 0.3), *ring(r, 6, 0.3 + np.pi)) for r in (0.04, 0.08)]
    pairs = [((*end[i], 0.0), (*end[i + 6], 0.0)) for end in ends for i in range(6)]
    return [*seven_touches(machine, rng), *(machine.distance(*pair, rng) for pair in pairs)]


def touches_and_distance(machine: WrongMachine, rng: np.random.Generator) -> list[Measurement]:
    """Touch a level plate thirteen times, and measure a distance."""
    return [*machine.touches(rng), *machine.one_distance(rng)]


WIDE = Priors(3e-3, 3e-3, 3e-3)
CASES = (
    Case("12 positions, no priors", usual, positions, None, PLACE, (0, 1, 2)),
    Case(
        "12 positions, towers 1.5 to 2 mm nearer, no priors", nearer, positions, None, PLACE, (2,)
    ),
    Case("13 touches and a distance", usual, touches_and_distance, WRONG_BY, DISC),
    Case("13 touches and a distance, no priors", usual, touches_and_distance, None, DISC),
    Case("7 touches, towers 1.5 to 2 mm nearer", nearer, seven_touches, Priors(), DISC),
    Case("the same, no priors", nearer, seven_touches, None, DISC),
    Case(
        "7 touches, 12 distances, arms 3.2 mm shorter", shorter, touches_and_prints, Priors(), DISC
    ),
    Case("the same, no priors", shorter, touches_and_prints, None, DISC),
    Case("the same, priors of 3 mm", shorter, touches_and_prints, WIDE, DISC),
)


def calibrated(measured: Sequence[Measurement], priors: Priors | None) -> Calibration:
    """Return the calibration of these."""
    return calibrate(
        NOMINAL.geometry,
        [one for one in measured if isinstance(one, Touch)],
        [one for one in measured if isinstance(one, MeasuredPosition)],
        [one for one in measured if isinstance(one, Distance)],
        priors,
    )


def coverage(case: Case, count: int, seed: int = 1) -> Coverage:
    """Return what ``count`` machines of a case come to."""
    rng = np.random.default_rng(seed)
    errors, told, results = [], [], []
    for _ in range(count):
        machine = case.machine(rng)
        result = calibrated(case.measure(machine, rng), case.priors)
        heights = TriGlide(machine.parameters.geometry).inverse_batch(case.places)
        heights = heights - machine.parameters.height_offsets
        found = positions_of(result.machine.vector, heights)
        errors.append((found - case.places)[:, case.axes])
        told.append(result.position_uncertainties(found)[:, case.axes])
        results.append(result)
    inside = np.abs(errors) <= INTERVAL * np.array(told)
    return Coverage(
        float(inside.mean()),
        sum(bool(one.outliers) for one in results),
        sum(one.is_contradicted for one in results),
    )
