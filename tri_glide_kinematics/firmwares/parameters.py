"""Settings of a firmware as a parameter file for all nodes, and back to the lines of a firmware.

The file keeps what was read, in lines that begin with ``#: ``. So the way back gives the very same
texts where its parameters are still those that came of them, and new ones where they are not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any, NamedTuple

import numpy as np

from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import parameter_file
from tri_glide_kinematics.firmwares.reading import (
    MINUTE,
    Firmware,
    FirmwareError,
    FirmwareSettings,
    settings_of,
    text_of,
)
from tri_glide_kinematics.firmwares.towers import MM, TOWER_ANGLES, plain_text, towers_of
from tri_glide_kinematics.keys import in_a_line
from tri_glide_kinematics.settings import IK_NODE, Values, file_values, machine_of, workspace_of
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.wording import vector_text

FIRST_LINE = "# Parameters of a machine, from settings of a firmware by tri_glide_kinematics."
READ = "# This comes back where its parameters do not change; it was read from "
KEPT = "#: "
DEFAULTS = {entry.name: entry.default for entry in IK_NODE}
JERK_TIME = 0.05  # in which an acceleration builds up, as that of the default machine [s]
NOTHING = "nothing is said: the default"
TOOL = "of the tool there: here of each slider"

# Of geometry, speed, acceleration and reach: the parameters, and how the names of the values that
# they are made of begin.
GROUPS = (
    (
        ("geometry", "anchors", "arm_lengths", "height_offsets", "upper_heights"),
        r"stepper_|printer\.delta_radius|DELTA_(?!PRINT)|MANUAL_Z|M665|M666 [XYZ]",
    ),
    (
        ("velocity_limits", "platform_speed_limit"),
        r"printer\.max_(z_)?velocity|DEFAULT_MAX_FEEDRATE|M203",
    ),
    (("acceleration_limits",), r"printer\.max_(z_)?accel|DEFAULT_.*ACCELERATION|M20[14]"),
    (("cylinder_radius", "cylinder_z"), r"printer\.(print_radius|min)|.*PRINTABLE|reach|M208"),
)
# Where new values of speed, acceleration and reach stand.
ALL_AXES = (("M203 X", "M203 Y", "M203 Z"), ("M201 X", "M201 Y", "M201 Z"))
PLACES = {
    Firmware.KLIPPER: (
        ("printer.max_velocity",),
        ("printer.max_accel",),
        ("printer.print_radius", "printer.minimum_z_position"),
    ),
    Firmware.MARLIN: (*ALL_AXES, ("PRINTABLE_RADIUS",)),
    Firmware.REPRAP: (*ALL_AXES, ("M665 B", "M208 Z S1")),
}
REMARKS = {Firmware.KLIPPER: "# ", Firmware.MARLIN: "// ", Firmware.REPRAP: "; "}


def parameters_of(settings: FirmwareSettings) -> dict[str, tuple[Any, str]]:
    """Return the parameters of ``ik_node`` that settings stand for, each with where it comes from.

    Raises:
        FirmwareError: if a value is out of its bounds, or the platform could be nowhere.
    """
    machine, limits, ends = settings.machine, settings.limits, settings.end_stops
    arms, anchors = machine.geometry.arm_lengths, np.array(machine.geometry.anchors)
    distances = np.linalg.norm(anchors, axis=1).tolist()
    top = _top(settings)
    lowest, radius = limits.lowest or 0.0, limits.radius or min(distances)
    margin = DEFAULTS["reach_margin"]
    # Where the platform is farthest from a tower and lowest, to a tenth of a millimetre below.
    reach = [min(d + radius, a - margin) for d, a in zip(distances, arms)]
    lower = [
        math.floor(1e4 * (lowest + math.sqrt(a * a - r * r))) / 1e4 for a, r in zip(arms, reach)
    ]
    speeds = limits.tower_speeds or (limits.tool_speed or DEFAULTS["velocity_limits"][0],) * 3
    towers, tool = limits.tower_accelerations, limits.tool_acceleration
    quickest = [min(each, tool or math.inf) for each in towers or [math.inf] * 3]
    if math.inf in quickest:
        quickest = DEFAULTS["acceleration_limits"]
    of_speed = "of the towers" if limits.tower_speeds else TOOL if limits.tool_speed else NOTHING
    of_acceleration = "of the towers, at most that of the tool" if towers else TOOL
    rows = (
        ("geometry", "calibrated", ""),
        ("anchors", anchors.ravel(), "towers A, B, C"),
        ("arm_lengths", arms, ""),
        ("height_offsets", machine.height_offsets, "heights are those above the bed"),
        ("upper_heights", ends, "end stops"),
        ("lower_heights", lower, "nothing is said: as low as the cylinder needs"),
        ("velocity_limits", speeds, of_speed),
        ("platform_speed_limit", limits.tool_speed or 0.0, "of the tool; 0 where nothing is said"),
        ("acceleration_limits", quickest, of_acceleration if towers or tool else NOTHING),
        (
            "jerk_limits",
            [each / JERK_TIME for each in quickest],
            f"nothing is said: reached in {JERK_TIME} s",
        ),
        ("reach_margin", margin, NOTHING),
        ("max_condition_number", DEFAULTS["max_condition_number"], NOTHING),
        ("space", "cylinder", ""),
        ("cylinder_radius", radius, "" if limits.radius else "nothing is said: to an anchor"),
        ("cylinder_z", (lowest, top), "from the bed" if limits.lowest is None else ""),
        ("initial_heights", (*(e - 0.5 * (top - lowest) for e in ends),), "of a simulated machine"),
    )
    found = {
        name: (value if isinstance(value, str | float) else tuple(map(float, value)), text)
        for name, value, text in rows
    }
    values = DEFAULTS | {name: value for name, (value, _) in found.items()}
    try:
        checked = {entry.name: entry.checked(values[entry.name]) for entry in IK_NODE}
        workspace_of(checked).check_position((0.0, 0.0, 0.5 * (lowest + top)))
    except KinematicsError as error:
        file = next(iter(settings.said.values())).file
        raise FirmwareError(file, "", f"no machine of this suite: {error}") from error
    return found


def _top(settings: FirmwareSettings) -> float:
    """Return the height of the tool in the middle with the first slider at its end stop [m]."""
    resting = TriGlide(settings.machine.geometry).inverse((0.0, 0.0, 0.0))
    return min(end - height for end, height in zip(settings.end_stops, resting))


def parameter_text(settings: FirmwareSettings) -> str:
    """Return a parameter file for all nodes; raises as ``parameters_of``."""
    rows = []
    for name, (value, text) in parameters_of(settings).items():
        rows.append((name, in_a_line(list(value) if isinstance(value, tuple) else value), text))
    remarks = (*settings.notes, "In braces, so that a file that is cut off is refused; in metres.")
    kept = lines_of(settings.firmware, {name: settings.said[name].text for name in settings.used})
    head = [FIRST_LINE, *(f"# {remark}" for remark in remarks), READ + settings.firmware.value]
    head += [KEPT + line for line in kept]
    return "\n".join((*head, parameter_file((), "/**", rows)))


def program_settings_text(settings: FirmwareSettings) -> str:
    """Return settings of programs: their zero is on the bed, as it is for the firmware.

    Home is at least 1 mm below the highest place in the middle.
    """
    return (
        f"unit: mm\ndialect: {settings.firmware.value}\n"
        f"home: [0, 0, {math.floor(MM * _top(settings)) - 1}]\noffsets: {{G54: [0, 0, 0]}}\n"
    )


def load_parameters(path: Path, *later: Path) -> tuple[Values, FirmwareSettings | None]:
    """Return the parameters in files, and the settings that the first file was made of, if any.

    Raises:
        KinematicsError: if a file cannot be read, or something in it has no meaning.
    """
    values = file_values(str(path), "/ik_node", IK_NODE, *map(str, later))
    text = text_of(path)
    firmware = re.search(rf"^{READ}(klipper|marlin|reprap)$", text, re.M)
    if firmware is None:
        return values, None
    # Each line keeps its number.
    lines = [line[len(KEPT) :] if line.startswith(KEPT) else "" for line in text.split("\n")]
    return values, settings_of(Firmware(firmware[1]), [(path, "\n".join(lines))])


def firmware_text(values: Values, origin: FirmwareSettings | None, firmware: Firmware) -> str:
    """Return the lines of a firmware for the parameters of a machine.

    Args:
        values: of ``ik_node``. The end stops are where the sliders are at ``upper_heights``.
        origin: settings that the parameters were made of; their texts stay where these are the
            same. None without any.
        firmware: whose lines.

    Raises:
        KinematicsError: if no firmware has such a machine.
    """
    texts, before, remarks = dict[str, str](), dict[str, tuple[Any, str]](), list[str]()
    order: Sequence[int] = (0, 1, 2)
    changed = [True] * 4
    if origin is not None and origin.firmware is firmware:
        before = parameters_of(origin)
        changed = [any(before[each][0] != values[each] for each in group) for group, _ in GROUPS]
        patterns = [pattern for (_, pattern), is_new in zip(GROUPS, changed) if is_new]
        # In Marlin, that is the length of a rod.
        reach_name = "M665 B" if firmware is Firmware.REPRAP else ""
        for name in origin.used:
            meant = "reach" if name == reach_name else name
            if not any(re.match(pattern, meant) for pattern in patterns):
                texts[name] = origin.said[name].text
    if changed[0]:
        machine = MachineParameters(machine_of(values).geometry, values["height_offsets"])
        offset = origin.probe_offset if origin and before else 0.0
        made = texts_of(firmware, machine, values["upper_heights"], offset)
        remarks = ["The end stops are where the sliders are at upper_heights."]
        if firmware is Firmware.MARLIN and not offset:
            remarks.append("With a probe, add its offset along z to DELTA_HEIGHT and M665 H.")
        texts, order, remarks = texts | made.texts, made.order, remarks + made.remarks
    speeds = [values["velocity_limits"][i] for i in order]
    accelerations = [values["acceleration_limits"][i] for i in order]
    if firmware is not Firmware.MARLIN:
        speeds = [values["platform_speed_limit"] or min(speeds)] * 3
        accelerations = [min(accelerations)] * 3
        if changed[2] or (changed[1] and not values["platform_speed_limit"]):
            remarks.append("Limits of the tool are the least of the sliders, where none is known.")
    reach = (values["cylinder_radius"], values["cylinder_z"][0])
    changed[3] &= values["space"] == "cylinder"
    minute = MINUTE if firmware is Firmware.REPRAP else 1.0
    new = ([minute * speed for speed in speeds], accelerations, reach)
    for is_new, names, numbers in zip(changed[1:], PLACES[firmware], new):
        if is_new:
            texts |= {name: plain_text(MM * each) for name, each in zip(names, numbers)}
    return "\n".join((*lines_of(firmware, texts, remarks), ""))


class Texts(NamedTuple):
    """The geometry of a machine as values of a firmware.

    Attributes:
        texts: by name.
        remarks: for its owner.
        order: which of our arms are towers A, B and C.
    """

    texts: dict[str, str]
    remarks: list[str]
    order: Sequence[int]


def texts_of(
    firmware: Firmware, machine: MachineParameters, end_stops: Sequence[float], probe_offset: float
) -> Texts:
    """Return the geometry of a machine as values of a firmware.

    Args:
        firmware: whose.
        machine: to be told.
        end_stops: heights of the sliders there. Shape (3,) [m].
        probe_offset: of ``FirmwareSettings``; Marlin takes it from the height after homing [mm].

    Raises:
        KinematicsError: if no firmware has such a machine.
    """
    towers, order, shift = towers_of(machine, end_stops)
    radius, arms, heights = fmean(towers.radii), np.array(towers.arms), np.array(towers.heights)
    turns = np.subtract(towers.angles, TOWER_ANGLES)
    remarks = []
    if firmware is Firmware.KLIPPER:
        texts = {"printer.delta_radius": plain_text(radius)}
        for tower, *numbers in zip("abc", towers.angles, towers.arms, towers.heights):
            names = ("angle", "arm_length", "position_endstop")
            found = zip(names, map(plain_text, numbers))
            texts |= {f"stepper_{tower}.{name}": text for name, text in found}
    elif firmware is Firmware.MARLIN:
        # With one radius: trims would only shift x and y.
        rod, lowest = fmean(towers.arms), min(towers.heights)
        height, rods, ends = lowest + probe_offset, arms - rod, lowest - heights
        texts = {
            "DELTA_HEIGHT": plain_text(height),
            "DELTA_ENDSTOP_ADJ": _braced(ends),
            "DELTA_RADIUS": plain_text(radius),
            "DELTA_RADIUS_TRIM_TOWER": _braced((0.0, 0.0, 0.0)),
            "DELTA_DIAGONAL_ROD": plain_text(rod),
            "DELTA_DIAGONAL_ROD_TRIM_TOWER": _braced(rods),
            "DELTA_TOWER_ANGLE_TRIM": _braced(turns),
        }
        typed = " ".join(_words("LRHXYZABC", (rod, radius, height, *turns, *rods)))
        remarks = [f"Typed, if its radius has no trims: M665 {typed}"]
        remarks.append(f"and M666 {' '.join(_words('XYZ', ends))}")
    else:
        middle = fmean(towers.heights)
        words = _words("RHXYZ", (radius, middle, *turns))
        texts = {"M665 L": ":".join(map(plain_text, arms))}
        texts |= {f"M665 {word[0]}": word[1:] for word in words}
        texts |= {f"M666 {word[0]}": word[1:] for word in _words("XYZ", heights - middle)}
    if order != (0, 1, 2):
        remarks.append(f"Towers A, B, C are arms {', '.join(str(i + 1) for i in order)}.")
    moved = [round(MM * each, 6) + 0.0 for each in shift]
    if any(moved):
        remarks.append(f"x and y here are those of the machine plus {vector_text(moved)} mm.")
    return Texts(texts, remarks, order)


def _words(letters: str, numbers: Iterable[float]) -> list[str]:
    return [letter + plain_text(number) for letter, number in zip(letters, numbers)]


def _braced(numbers: Iterable[float]) -> str:
    return f"{{ {', '.join(map(plain_text, numbers))} }}"


def lines_of(
    firmware: Firmware, texts: Mapping[str, str], remarks: Sequence[str] = ()
) -> Sequence[str]:
    """Return remarks, and values as their firmware reads them."""
    groups: dict[str, list[str]] = {}
    for name, text in texts.items():
        section, _, option = name.rpartition(".")
        command, _, letter = name.partition(" ")
        if firmware is Firmware.KLIPPER:
            groups.setdefault(f"[{section}]", []).append(f"{option}: {text}")
        elif letter:
            groups.setdefault(command + letter[1:], []).append(letter[0] + text)
        else:
            groups[f"#define {name} {text}".rstrip()] = []
    between = "\n" if firmware is Firmware.KLIPPER else " "
    lines = "\n".join(between.join((head, *rows)) for head, rows in groups.items()).split("\n")
    return [*(REMARKS[firmware] + each for each in remarks), *lines]
