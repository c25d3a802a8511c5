"""Settings of a firmware as a machine: its geometry, its end stops, and its limits.

Klipper: ``printer.cfg`` with its includes and what SAVE_CONFIG appends, where a value that stands
above wins (``configfile.py``). Marlin: ``Configuration.h`` with its conditions, and what M503
prints. RepRapFirmware: ``config.g`` with the files that it runs (M98, M501).

All three count from the bed: a reported height is the true one of the slider here, so the offsets
are zero. Which limit bounds the tool and which a tower is from their sources:

- Klipper (``toolhead.py``, ``kinematics/delta.py``): ``max_velocity`` and ``max_accel`` bound the
  tool, ``max_z_velocity`` and ``max_z_accel`` its part along z.
- Marlin (``planner.cpp``): DEFAULT_MAX_FEEDRATE (M203) and DEFAULT_MAX_ACCELERATION (M201) bound
  each tower, as the planner counts steps of towers; DEFAULT_ACCELERATION (M204) bounds the tool.
- RepRapFirmware (``LimitSpeedAndAcceleration``): M203, M201 and M204 bound the tool.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from configparser import Error, RawConfigParser
from dataclasses import dataclass
from enum import Enum
from glob import glob
from pathlib import Path

import numpy as np

from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares.towers import MM, TOWER_ANGLES, Towers
from tri_glide_kinematics.keys import FileError, load_text, shortened
from tri_glide_kinematics.vectors import Vector3, three

MOST_BYTES = 4_000_000  # larger files are none of settings
DEEPEST = 8  # of files that include others, and of names that stand for others
LONGEST = 300  # expression
LARGEST = 1e7  # of all numbers, in the units of the firmware
MINUTE = 60.0  # s
NONE = (0.0, 0.0, 0.0)

SAVED = re.compile(r"^#\*# <-+ SAVE_CONFIG -+>", re.M)
INCLUDE = re.compile(r"^\[include\b(.*)\][^\n\]]*$", re.M)
# A remark of C, a line that goes on, a directive, a question of a condition.
REMARK = re.compile(r"//[^\n]*|/\*.*?(?:\*/|\Z)", re.S)
DIRECTIVE = re.compile(r"\s*#\s*(if|ifdef|ifndef|elif|else|endif|define|undef)\b\s*(\w*)(.*)", re.S)
ASKED = re.compile(r"\b(ENABLED|DISABLED|EITHER|ANY|BOTH|ALL|NONE|defined)\s*\(([\w\s,]*)\)")
# A command, also as a host has logged it, and its words.
COMMAND = re.compile(r"(?:.*\b(?:Recv|Send): ?)?(?:.*echo:)?(\s*)([GM])0*(\d+)(?![\d.])(.*)", re.I)
COMMANDS = "M665 M666 M201 M203 M204 M208 M669 M851 M98 M501 G20 G31".split()
WORD = re.compile(r'\s*([A-Z])\s*("[^"]*"|(?:\{[^}]*\}|[-+.:\d])*)')

ON = ("", "1", "true")
NO_NUMBER = (ValueError, KeyError, ArithmeticError, SyntaxError, MemoryError, RecursionError)
OPERATORS: Mapping[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.And: lambda *values: all(values),
    ast.Or: lambda *values: any(values),
}

# With a probe, Marlin counts the height after homing from where the probe touches.
PROBES = frozenset(
    "FIX_MOUNTED_PROBE NOZZLE_AS_PROBE BLTOUCH Z_PROBE_SERVO_NR Z_PROBE_ALLEN_KEY Z_PROBE_SLED "
    "SOLENOID_PROBE SENSORLESS_PROBING TOUCH_MI_PROBE RACK_AND_PINION_PROBE MAGLEV4 BD_SENSOR "
    "MAG_MOUNTED_PROBE BIQU_MICROPROBE_V1 BIQU_MICROPROBE_V2 DUET_SMART_EFFECTOR".split()
)
# Values of Marlin, as M503 prints them and in its headers.
HEIGHT = ("M665 H", "DELTA_HEIGHT", "MANUAL_Z_HOME_POS")
RADIUS = ("M665 R", "DELTA_RADIUS")
SHEAR = "must be 0: a bed that is tilted shears z, which vertical sliders do not do; level it"
SIGNS = {
    "klipper": r"^\[(printer|stepper_[abc]|include .*)\]",
    "marlin": r"^\s*#\s*define\s|\becho:|^\s*M851\b|^\s*M665\b[^;\n]*[SAC]-?\d",
    "reprap": r"^M(569|584|574|669|671)\b|^M665\b[^;\n]*:|^M666\b[^;\n]*[AB]-?\d",
}


class Firmware(Enum):
    """A firmware of printers."""

    KLIPPER = "klipper"
    MARLIN = "marlin"
    REPRAP = "reprap"


class FirmwareError(FileError):
    """A file of a firmware cannot be read, or something in it has no meaning here."""


@dataclass(frozen=True)
class Said:
    """A value as it is written.

    Attributes:
        text: of the value.
        file: in which it stands.
        line: from 1; 0 in Klipper, where section and option are the place.
    """

    text: str
    file: str
    line: int = 0


@dataclass(frozen=True)
class FirmwareLimits:
    """What a firmware keeps the machine in; None for what it does not say.

    Attributes:
        tool_speed: [m/s].
        tool_acceleration: [m/s^2].
        tower_speeds: of towers A, B and C. Shape (3,) [m/s].
        tower_accelerations: Shape (3,) [m/s^2].
        radius: of the cylinder about the axis that the tool stays in [m].
        lowest: height of the tool [m].
    """

    tool_speed: float | None = None
    tool_acceleration: float | None = None
    tower_speeds: Vector3 | None = None
    tower_accelerations: Vector3 | None = None
    radius: float | None = None
    lowest: float | None = None


@dataclass(frozen=True, eq=False)
class FirmwareSettings:
    """The settings of one machine in the files of a firmware.

    Attributes:
        firmware: whose they are.
        towers: its geometry, as it holds it [mm], [degrees].
        machine: the same machine; its arms are towers A, B and C. A reported height is that of the
            slider above the bed, as the firmware itself counts, so all offsets are zero.
        end_stops: heights of the sliders at their end stops. Shape (3,) [m].
        limits: of its motion.
        notes: what a person has to know: what was taken or left out, and why.
        said: all values that were found, by name: ``stepper_a.rotation_distance`` of Klipper,
            ``DELTA_RADIUS`` of Marlin, ``M665 L`` of RepRapFirmware and of what Marlin prints.
        used: names of those that the settings are made of.
        probe_offset: of the nozzle to the probe along z, which Marlin takes from its height after
            homing [mm].
    """

    firmware: Firmware
    towers: Towers
    machine: MachineParameters
    end_stops: Vector3
    limits: FirmwareLimits
    notes: tuple[str, ...]
    said: Mapping[str, Said]
    used: tuple[str, ...]
    probe_offset: float = 0.0

    def numbers(self, *names: str) -> list[float]:
        """Return the numbers of the first of these values in ``said``; none if none is there.

        Raises:
            FirmwareError: if it has no numbers.
        """
        return _Sayings(self.firmware, Path(), dict(self.said)).numbers(*names)


def load_firmware_settings(
    path: str | Path, *later: str | Path, firmware: Firmware | None = None
) -> FirmwareSettings:
    """Return the settings that stand in files of a firmware.

    Args:
        path: ``printer.cfg`` of Klipper; ``Configuration.h`` of Marlin, or what it prints after
            M503; ``config.g`` or ``config-override.g`` of RepRapFirmware.
        later: more files of the same firmware; of two, the later one wins.
        firmware: whose they are; None to see that from the files.

    Raises:
        FirmwareError: if a file cannot be read, a value in it has no meaning or is missing, the
            machine is no linear delta, or a setting cannot be held by a machine of vertical
            sliders; it names file, line and value.
    """
    files = [(Path(each), text_of(Path(each))) for each in (path, *later)]
    return settings_of(firmware or _guessed(*files[0]), files)


def settings_of(firmware: Firmware, files: Sequence[tuple[Path, str]]) -> FirmwareSettings:
    """Return the settings of files with these texts; raises as ``load_firmware_settings``."""
    said = _Sayings(firmware, files[0][0], {})
    for file, text in files:
        if firmware is Firmware.KLIPPER:
            _scan_klipper(file, text, said)
            continue
        if firmware is Firmware.MARLIN:
            text = REMARK.sub(lambda each: "\n" * each[0].count("\n"), text)
            _scan_header(file, text, said)
        _scan_commands(file, text, said, [])
    readers = {Firmware.KLIPPER: _klipper, Firmware.MARLIN: _marlin, Firmware.REPRAP: _reprap}
    towers, limits = readers[firmware](said)
    try:
        geometry, end_stops = towers.machine()
    except KinematicsError as error:
        raise FirmwareError(files[0][0], "", f"is of no working machine: {error}") from error
    found = towers, MachineParameters(geometry), end_stops, limits
    return FirmwareSettings(
        firmware, *found, tuple(said.notes), said.said, tuple(said.used), said.probe_offset
    )


def text_of(file: Path) -> str:
    """Return the text of a file.

    Raises:
        FirmwareError: if it cannot be read, is no text, or too large for settings.
    """
    return load_text(file, FirmwareError, MOST_BYTES)


def _guessed(file: Path, text: str) -> Firmware:
    """Return whose settings a file holds, by words that only one of them has."""
    found = [name for name, sign in SIGNS.items() if re.search(sign, text, re.M)]
    found = ["reprap"] if file.suffix == ".g" else found
    if not found:
        reason = "no [printer], #define, M503 or M665: name it with --from (parameters: with --to)"
        raise FirmwareError(file, "", f"whose settings? {reason}")
    return Firmware(found[0])


class _Sayings:
    """All values of some files, by name; what is missing or no number is told with its place."""

    def __init__(self, firmware: Firmware, file: Path, said: dict[str, Said]) -> None:
        self.firmware = firmware
        self.file = file
        self.said = said
        self.used: dict[str, None] = {}
        self.notes: list[str] = []
        self.probe_offset = 0.0

    def error(self, name: str, reason: str) -> FirmwareError:
        where = self.said.get(name, Said("", str(self.file)))
        place = f"line {where.line}" if where.line else ""
        return FirmwareError(where.file, place, f"{name} {reason}")

    def use(self, *names: str) -> str:
        """Return the first of these names that is there; empty if none is."""
        name = next((each for each in names if each in self.said), "")
        self.used |= {name: None} if name else {}
        return name

    def numbers(self, *names: str, above: float = -LARGEST, unit: float = 1.0) -> list[float]:
        """Return the numbers of the first value that is there, in units; none without a value."""
        name = self.use(*names)
        text = self.said[name].text if name else ""
        is_marlin = self.firmware is Firmware.MARLIN
        is_computed = is_marlin or (self.firmware is Firmware.REPRAP and "{" in text)
        parts = [each.strip("{} ") for each in re.split("[,:]", text) if name]
        try:
            numbers = [self.value(each) if is_computed else float(each) for each in parts]
        except NO_NUMBER:
            numbers = [math.nan]
        if not all(above < number < LARGEST for number in numbers):
            bound = f"greater than {above:g}, at most {LARGEST:g}"
            raise self.error(name, f"is {shortened(text)}, must be a number {bound}")
        return [number / unit for number in numbers]

    def one(self, *names: str, above: float = -LARGEST, unit: float = 1.0) -> float | None:
        numbers = self.numbers(*names, above=above, unit=unit)
        if len(numbers) > 1:
            raise self.error(self.use(*names), f"has {len(numbers)} numbers, must have one")
        return numbers[0] if numbers else None

    def needed(self, *names: str, above: float = 0.0) -> float:
        number = self.one(*names, above=above)
        if number is None:
            raise self.error(" or ".join(names), "is missing")
        return number

    def each(
        self, name: str, letters: Sequence[str], otherwise: Sequence[float], most: int = 4
    ) -> Vector3:
        """Return the numbers of three towers: under one name, or each under its own.

        Old versions of Marlin have three names, with ``_1`` to ``_3``.
        """
        values = self.numbers(name)[:most] or otherwise
        if len(values) != 3:
            raise self.error(name, f"has {len(values)} numbers, must have three")
        found = [self.one(each, f"{name}_{i}") for i, each in enumerate(letters, 1)]
        return three([value if each is None else each for each, value in zip(found, values)])

    def speeds(self, name: str, command: str) -> Vector3 | None:
        """Return limits of three towers in SI; None if one of them is missing."""
        values = self.each(name, _letters(command), [math.nan] * 3, most=3)
        if min(values) <= 0.0:
            raise self.error(self.use(name, f"{command} X"), "must be greater than 0")
        return None if math.isnan(sum(values)) else three([value / MM for value in values])

    def least(self, meaning: str, *names: str, unit: float = MM) -> float | None:
        """Return the least of several limits of the tool, and note that if they differ."""
        found = {name: self.one(name, above=0.0, unit=unit) for name in names}
        limits = {limit: name for name, limit in found.items() if limit is not None}
        least = min(limits, default=None)
        if len(limits) > 1:
            text = f"the least of {', '.join(limits.values())} bounds the {meaning} of the tool"
            self.notes.append(f"{text} in each direction here: {limits[min(limits)]}")
        return least

    def level(self, *names: str) -> None:
        for name in names:
            if self.one(name):
                raise self.error(name, f"= {self.said[name].text} {SHEAR}")

    def value(self, text: str) -> float:
        """Return the value of an expression: arithmetic in parentheses, and names of values.

        Raises:
            one of ``NO_NUMBER``: if it is none.
        """
        for _ in range(DEEPEST):
            text = re.sub(r"(?<=[\d.])[fFlLuU]+\b", "", text[:LONGEST])
            text = re.sub(r"(?<![\w.])(?!and\b|or\b|not\b)[A-Za-z_]\w*", self._inner, text)
        return float(self._computed(ast.parse(text.strip(), mode="eval").body))

    def _computed(self, part: ast.AST) -> float:
        match part:
            case ast.Constant(value=int() | float() as number):
                return number
            case ast.UnaryOp(op=sign, operand=inner):
                return OPERATORS[type(sign)](self._computed(inner))
            case ast.BoolOp(op=sign, values=values):
                return OPERATORS[type(sign)](*map(self._computed, values))
            case ast.BinOp(left=left, op=sign, right=right):
                one, other = self._computed(left), self._computed(right)
                found = OPERATORS[type(sign)](one, other)
                # In C, whole numbers are divided without a rest.
                is_whole = isinstance(one, int) and isinstance(other, int)
                return int(found) if is_whole and self.firmware is Firmware.MARLIN else found
        raise ValueError

    def _inner(self, name: re.Match[str]) -> str:
        self.use(name[0])
        # As C does: the text, so that of A + B times two only B is doubled.
        return f" {self.said[name[0]].text} "


def _scan_klipper(file: Path, text: str, sayings: _Sayings) -> None:
    head, *block = SAVED.split(text, maxsplit=1)
    first = head.count("\n") + 1
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip() and number != first and line.startswith("#*# ") > (number > first):
            raise FirmwareError(file, f"line {number}", "begins with #*#, above any SAVE_CONFIG")
        if line.strip() and not line.startswith("#*#") and number > first:
            reason = "below SAVE_CONFIG a line must begin with #*#: else Klipper reads none of them"
            raise FirmwareError(file, f"line {number}", reason)
    _scan_options(file, head, sayings.said, [])
    saved: dict[str, Said] = {}
    # The remarks at the head of what is saved end where its first section begins.
    plain = re.sub("^.{0,4}", "", "".join(block), flags=re.M)
    _scan_options(file, plain[(plain + "[").index("[") :], saved, [])
    for name, where in saved.items():
        kept = sayings.said.setdefault(name, where)
        if kept.text != where.text:
            text = f"{kept.text} of {kept.file} wins over {where.text}, which SAVE_CONFIG keeps"
            sayings.notes.append(f"{name}: {text}")


def _scan_options(file: Path, text: str, said: dict[str, Said], trail: list[Path]) -> None:
    """Read values of Klipper, as it does itself, and those of the files that are included."""
    above = 0
    for index, part in enumerate(INCLUDE.split(re.sub("#.*", "", text))):
        if index % 2:
            for other in _included(file, part.strip(), trail):
                _scan_options(other, text_of(other), said, [*trail, other.resolve()])
            continue
        parser = RawConfigParser(strict=False, inline_comment_prefixes=(";",), default_section="")
        try:
            # Errors tell the number of the line.
            parser.read_string("\n" * above + part, file.name)
        except Error as error:
            raise FirmwareError(file, "", shortened(" ".join(str(error).split()))) from error
        above += part.count("\n")
        for section in parser.sections():
            for option, value in parser.items(section):
                said[f"{section}.{option}"] = Said(" ".join(value.split()), str(file))


def _included(file: Path, wanted: str, trail: list[Path]) -> list[Path]:
    """Return the files that Klipper includes, by a name or a pattern."""
    found = [file.parent / each for each in sorted(glob(wanted, root_dir=file.parent))]
    if not found and not re.search(r"[*?\[]", wanted):
        raise FirmwareError(file, f"[include {wanted}]", "there is no such file")
    if len(trail) > DEEPEST or any(each.resolve() in (*trail, file.resolve()) for each in found):
        raise FirmwareError(file, f"[include {wanted}]", "leads in a circle")
    return found


def _scan_header(file: Path, text: str, sayings: _Sayings) -> None:
    """Read the definitions of a header of Marlin that its conditions leave in."""
    said = sayings.said
    # Of each #if: whether its branch holds, whether one of its branches did (None: not known), and
    # its line.
    branches: list[tuple[bool | None, bool | None, int]] = []
    lines = enumerate(text.split("\n"), 1)
    for number, line in lines:
        while line.endswith("\\"):
            line = line[:-1] + next(lines, (0, ""))[1]
        directive = DIRECTIVE.match(line)
        if directive is None:
            continue
        word, name, rest = directive.groups()
        doubt = next((f" (if line {each[2]} holds)" for each in branches if each[0] is None), "")
        if word in ("if", "ifdef", "ifndef"):
            asked = {"if": "{}", "ifdef": "defined({})", "ifndef": "!defined({})"}[word]
            holds = _holds(asked.format(name + rest), sayings)
            branches.append((holds, holds, number))
        elif word in ("elif", "else", "endif"):
            if not branches:
                raise FirmwareError(file, f"line {number}", f"#{word} has no #if")
            _, past, first = branches.pop()
            holds = word == "else" or _holds(name + rest, sayings)
            if word != "endif":
                now = False if past else None if past is None and holds else holds
                branches.append((now, holds if holds or past is False else past, first))
        elif all(holds is not False for holds, _, _ in branches):
            said.pop(name, None)
            if word == "define":
                said[name] = Said(" ".join(rest.split()) + doubt, str(file), number)
    if branches:
        raise FirmwareError(file, f"line {branches[-1][2]}", "#if has no #endif: is it cut off?")


def _holds(text: str, sayings: _Sayings) -> bool | None:
    """Return whether a condition of C holds; None if it is not understood."""

    def answer(asked: re.Match[str]) -> str:
        found = [sayings.said.get(name.strip()) for name in asked[2].split(",")]
        any_text = asked[1] == "defined"
        on = [each is not None and (any_text or each.text in ON) for each in found]
        is_on = all(on) if asked[1] in ("BOTH", "ALL") else any(on)
        return f" {int(is_on != (asked[1] in ('DISABLED', 'NONE')))} "

    plain = ASKED.sub(answer, text).replace("&&", " and ").replace("||", " or ")
    try:
        return bool(sayings.value(plain.replace("!", " not ")))
    except NO_NUMBER:
        return None


def _scan_commands(file: Path, text: str, sayings: _Sayings, trail: list[Path]) -> None:
    """Read commands of RepRapFirmware, or as Marlin prints them, one a line."""
    is_reprap = sayings.firmware is Firmware.REPRAP
    has_conditions = is_reprap and re.search(r"^\s*(if|while)\b", text, re.M)
    for number, line in enumerate(text.split("\n"), 1):
        found = COMMAND.match(re.sub(r'("[^"]*")|;.*', r"\1", line))
        command = f"{found[2].upper()}{found[3]}" if found else ""
        if found is None or command not in COMMANDS:
            continue
        rest = re.sub(r'("[^"]*")|[a-z]+', lambda each: each[1] or each[0].upper(), found[4])
        words = dict(WORD.findall(rest))
        wanted = re.search(r'P\s*"?([^"\s]*)', found[4], re.I)
        name = wanted[1] if wanted else "config-override.g"
        other = file.parent / name.rpartition("/")[2]
        runs = is_reprap and command in ("M98", "M501")
        reasons = (
            (command == "G20", "G20 (inches) is not read: only millimetres are"),
            (has_conditions and found[1], f"{command} depends on a condition, which is not read"),
            (
                WORD.sub("", rest).strip() and not runs,
                f"{shortened(line.strip())} is not understood",
            ),
            (runs and other.resolve() in (*trail, file.resolve()), f"{command} leads in a circle"),
        )
        for is_wrong, reason in reasons:
            # Only logs need the place of the probe.
            if is_wrong and command != "G31":
                raise FirmwareError(file, f"line {number}", reason)
        if runs and other.is_file():
            _scan_commands(other, text_of(other), sayings, [*trail, file.resolve()])
        elif runs:
            sayings.notes.append(f"{file}, line {number}: there is no {other} to run: left out")
        else:
            end = " S1" if command == "M208" and words.pop("S", "") == "1" else ""
            for letter, value in words.items():
                sayings.said[f"{command} {letter}{end}"] = Said(value, str(file), number)


def _klipper(said: _Sayings) -> tuple[Towers, FirmwareLimits]:
    kind = said.use("printer.kinematics")
    kinematics = said.said[kind].text if kind else "delta"
    if kinematics != "delta":
        raise said.error(kind, f"is {shortened(kinematics)}, must be delta")
    said.level("bed_tilt.x_adjust", "bed_tilt.y_adjust")
    radius = said.needed("printer.delta_radius")
    of_all = [f"stepper_{tower}" for tower in "abc"]
    arms = [said.needed(f"{s}.arm_length", "stepper_a.arm_length", above=radius) for s in of_all]
    ends = [said.needed(f"{s}.position_endstop", "stepper_a.position_endstop") for s in of_all]
    angles = said.each("", [f"{stepper}.angle" for stepper in of_all], TOWER_ANGLES)
    limits = FirmwareLimits(
        said.least("speed", "printer.max_velocity", "printer.max_z_velocity"),
        said.least("acceleration", "printer.max_accel", "printer.max_z_accel"),
        radius=said.one("printer.print_radius", above=0.0, unit=MM),
        lowest=said.one("printer.minimum_z_position", unit=MM),
    )
    return Towers((radius,) * 3, angles, three(arms), three(ends)), limits


def _marlin(said: _Sayings) -> tuple[Towers, FirmwareLimits]:
    known = said.said.keys()
    if not said.use("DELTA", "DELTA_RADIUS", "M665 R"):
        raise FirmwareError(said.file, "", "has no #define DELTA and no M665: it is of no delta")
    if "M665 B" in known and not {"M665 A", "M665 C"} & known:
        said.notes.append("M665 B without A and C is the radius of a calibration: left out")
        del said.said["M665 B"]
    if "M665 R" in known and "DELTA" not in known:
        text = "DELTA_RADIUS_TRIM_TOWER, which Marlin does not print, is taken as 0"
        said.notes.append(f"{text}: name Configuration.h before this file to have it")
    offset = said.one("M851 Z")
    if offset is None and said.use(*PROBES):
        offset = (said.numbers("NOZZLE_TO_PROBE_OFFSET") or [0.0])[-1]
    said.probe_offset = offset or 0.0
    if offset:
        said.notes.append(f"after homing, z is DELTA_HEIGHT less {offset:g} mm, that of the probe")
    height = said.needed(*HEIGHT) - said.probe_offset
    ends = said.each("DELTA_ENDSTOP_ADJ", _letters("M666"), NONE)
    radius, rod = said.needed(*RADIUS), said.needed("M665 L", "DELTA_DIAGONAL_ROD")
    radii = said.each("DELTA_RADIUS_TRIM_TOWER", [""] * 3, NONE)
    rods = said.each("DELTA_DIAGONAL_ROD_TRIM_TOWER", _letters("M665", "ABC"), NONE)
    turns = said.each("DELTA_TOWER_ANGLE_TRIM", _letters("M665"), NONE)
    towers = Towers(
        three(np.add(radius, radii)),
        three(np.add(TOWER_ANGLES, turns)),
        three(np.add(rod, rods)),
        three(np.subtract(height, ends)),
    )
    defined = ("DEFAULT_ACCELERATION", "DEFAULT_TRAVEL_ACCELERATION")
    limits = FirmwareLimits(
        None,
        said.least("acceleration", *(_letters("M204", "PT") if "M204 P" in known else defined)),
        said.speeds("DEFAULT_MAX_FEEDRATE", "M203"),
        said.speeds("DEFAULT_MAX_ACCELERATION", "M201"),
        said.one("PRINTABLE_RADIUS", "DELTA_PRINTABLE_RADIUS", above=0.0, unit=MM),
    )
    return towers, limits


def _reprap(said: _Sayings) -> tuple[Towers, FirmwareLimits]:
    if said.one("M669 K") not in (None, 3.0):
        raise said.error("M669 K", "must be 3: a linear delta")
    said.level("M666 A", "M666 B")
    radius = said.needed("M665 R")
    rods = said.numbers("M665 L", above=radius)
    if len(rods) not in (1, 3):
        raise said.error("M665 L", "is missing, or has neither one number nor three")
    turns, ends = (said.each("", _letters(code), NONE) for code in ("M665", "M666"))
    rods = rods * (3 // len(rods))
    heights = three(np.add(said.needed("M665 H"), ends))
    towers = Towers((radius,) * 3, three(np.add(TOWER_ANGLES, turns)), three(rods), heights)
    span = said.numbers("M208 Z", unit=MM)
    lowest = said.one("M208 Z S1", unit=MM)
    limits = FirmwareLimits(
        said.least("speed", *_letters("M203"), unit=MM * MINUTE),
        said.least("acceleration", *_letters("M201"), *_letters("M204", "PT")),
        radius=said.one("M665 B", above=0.0, unit=MM),
        lowest=span[0] if lowest is None and len(span) == 2 else lowest,
    )
    return towers, limits


def _letters(command: str, letters: str = "XYZ") -> list[str]:
    return [f"{command} {letter}" for letter in letters]
