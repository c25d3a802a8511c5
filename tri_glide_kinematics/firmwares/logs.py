"""What firmwares measured, as the measurements that ``calibrate`` takes.

A firmware tells where its settings put the nozzle when it touched the bed. The sliders were where
these settings put them, whatever the machine is really like: so each log needs the settings of its
moment. The bed is z = 0, and level.

- Klipper (``delta_calibrate.py``): SAVE_CONFIG keeps ``height0``, the height of the nozzle, and
  ``height0_pos``, in steps below the end stops; ``distance0`` lies between two such places.
- Marlin (``G30.cpp``, ``G33.cpp``): G30 prints places of the probe. G33 prints heights alone, on a
  circle that follows from ``Configuration.h``, and a middle that is a mean of three from P3 on.
- RepRapFirmware (``Grid.cpp``, ``RandomProbePointSet.cpp``): a height map, in which a bare 0 was
  not probed; heights of G32, whose places stand in ``bed.g``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tri_glide_kinematics.calibration import Distance, MeasurementFile, Plate, Touch
from tri_glide_kinematics.calibration.firmwares import MM, MarlinDelta
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares.reading import Firmware, FirmwareError, FirmwareSettings
from tri_glide_kinematics.keys import shortened
from tri_glide_kinematics.tables import table_text
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import three

# Standard deviations of what a log does not say [m]: a good probe, a calliper on a printed part.
TOUCH, DISTANCE = 2e-5, 5e-5

# Numbers of Marlin are printed with two digits behind the point.
ROUNDED = 0.0101

# The circle of the middle of G33 from P3 on, as part of the large one; an error that grows with the
# square of the radius is so much, squared, of that on the large one.
MIDDLE = 0.1
ANGLES = {"x": 210.0, "y": 330.0, "z": 90.0, "yz": 30.0, "zx": 150.0, "xy": 270.0}

NUMBER = r"([-+]?\d+(?:\.\d*)?)"
SIGNS = re.compile(
    r"RepRapFirmware height map file|bed probe heights:|G33 Auto Calibrate|\bBed X:"
    r"|^(?:#\*#)?\s*\[delta_calibrate\]",
    re.MULTILINE,
)
KEPT = re.compile(r"(?:#\*#)?\s*(manual_height|height|distance)(\d+)(\w*)\s*[:=]\s*([^#;]*)")
FIELDS = {"height": ("", "_pos"), "distance": ("", "_pos1", "_pos2")}
G30 = re.compile(rf"Bed X:\s*{NUMBER}\s*Y:\s*{NUMBER}\s*Z:\s*{NUMBER}")
G33 = re.compile(r"\bG33\b(?! Auto)([^*;]*)")
IN_FORCE = re.compile(rf"\b(Height|Radius|[ET][xyz]):\s*{NUMBER}")
CIRCLE = re.compile(rf"at radius:\s*{NUMBER}")
RESULT = re.compile(rf"(?<!\w)(c|[xyz]|yz|zx|xy):\s*{NUMBER}")
PLACE = re.compile(rf"^[^;]*\bG30\b[^;]*\bP(\d+)[^;]*?\bX{NUMBER}[^;]*?\bY{NUMBER}", re.IGNORECASE)
HEIGHTS = re.compile(r"bed probe heights:([^,]*)", re.IGNORECASE)
DRY = "run G33 P3 V0, which prints all heights and changes no setting"


@dataclass(frozen=True)
class FirmwareLog:
    """What a firmware measured.

    Attributes:
        measurements: with the machine of the settings as the nominal one.
        notes: what a person has to know: what was assumed, and what was left out.
    """

    measurements: MeasurementFile
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Line:
    file: Path
    number: int
    text: str

    def error(self, reason: str) -> FirmwareError:
        return FirmwareError(self.file, f"line {self.number}", reason)


def is_log(file: str | Path) -> bool:
    """Return whether a file has what a firmware measured.

    Raises:
        TableError: if it cannot be read.
    """
    return SIGNS.search(table_text(file)) is not None


def load_log(files: Sequence[str | Path], settings: FirmwareSettings) -> FirmwareLog:
    """Read what a firmware measured.

    Args:
        files: of one log: for Klipper, ``printer.cfg`` or what SAVE_CONFIG appended to it; for
            Marlin, what it printed, with the commands; for RepRapFirmware, ``heightmap.csv``, or
            what G32 printed and ``bed.g``.
        settings: with which it was measured.

    Raises:
        FirmwareError: if there is nothing in it, it is none of single touches, a place is not
            known, or a number has no meaning; it names file and line.
        TableError: if a file cannot be read.
    """
    log = _Log(settings)
    for file in map(Path, files):
        texts = enumerate(table_text(file).split("\n"), 1)
        log.lines += [_Line(file, number, text) for number, text in texts]
    readers = {Firmware.KLIPPER: _klipper, Firmware.MARLIN: _marlin, Firmware.REPRAP: _reprap}
    readers[settings.firmware](log)
    if not log.touches and not log.distances:
        kind = settings.firmware.value
        reason = f"has nothing that {kind} measured, and the settings are of {kind}"
        raise FirmwareError(files[0], "", reason)
    log.notes.append(
        f"assumed (standard deviations): touches within {MM * TOUCH:g} mm, distances within "
        f"{MM * DISTANCE:g} mm"
    )
    touches, distances = tuple(log.touches), tuple(log.distances)
    content = MeasurementFile(settings.machine, touches=touches, distances=distances)
    return FirmwareLog(content, tuple(log.notes))


class _Log:
    """What is found in a log; places and heights are in mm."""

    def __init__(self, settings: FirmwareSettings) -> None:
        self.settings = settings
        self.machine = TriGlide(settings.machine.geometry)
        self.lines: list[_Line] = []
        self.touches: list[Touch] = []
        self.distances: list[Distance] = []
        self.notes: list[str] = []

    def said(self, name: str, otherwise: float = 0.0) -> list[float]:
        """Return the numbers of a setting, or this one."""
        if name not in self.settings.said:
            return [otherwise]
        where = self.settings.said[name]
        line = _Line(Path(where.file), where.line, where.text)
        return _numbers(line, where.text.strip("{} "), name)

    def touch(self, line: _Line, x: float, y: float, z: float, spread: float = 0.0) -> None:
        """Add a touch of the nozzle; ``spread`` adds to its standard deviation [mm]."""
        with _told(line):
            heights = self.machine.inverse((x / MM, y / MM, z / MM))
            deviation = math.hypot(TOUCH, spread / MM)
            self.touches.append(Touch(heights, standard_deviation=deviation))

    def behind(self, line: _Line) -> None:
        """Note that what stands below was measured with other settings."""
        place = f"{line.file}, line {line.number}"
        self.notes.append(
            f"{place}: settings are changed here; what was measured later is left out"
        )

    def probe_offset(self) -> tuple[float, float]:
        """Return where the probe is from the nozzle [mm]."""
        if {"NOZZLE_AS_PROBE", "SENSORLESS_PROBING"} & self.settings.said.keys():
            return 0.0, 0.0
        x, y = [*self.said("NOZZLE_TO_PROBE_OFFSET"), 0.0][:2]
        code = "G31" if self.settings.firmware is Firmware.REPRAP else "M851"
        return self.said(f"{code} X", x)[0], self.said(f"{code} Y", y)[0]

    def probed(self, line: _Line, x: float, y: float, z: float) -> None:
        """Add a touch of the probe at this place."""
        x_offset, y_offset = self.probe_offset()
        self.touch(line, x - x_offset, y - y_offset, z)


@contextmanager
def _told(line: _Line) -> Iterator[None]:
    """Make what a number cannot mean an error of its line."""
    try:
        yield
    except KinematicsError as error:
        raise line.error(str(error)) from error


def _numbers(line: _Line, text: str, name: str, count: int | None = None) -> list[float]:
    """Return numbers between commas.

    Raises:
        FirmwareError: if one is none, or there are not as many.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if (
        not numbers
        or len(numbers) != (count or len(numbers))
        or not all(map(math.isfinite, numbers))
    ):
        wanted = "numbers" if count is None else f"{count} numbers" if count > 1 else "a number"
        raise line.error(f"{name} is {shortened(text.strip())}, must be {wanted}")
    return numbers


def _klipper(log: _Log) -> None:
    found: dict[tuple[str, int], dict[str, tuple[_Line, str]]] = {}
    for line in log.lines:
        kept = KEPT.match(line.text)
        if kept is not None:
            # As Klipper does: what stands above wins.
            found.setdefault((kept[1], int(kept[2][:9])), {}).setdefault(kept[3], (line, kept[4]))
    if found:
        log.notes.append("here touch 1 and distance 1 are height0 and distance0, and so on")
    steps = [_step(log, f"stepper_{tower}") for tower in "abc"] if found else []
    for (kind, index), given in found.items():
        name, fields = f"{kind}{index}", FIELDS[kind.rpartition("_")[2]]
        line = next(iter(given.values()))[0]
        for field in (*fields, *given):
            if field not in given or field not in fields:
                what = "is missing" if field in fields else "is no field of it"
                must = " and ".join(name + each for each in fields)
                raise line.error(f"{name}{field} {what}: there must be {must}")
        ((value,), *places) = (
            _numbers(*given[field], name + field, 3 if field else 1) for field in fields
        )
        ends = [
            three(
                end - step * count / MM
                for end, step, count in zip(log.settings.end_stops, steps, place)
            )
            for place in places
        ]
        with _told(line):
            if kind == "distance":
                log.distances.append(Distance(ends[0], ends[1], value / MM, DISTANCE))
            else:
                plate = Plate(f"z = {value:g} mm", value / MM)
                log.touches.append(Touch(ends[0], plate, TOUCH))


def _step(log: _Log, stepper: str) -> float:
    """Return how far a tower moves in one step [mm]."""
    if f"{stepper}.step_distance" in log.settings.said:
        return log.said(f"{stepper}.step_distance")[0]
    names = [f"{stepper}.{name}" for name in ("rotation_distance", "microsteps")]
    missing = [name for name in names if name not in log.settings.said]
    if missing:
        raise log.lines[0].error(f"counts steps, and {missing[0]} is missing in the settings")
    (rotation,), (microsteps,) = map(log.said, names)
    (full,) = log.said(f"{stepper}.full_steps_per_rotation", 200.0)
    gears = log.settings.said.get(f"{stepper}.gear_ratio")
    ratios = re.findall(r"([\d.]+)\s*:\s*([\d.]+)", gears.text) if gears else []
    with _told(log.lines[0]):
        try:
            gearing = math.prod(float(driven) / float(driving) for driven, driving in ratios)
            return rotation / (full * microsteps * gearing)
        except (ValueError, ZeroDivisionError):
            raise KinematicsError(f"no steps follow from the settings of {stepper}") from None


def _marlin(log: _Log) -> None:
    command: str | None = None
    session: _Session | None = None
    for line in log.lines:
        place, asked = G30.search(line.text), G33.search(line.text)
        if place is not None:
            log.probed(line, *map(float, place.groups()))
        elif "G33 Auto Calibrate" in line.text:
            session, command = _Session(log, line, command), None
        elif asked is not None:
            command = asked[1].upper()
        elif session is not None and session.takes(line):
            session.finish()
            session = None
            if "DRY" not in line.text:
                log.behind(line)
                return
    if session is not None:
        session.finish()


class _Session:
    """One run of G33, with the command behind it if the log has that."""

    def __init__(self, log: _Log, line: _Line, command: str | None) -> None:
        self.log, self.line, self.command = log, line, command
        self.radius: float | None = None
        self.heights: dict[str, float] = {}

    def takes(self, line: _Line) -> bool:
        """Take what a line says; return whether the first round of probes is over.

        Raises:
            FirmwareError: if other settings were in force.
        """
        circle = CIRCLE.search(line.text)
        self.radius = float(circle[1]) if circle else self.radius
        delta = self.log.settings.delta
        if isinstance(delta, MarlinDelta) and not self.heights:
            all_three = {"E": delta.endstop_adj, "T": delta.tower_angle_trim}
            height = delta.height + self.log.settings.probe_offset
            known = {"Height": height, "Radius": delta.radius} | {
                f"{kind}{axis}": each
                for kind, values in all_three.items()
                for axis, each in zip("xyz", values)
            }
            for name, text in IN_FORCE.findall(line.text):
                if abs(float(text) - known[name]) > ROUNDED:
                    reason = f"{name} was {text}, and is {known[name]:g} in the settings"
                    raise line.error(f"{reason}: name those of that moment, as M503 prints them")
        is_over = re.search(r"Iteration|Calibration OK|End DRY", line.text)
        if is_over is None:
            self.heights |= {name: float(text) for name, text in RESULT.findall(line.text)}
        return is_over is not None

    def finish(self) -> None:
        """Add the touches.

        Raises:
            FirmwareError: if the heights are none of single touches, or it is not known where.
        """
        words = dict(re.findall(r"([A-Z])\s*(-?[\d.]*)", self.command or ""))
        points = words.get("P")
        if points is None and self.command is not None:
            points = f"{self.log.said('DELTA_CALIBRATION_DEFAULT_POINTS', 4.0)[0]:g}"
        reason = ""
        if not self.heights:
            reason = "no heights are printed"
        elif "O" in words:
            reason = "with O, Marlin probes beside the circle"
        elif points is None and {"x", "yz"} <= self.heights.keys():
            reason = "from P4 on heights are means of several places, and the command is not there"
        elif points not in (None, "1", "2", "3"):
            reason = f"with P{points}, heights are means of several places, or none: no touches"
        if reason:
            raise self.line.error(f"{reason}: {DRY}, and keep this command above what it prints")
        middle = self.heights.pop("c", None)
        radius = self.radius
        if radius is None and self.heights:
            radius = _circle(self.log, self.line) - float(words.get("R") or 0.0)
        for name, height in self.heights.items():
            angle = math.radians(ANGLES[name])
            x, y = (radius or 0.0) * math.cos(angle), (radius or 0.0) * math.sin(angle)
            self.log.touch(self.line, x, y, height)
        if middle is not None:
            bowl = max((abs(height - middle) for height in self.heights.values()), default=0.0)
            is_mean = len(self.heights) > 3
            self.log.touch(self.line, 0.0, 0.0, middle, MIDDLE**2 * bowl if is_mean else 0.0)


def _circle(log: _Log, line: _Line) -> float:
    """Return the radius of the places of G33 [mm]."""
    if "DELTA_CALIBRATION_RADIUS" in log.settings.said:
        return log.said("DELTA_CALIBRATION_RADIUS")[0]
    radius = log.settings.limits.radius
    if radius is None:
        reason = "G33 prints no radius, and the settings have no DELTA_PRINTABLE_RADIUS"
        raise line.error(f"{reason}: name Configuration.h with --settings, too")
    return MM * radius - log.said("PROBING_MARGIN", 10.0)[0] - math.hypot(*log.probe_offset())


def _reprap(log: _Log) -> None:
    places: dict[int, tuple[float, float]] = {}
    rows: list[tuple[_Line, list[str]]] = []
    is_over = False
    lines = iter(log.lines)
    for line in lines:
        place, heights = PLACE.match(line.text), HEIGHTS.search(line.text)
        if "RepRapFirmware height map file" in line.text:
            _height_map(log, lines, line)
        elif place is not None:
            places[int(place[1][:9])] = float(place[2]), float(place[3])
        elif heights is not None and not is_over:
            rows.append((line, re.findall(r"not set|probing failed|\S+", heights[1])))
        elif re.search(r"Calibrated \d+ factors", line.text):
            is_over = True
            if not rows:
                reason = "this calibration prints no heights: write S-1 at the last G30 of bed.g"
                raise line.error(f"{reason}, and run G32 with the settings of before")
            log.behind(line)
    for line, texts in rows:
        for index, text in enumerate(texts):
            if text in ("not set", "probing failed"):
                log.notes.append(f"{line.file}, line {line.number}: P{index}: {text}")
                continue
            if index not in places:
                reason = f"nobody says where P{index} is: name bed.g, too, with its G30 P{index}"
                raise line.error(f"{reason} X... Y...")
            log.probed(line, *places[index], *_numbers(line, text, f"height of P{index}", 1))


def _height_map(log: _Log, lines: Iterator[_Line], first: _Line) -> None:
    """Read a height map below its first line.

    Raises:
        FirmwareError: if a number or a line is missing.
    """
    head, line = next(lines, first), next(lines, first)
    names, values = ([cell.strip() for cell in each.text.split(",")] for each in (head, line))
    grid = dict(zip(names, values))
    if (grid.get("axis0", "X"), grid.get("axis1", "Y")) != ("X", "Y"):
        raise line.error("is no map over X and Y")

    def of(*all_names: str) -> float:
        known = [name for name in all_names if name in grid]
        if not known or len(names) != len(values):
            raise line.error(f"has no {all_names[0]}: names and numbers do not fit together")
        return _numbers(line, grid[known[0]], known[0], 1)[0]

    x, y = of("xmin", "min0"), of("ymin", "min1")
    x_step, y_step = of("xspacing", "spacing0", "spacing"), of("yspacing", "spacing1", "spacing")
    x_count, y_count = of("xnum", "num0"), of("ynum", "num1")
    row = -1
    for row, line in zip(range(int(y_count)), lines):
        texts = [text.strip() for text in line.text.split(",")]
        if len(texts) != x_count:
            raise line.error(f"has {len(texts)} heights, must have {x_count:g}")
        for column, text in enumerate(texts):
            # What was not probed is a bare 0.
            if text != "0":
                (height,) = _numbers(line, text, f"height {column + 1}", 1)
                log.probed(line, x + column * x_step, y + row * y_step, height)
    if row + 1 != y_count:
        raise first.error(f"the map has {row + 1} lines of heights, must have {y_count:g}")
