"""Which measurements would help most: D-optimal choice, one after the other.

The volume of the ellipsoid of the twelve parameters is the root of the determinant of their
covariance. Each measurement shrinks it by a factor that is known before it is made. The best is
taken, its information added, and so on (Fedorov, Theory of Optimal Experiments, 1972).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from statistics import median

import numpy as np

from tri_glide_kinematics.calibration.fit.data_checks import names_of
from tri_glide_kinematics.calibration.fit.measurements import (
    BASE,
    CalibrationError,
    Distance,
    MeasuredPosition,
    Measurement,
    Plate,
    Touch,
)
from tri_glide_kinematics.calibration.fit.model import MeasurementModel, Region, positions_of
from tri_glide_kinematics.calibration.fit.solving import Solution
from tri_glide_kinematics.calibration.fit.unknowns import (
    MACHINE,
    Knowledge,
    MachineParameters,
    State,
    Unknowns,
)
from tri_glide_kinematics.equal_numbers import first_largest
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3, minus
from tri_glide_kinematics.workspace import Workspace

KINDS = ("touch", "position", "distance")
# Rings of candidate places in the region, besides its centre.
RINGS = 3
# Without priors: so far the nominal machine may be off, so that the ellipsoid has a volume [m].
WITHOUT_PRIORS = 0.01


@dataclass(frozen=True)
class Proposal:
    """A measurement that would help.

    Attributes:
        kind: ``touch``, ``position`` or ``distance``.
        places: of the platform: one, or two for a distance. Each of shape (3,) [m].
        target: name of the plate or of the frame; empty for a distance.
        measurement: as it is expected, with the reported heights to go to.
        volume: of the ellipsoid of the parameters after this and all proposals before it, as a part
            of what it is now; 1 of one that is not chosen yet.
    """

    kind: str
    places: tuple[Vector3, ...]
    target: str
    measurement: Measurement
    volume: float = 1.0


def next_points(
    solution: Solution,
    knowledge: Knowledge,
    unknowns: Unknowns,
    measured: Sequence[Measurement],
    count: int,
    kinds: Mapping[str, float] | None,
    workspace: Workspace | None,
) -> tuple[Proposal, ...]:
    """Return ``count`` proposals; see ``Calibration.next_points``.

    Raises:
        OutOfBoundsError: if ``count`` is negative.
        CalibrationError: if there is no such kind of measurement.
    """
    if count < 0:
        raise OutOfBoundsError("count", count, "at least 0")
    chosen_kinds = dict(kinds) if kinds is not None else _kinds_of(measured)
    for kind in chosen_kinds:
        if kind not in KINDS:
            raise CalibrationError(f"{kind!r} is no kind of measurement: {', '.join(KINDS)} are")
    candidates = _candidates(solution.state, measured, chosen_kinds, workspace)
    if not candidates:
        return ()
    model = MeasurementModel([one.measurement for one in candidates], unknowns)
    matrix = model.equations(solution.state)[1]
    rows = [_in_scale(matrix[part], knowledge.scale) for part in model.rows]
    information = information_of(solution, knowledge)
    proposals: list[Proposal] = []
    volume = 1.0
    left = list(range(len(candidates)))
    while left and len(proposals) < count:
        gains = gains_of([rows[i] for i in left], information)
        best = left.pop(first_largest(gains))
        information = information + rows[best].T @ rows[best]
        volume *= float(np.exp(-0.5 * gains.max()))
        proposals.append(replace(candidates[best], volume=volume))
    return tuple(proposals)


def information_of(solution: Solution, knowledge: Knowledge) -> FloatArray:
    """Return the information about u and all other unknowns, that of the priors included."""
    matrix = _in_scale(solution.matrix, knowledge.scale)
    information = matrix.T @ matrix
    weight = 1.0 if knowledge.is_prior else 1.0 / WITHOUT_PRIORS**2
    information[:MACHINE, :MACHINE] += weight * np.eye(MACHINE)
    return np.asarray(information)


def gains_of(rows: Sequence[FloatArray], information: FloatArray) -> FloatArray:
    """Return by how much each adds to the logarithm of the determinant of the machine's part.

    That is the determinant of all, less that of plates and frames.
    """
    together = np.linalg.inv(information)
    others = np.linalg.inv(information[MACHINE:, MACHINE:])

    def gain(row: FloatArray) -> float:
        eye = np.eye(len(row))
        added = np.linalg.slogdet(eye + row @ together @ row.T)[1]
        return float(
            added - np.linalg.slogdet(eye + row[:, MACHINE:] @ others @ row[:, MACHINE:].T)[1]
        )

    return np.array([gain(row) for row in rows])


def _in_scale(matrix: FloatArray, scale: FloatArray) -> FloatArray:
    return np.concatenate((matrix[:, :MACHINE] @ scale, matrix[:, MACHINE:]), axis=1)


def _kinds_of(measured: Sequence[Measurement]) -> dict[str, float]:
    """Return the kinds that were measured, each with its usual standard deviation [m]."""
    deviations: dict[str, list[float]] = {}
    for name, one in zip(names_of(measured), measured):
        deviations.setdefault(name.split()[0], []).append(one.standard_deviation)
    return {kind: median(values) for kind, values in deviations.items()}


def _candidates(
    state: State,
    measured: Sequence[Measurement],
    kinds: Mapping[str, float],
    workspace: Workspace | None,
) -> list[Proposal]:
    """Return what could be measured, where the platform can be."""
    machine = MachineParameters.from_vector(state.machine)
    kinematics = TriGlide(machine.geometry)
    region = Region.of(machine.geometry)
    disc = Region.disc(region.center, region.radius, RINGS).places[:, :2].tolist()

    def reachable(places: Iterable[Vector3]) -> Iterator[tuple[Vector3, Vector3]]:
        """Yield those where the platform can be, with the heights that are reported there."""
        for place in places:
            with suppress(KinematicsError):
                if workspace is not None:
                    workspace.check_position(place)
                yield place, minus(kinematics.inverse(place), machine.height_offsets)

    plates = {one.plate.name: one.plate for one in measured if isinstance(one, Touch)}
    frames = {one.frame for one in measured if isinstance(one, MeasuredPosition)}
    levels = _levels(state, measured)
    found: list[Proposal] = []
    if "touch" in kinds:
        for plate in plates.values() if plates else [Plate()]:
            surface = state.plates.get(plate.name, np.zeros(3))
            places = ((x, y, float(surface @ (1.0, x, y))) for x, y in disc)
            for place, reported in reachable(places):
                touch = Touch(reported, plate, kinds["touch"])
                found.append(Proposal("touch", (place,), plate.name, touch))
    if "position" in kinds:
        for frame in sorted(frames) if frames else [BASE]:
            for place, reported in reachable((x, y, z) for x, y in disc for z in levels):
                seen = _seen(place, frame, state)
                one = MeasuredPosition(reported, seen, frame, kinds["position"])
                found.append(Proposal("position", (place,), frame, one))
    if "distance" in kinds:
        ends = reachable((x, y, levels[0]) for x, y in disc)
        for (start, low), (end, high) in combinations(ends, 2):
            length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
            # A short distance says little for its standard deviation.
            if length > 0.5 * region.radius:
                measurement = Distance(low, high, length, kinds["distance"])
                found.append(Proposal("distance", (start, end), "", measurement))
    return found


def _levels(state: State, measured: Sequence[Measurement]) -> list[float]:
    """Return the lowest and the highest z so far; places on one level count as one level."""
    model = MeasurementModel(measured, Unknowns.of(measured))
    heights = positions_of(state.machine, model.reported_heights)[:, 2]
    lowest, highest = float(np.nanmin(heights)), float(np.nanmax(heights))
    return [lowest, highest] if highest - lowest > 0.01 else [lowest]


def _seen(place: Vector3, frame: str, state: State) -> Vector3:
    """Return a place in a frame."""
    if frame not in state.frames:
        return place
    placement = state.frames[frame]
    x, y, z = (placement.rotation @ place + placement.shift).tolist()
    return x, y, z
