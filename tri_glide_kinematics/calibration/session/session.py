"""A session: what a user has measured so far, one by one, and what comes of it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import count
from pathlib import Path

import numpy as np

from tri_glide_kinematics.calibration.fit import (
    BASE,
    PARAMETER_NAMES,
    Calibration,
    Distance,
    MachineParameters,
    MeasuredPosition,
    Measurement,
    MeasurementFile,
    Plate,
    Priors,
    Proposal,
    Region,
    Residual,
    Touch,
    calibrate,
    measurement_text,
)
from tri_glide_kinematics.calibration.session.leading import RecordingError
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import parameter_file, replace_file, write_file
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3, plus
from tri_glide_kinematics.wording import list_text, number_text, vector_text
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits


class SavingError(KinematicsError):
    """A file cannot be written."""


def new_session_file(folder: Path, now: datetime) -> Path:
    """Return a name in a folder that no file has yet: that of the session that begins ``now``."""
    name = f"session_{now:%Y-%m-%d_%H-%M-%S}"
    files = (folder / f"{name}{f'_{number}' if number else ''}.yaml" for number in count())
    return next(file for file in files if not file.exists())


def keep_measurements(file: Path, content: MeasurementFile) -> None:
    """Write the measurements made so far in place of those before; they are on the disk then.

    Raises:
        SavingError: if that is not possible.
    """
    try:
        write_file(file, measurement_text(content))
    except OSError as error:
        reason = error.strerror or error
        raise SavingError(f"not noted, as {file} cannot be written: {reason}") from error


class Session:
    """Measurements in the order in which they were made, counted from 1.

    Attributes:
        measurements: all that are whole.
    """

    def __init__(self, plate: Plate, keep: Callable[[], None] = lambda: None) -> None:
        """Begin without any.

        Args:
            plate: that is meant where none is named; plates of other names are known in nothing.
            keep: is called after each change of the measurements, to keep them. If it raises an
                error, the change is taken back.
        """
        self._keep = keep
        self.measurements: list[Measurement] = []
        self._plate = plate
        self._first_end: Vector3 | None = None

    def touch(self, heights: Vector3, deviation: float, plate: str = "") -> int:
        """Note a touch and return its number.

        Args:
            heights: as reported. Shape (3,) [m].
            deviation: standard deviation [m].
            plate: by its name; empty for the usual one.

        Raises:
            KinematicsError: if a number has no meaning.
        """
        known = self._plate if plate in ("", self._plate.name) else Plate(plate, None, None)
        return self._add(Touch(heights, known, deviation))

    def position(
        self, heights: Vector3, position: Vector3, deviation: float, frame: str = ""
    ) -> int:
        """Note where another instrument sees the platform [m], and return the number of that.

        Raises:
            KinematicsError: if a number has no meaning.
        """
        return self._add(MeasuredPosition(heights, position, frame or BASE, deviation))

    def distance_end(self, heights: Vector3, distance: float, deviation: float) -> int:
        """Note an end of a distance; return the number of the measurement, 0 after the first end.

        Args:
            heights: as reported. Shape (3,) [m].
            distance: from the first end [m]; 0 for the first end, which is noted anew.
            deviation: standard deviation [m].

        Raises:
            RecordingError: if no first end has been noted.
            KinematicsError: if a number has no meaning.
        """
        if distance == 0.0:
            self._first_end = heights
            return 0
        if self._first_end is None:
            raise RecordingError("the first end is missing: note it with distance 0")
        number = self._add(Distance(self._first_end, heights, distance, deviation))
        self._first_end = None
        return number

    def replace(self, measurements: Iterable[Measurement]) -> None:
        """Go on with other measurements than those that were made."""
        self._use([*measurements])
        self._first_end = None

    def drop(self, number: int) -> str:
        """Forget a measurement, or all for the number 0, and return in words what was forgotten.

        Raises:
            RecordingError: if there is no such measurement.
        """
        count = len(self.measurements)
        if number == 0:
            self._use([])
            self._first_end = None
            return f"{count} measurements"
        if not 1 <= number <= count:
            raise RecordingError(f"there is no measurement {number}, only {count}")
        dropped = self.measurements[number - 1]
        self._use([*self.measurements[: number - 1], *self.measurements[number:]])
        return in_words(dropped)

    def lines(self) -> list[str]:
        """Return each measurement in words."""
        return [f"{index}: {in_words(each)}" for index, each in enumerate(self.measurements, 1)]

    @property
    def missing(self) -> str:
        """The measurement that is begun and not whole, in words; empty if there is none."""
        return "" if self._first_end is None else "the second end of a distance"

    def content(
        self,
        nominal: MachineParameters,
        priors: Priors | None,
        workspace: WorkspaceLimits | None = None,
    ) -> MeasurementFile:
        """Return all of it, and what is known of the machine, as a file holds that."""
        return MeasurementFile(
            nominal,
            priors,
            tuple(each for each in self.measurements if isinstance(each, Touch)),
            tuple(each for each in self.measurements if isinstance(each, MeasuredPosition)),
            tuple(each for each in self.measurements if isinstance(each, Distance)),
            workspace,
        )

    def _add(self, measurement: Measurement) -> int:
        self._use([*self.measurements, measurement])
        return len(self.measurements)

    def _use(self, measurements: list[Measurement]) -> None:
        before, self.measurements = self.measurements, measurements
        try:
            self._keep()
        except Exception:
            self.measurements = before
            raise


def in_words(measurement: Measurement) -> str:
    """Return a measurement in words."""
    deviation = f"±{number_text(1e6 * measurement.standard_deviation, 4)} µm"
    if isinstance(measurement, Touch):
        place = vector_text(measurement.heights, 7)
        return f"touch of plate {measurement.plate.name!r} {deviation} at heights {place} m"
    if isinstance(measurement, MeasuredPosition):
        position = vector_text(measurement.position, 7)
        place = vector_text(measurement.heights, 7)
        frame = measurement.frame
        return f"position {position} m in frame {frame!r} {deviation} at heights {place} m"
    ends = (measurement.heights_from, measurement.heights_to)
    first, second = (vector_text(heights, 7) for heights in ends)
    length = number_text(1e3 * measurement.distance, 7)
    return f"distance {length} mm {deviation} from heights {first} to {second} m"


NOT_SAID = (
    "These places are not compared with the sliders' travel: the measurements come without a "
    "`workspace`"
)
NO_PLACE = "No place that would be worth measuring lies inside the workspace"


def solved(content: MeasurementFile) -> Calibration:
    """Return the calibration.

    Raises:
        CalibrationError: if there is none, with the reason.
    """
    return calibrate(
        content.nominal.geometry,
        content.touches,
        content.positions,
        content.distances,
        content.priors,
        height_offsets=content.nominal.height_offsets,
    )


def proposed(
    content: MeasurementFile, calibration: Calibration, count: int
) -> tuple[tuple[Proposal, ...], str]:
    """Return ``count`` measurements that would help most, and what is to be said of them."""
    if not count:
        return (), ""
    limits = content.workspace
    workspace = None if limits is None else workspace_of(calibration.machine, limits)
    proposals = calibration.next_points(count, workspace=workspace)
    return proposals, NO_PLACE if not proposals else NOT_SAID if limits is None else ""


def workspace_of(machine: MachineParameters, limits: WorkspaceLimits) -> Workspace:
    """Return the workspace of a machine.

    Args:
        machine: with its height offsets.
        limits: with the travel as the drives report it.
    """
    offsets = machine.height_offsets
    in_space = replace(
        limits,
        lower_heights=plus(limits.lower_heights, offsets),
        upper_heights=plus(limits.upper_heights, offsets),
    )
    return Workspace(TriGlide(machine.geometry), in_space)


def parameter_text(
    machine: MachineParameters, name: str, drawing: MachineParameters | None = None
) -> str:
    """Return the text of the file ``name`` for a ``machine``, with lengths to a nanometre.

    With its ``drawing``, about which the priors of the next calibration will be, too.
    """
    head = (
        "Geometry of one machine, as it was calibrated. All nodes take it after their other file:",
        f"--params-file tri_glide.yaml --params-file {name}",
        "In braces, so that a file that is cut off is refused.",
    )
    lengths: dict[str, Iterable[float]] = {
        "anchors": np.ravel(machine.geometry.anchors),
        "arm_lengths": machine.geometry.arm_lengths,
        "height_offsets": machine.height_offsets,
        **({} if drawing is None else {"drawn_machine": drawing.vector}),
    }
    rows = [(key, list_text(values, 9), "m") for key, values in lengths.items()]
    # One section for all nodes, as in config/tri_glide.yaml: so "-p name:=value" wins over it.
    return parameter_file(head, "/**", [("geometry", "calibrated", ""), *rows])


def save_parameters(
    file: Path, machine: MachineParameters, drawing: MachineParameters | None = None
) -> None:
    """Write the file, as ``parameter_text``; an older one becomes ``NAME.bak``.

    Raises:
        SavingError: if that is not possible, or a file is there that was not written so.
    """
    try:
        replace_file(file, parameter_text(machine, file.name, drawing))
    except OSError as error:
        raise SavingError(f"{file} cannot be written: {error.strerror or error}") from error


# A calibration as a person reads it.

# Places lie on this many rings about the centre.
RINGS = 8


@dataclass(frozen=True, eq=False)
class UncertaintyMap:
    """Standard deviations of x, y and z over a disc; they do not depend on z.

    Attributes:
        region: the disc with its n places.
        before: by what was assumed. Shape (n, 3) [m]; infinite where nothing is known.
        after: by the calibration. Shape (n, 3) [m].
        aligned: the same, if a shift in x and y and a turn about z do not matter. Shape (n, 3) [m].
    """

    region: Region
    before: FloatArray
    after: FloatArray
    aligned: FloatArray

    @classmethod
    def of(cls, calibration: Calibration) -> UncertaintyMap:
        """Return the map of a ``calibration``."""
        whole = Region.of(calibration.geometry)
        region = Region.disc(whole.center, whole.radius, RINGS)
        return cls(
            region,
            calibration.position_uncertainties_before(region.places),
            calibration.position_uncertainties(region.places),
            calibration.position_uncertainties(region.places, aligned=True),
        )


# Below it a length is written in micrometres [m].
MICROMETRES_BELOW = 1e-4
MILLIMETRES = 1e3
QUESTION = (
    "Is the height of the plate right? If the machine may be so far from what was assumed, say so "
    "in the priors"
)
PLURALS = {"touch": "touches", "position": "positions", "distance": "distances"}


def report(calibration: Calibration, proposals: Sequence[Proposal] = (), remark: str = "") -> str:
    """Return all that a calibration has to say.

    Args:
        calibration: to be told of.
        proposals: of what to measure next.
        remark: on these, in words.
    """
    parts = [
        _data(calibration),
        _contradictions(calibration),
        _parameters(calibration),
        _places(UncertaintyMap.of(calibration)),
        _undetermined(calibration),
        _residuals(calibration.residuals),
        _listed("Warnings", calibration.warnings),
        _listed("What would help most, the best first", map(_proposal, proposals)),
        remark,
    ]
    return "\n\n".join(part for part in parts if part)


def length_text(length: float) -> str:
    """Return a length [m] in the unit that suits it; infinite stands for what is not known."""
    if not math.isfinite(length):
        return "not known"
    if abs(length) < MICROMETRES_BELOW:
        return f"{number_text(1e6 * length, 3)} µm"
    return f"{number_text(1e3 * length, 3)} mm"


def _data(calibration: Calibration) -> str:
    counts = Counter(one.name.split()[0] for one in calibration.residuals)
    texts = [f"{count} {kind if count == 1 else PLURALS[kind]}" for kind, count in counts.items()]
    priors = "nothing" if calibration.priors is None else str(calibration.priors)
    squares = number_text(calibration.chi_squared, 3)
    freedom = calibration.degrees_of_freedom
    spread = number_text(math.sqrt(2.0 * freedom), 2)
    return (
        f"Measured: {', '.join(texts)}\n"
        f"Assumed before: {priors}\n"
        f"Residuals: chi-squared is {squares}, expected {freedom} ± {spread}"
    )


def contradiction(calibration: Calibration) -> str:
    """Return in words why the result is not to be used; empty if it is."""
    if not calibration.is_contradicted:
        return ""
    parts = ["measurements and assumptions contradict each other"]
    if calibration.has_gross_residuals:
        parts.append(
            f"chi-squared is {number_text(calibration.chi_squared, 3)}, expected "
            f"{calibration.degrees_of_freedom}; the standard deviations are not valid"
        )
    if calibration.has_many_outliers:
        parts.append(
            f"{len(calibration.outliers)} of {len(calibration.residuals)} measurements contradict "
            "the others, which may be the wrong ones"
        )
    far = calibration.far_from_priors
    if far:
        name = max(far, key=lambda each: far[each])
        parts.append(f"{name} is {_distance(far[name])}")
    return ": ".join((parts[0], "; ".join(parts[1:])))


def _contradictions(calibration: Calibration) -> str:
    """Return what contradicts the assumptions, which spoils all numbers below."""
    if not calibration.is_contradicted:
        return ""
    far = [f"{name} is {_distance(size)}" for name, size in calibration.far_from_priors.items()]
    parts = (f"NOT VALID: {contradiction(calibration)}", _listed(QUESTION, far))
    return "\n".join(filter(None, parts))


def _distance(size: float) -> str:
    return f"{number_text(size, 3)} standard deviations from what was assumed"


def _parameters(calibration: Calibration) -> str:
    lines = [
        f"{'parameter [mm]':18}{'nominal':>12}{'calibrated':>13}{'change':>10}{'± (1 sd)':>12}"
    ]
    rows = zip(
        PARAMETER_NAMES,
        _for_table(calibration.nominal.vector),
        _for_table(calibration.machine.vector),
        _for_table(calibration.standard_deviations),
    )
    for name, nominal, value, deviation in rows:
        known = f"{deviation:.4f}" if math.isfinite(deviation) else "not known"
        change = value - nominal
        lines.append(f"{name:18}{nominal:12.4f}{value:13.4f}{change:+10.4f}{known:>12}")
    return "\n".join(lines)


def _for_table(lengths: FloatArray) -> FloatArray:
    """Return lengths [m] in millimetres, without a sign where a zero is written."""
    return np.round(MILLIMETRES * lengths, 4) + 0.0


def _places(uncertainty: UncertaintyMap) -> str:
    radius = number_text(1e3 * uncertainty.region.radius, 3)
    columns = (uncertainty.before, uncertainty.after, uncertainty.aligned)
    lines = [
        f"How well the platform's position is known within {radius} mm of the axis, at the worst "
        "place (1 sd):",
        f"   {'before':>12}{'after':>12}{'in itself *':>14}",
    ]
    for axis, name in enumerate("xyz"):
        before, after, aligned = (length_text(_worst(column[:, axis])) for column in columns)
        lines.append(f"{name}  {before:>12}{after:>12}{aligned:>14}")
    lines.append(
        "* if a shift in x and y and a turn about z do not matter: what a part is off that is made"
    )
    lines.append("  with the machine")
    return "\n".join(lines)


def _worst(values: FloatArray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else math.inf


def _undetermined(calibration: Calibration) -> str:
    if not calibration.unidentified:
        return "The measurements determine all twelve parameters."
    where = "as it was assumed to be" if calibration.priors is None else "as the priors say"
    return _listed(
        f"Not determined by these measurements, and left {where}", calibration.unidentified
    )


def _residuals(residuals: Sequence[Residual]) -> str:
    lines = [f"{'measurement [µm]':18}{'residual':>11}{'by the others *':>17}{'in sd':>8}"]
    for one in residuals:
        left, others = (f"{1e6 * _size(values):+.1f}" for values in (one.error, one.left_out))
        size = f"{one.size:.1f}"
        if not math.isfinite(one.size):
            others = size = "-"
        mark = "  left out: contradicts the others" if one.is_outlier else ""
        lines.append(f"{one.name:18}{left:>11}{others:>17}{size:>8}{mark}")
    lines.append("* predicted by all other measurements, minus measured; of a position its length")
    return "\n".join(lines)


def _size(values: Sequence[float]) -> float:
    return values[0] if len(values) == 1 else math.hypot(*values)


def _proposal(one: Proposal) -> str:
    places = " to ".join(
        "(" + ", ".join(number_text(1e3 * value, 4) for value in place) + ") mm"
        for place in one.places
    )
    target = f" of {one.target!r}" if one.target else ""
    volume = number_text(100.0 * one.volume, 3)
    return f"{one.kind}{target} at {places}: the uncertain volume shrinks to {volume} %"


def _listed(title: str, texts: Iterable[str]) -> str:
    lines = [f"- {text}" for text in texts]
    return "\n".join([f"{title}:", *lines]) if lines else ""
