"""Calibrations of many wrong machines: is the truth where the result says, and how near?

``python -m benchmarks.calibration`` prints the table; ``--count 100`` for a quick look.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import chi2

from benchmarks.command_line import numbers
from benchmarks.machine import description
from benchmarks.table import Row, print_rows
from benchmarks.touch_places import least_median, random_places
from testing.wrong_machines import (
    DISTANCE,
    IN_RINGS,
    NOMINAL,
    PLACES,
    RADIUS,
    REGION,
    TOUCH,
    WRONG_BY,
    WrongMachine,
)
from tri_glide_kinematics.calibration.fit import (
    Distance,
    MeasuredPosition,
    Plate,
    Priors,
    Touch,
    calibrate,
)
from tri_glide_kinematics.vectors import FloatArray

GEOMETRY = NOMINAL.geometry
SCALE = "the common scale of anchors and arms"
# Searches for the best places of touches, from places at random.
SEARCHES = 3
# Of each measurement one place, or two for a distance.
Places = Sequence[Sequence[Sequence[float]]]
FREE = ("shifting along x", "shifting along y", "turning about z")


def main() -> None:
    """Measure and print the table."""
    options = numbers(__doc__, count=(1000, "machines"), seed=(1, "of machines and noise"))
    print(description(), flush=True)
    print_rows("calibration", rows(options.count, options.seed))


def rows(count: int, seed: int) -> Iterator[Row]:
    """Yield one row after the other."""
    least = least_median(SEARCHES, np.random.default_rng(seed + 6))
    yield from with_priors(count, np.random.default_rng(seed), least)
    yield from without_priors(count, np.random.default_rng(seed + 1))
    yield from again_and_again(max(count // 20, 1), np.random.default_rng(seed + 2))
    yield from with_an_outlier(count, np.random.default_rng(seed + 3))
    yield speed(np.random.default_rng(seed + 4))
    yield from proposals(max(count // 50, 1), np.random.default_rng(seed + 5))


def with_priors(count: int, rng: np.random.Generator, least: float) -> Iterator[Row]:
    """Thirteen touches, one distance, priors that are right.

    Args:
        count: of machines.
        rng: for machines and noise.
        least: what is possible at best in the worst place along z [m].
    """
    inner = chi2.isf(0.05, 12)
    for name, places in (("in the middle and on the rim", PLACES), ("in rings", IN_RINGS)):
        inside, ratios, sizes, used, refused = 0, [], [], 0, 0
        for _ in range(count):
            machine = WrongMachine.random(rng)
            touches, distances = machine.touches(rng, places), machine.one_distance(rng)
            result = calibrate(GEOMETRY, touches, (), distances, WRONG_BY)
            error = result.machine.vector - machine.parameters.vector
            inside += bool(error @ np.linalg.solve(result.covariance, error) <= inner)
            errors = machine.errors(result.machine)
            ratios.append(errors / result.position_uncertainties(REGION.places, aligned=True))
            sizes.append(
                np.column_stack((np.hypot(errors[:, 0], errors[:, 1]), np.abs(errors[:, 2])))
            )
            used += not result.warnings
            refused += result.is_contradicted
        part = inside / count
        what = f"touches {name}: truth inside the 95 % ellipsoid, of {count} machines"
        yield Row.in_percent(what, part, "93 to 97 %", 0.93 <= part <= 0.97)
        spread = np.sqrt(np.square(ratios).mean(axis=(0, 1)))
        yield Row(
            "the same: spread of the error of x, y, z by the predicted one",
            ", ".join(f"{value:.3f}" for value in spread),
            "0.95 to 1.05",
            bool((np.abs(spread - 1.0) <= 0.05).all()),
        )
        at_best = f"; z at best {1e6 * least:.1f}"
        worst, usual = np.median(np.max(sizes, axis=1), axis=0), np.median(sizes, axis=0)
        for what, (across, along), more in (
            ("worst place of each machine, median of all", 1e6 * worst, at_best),
            ("median of all at each place, worst of these", 1e6 * usual.max(axis=0), ""),
        ):
            yield Row(
                f"the same: {what}: across, z",
                f"{across:.1f} and {along:.1f} µm",
                f"60 and 10 µm{more}",
                bool(across < 60.0 and along < 10.0),
            )
        yield Row.in_percent("the same: without a warning", used / count, "-", True)
        yield Row.in_percent(
            "the same: taken for too far from the priors",
            refused / count,
            "about 0.1 %",
            refused <= 0.005 * count + 1,
        )


def without_priors(count: int, rng: np.random.Generator) -> Iterator[Row]:
    """Touches alone, of a known plate and of an unknown one."""
    for name, plate in (("a known", Plate()), ("an unknown", Plate("bed", None, None))):
        named, better, sizes = 0, 0, []
        for _ in range(count):
            machine = WrongMachine.random(rng)
            touches = [Touch(one.heights, plate, TOUCH) for one in machine.touches(rng)]
            result = calibrate(GEOMETRY, touches, priors=None)
            named += {*FREE, SCALE} <= set(result.unidentified)
            before, after = (
                _size(machine.errors(each), plate.height is None)
                for each in (NOMINAL, result.machine)
            )
            better += after <= before
            sizes.append((before, after))
        before, after = 1e6 * np.median(sizes, axis=0)
        what = f"touches of {name} plate alone, no priors: free directions and scale named"
        yield Row.in_percent(what, named / count, "100 %", named == count)
        what = f"the same: error not larger than before (median {before:.0f} to {after:.0f} µm)"
        yield Row.in_percent(what, better / count, "99 %", better >= 0.99 * count)


def again_and_again(count: int, rng: np.random.Generator) -> Iterator[Row]:
    """Twenty calibrations, each of the machine as the one before left it, with new data."""
    for name, priors in (("priors about the drawing", WRONG_BY), ("no priors", None)):
        largest = [_wandering(priors, rng) for _ in range(count)]
        what = f"20 calibrations with new data, {name}: farthest way of a parameter, of {count}"
        # Results of independent data differ; what drifts goes on and on.
        yield Row.at_most(what, max(largest), 2.0, ".2f", " standard deviations")


def _wandering(priors: Priors | None, rng: np.random.Generator) -> float:
    """Return the farthest way from the first result by its standard deviation."""
    machine, farthest = WrongMachine.random(rng), 0.0
    believed, first = NOMINAL, None
    for _ in range(20):
        result = calibrate(
            believed.geometry,
            machine.touches(rng),
            (),
            machine.one_distance(rng),
            priors,
            height_offsets=believed.height_offsets,
        )
        # The priors stay with the drawing.
        believed, priors = result.machine, result.priors
        if first is None:
            first = result
        ways = np.abs(believed.vector - first.machine.vector) / first.standard_deviations
        farthest = max(farthest, float(ways.max()))
    return farthest


def with_an_outlier(count: int, rng: np.random.Generator) -> Iterator[Row]:
    """One of fourteen measurements is wrong by 2 mm."""
    counts = {"touch": [0, 0], "distance": [0, 0]}
    others, farthest, false_alarms = 0, 0.0, 0
    for number in range(count):
        machine = WrongMachine.random(rng)
        touches, distances = machine.touches(rng), machine.one_distance(rng)
        false_alarms += bool(calibrate(GEOMETRY, touches, (), distances, WRONG_BY).outliers)
        error, wrong = 2e-3 * rng.choice((-1.0, 1.0)), number % 14
        name = f"touch {wrong + 1}" if wrong < 13 else "distance 1"
        without = [one for i, one in enumerate(touches) if i != wrong], distances[: wrong < 13]
        if wrong < 13:
            touches[wrong] = _lifted(machine, touches[wrong], error)
        else:
            one = distances[0]
            length = one.distance + float(error)
            distances = [Distance(one.heights_from, one.heights_to, length, DISTANCE)]
        result = calibrate(GEOMETRY, touches, (), distances, WRONG_BY)
        reference = calibrate(GEOMETRY, without[0], (), without[1], WRONG_BY)
        kind = counts[name.split()[0]]
        kind[0] += name in result.outliers
        kind[1] += 1
        others += len(set(result.outliers) - {name})
        ways = (result.machine.vector - reference.machine.vector) / reference.standard_deviations
        farthest = max(farthest, float(np.abs(ways).max()))
    for kind_name, (named, of) in counts.items():
        if of:
            what = f"one {kind_name} of 14 measurements wrong by 2 mm: named, of {of}"
            yield Row.in_percent(what, named / of, "100 %", named == of)
    yield Row(f"the same: good measurements named, of {13 * count}", f"{others}", "-", True)
    what = "the same: farthest from the result without it"
    yield Row.at_most(what, farthest, 2.0, ".2f", " standard deviations")
    what = f"nothing wrong: a good measurement named, of {count} calibrations"
    is_rare = false_alarms <= 0.03 * count + 1
    yield Row.in_percent(what, false_alarms / count, "about 1 %", is_rare)


def _lifted(machine: WrongMachine, touch: Touch, error: float) -> Touch:
    """Return a touch with the platform off the plate by ``error`` [m]."""
    first, second, third = (height + error for height in touch.heights)
    return Touch((first, second, third), touch.plate, touch.standard_deviation)


def speed(rng: np.random.Generator) -> Row:
    """A hundred measurements of all kinds."""
    machine = WrongMachine.random(rng)
    places = random_places(100, rng)
    touches = machine.touches(rng, places[:50])
    positions: list[MeasuredPosition] = [
        machine.position((*place, 0.05), rng, "camera") for place in places[50:80]
    ]
    # Across the disc: a distance of nothing is none.
    rim = RADIUS * places[80:] / np.linalg.norm(places[80:], axis=1, keepdims=True)
    distances = [machine.distance((x, y, 0.0), (-x, -y, 0.0), rng) for x, y in rim.tolist()]
    times = []
    for _ in range(20):
        begin = time.perf_counter()
        calibrate(GEOMETRY, touches, positions, distances, WRONG_BY)
        times.append(time.perf_counter() - begin)
    return Row(
        "fit of 100 measurements, median (longest) of 20",
        f"{1e3 * np.median(times):.0f} ms ({1e3 * max(times):.0f} ms)",
        "100 ms",
        float(np.median(times)) < 0.1,
    )


def proposals(count: int, rng: np.random.Generator) -> Iterator[Row]:
    """Ten points that are proposed against ten at random, of the same kinds."""
    for name, kinds in (
        ("touches", {"touch": TOUCH}),
        ("touches and distances", {"touch": TOUCH, "distance": DISTANCE}),
    ):
        parts = []
        for _ in range(count):
            machine = WrongMachine.random(rng)
            touches = machine.touches(rng, random_places(4, rng))
            result = calibrate(GEOMETRY, touches, priors=WRONG_BY)
            chosen = [one.places for one in result.next_points(10, kinds=kinds)]
            ours = _volume(machine, touches, chosen, rng)
            random = [
                [(x, y, 0.0) for x, y in random_places(len(one), rng).tolist()] for one in chosen
            ]
            parts.append(ours / _volume(machine, touches, random, rng))
        median = float(np.median(parts))
        what = f"10 {name} proposed: volume by that of 10 at random, median (largest) of {count}"
        yield Row(what, f"{median:.2f} ({max(parts):.2f})", "0.5", median <= 0.5)


def _volume(
    machine: WrongMachine, touches: list[Touch], chosen: Places, rng: np.random.Generator
) -> float:
    """Return the volume of the ellipsoid, to a constant, after these are measured, too."""
    more = [machine.touch(one[0][0], one[0][1], rng) for one in chosen if len(one) == 1]
    distances = [machine.distance(one[0], one[1], rng) for one in chosen if len(one) == 2]
    result = calibrate(GEOMETRY, [*touches, *more], (), distances, WRONG_BY)
    return float(np.exp(0.5 * np.linalg.slogdet(result.covariance)[1]))


def _size(errors: FloatArray, unknown_height: bool) -> float:
    """Return the root mean square of errors; without their mean height if nothing tells it [m]."""
    if unknown_height:
        errors = errors - (0.0, 0.0, errors[:, 2].mean())
    return float(np.sqrt(np.square(errors).sum(axis=1).mean()))


if __name__ == "__main__":
    main()
