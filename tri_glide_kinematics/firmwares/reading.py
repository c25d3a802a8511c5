"""Settings of a firmware as a machine: its geometry, its end stops, and its limits.

All three firmwares count from the bed: the true height of a slider is what is reported here, so
the offsets are zero. Which limit bounds the tool and which a tower is from their sources:

- Klipper (``toolhead.py``, ``kinematics/delta.py``): ``max_velocity`` and ``max_accel`` bound the
  tool; ``max_z_velocity`` and ``max_z_accel`` its part along z.
- Marlin (``planner.cpp``): DEFAULT_MAX_FEEDRATE (M203) and DEFAULT_MAX_ACCELERATION (M201) bound
  the steps of each tower, as its planner counts in these; DEFAULT_ACCELERATION (M204) the tool.
- RepRapFirmware (``DDA.cpp``, ``LimitSpeedAndAcceleration``): M203, M201 and M204 bound the tool.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tri_glide_kinematics.calibration import MachineParameters
from tri_glide_kinematics.calibration.firmwares import (
    MM,
    TOWER_ANGLES,
    KlipperDelta,
    MarlinDelta,
    RepRapFirmwareDelta,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.firmwares.scanning import (
    Firmware,
    FirmwareError,
    Said,
    Sayings,
    guessed,
    scanned,
    text_of,
)
from tri_glide_kinematics.vectors import Vector3, three
from tri_glide_kinematics.wording import number_text

# Lengths are no larger than this [mm], speeds and accelerations no larger than that [mm/s, mm/s^2].
LARGEST = 1e4
FASTEST = 1e6
MINUTE = 60.0  # s
AXES = "XYZ"
TOWERS = "abc"

# Probes of Marlin; with one of them, the height after homing is counted from the probe.
PROBES = (
    *("FIX_MOUNTED_PROBE", "NOZZLE_AS_PROBE", "BLTOUCH", "Z_PROBE_SERVO_NR", "TOUCH_MI_PROBE"),
    *("Z_PROBE_ALLEN_KEY", "Z_PROBE_SLED", "SOLENOID_PROBE", "RACK_AND_PINION_PROBE", "MAGLEV4"),
    *("MAG_MOUNTED_PROBE", "BIQU_MICROPROBE_V1", "BIQU_MICROPROBE_V2", "SENSORLESS_PROBING"),
    *("DUET_SMART_EFFECTOR", "BD_SENSOR"),
)

Delta = KlipperDelta | MarlinDelta | RepRapFirmwareDelta


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
        delta: its settings of the geometry, in its own terms [mm], [degrees].
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
    delta: Delta
    machine: MachineParameters
    end_stops: Vector3
    limits: FirmwareLimits
    notes: tuple[str, ...]
    said: Mapping[str, Said]
    used: tuple[str, ...]
    probe_offset: float = 0.0


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
    return settings_of(firmware or guessed(*files[0]), files)


def settings_of(firmware: Firmware, files: Sequence[tuple[Path, str]]) -> FirmwareSettings:
    """Return the settings of files with these texts; raises as ``load_firmware_settings``."""
    said = _Asked(scanned(firmware, files), files[0][0])
    read = {
        Firmware.KLIPPER: _klipper,
        Firmware.MARLIN: _marlin,
        Firmware.REPRAP: _reprap,
    }[firmware]
    try:
        delta, limits = read(said)
        # Heights are counted from the end stops, which are then as high as the offsets.
        at_end_stops = delta.machine()
    except FirmwareError:
        raise
    except KinematicsError as error:
        raise FirmwareError(files[0][0], "", f"is of no working machine: {error}") from error
    return FirmwareSettings(
        firmware,
        delta,
        MachineParameters(at_end_stops.geometry),
        at_end_stops.height_offsets,
        limits,
        tuple(said.notes),
        said.sayings.said,
        tuple(said.sayings.used),
        said.probe_offset,
    )


class _Asked:
    """Values of files, asked for by their names; what is missing is named."""

    def __init__(self, sayings: Sayings, file: Path) -> None:
        self.sayings = sayings
        self.file = file
        self.notes = sayings.notes
        self.probe_offset = 0.0

    def needed(self, *names: str, least: float = 0.0) -> float:
        """Return the first of some lengths that is there; it is above ``least`` [mm].

        Raises:
            FirmwareError: if none is.
        """
        value = self.length(*names)
        name = self.first(names)
        if value is None:
            raise FirmwareError(self.file, "", f"{' or '.join(names)} is missing")
        if value <= least:
            raise self.sayings.error(
                name, f"= {number_text(value)} mm must be greater than {number_text(least)} mm"
            )
        return value

    def first(self, names: Sequence[str]) -> str:
        return next((name for name in names if name in self.sayings.said), names[0])

    def length(self, *names: str, bound: float = LARGEST) -> float | None:
        return self.sayings.number(self.first(names), bound)

    def limit(self, name: str, unit: float = MM) -> float | None:
        """Return a limit in SI, which is greater than 0; ``unit`` is so many of its own."""
        limits = self.limits(name, unit)
        return None if limits is None else limits[0]

    def limits(self, name: str, unit: float = MM) -> list[float] | None:
        values = self.sayings.numbers(name, FASTEST * unit / MM)
        for value in values or ():
            if value <= 0.0:
                raise self.sayings.error(name, f"= {number_text(value)} must be greater than 0")
        return None if values is None else [value / unit for value in values]

    def three(self, name: str, default: float = 0.0) -> Vector3:
        """Return the three numbers of a value in braces, or of three names with _1, _2, _3."""
        values = self.sayings.numbers(name, LARGEST)
        if values is None:
            each = [self.length(f"{name}_{i}") for i in (1, 2, 3)]
            values = [default if value is None else value for value in each]
        if len(values) != 3:
            raise self.sayings.error(name, f"has {len(values)} numbers, must have three")
        return three(values)

    def axes(self, command: str, otherwise: Vector3 = (0.0, 0.0, 0.0), axes: str = AXES) -> Vector3:
        """Return the numbers that a command has for three axes."""
        each = [self.length(f"{command} {axis}") for axis in axes]
        return three([default if n is None else n for n, default in zip(each, otherwise)])

    def least(self, meaning: str, *limits: tuple[str, float | None]) -> float | None:
        """Return the least of several limits of the tool, and note that if they differ."""
        known = [(value, name) for name, value in limits if value is not None]
        if not known:
            return None
        value, name = min(known)
        if any(other != value for other, _ in known):
            self.notes.append(
                f"{name} is the least of {', '.join(each for _, each in known)}: here, it bounds "
                f"the {meaning} of the tool in all directions"
            )
        return value

    def no(self, name: str, remedy: str) -> None:
        """Refuse a value that is not zero.

        Raises:
            FirmwareError: if it is not.
        """
        value = self.length(name)
        if value:
            raise self.sayings.error(name, f"= {number_text(value)} must be 0: {remedy}")


def _klipper(said: _Asked) -> tuple[KlipperDelta, FirmwareLimits]:
    kind = said.sayings.said.get("printer.kinematics")
    if kind is not None and kind.text != "delta":
        raise said.sayings.error("printer.kinematics", f"is {kind.text!r}, must be 'delta'")
    if kind is not None:
        said.sayings.used["printer.kinematics"] = None
    for axis in "xy":
        said.no(
            f"bed_tilt.{axis}_adjust",
            "it shears z, which vertical sliders do not do; level the bed, or calibrate anew",
        )
    radius = said.needed("printer.delta_radius")
    names = [f"stepper_{tower}." for tower in TOWERS]
    arms = [
        said.needed(f"{name}arm_length", "stepper_a.arm_length", least=radius) for name in names
    ]
    ends = [said.needed(f"{name}position_endstop", "stepper_a.position_endstop") for name in names]
    angles = [
        default if angle is None else angle
        for name, default in zip(names, TOWER_ANGLES)
        for angle in (said.length(f"{name}angle"),)
    ]
    fastest = said.limit("printer.max_velocity")
    quickest = said.limit("printer.max_accel")
    limits = FirmwareLimits(
        said.least(
            "speed",
            ("max_velocity", fastest),
            ("max_z_velocity", said.limit("printer.max_z_velocity")),
        ),
        said.least(
            "acceleration",
            ("max_accel", quickest),
            ("max_z_accel", said.limit("printer.max_z_accel")),
        ),
        radius=said.limit("printer.print_radius"),
        lowest=_metres(said.length("printer.minimum_z_position")),
    )
    return KlipperDelta(radius, three(angles), three(arms), three(ends)), limits


def _marlin(said: _Asked) -> tuple[MarlinDelta, FirmwareLimits]:
    known = said.sayings.said
    printed = any(name.startswith("M665 ") for name in known)
    if not printed and "DELTA" not in known and "DELTA_RADIUS" not in known:
        raise FirmwareError(
            said.file, "", "has neither #define DELTA nor a line M665: it is of no linear delta"
        )
    rods = [f"M665 {letter}" for letter in "ABC"]
    if "M665 B" in known and not {rods[0], rods[2]} & known.keys():
        said.notes.append("M665 B without A and C is the radius of the calibration: left out")
        rods = []
    rod_trims = said.three("DELTA_DIAGONAL_ROD_TRIM_TOWER")
    rod_trims = said.axes("M665", rod_trims, "ABC") if rods else rod_trims
    turns = said.axes("M665", said.three("DELTA_TOWER_ANGLE_TRIM"))
    ends = said.axes("M666", said.three("DELTA_ENDSTOP_ADJ"))
    radius_trims = said.three("DELTA_RADIUS_TRIM_TOWER")
    if printed and "DELTA_RADIUS" not in known:
        said.notes.append(
            "DELTA_RADIUS_TRIM_TOWER is not printed by Marlin: taken as 0; give Configuration.h "
            "before this file if it has one"
        )
    height = said.needed("M665 H", "DELTA_HEIGHT", "MANUAL_Z_HOME_POS")
    offset = said.length("M851 Z")
    if offset is None and any(name in known for name in PROBES):
        said.sayings.used |= dict.fromkeys(name for name in PROBES if name in known)
        offset = (said.sayings.numbers("NOZZLE_TO_PROBE_OFFSET", LARGEST) or [0.0])[-1]
    if offset:
        said.probe_offset = offset
        said.notes.append(
            f"the probe is {number_text(offset)} mm along z from the nozzle: Marlin homes to its "
            "height less this"
        )
    speeds = _towers(said, "M203", "DEFAULT_MAX_FEEDRATE")
    accelerations = _towers(said, "M201", "DEFAULT_MAX_ACCELERATION")
    both = (("P", "DEFAULT_ACCELERATION"), ("T", "DEFAULT_TRAVEL_ACCELERATION"))
    tool = [(name, said.limit(said.first((f"M204 {letter}", name)))) for letter, name in both]
    delta = MarlinDelta(
        height - said.probe_offset,
        ends,
        said.needed("M665 R", "DELTA_RADIUS"),
        radius_trims,
        said.needed("M665 L", "DELTA_DIAGONAL_ROD"),
        rod_trims,
        turns,
    )
    radius = said.limit(said.first(("PRINTABLE_RADIUS", "DELTA_PRINTABLE_RADIUS")))
    limits = FirmwareLimits(None, said.least("acceleration", *tool), speeds, accelerations, radius)
    return delta, limits


def _towers(said: _Asked, command: str, name: str) -> Vector3 | None:
    values = said.limits(name)
    each = [said.limit(f"{command} {axis}") for axis in AXES]
    if values is not None and len(values) < 3:
        raise said.sayings.error(name, f"has {len(values)} numbers, must have three or more")
    if values is None and None in each:
        return None
    return three([m if m is not None else (values or [0.0])[i] for i, m in enumerate(each)])


def _reprap(said: _Asked) -> tuple[RepRapFirmwareDelta, FirmwareLimits]:
    kind = said.length("M669 K")
    if kind is not None and kind != 3.0:
        raise said.sayings.error("M669 K", f"= {kind:g} must be 3: a linear delta")
    for letter in "AB":
        said.no(
            f"M666 {letter}",
            "a tilt of the bed shears z, which vertical sliders do not do: set A0 B0, then "
            "calibrate with 6 or 7 factors (G32)",
        )
    rods = said.sayings.numbers("M665 L", LARGEST)
    radius = said.needed("M665 R")
    if rods is None:
        raise FirmwareError(said.file, "", "M665 L is missing")
    if len(rods) not in (1, 3) or min(rods) <= radius:
        bound = "one number or three, greater than M665 R"
        raise said.sayings.error("M665 L", f"must be {bound} = {number_text(radius)} mm")
    delta = RepRapFirmwareDelta(
        three(rods * 3 if len(rods) == 1 else rods),
        radius,
        said.needed("M665 H"),
        said.axes("M665"),
        said.axes("M666"),
    )
    speeds = [(f"M203 {axis}", said.limit(f"M203 {axis}", MM * MINUTE)) for axis in AXES]
    accelerations = [(f"{name} {axis}", said.limit(f"{name} {axis}")) for name, axis in _QUICK]
    span = said.sayings.numbers("M208 Z", LARGEST) or []
    lowest = said.length("M208 Z S1")
    if lowest is None and len(span) == 2:
        lowest = span[0]
    limits = FirmwareLimits(
        said.least("speed", *speeds),
        said.least("acceleration", *accelerations),
        radius=said.limit("M665 B"),
        lowest=_metres(lowest),
    )
    return delta, limits


_QUICK = (*(("M201", axis) for axis in AXES), ("M204", "P"), ("M204", "T"))


def _metres(length: float | None) -> float | None:
    return None if length is None else length / MM
