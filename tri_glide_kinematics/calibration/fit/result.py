"""The result of a calibration, and which measurements would help most."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from statistics import median

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from tri_glide_kinematics.calibration.fit.model import (
    MeasurementModel,
    Region,
    plane_basis,
    position_derivatives,
    positions_of,
)
from tri_glide_kinematics.calibration.fit.numbers import (
    BASE,
    MACHINE,
    PARAMETER_NAMES,
    CalibrationError,
    Distance,
    FramePlacement,
    Knowledge,
    MachineParameters,
    MeasuredPosition,
    Measurement,
    Plate,
    Priors,
    Spectrum,
    State,
    Touch,
    Unknowns,
    names_of,
)
from tri_glide_kinematics.calibration.fit.solving import Solution
from tri_glide_kinematics.checks import finite_array, finite_vector
from tri_glide_kinematics.equal_numbers import first_largest
from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3, minus, three
from tri_glide_kinematics.workspace import Workspace

# Which measurements would help most: D-optimal choice, one after the other.
#
# The volume of the ellipsoid of the twelve parameters is the root of the determinant of their
# covariance. Each measurement shrinks it by a factor that is known before it is made. The best is
# taken, its information added, and so on (Fedorov, Theory of Optimal Experiments, 1972).

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


def information_of(solution: Solution, knowledge: Knowledge) -> FloatArray:
    """Return the information about u and all other unknowns, that of the priors included."""
    matrix = _in_scale(solution.matrix, knowledge.scale)
    information = matrix.T @ matrix
    weight = 1.0 if knowledge.is_prior else 1.0 / WITHOUT_PRIORS**2
    information[:MACHINE, :MACHINE] += weight * np.eye(MACHINE)
    return np.asarray(information)


def knowledge_of(information: FloatArray) -> float:
    """Return the logarithm of the determinant of the machine's part: of all, less the others."""
    others = information[MACHINE:, MACHINE:]
    return float(np.linalg.slogdet(information)[1] - np.linalg.slogdet(others)[1])


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
    return three(placement.rotation @ place + placement.shift)


# The result of a calibration.

# A direction is named if this part of it (of the square of its length) is not determined.
MOSTLY = 0.8
# Of a direction without a name, parameters with less than this part of the largest are left out.
SMALL_PART = 0.5
# Directions with less than this left, after those with a name are taken out, are rounding.
NOTHING = 0.3


def named_directions(machine: FloatArray) -> dict[str, FloatArray]:
    """Return directions with a meaning, each of shape (12,).

    Scale and size come with the height offsets that hold the platform where it is in the middle;
    tilting is about the mean of the carriages then.
    """
    anchors, lengths = machine[:6].reshape(3, 2), machine[6:9]
    arms = anchors - anchors.mean(axis=0)
    squares = np.square(arms).sum(axis=1)
    rises = np.sqrt(np.maximum(np.square(lengths) - squares, 1e-12))
    higher = rises - rises.mean()
    none, ones = np.zeros(3), np.ones(3)
    first, last = np.array([1.0, -1.0, 0.0]), np.array([0.0, 1.0, -1.0])
    level = np.zeros((3, 2))
    across = np.column_stack((-arms[:, 1], arms[:, 0]))

    def direction(anchor: FloatArray, arm: FloatArray, offset: FloatArray) -> FloatArray:
        return np.concatenate((anchor.ravel(), arm, offset))

    along_x, along_y = np.tile((1.0, 0.0), (3, 1)), np.tile((0.0, 1.0), (3, 1))
    return {
        "shifting along x": direction(along_x, none, none),
        "shifting along y": direction(along_y, none, none),
        "turning about z": direction(across, none, none),
        "shifting along z (all height offsets together)": direction(level, none, ones),
        "tilting about x": direction(-along_y * higher[:, None], none, arms[:, 1]),
        "tilting about y": direction(-along_x * higher[:, None], none, arms[:, 0]),
        "the common scale of anchors and arms": direction(arms, lengths, rises),
        "the size of the anchors' triangle": direction(arms, none, -squares / rises),
        "stretching the anchors' triangle along y and not along x": direction(
            arms * (-1.0, 1.0),
            none,
            (np.square(arms[:, 0]) - np.square(arms[:, 1])) / rises,
        ),
        "the difference between arms 1 and 2": direction(level, first, first * lengths / rises),
        "the difference between arms 2 and 3": direction(level, last, last * lengths / rises),
        "shearing the anchors' triangle": direction(
            arms[:, ::-1], none, -2.0 * arms[:, 0] * arms[:, 1] / rises
        ),
    }


def along_named(machine: FloatArray, scale: FloatArray, change: FloatArray) -> dict[str, float]:
    """Return how far a change goes along each direction with a meaning.

    Args:
        machine: about which the directions are. Shape (12,) [m].
        scale: machine = mean + scale u. Shape (12, 12).
        change: of u. Shape (12,).
    """
    found = {}
    for name, direction in named_directions(machine).items():
        unit = np.linalg.solve(scale, direction)
        found[name] = float(unit @ change / np.linalg.norm(unit))
    return found


def in_words(machine: FloatArray, scale: FloatArray, unknown: FloatArray) -> tuple[str, ...]:
    """Return the names of the directions that are not determined.

    Args:
        machine: about which the directions are. Shape (12,) [m].
        scale: machine = mean + scale u. Shape (12, 12).
        unknown: directions of u, columns at right angles to each other. Shape (12, m).
    """
    names = []
    rest = unknown
    for name, direction in named_directions(machine).items():
        if not rest.shape[1]:
            break
        unit = np.linalg.solve(scale, direction)
        unit /= np.linalg.norm(unit)
        inside = unknown.T @ unit
        if inside @ inside < MOSTLY:
            continue
        # Take it out of what is left; a direction that is in there no more says nothing new.
        part = rest.T @ unit
        length = float(np.linalg.norm(part))
        if length < NOTHING:
            continue
        names.append(name)
        kept = np.linalg.svd(part[None, :] / length)[2][1:]
        rest = rest @ kept.T
    return (*names, *(_combination(scale @ column) for column in rest.T))


def _combination(change: FloatArray) -> str:
    """Return which parameters a direction without a name changes most."""
    largest = np.abs(change).max()
    parts = [
        PARAMETER_NAMES[i] for i in range(len(change)) if abs(change[i]) > SMALL_PART * largest
    ]
    return f"a combination of {', '.join(parts)}"


# Residuals that are larger than stated by this factor, and not by chance, are no matter of degree.
GROSS = 3.0
GROSS_BY_CHANCE = 1e-6
# One of a thousand machines is farther from what was assumed, by chance (standard deviations).
FAR_FROM_PRIORS = 4.0
# Left out are so many, and so large a part: no matter of one or two that slipped.
MANY, MANY_PART = 3, 0.15
# A change of the position by less than this part of a direction's own is rounding.
UNTOUCHED = 1e-6


@dataclass(frozen=True)
class Residual:
    """The residual of a measurement.

    Attributes:
        name: kind and number, for example ``touch 3``.
        measurement: itself.
        error: predicted minus measured: one number, or three for a position [m].
        left_out: the same, predicted by all other measurements; 0 where they say nothing [m].
        size: of ``left_out`` by its standard deviation (root mean square of three); NaN if the
            others say nothing.
        is_outlier: whether it was left out of the fit.
    """

    name: str
    measurement: Measurement
    error: tuple[float, ...]
    left_out: tuple[float, ...]
    size: float
    is_outlier: bool


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated machine.

    Attributes:
        machine: geometry and height offsets.
        nominal: where the fit began.
        priors: that were used, with their mean; None if there were none.
        unidentified: in words, what the data do not determine. There the machine is as the priors
            say; without priors, exactly as it was assumed to be.
        covariance: of the twelve parameters, in the order of ``MachineParameters.vector``. Without
            priors, of what the data determine: the rest is in ``standard_deviations`` and
            ``position_uncertainty`` only. Shape (12, 12) [m^2].
        residuals: of all measurements: touches, positions, distances.
        plates: of touches, with height and tilt as they were fitted.
        frames: of positions that were fitted.
        chi_squared: sum of squared residuals by their standard deviations, priors included.
        degrees_of_freedom: what ``chi_squared`` should be, within twice the root of twice that.
        warnings: in words; empty if all is well.
    """

    machine: MachineParameters
    nominal: MachineParameters
    priors: Priors | None
    unidentified: tuple[str, ...]
    covariance: FloatArray
    residuals: tuple[Residual, ...]
    plates: Mapping[str, Plate]
    frames: Mapping[str, FramePlacement]
    chi_squared: float
    degrees_of_freedom: int
    warnings: tuple[str, ...]
    _solution: Solution
    _knowledge: Knowledge
    _unknowns: Unknowns

    @property
    def geometry(self) -> TriGlideGeometry:
        """Anchors and arm lengths."""
        return self.machine.geometry

    @property
    def height_offsets(self) -> Vector3:
        """What is added to reported slider heights to get the true ones. Shape (3,) [m]."""
        return self.machine.height_offsets

    @property
    def outliers(self) -> tuple[str, ...]:
        """Names of the measurements that were left out, as they contradict the others."""
        return tuple(one.name for one in self.residuals if one.is_outlier)

    @property
    def is_contradicted(self) -> bool:
        """Whether something that was stated is wrong, so that the result is not to be used."""
        return self.has_gross_residuals or self.has_many_outliers or bool(self.far_from_priors)

    @property
    def has_many_outliers(self) -> bool:
        """Whether so many contradict the others that these may be the wrong ones."""
        return len(self.outliers) >= max(MANY, MANY_PART * len(self.residuals))

    @property
    def has_gross_residuals(self) -> bool:
        """Whether residuals are so large that the standard deviations are not valid."""
        freedom, squares = self.degrees_of_freedom, self.chi_squared
        return squares > GROSS * GROSS * freedom > 0 and chdtrc(freedom, squares) < GROSS_BY_CHANCE

    @property
    def far_from_priors(self) -> dict[str, float]:
        """What is farther from what was assumed than chance explains, and by how many deviations.

        Of the directions with a meaning the farthest, if it is farther than any parameter; then
        parameters.
        """
        if self.priors is None:
            return {}
        sizes = self.prior_residuals
        found = dict(zip(PARAMETER_NAMES, np.abs(sizes).tolist()))
        scale = self._knowledge.scale
        off = self.machine.vector - self._knowledge.mean
        change = np.asarray(np.linalg.solve(scale, off), float)
        ways = along_named(self.nominal.vector, scale, change)
        name = max(ways, key=lambda each: abs(ways[each]))
        if abs(ways[name]) > max(found.values()):
            found = {name: abs(ways[name]), **found}
        return {name: size for name, size in found.items() if size > FAR_FROM_PRIORS}

    @property
    def prior_residuals(self) -> FloatArray:
        """Each parameter less what was assumed, by its standard deviation there. Shape (12,)."""
        if self.priors is None:
            return np.zeros(MACHINE)
        deviations = np.linalg.norm(self._knowledge.scale, axis=1)
        return np.asarray((self.machine.vector - self._knowledge.mean) / deviations)

    @property
    def standard_deviations(self) -> FloatArray:
        """Of the twelve parameters; infinite where nothing is known. Shape (12,) [m]."""
        return self._deviations(np.eye(MACHINE))

    def position_uncertainty(self, position: Sequence[float], *, aligned: bool = False) -> Vector3:
        """Return the standard deviations of the platform's x, y and z at a position.

        Args:
            position: Shape (3,) [m].
            aligned: whether a shift in x and y and a turn about z of the whole region count as no
                error. Only positions in the frame of the machine can tell these.

        Returns:
            Shape (3,) [m]; infinite where nothing is known, NaN where the arms do not reach.
        """
        place = finite_vector("position", position, 3)
        return three(self.position_uncertainties([place], aligned=aligned)[0])

    def position_uncertainties(self, positions: ArrayLike, *, aligned: bool = False) -> FloatArray:
        """Return the same for many positions. Shape (n, 3) [m]."""
        rows = _position_rows(self.machine, positions, aligned)
        return self._deviations(rows.reshape(-1, MACHINE)).reshape(-1, 3)

    def position_uncertainties_before(
        self, positions: ArrayLike, *, aligned: bool = False
    ) -> FloatArray:
        """Return the same before the calibration: by the priors; infinite without any."""
        rows = _position_rows(self.nominal, positions, aligned)
        if not self._knowledge.is_prior:
            return np.full((len(rows), 3), np.inf)
        return np.asarray(np.linalg.norm(rows @ self._knowledge.scale, axis=2))

    def next_points(
        self,
        count: int,
        *,
        kinds: Mapping[str, float] | None = None,
        workspace: Workspace | None = None,
    ) -> tuple[Proposal, ...]:
        """Return the measurements that would help most, the best first.

        Args:
            count: how many.
            kinds: ``touch``, ``position``, ``distance``, each with its standard deviation [m];
                those that were measured so far if None.
            workspace: in which the platform has to stay.

        Raises:
            OutOfBoundsError: if ``count`` is negative.
            CalibrationError: if there is no such kind of measurement.
        """
        if count < 0:
            raise OutOfBoundsError("count", count, "at least 0")
        state, scale = self._solution.state, self._knowledge.scale
        measured = [one.measurement for one in self.residuals]
        chosen_kinds = dict(kinds) if kinds is not None else _kinds_of(measured)
        for kind in chosen_kinds:
            if kind not in KINDS:
                raise CalibrationError(
                    f"{kind!r} is no kind of measurement: {', '.join(KINDS)} are"
                )
        candidates = _candidates(state, measured, chosen_kinds, workspace)
        if not candidates:
            return ()
        model = MeasurementModel([one.measurement for one in candidates], self._unknowns)
        matrix = model.equations(state)[1]
        rows = [_in_scale(matrix[part], scale) for part in model.rows]
        information = information_of(self._solution, self._knowledge)
        proposals: list[Proposal] = []
        before = knowledge_of(information)
        left = list(range(len(candidates)))
        while left and len(proposals) < count:
            known = [knowledge_of(information + rows[i].T @ rows[i]) for i in left]
            best = left.pop(first_largest(known))
            information = information + rows[best].T @ rows[best]
            volume = math.exp(0.5 * (before - max(known)))
            proposals.append(replace(candidates[best], volume=volume))
        return tuple(proposals)

    def _deviations(self, rows: FloatArray) -> FloatArray:
        """Return the standard deviations of linear functions of the parameters. Shape (n,)."""
        spectrum, deviations = _spread(self._solution, self._knowledge)
        parts = rows @ self._knowledge.scale @ spectrum.directions
        # Infinity times nothing is nothing.
        touched = np.isfinite(deviations) | (np.abs(parts) > UNTOUCHED)
        return np.asarray(np.linalg.norm(parts * np.where(touched, deviations, 0.0), axis=1))


def _position_rows(machine: MachineParameters, positions: ArrayLike, aligned: bool) -> FloatArray:
    """Return how positions change with the parameters. Shape (n, 3, 12)."""
    places = finite_array("positions", positions, (None, 3))
    rows = position_derivatives(machine.vector, places)
    if aligned:
        region = Region.of(machine.geometry)
        motion = region.plane_motion(region.derivatives(machine.vector))
        rows = rows - plane_basis(places, region.center) @ motion
    return rows


def covariance_of(solution: Solution, knowledge: Knowledge) -> FloatArray:
    """Return the covariance of the twelve parameters, at the machine that was found.

    Without priors, what was not fitted is left out.

    Returns:
        Shape (12, 12) [m^2].
    """
    spectrum, deviations = _spread(solution, knowledge)
    if not knowledge.is_prior:
        deviations[solution.basis.shape[1] :] = 0.0
    spread = knowledge.scale @ spectrum.directions * deviations
    return np.asarray(spread @ spread.T)


def _spread(solution: Solution, knowledge: Knowledge) -> tuple[Spectrum, FloatArray]:
    """Return directions of u with the standard deviation along each. Shape (12,)."""
    spectrum = knowledge.spectrum(solution.matrix)
    return spectrum, spectrum.errors(solution.residuals)


def unidentified_of(solution: Solution, knowledge: Knowledge) -> tuple[str, ...]:
    """Return in words what the data of a solution do not determine."""
    unknown = solution.spectrum.directions[:, solution.spectrum.determined :]
    return in_words(solution.state.machine, knowledge.scale, unknown)
