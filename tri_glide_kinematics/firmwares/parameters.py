"""Settings of a firmware as a parameter file for all nodes, and back to the lines of a firmware.

The file keeps what was read, in lines that begin with ``#: ``. So the way back gives the very same
texts where its parameters are still those that came of them, and new ones where they are not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.calibration.firmwares import (
    MM,
    KlipperDelta,
    MarlinDelta,
    RepRapFirmwareDelta,
    plain_text,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares.reading import (
    MINUTE,
    Firmware,
    FirmwareError,
    FirmwareSettings,
    settings_of,
)
from tri_glide_kinematics.settings import IK_NODE, Values, file_values, machine_of, workspace_of
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.wording import vector_text

FIRST_LINE = "# Parameters of a machine, from settings of a firmware by tri_glide_kinematics."
READ = "# This was read from "
KEPT = "#: "
DEFAULTS = {entry.name: entry.default for entry in IK_NODE}
JERK_TIME = 0.05  # in which an acceleration builds up, as that of the default machine [s]
KINDS = {
    Firmware.KLIPPER: KlipperDelta,
    Firmware.MARLIN: MarlinDelta,
    Firmware.REPRAP: RepRapFirmwareDelta,
}
REMARKS = {Firmware.KLIPPER: "#", Firmware.MARLIN: "//", Firmware.REPRAP: ";"}
# Parameters, names of the values of all firmwares that they are made of, and those of new values.
GEOMETRY = ("anchors", "arm_lengths", "height_offsets", "upper_heights")
OF_GEOMETRY = r"stepper_|printer\.delta_radius|DELTA_(?!PRINT)|MANUAL_Z|M66[56] [^B]|M851|.*PROBE"
SPEED = ("velocity_limits", "platform_speed_limit")
OF_SPEED = r"printer\.max_(z_)?velocity|DEFAULT_MAX_FEEDRATE|M203"
OF_ACCELERATION = r"printer\.max_(z_)?accel|DEFAULT_.*ACCELERATION|M20[14]"
REACH = ("cylinder_radius", "cylinder_z")
OF_REACH = r"printer\.(print_radius|min)|.*PRINTABLE_RADIUS|M665 B|M208"
AXES = "XYZ"


def parameters_of(settings: FirmwareSettings) -> dict[str, tuple[Any, str]]:
    """Return the parameters of ``ik_node`` that settings stand for, each with where it comes from.

    Raises:
        FirmwareError: if a value is out of its bounds, or the platform could be nowhere.
    """
    geometry, limits, ends = settings.machine.geometry, settings.limits, settings.end_stops
    distances = [math.hypot(*anchor) for anchor in geometry.anchors]
    arms = geometry.arm_lengths
    tops = [e - math.sqrt(a * a - d * d) for e, a, d in zip(ends, arms, distances)]
    lowest, radius = limits.lowest or 0.0, limits.radius or min(distances)
    margin = DEFAULTS["reach_margin"]
    # Where the platform is farthest from a tower and lowest, to a tenth of a millimetre below.
    reach = [min(d + radius, a - margin) for d, a in zip(distances, arms)]
    lower = [lowest + math.sqrt(a * a - r * r) for a, r in zip(arms, reach)]
    tool = "of the tool there: taken for each slider, too"
    speeds, speed_text = limits.tower_speeds, "of the towers"
    if speeds is None:
        speeds, speed_text = (limits.tool_speed or DEFAULTS["velocity_limits"][0],) * 3, tool
    both = (
        limits.tower_accelerations or (math.inf,) * 3,
        (limits.tool_acceleration or math.inf,) * 3,
    )
    quick = tuple(min(pair) for pair in zip(*both))
    quick_text = "of the towers, no more than of the tool" if limits.tower_accelerations else tool
    nothing = "nothing is said: the default"
    if math.inf in quick:
        quick, quick_text = DEFAULTS["acceleration_limits"], nothing
    said = limits.tool_speed or limits.tower_speeds
    found = {
        "geometry": ("calibrated", ""),
        "anchors": (tuple(n for anchor in geometry.anchors for n in anchor), "towers A, B, C"),
        "arm_lengths": (arms, ""),
        "height_offsets": (settings.machine.height_offsets, "heights are those above the bed"),
        "upper_heights": (ends, "end stops"),
        "lower_heights": (
            tuple(math.floor(1e4 * each) / 1e4 for each in lower),
            "nothing is said: as low as the cylinder below needs",
        ),
        "velocity_limits": (speeds, speed_text if said else nothing),
        "platform_speed_limit": (
            limits.tool_speed or 0.0,
            "of the tool" if limits.tool_speed else "nothing is said of the tool: no limit",
        ),
        "acceleration_limits": (quick, quick_text),
        "jerk_limits": (
            tuple(each / JERK_TIME for each in quick),
            f"nothing is said: the acceleration builds up in {JERK_TIME:g} s",
        ),
        "reach_margin": (margin, nothing),
        "max_condition_number": (DEFAULTS["max_condition_number"], nothing),
        "space": ("cylinder", ""),
        "cylinder_radius": (
            radius,
            "" if limits.radius else "nothing is said: as far as the nearest tower joint",
        ),
        "cylinder_z": ((lowest, min(tops)), "" if limits.lowest else "from the bed"),
    }
    middle = (0.0, 0.0, 0.5 * (lowest + min(tops)))
    try:
        values = DEFAULTS | {name: value for name, (value, _) in found.items()}
        values = {entry.name: entry.checked(values[entry.name]) for entry in IK_NODE}
        workspace_of(values).check_position(middle)
    except KinematicsError as error:
        file = next(iter(settings.said.values())).file
        raise FirmwareError(file, "", f"no machine of this suite: {error}") from error
    heights = TriGlide(geometry).inverse(middle)
    found["initial_heights"] = (heights, "of a simulated machine: the middle of its space")
    return found


def parameter_text(settings: FirmwareSettings) -> str:
    """Return a parameter file for all nodes; raises as ``parameters_of``."""
    kept = {name: settings.said[name].text for name in settings.used}
    rows = [
        f"  {name}: {list(value) if isinstance(value, tuple) else value},{f' # {text}' * bool(text)}"
        for name, (value, text) in parameters_of(settings).items()
    ]
    return "\n".join(
        (
            FIRST_LINE,
            *(f"# {note}" for note in settings.notes),
            f"{READ}{settings.firmware.value}, and comes back where its parameters do not change:",
            *(f"{KEPT}{line}" for line in _lines(settings.firmware, kept)),
            "# In braces, so that a file that is cut off is refused. Lengths in metres.",
            "/**: {ros__parameters: {",
            *rows,
            "}}\n",
        )
    )


def load_parameters(path: Path, *later: Path) -> tuple[Values, FirmwareSettings | None]:
    """Return the parameters in files, and the settings that the first file was made of, if any.

    Raises:
        KinematicsError: if a file cannot be read, or something in it has no meaning.
    """
    values = file_values(str(path), "/ik_node", IK_NODE, *map(str, later))
    text = path.read_text(encoding="utf-8")
    firmware = re.search(rf"^{READ}(klipper|marlin|reprap)\b", text, re.M)
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
    same = origin is not None and origin.firmware is firmware
    before = parameters_of(origin) if same else {}
    texts = {name: origin.said[name].text for name in origin.used} if same else {}
    order, remarks = [0, 1, 2], []

    def changed(names: Sequence[str], pattern: str) -> bool:
        if before and all(before[name][0] == values[name] for name in names):
            return False
        for name in [each for each in texts if re.match(pattern, each)]:
            del texts[name]
        return True

    if changed(GEOMETRY, OF_GEOMETRY):
        machine = MachineParameters(machine_of(values).geometry, values["height_offsets"])
        with np.errstate(invalid="ignore"):
            converted = KINDS[firmware].of(machine, values["upper_heights"])
        made = settings_of(firmware, [(Path(), str(converted.settings))])
        texts |= {name: each.text for name, each in made.said.items()}
        order = list(converted.towers)
        shift = [round(MM * each, 6) + 0.0 for each in converted.shift]
        remarks = ["The end stops are where the sliders are at upper_heights."]
        if order != [0, 1, 2]:
            remarks.append(f"Towers A, B, C are arms {', '.join(str(i + 1) for i in order)}.")
        if any(shift):
            remarks.append(f"x and y here are those of the machine plus {vector_text(shift)} mm.")
    speeds = [values["velocity_limits"][i] for i in order]
    accelerations = [values["acceleration_limits"][i] for i in order]
    if firmware is not Firmware.MARLIN:
        speeds = [values["platform_speed_limit"] or min(speeds)] * 3
        accelerations = [min(accelerations)] * 3
    new: dict[str, float] = {}
    if changed(SPEED, OF_SPEED):
        names = {Firmware.KLIPPER: ["printer.max_velocity"]}.get(firmware, _axes("M203"))
        unit = MM * (MINUTE if firmware is Firmware.REPRAP else 1.0)
        new |= {name: unit * speed for name, speed in zip(names, speeds)}
    if changed(["acceleration_limits"], OF_ACCELERATION):
        names = {Firmware.KLIPPER: ["printer.max_accel"]}.get(firmware, _axes("M201"))
        new |= {name: MM * each for name, each in zip(names, accelerations)}
    if values["space"] == "cylinder" and changed(REACH, OF_REACH):
        names = {
            Firmware.KLIPPER: ["printer.print_radius", "printer.minimum_z_position"],
            Firmware.MARLIN: ["PRINTABLE_RADIUS"],
            Firmware.REPRAP: ["M665 B", "M208 Z S1"],
        }[firmware]
        reach = (values["cylinder_radius"], values["cylinder_z"][0])
        new |= {name: MM * each for name, each in zip(names, reach)}
    texts |= {name: plain_text(number) for name, number in new.items()}
    lines = [f"{REMARKS[firmware]} {remark}" for remark in remarks]
    return "\n".join((*lines, *_lines(firmware, texts), ""))


def _axes(command: str) -> list[str]:
    return [f"{command} {axis}" for axis in AXES]


def _lines(firmware: Firmware, texts: Mapping[str, str]) -> list[str]:
    """Return values as their firmware reads them."""
    groups: dict[str, list[str]] = {}
    for name, text in texts.items():
        value = " ".join(text.split())
        section, _, option = name.rpartition(".")
        command, _, letter = name.partition(" ")
        if firmware is Firmware.KLIPPER:
            groups.setdefault(f"[{section}]", []).append(f"{option}: {value}")
        elif letter:
            groups.setdefault(command + letter[1:], []).append(letter[0] + value)
        else:
            groups[f"#define {name} {value}".rstrip()] = []
    between = "\n" if firmware is Firmware.KLIPPER else " "
    return "\n".join(between.join((head, *rows)) for head, rows in groups.items()).split("\n")
