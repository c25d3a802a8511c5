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
from dataclasses import replace
from operator import sub
from pathlib import Path
from typing import NamedTuple

from tri_glide_kinematics.calibration import (
    Distance,
    MachineParameters,
    MeasurementFile,
    Plate,
    Priors,
    Touch,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares.parameters import lines_of, texts_of
from tri_glide_kinematics.firmwares.reading import (
    HEIGHT,
    RADIUS,
    Firmware,
    FirmwareError,
    FirmwareSettings,
)
from tri_glide_kinematics.firmwares.towers import MM, TOWER_ANGLES
from tri_glide_kinematics.keys import shortened
from tri_glide_kinematics.tables import table_text
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import three

# Standard deviations of what a log does not say [m]: a good probe, a calliper on a printed part.
TOUCH, DISTANCE = 2e-5, 5e-5

# Marlin prints numbers with two digits behind the point.
ROUNDED = 0.0101

# The circle of the middle of G33 from P3 on, as part of the large one: an error that grows with the
# square of the radius is so much, squared, of that on the large one.
MIDDLE = 0.1
ANGLES = {"x": 210.0, "y": 330.0, "z": 90.0, "yz": 30.0, "zx": 150.0, "xy": 270.0}
DRY = "run G33 P3 V0, which prints all heights and changes nothing, and keep this command above it"

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
OVER = re.compile("Iteration|Calibration OK|End DRY")
PLACE = re.compile(rf"^[^;]*\bG30\b[^;]*\bP(\d+)[^;]*?\bX{NUMBER}[^;]*?\bY{NUMBER}", re.IGNORECASE)
HEIGHTS = re.compile(r"bed probe heights:([^,]*)", re.IGNORECASE)
# Names of origin, spacing and number of places of a map, in its three versions.
GRID = "xmin,min0 ymin,min1 xspacing,spacing0,spacing yspacing,spacing1,spacing xnum,num0 ynum,num1"

# Where the lines of a calibrated machine are typed, and what comes behind.
TYPED = {
    Firmware.KLIPPER: ("printer.cfg", "FIRMWARE_RESTART"),
    Firmware.MARLIN: ("Configuration.h", "build and load the firmware; then M502 and M500"),
    Firmware.REPRAP: ("config.g, or the console", "M500"),
}


class _Line(NamedTuple):
    file: str | Path
    number: int
    content: str

    def error(self, reason: str) -> FirmwareError:
        return FirmwareError(self.file, f"line {self.number}", reason)


def check_no_log(file: str | Path) -> None:
    """Check that a file of measurements is none of what a firmware measured.

    Raises:
        FirmwareError: if it is, as settings are missing then.
        TableError: if it cannot be read.
    """
    if SIGNS.search(table_text(file)):
        reason = "is what a firmware measured: name its settings of that moment with --settings"
        raise FirmwareError(file, "", reason)


def firmware_lines(machine: MachineParameters, settings: FirmwareSettings) -> str:
    """Return what to type into a firmware for a machine that was calibrated with its settings."""
    firmware = settings.firmware
    made = texts_of(firmware, machine, settings.end_stops, settings.probe_offset)
    file, command = TYPED[firmware]
    lines = "\n".join(lines_of(firmware, made.texts, made.remarks))
    return f"lines for {file}, in place of the old ones:\n\n{lines}\n\nnext: {command}"


def load_log(
    files: Sequence[str | Path], settings: FirmwareSettings
) -> tuple[MeasurementFile, tuple[str, ...]]:
    """Read what a firmware measured.

    Args:
        files: of one log: for Klipper, ``printer.cfg`` or what SAVE_CONFIG appended to it; for
            Marlin, what it printed, with the commands; for RepRapFirmware, ``heightmap.csv``, or
            what G32 printed and ``bed.g``.
        settings: with which it was measured.

    Returns:
        Measurements about the machine of the settings, and what a person has to know of them.

    Raises:
        FirmwareError: if there is nothing in it, it is none of single touches, a place is not
            known, or a number has no meaning; it names file and line.
        TableError: if a file cannot be read.
    """
    log = _Log(settings)
    for file in files:
        texts = enumerate(table_text(file).split("\n"), 1)
        log.lines += [_Line(file, number, text) for number, text in texts]
    readers = {Firmware.KLIPPER: _klipper, Firmware.MARLIN: _marlin, Firmware.REPRAP: _reprap}
    readers[settings.firmware](log)
    if not log.touches and not log.distances:
        kind = settings.firmware.value
        reason = f"has nothing that {kind} measured, and the settings are of {kind}"
        raise FirmwareError(files[0], "", reason)
    assumed = f"touches within {MM * TOUCH:g} mm, distances within {MM * DISTANCE:g} mm"
    log.notes.append(f"assumed (standard deviations): {assumed}")
    measured = MeasurementFile(settings.machine, Priors(), tuple(log.touches))
    return replace(measured, distances=tuple(log.distances)), tuple(log.notes)


class _Log:
    """What is found in a log; places and heights are in mm."""

    def __init__(self, settings: FirmwareSettings) -> None:
        self.settings = settings
        self.machine = TriGlide(settings.machine.geometry)
        self.lines: list[_Line] = []
        self.touches: list[Touch] = []
        self.distances: list[Distance] = []
        self.notes: list[str] = []

    def number(self, *names: str, otherwise: float) -> float:
        """Return the number of the first of these settings that is there."""
        return (self.settings.numbers(*names) or [otherwise])[0]

    def touch(self, line: _Line, x: float, y: float, z: float, spread: float = 0.0) -> None:
        """Add a touch of the nozzle; ``spread`` adds to its standard deviation [mm]."""
        with _told(line):
            heights = self.machine.inverse((x / MM, y / MM, z / MM))
            self.touches.append(Touch(heights, Plate(), math.hypot(TOUCH, spread / MM)))

    def probed(self, line: _Line, x: float, y: float, z: float) -> None:
        """Add a touch of the probe at this place."""
        x_offset, y_offset = self.probe_offset()
        self.touch(line, x - x_offset, y - y_offset, z)

    def probe_offset(self) -> tuple[float, float]:
        """Return where the probe is from the nozzle."""
        if {"NOZZLE_AS_PROBE", "SENSORLESS_PROBING"} & self.settings.said.keys():
            return 0.0, 0.0
        both = [*self.settings.numbers("NOZZLE_TO_PROBE_OFFSET"), 0.0, 0.0]
        code = "G31" if self.settings.firmware is Firmware.REPRAP else "M851"
        x, y = (
            self.number(f"{code} {axis}", f"{axis}_PROBE_OFFSET_FROM_EXTRUDER", otherwise=at)
            for axis, at in zip("XY", both)
        )
        return x, y

    def end_at(self, line: _Line) -> None:
        """Note that what stands below was measured with other settings."""
        reason = "settings are changed here; what was measured later is left out"
        self.notes.append(str(line.error(reason)))


@contextmanager
def _told(line: _Line) -> Iterator[None]:
    """Make what a number cannot mean an error of its line."""
    try:
        yield
    except KinematicsError as error:
        raise line.error(str(error)) from error


def _numbers(line: _Line, text: str, name: str, count: int = 0) -> list[float]:
    """Return numbers between commas: so many of them, or any with 0.

    Raises:
        FirmwareError: if one is none, or there are not as many.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)) or count not in (0, len(numbers)):
        wanted = f"{count} numbers" if count > 1 else "a number"
        raise line.error(f"{name} is {shortened(text.strip())}, must be {wanted}")
    return numbers


def _klipper(log: _Log) -> None:
    found: dict[tuple[str, str], dict[str, tuple[_Line, str]]] = {}
    for line in log.lines:
        kept = KEPT.match(line.content)
        if kept is not None:
            # As Klipper does: what stands above wins.
            found.setdefault((kept[1], kept[2]), {}).setdefault(kept[3], (line, kept[4]))
    if found:
        log.notes.append("touch 1 and distance 1 are height0 and distance0, and so on")
    steps = [_step(log, f"stepper_{tower}") for tower in "abc"] if found else []
    for (kind, index), given in found.items():
        name, fields = kind + index, FIELDS[kind.removeprefix("manual_")]
        line = next(iter(given.values()))[0]
        if set(given) != set(fields):
            has, must = (" and ".join(name + each for each in some) for some in (given, fields))
            raise line.error(f"has {has}: there must be {must}")
        numbers = [_numbers(*given[each], name + each, 3 if each else 1) for each in fields]
        (value,), *places = numbers
        moves = [[step * count / MM for step, count in zip(steps, place)] for place in places]
        ends = [three(map(sub, log.settings.end_stops, move)) for move in moves]
        with _told(line):
            if kind == "distance":
                log.distances.append(Distance(ends[0], ends[1], value / MM, DISTANCE))
            else:
                plate = Plate(f"z = {value:g} mm", value / MM)
                log.touches.append(Touch(ends[0], plate, TOUCH))


def _step(log: _Log, stepper: str) -> float:
    """Return how far a tower moves in one step [mm]."""
    names = ("rotation_distance", "microsteps", "full_steps_per_rotation")
    turn, micro, full = (
        log.number(f"{stepper}.{name}", otherwise=usual)
        for name, usual in zip(names, (math.nan, math.nan, 200.0))
    )
    gears = log.settings.said.get(f"{stepper}.gear_ratio")
    for driven, driving in re.findall(rf"{NUMBER}\s*:\s*{NUMBER}", gears.text if gears else ""):
        full *= float(driven) / (float(driving) or math.nan)
    step = turn / (micro * full or math.nan)
    step = log.number(f"{stepper}.step_distance", otherwise=step)
    if not step > 0.0:
        reason = f"counts steps, and the settings of {stepper} tell none by its {names[0]}"
        raise log.lines[0].error(f"{reason} and {names[1]}")
    return step


def _marlin(log: _Log) -> None:
    command: str | None = None
    run: list[_Line] = []
    for line in log.lines:
        place, asked = G30.search(line.content), G33.search(line.content)
        if "G33 Auto Calibrate" in line.content:
            run = [line]
        elif run and OVER.search(line.content):
            _g33(log, run, command)
            run, command = [], None
            if "DRY" not in line.content:
                log.end_at(line)
                return
        elif run:
            run.append(line)
        elif place is not None:
            log.probed(line, *map(float, place.groups()))
        elif asked is not None:
            command = asked[1].upper()
    if run:
        _g33(log, run, command)


def _g33(log: _Log, run: list[_Line], command: str | None) -> None:
    """Add the touches of the first round of G33.

    Raises:
        FirmwareError: if the heights are none of single touches, it is not known where they were,
            or other settings were in force.
    """
    towers, (height,) = log.settings.towers, log.settings.numbers(*HEIGHT)
    known = {"Height": height, "Radius": log.settings.numbers(*RADIUS)[0]}
    for i, axis in enumerate("xyz"):
        known["E" + axis] = height - log.settings.probe_offset - towers.heights[i]
        known["T" + axis] = towers.angles[i] - TOWER_ANGLES[i]
    heights: dict[str, float] = {}
    radius: float | None = None
    for line in run:
        for name, text in IN_FORCE.findall(line.content):
            if abs(float(text) - known[name]) > ROUNDED:
                reason = f"{name} was {text}, and is {known[name]:g} in the settings"
                raise line.error(f"{reason}: name those of that moment, as M503 prints them")
        circle = CIRCLE.search(line.content)
        radius = float(circle[1]) if circle else radius
        heights |= {name: float(text) for name, text in RESULT.findall(line.content)}
    words = dict(re.findall(r"([A-Z])\s*(-?[\d.]*)", command or ""))
    points = words.get("P", f"{log.number('DELTA_CALIBRATION_DEFAULT_POINTS', otherwise=4.0):g}")
    if command is None:
        points = "4 or more, as the command is not there" if len(heights) == 7 else "2"
    if not heights:
        raise run[0].error(f"no heights are printed: {DRY}")
    if points not in ("1", "2", "3") or "O" in words:
        reason = f"with P{points}, heights are means of several places, or none"
        reason = "with O, the probe is beside the circle" if "O" in words else reason
        raise run[0].error(f"{reason}: no touches; {DRY}")
    if radius is None and set(heights) != {"c"}:
        radius = _circle(log, run[0]) - _numbers(run[0], words.get("R") or "0", "R", 1)[0]
    is_mean = points == "3"
    bowl = max(heights.values()) - min(heights.values())
    for name, height in heights.items():
        at, turn = (radius or 0.0) * (name != "c"), math.radians(ANGLES.get(name, 0.0))
        spread = MIDDLE**2 * bowl * (name == "c" and is_mean)
        log.touch(run[0], at * math.cos(turn), at * math.sin(turn), height, spread)


def _circle(log: _Log, line: _Line) -> float:
    """Return the radius of the places of G33 [mm]."""
    given = log.settings.numbers("DELTA_CALIBRATION_RADIUS")
    if given:
        return given[0]
    radius = log.settings.limits.radius
    if radius is None:
        reason = "G33 prints no radius, and the settings have no DELTA_PRINTABLE_RADIUS"
        raise line.error(f"{reason}: name Configuration.h with --settings, too")
    offset = log.probe_offset()
    edge = log.settings.numbers("MIN_PROBE_EDGE")
    if edge:
        # Of Marlin up to 2.0.
        return MM * radius - max(map(abs, (*edge, *offset)))
    return MM * radius - log.number("PROBING_MARGIN", otherwise=10.0) - math.hypot(*offset)


def _reprap(log: _Log) -> None:
    places: dict[str, tuple[float, float]] = {}
    rows: list[tuple[_Line, list[str]]] = []
    is_over = False
    lines = iter(log.lines)
    for line in lines:
        place, heights = PLACE.match(line.content), HEIGHTS.search(line.content)
        if "RepRapFirmware height map file" in line.content:
            _height_map(log, lines, line)
        elif place is not None:
            places[place[1]] = float(place[2]), float(place[3])
        elif heights is not None and not is_over:
            rows.append((line, re.findall(r"not set|probing failed|\S+", heights[1])))
        elif re.search(r"Calibrated \d+ factors", line.content):
            is_over = True
            if not rows:
                reason = "this calibration prints no heights: write S-1 at the last G30 of bed.g"
                raise line.error(f"{reason}, and run G32 with the settings of before")
            log.end_at(line)
    for line, texts in rows:
        for index, text in enumerate(texts):
            if text in ("not set", "probing failed"):
                log.notes.append(str(line.error(f"P{index}: {text}")))
            elif str(index) in places:
                x, y = places[str(index)]
                log.probed(line, x, y, _numbers(line, text, f"height of P{index}", 1)[0])
            else:
                reason = f"nobody says where P{index} is: name bed.g with --places"
                raise line.error(f"{reason}, with its G30 P{index} X... Y...")


def _height_map(log: _Log, lines: Iterator[_Line], first: _Line) -> None:
    """Read a height map below its first line.

    Raises:
        FirmwareError: if a number or a line is missing.
    """
    head, line = next(lines, first), next(lines, first)
    names, values = (re.split(r"\s*,\s*", each.content.strip()) for each in (head, line))
    grid = dict(zip(names, values))
    if (grid.get("axis0", "X"), grid.get("axis1", "Y")) != ("X", "Y"):
        raise line.error("is no map over X and Y")
    numbers = []
    for some in GRID.split():
        text = next((grid[each] for each in some.split(",") if each in grid), "missing")
        numbers += _numbers(line, text, some, 1)
    x, y, x_step, y_step, columns, rows = numbers
    row = -1
    for row, line in zip(range(int(rows)), lines):
        texts = line.content.split(",")
        if len(texts) != columns:
            raise line.error(f"has {len(texts)} heights, must have {columns:g}")
        for column, text in enumerate(map(str.strip, texts)):
            # What was not probed is a bare 0.
            if text != "0":
                height = _numbers(line, text, f"height {column + 1}", 1)[0]
                log.probed(line, x + column * x_step, y + row * y_step, height)
    if row + 1 != rows:
        raise first.error(f"the map has {row + 1} lines of heights, must have {rows:g}")
