"""Files of measurements.

Heights are reported ones. Lengths are in the unit that the file names. An example:

    unit: mm
    nominal:
      anchors: [[0, -200], [173.2, 100], [-173.2, 100]]
      arm_lengths: [400, 400, 400]
      height_offsets: [0, 0, 0]              # without it: zeros
    # or: none; without it: these
    priors: {anchors: 1, arm_lengths: 0.5, height_offsets: 2, common_radius: 1,
      common_arm_length: 1}
    plates:
      bed: {height: 0, tilt: [0, 0]}         # or: unknown, for one or both
    touches:
      - {heights: [346.4, 346.4, 346.4], plate: bed, standard_deviation: 0.01}
    positions:
      - {heights: [...], position: [...], frame: camera, standard_deviation: 0.05}
    distances:
      - {from: [...], to: [...], distance: 240, standard_deviation: 0.05}
    workspace: {lower_heights: [...], ...}   # or without it, see ``read_workspace``
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from tri_glide_kinematics.calibration.fit.numbers import (
    BASE,
    PRIOR_KINDS,
    CalibrationError,
    Distance,
    MachineParameters,
    MeasuredPosition,
    Plate,
    Priors,
    Touch,
)
from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.keys import UNITS, FileError, Keys, whole_yaml
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlideGeometry
from tri_glide_kinematics.vectors import Vector3, three
from tri_glide_kinematics.workspace import Cylinder, WorkspaceLimits


class MeasurementFileError(FileError, CalibrationError):
    """A file of measurements cannot be read, or something in it has no meaning."""


NONE = "none"


def read_workspace(section: Keys, unit: float) -> WorkspaceLimits:
    """Return the limits, with the travel as the drives report it.

    Args:
        section: the keys.
        unit: of all lengths in it [m].

    Raises:
        KinematicsError: if a key is missing or a number has no meaning.
    """

    def lengths(key: str, count: int) -> tuple[float, ...]:
        return tuple(unit * value for value in section.numbers(key, section.value(key), count))

    def given(key: str) -> bool:
        return bool(section.value(key, NONE) != NONE)

    cylinder = None
    if given("cylinder_center"):
        x, y = lengths("cylinder_center", 2)
        lower, upper = lengths("cylinder_z", 2)
        cylinder = Cylinder(x, y, unit * section.number("cylinder_radius"), lower, upper)
    return WorkspaceLimits(
        three(lengths("lower_heights", 3)),
        three(lengths("upper_heights", 3)),
        unit * section.number("reach_margin"),
        section.number("max_condition_number"),
        three(lengths("box_lower", 3)) if given("box_lower") else None,
        three(lengths("box_upper", 3)) if given("box_upper") else None,
        cylinder,
    )


# Of a file that is written here: no other is overwritten.
FIRST_LINE = "# Measurements of one machine."
UNKNOWN = "unknown"

Made = TypeVar("Made")


@dataclass(frozen=True)
class MeasurementFile:
    """The contents of a file of measurements.

    Attributes:
        nominal: the machine as it was drawn, with the offsets that are assumed.
        priors: how far the real one may be from it; None if that is not known at all.
        touches: of plates.
        positions: that were measured.
        distances: that were measured.
        workspace: where the platform may be, with the travel of the sliders as the drives report
            it; None if that is not said.
    """

    nominal: MachineParameters = field(default_factory=lambda: MachineParameters(DEFAULT_GEOMETRY))
    priors: Priors | None = field(default_factory=Priors)
    touches: tuple[Touch, ...] = ()
    positions: tuple[MeasuredPosition, ...] = ()
    distances: tuple[Distance, ...] = ()
    workspace: WorkspaceLimits | None = None


def load_measurements(file: str | Path) -> MeasurementFile:
    """Read a file.

    Raises:
        MeasurementFileError: if it cannot be read, or something in it has no meaning; the text
            names file, measurement and number.
    """
    return _Reader(MeasurementFileError.keys_of(file)).read()


def measurement_text(content: MeasurementFile, unit: str = "mm") -> str:
    """Return the text of a file that ``load_measurements`` reads as the same."""
    return f"{FIRST_LINE}\n{whole_yaml(_as_keys(content, unit))}"


def save_measurements(file: str | Path, content: MeasurementFile, unit: str = "mm") -> None:
    """Write a file that ``load_measurements`` reads as the same; an older one is kept.

    Raises:
        MeasurementFileError: if it cannot be written, or a file is there that was not written so.
    """
    with MeasurementFileError.of_writing(file):
        replace_file(file, measurement_text(content, unit))


class _Reader:
    """Reads one file."""

    def __init__(self, keys: Keys) -> None:
        self._keys = keys
        self._unit = keys.unit()
        self._plates: dict[str, Plate] = {}

    def read(self) -> MeasurementFile:
        with self._keys.all_read():
            nominal, priors = self._nominal(), self._priors()
            for name, values in self._keys.section("plates", {}).items():
                self._plates[name] = self._plate(name, values)
            return MeasurementFile(
                nominal,
                priors,
                self._all("touches", "touch", self._touch),
                self._all("positions", "position", self._position),
                self._all("distances", "distance", self._distance),
                self._workspace(),
            )

    def _nominal(self) -> MachineParameters:
        section = self._keys.section("nominal")
        with section.all_read():
            rows = enumerate(section.entries("anchors"))
            anchors = [self._lengths(section, f"anchors[{i}]", row, 2) for i, row in rows]
            arms = self._lengths(section, "arm_lengths", section.value("arm_lengths"), 3)
            offsets = section.value("height_offsets", [0.0, 0.0, 0.0])
            x, y, z = self._lengths(section, "height_offsets", offsets, 3)
            return MachineParameters(TriGlideGeometry(anchors, arms), (x, y, z))

    def _priors(self) -> Priors | None:
        if self._keys.value("priors", {}) == NONE:
            return None
        section = self._keys.section("priors", {})
        usual = [getattr(Priors(), kind) / self._unit for kind in PRIOR_KINDS]
        with section.all_read():
            numbers = [self._unit * section.number(*each) for each in zip(PRIOR_KINDS, usual)]
            return Priors(**dict(zip(PRIOR_KINDS, numbers)))  # type: ignore[arg-type]

    def _workspace(self) -> WorkspaceLimits | None:
        if self._keys.value("workspace", NONE) == NONE:
            return None
        section = self._keys.section("workspace")
        with section.all_read():
            return read_workspace(section, self._unit)

    def _plate(self, name: str, values: Any) -> Plate:
        section = self._keys.within(f"plate {name!r}", values)
        with section.all_read():
            height, tilt = section.value("height", 0.0), section.value("tilt", [0.0, 0.0])
            return Plate(
                name,
                None if height == UNKNOWN else self._unit * section.number("height", 0.0),
                None if tilt == UNKNOWN else self._pair(section, "tilt", tilt),
            )

    def _touch(self, section: Keys) -> Touch:
        name = section.text("plate", "bed")
        if name not in self._plates and name != "bed":
            known = ", ".join(self._plates) or "none"
            raise section.error(
                f"is {name!r}, which `plates` does not name (it has: {known})", "plate"
            )
        heights = self._heights(section, "heights")
        plate = self._plates.get(name, Plate(name))
        return Touch(heights, plate, self._deviation(section))

    def _position(self, section: Keys) -> MeasuredPosition:
        heights, position = self._heights(section, "heights"), self._heights(section, "position")
        return MeasuredPosition(
            heights, position, section.text("frame", BASE), self._deviation(section)
        )

    def _distance(self, section: Keys) -> Distance:
        ends = self._heights(section, "from"), self._heights(section, "to")
        distance = self._unit * section.number("distance")
        return Distance(*ends, distance, self._deviation(section))

    def _all(self, key: str, name: str, read: Callable[[Keys], Made]) -> tuple[Made, ...]:
        found = []
        for number, each in enumerate(self._keys.entries(key, []), 1):
            section = self._keys.within(f"{name} {number}", each)
            with section.all_read():
                found.append(read(section))
        return tuple(found)

    def _heights(self, section: Keys, key: str) -> Vector3:
        return three(self._unit * value for value in section.vector(key))

    def _deviation(self, section: Keys) -> float:
        return self._unit * section.number("standard_deviation")

    def _lengths(self, section: Keys, key: str, values: Any, count: int) -> tuple[float, ...]:
        return tuple(self._unit * value for value in section.numbers(key, values, count))

    def _pair(self, section: Keys, key: str, values: Any) -> tuple[float, float]:
        first, second = section.numbers(key, values, 2)
        return first, second


def _as_keys(content: MeasurementFile, unit: str) -> dict[str, Any]:
    """Return the content as YAML writes it."""

    def in_unit(lengths: Any) -> Any:
        if isinstance(lengths, Iterable):
            return [in_unit(length) for length in lengths]
        # Twelve digits: what is left of a change of units is not written.
        return float(f"{lengths / UNITS[unit]:.12g}")

    def deviation(measurement: Touch | MeasuredPosition | Distance) -> dict[str, Any]:
        return {"standard_deviation": in_unit(measurement.standard_deviation)}

    geometry = content.nominal.geometry
    plates = {touch.plate.name: touch.plate for touch in content.touches}
    priors, workspace = content.priors, content.workspace
    return {
        "unit": unit,
        "nominal": {
            "anchors": in_unit(geometry.anchors),
            "arm_lengths": in_unit(geometry.arm_lengths),
            "height_offsets": in_unit(content.nominal.height_offsets),
        },
        "priors": NONE
        if priors is None
        else {kind: in_unit(getattr(priors, kind)) for kind in PRIOR_KINDS},
        "plates": {
            name: {
                "height": UNKNOWN if plate.height is None else in_unit(plate.height),
                "tilt": UNKNOWN if plate.tilt is None else list(plate.tilt),
            }
            for name, plate in plates.items()
        },
        "touches": [
            {"heights": in_unit(one.heights), "plate": one.plate.name, **deviation(one)}
            for one in content.touches
        ],
        "positions": [
            {
                "heights": in_unit(one.heights),
                "position": in_unit(one.position),
                "frame": one.frame,
                **deviation(one),
            }
            for one in content.positions
        ],
        "distances": [
            {
                "from": in_unit(one.heights_from),
                "to": in_unit(one.heights_to),
                "distance": in_unit(one.distance),
                **deviation(one),
            }
            for one in content.distances
        ],
        "workspace": NONE
        if workspace is None
        else {
            name: value if name == "max_condition_number" else in_unit(value)
            for name, value in workspace.by_name().items()
        },
    }
