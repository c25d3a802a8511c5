"""Twelve files of settings as three firmwares have them, with the numbers that stand in them.

The numbers are written a second time, and each firmware's own formulas a second time, too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, hypot, radians, sin, sqrt
from pathlib import Path

Three = Sequence[float]


@dataclass(frozen=True)
class Klipper:
    """``DeltaKinematics`` of ``klippy/kinematics/delta.py`` [mm, degrees]."""

    radius: float
    arms: Three
    ends: Three
    angles: Three = (210.0, 330.0, 90.0)

    def carriages(self, x: float, y: float, z: float) -> list[float]:
        towers = [
            (cos(radians(a)) * self.radius, sin(radians(a)) * self.radius) for a in self.angles
        ]
        return [
            sqrt(arm**2 - (tx - x) ** 2 - (ty - y) ** 2) + z
            for arm, (tx, ty) in zip(self.arms, towers)
        ]

    def end_stops(self) -> list[float]:
        return [end + sqrt(arm**2 - self.radius**2) for end, arm in zip(self.ends, self.arms)]


@dataclass(frozen=True)
class Marlin:
    """``recalc_delta_settings``, ``DELTA_IK`` and ``home_delta`` of ``delta.cpp``."""

    height: float
    radius: float
    rod: float
    adjustments: Three = (0.0, 0.0, 0.0)
    turns: Three = (0.0, 0.0, 0.0)
    radius_trims: Three = (0.0, 0.0, 0.0)
    rod_trims: Three = (0.0, 0.0, 0.0)
    probe: float = 0.0

    def carriages(self, x: float, y: float, z: float) -> list[float]:
        found = []
        for i, angle in enumerate((210.0, 330.0, 90.0)):
            turned, radius = radians(angle + self.turns[i]), self.radius + self.radius_trims[i]
            away = (cos(turned) * radius - x, sin(turned) * radius - y)
            found.append(z + sqrt((self.rod + self.rod_trims[i]) ** 2 - hypot(*away) ** 2))
        return found

    def end_stops(self) -> list[float]:
        # Each carriage moves down from its end stop by its adjustment, which is negative; then the
        # nozzle is said to be in the middle at its height.
        homed = self.carriages(0.0, 0.0, self.height - self.probe)
        return [each - adjustment for each, adjustment in zip(homed, self.adjustments)]


@dataclass(frozen=True)
class RepRap:
    """``Recalc`` and ``Transform`` of ``LinearDeltaKinematics.cpp``."""

    rods: Three
    radius: float
    height: float
    corrections: Three = (0.0, 0.0, 0.0)
    adjustments: Three = (0.0, 0.0, 0.0)

    def carriages(self, x: float, y: float, z: float) -> list[float]:
        a, b, c = self.corrections
        r = self.radius
        towers = (
            (-r * cos(radians(30.0 + a)), -r * sin(radians(30.0 + a))),
            (r * cos(radians(30.0 - b)), -r * sin(radians(30.0 - b))),
            (-r * sin(radians(c)), r * cos(radians(c))),
        )
        return [
            sqrt(rod**2 - (x - tx) ** 2 - (y - ty) ** 2) + z
            for rod, (tx, ty) in zip(self.rods, towers)
        ]

    def end_stops(self) -> list[float]:
        return [
            self.height + sqrt(rod**2 - self.radius**2) + adjustment
            for rod, adjustment in zip(self.rods, self.adjustments)
        ]


@dataclass(frozen=True)
class Sample:
    """Files of one machine.

    Attributes:
        firmware: its name.
        files: texts, by name; the first one is named, others beside it.
        delta: the numbers in it.
        parameters: some that must come of it.
        encoding: of the files.
        notes: words of what is told.
    """

    firmware: str
    files: Mapping[str, str]
    delta: Klipper | Marlin | RepRap
    parameters: Mapping[str, object] = field(default_factory=dict)
    encoding: str = "utf-8"
    notes: Sequence[str] = ()

    def write(self, folder: Path) -> Path:
        """Write all files, and return the path of the first."""
        for name, text in self.files.items():
            file = folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(text.encode(self.encoding))
        return folder / next(iter(self.files))


FOLDER = Path(__file__).parent / "firmwares" / "files"
KOSSEL, SAVED, TOWERS = (
    (FOLDER / name).read_text() for name in ("kossel.cfg", "saved.cfg", "towers.cfg")
)
MARLIN, OLD = ((FOLDER / name).read_text() for name in ("Configuration.h", "Configuration_old.h"))
M503, DUET, OVERRIDE = (
    (FOLDER / name).read_text() for name in ("m503.txt", "config.g", "config-override.g")
)
TRIMMED = MARLIN.replace("//#define DELTA_RADIUS_TRIM_TOWER       { 0.0, 0.0, 0.0 }", "")
TRIMMED = TRIMMED.replace(
    "  // Delta radius and diagonal rod adjustments",
    "  #define DELTA_RADIUS_TRIM_TOWER       { 0.31, -0.2, 0.05 } // (mm)\n"
    "  #define DELTA_DIAGONAL_ROD_TRIM_TOWER { \\\n    0.1, -0.25, 0.0 } /* (mm) */",
).replace("//#define FIX_MOUNTED_PROBE", "#define FIX_MOUNTED_PROBE")

OVERRIDDEN = RepRap(
    (215.0, 215.107, 214.95), 105.603, 250.104, (0.213, -0.402, 0.0), (0.121, -0.062, -0.059)
)
SAMPLES = {
    "kossel": Sample(
        "klipper",
        {"printer.cfg": KOSSEL},
        Klipper(174.75, (333.0,) * 3, (297.05,) * 3),
        {
            "velocity_limits": (0.15,) * 3,
            "platform_speed_limit": 0.15,
            "acceleration_limits": (3.0,) * 3,
            "jerk_limits": (60.0,) * 3,
            "cylinder_z": (-0.005, 0.29705),
            "cylinder_radius": 0.17475,
        },
        notes=("printer.max_z_velocity",),
    ),
    "saved": Sample(
        "klipper",
        {"printer.cfg": SAVED, "mainsail.cfg": "[pause_resume]\n"},
        Klipper(
            101.123456,
            (215.017001, 214.98312, 215.250001),
            (221.432101, 221.3, 221.0001),
            (210.25, 330.046877, 90.0),
        ),
        {"cylinder_radius": 0.12, "platform_speed_limit": 0.25, "reach_margin": 0.005},
        notes=("stepper_a.angle: 210.25",),
    ),
    "included": Sample(
        "klipper",
        {
            "printer.cfg": "[include conf.d/*.cfg]\n[printer]\ndelta_radius: 180\n",
            "conf.d/10-towers.cfg": "[include ../towers.cfg]\n[stepper_c]\nangle: 90.5\n",
            "conf.d/20-base.cfg": "[printer]\nkinematics: delta\ndelta_radius: 175\n"
            "max_accel: 4000\nmax_velocity:\n   200\n[stepper_a]\narm_length: 400\n"
            "position_endstop: 355.25\n",
            "towers.cfg": TOWERS,
        },
        Klipper(180.0, (400.0, 400.0, 401.5), (355.25, 355.5, 355.25), (210.0, 330.0, 90.5)),
        {"acceleration_limits": (4.0,) * 3, "velocity_limits": (0.2,) * 3},
        encoding="utf-8-sig",
    ),
    "umlaut": Sample(
        "klipper",
        {"drucker.cfg": KOSSEL.replace("\n", "\r\n").replace("documentation", "Beschreibung für")},
        Klipper(174.75, (333.0,) * 3, (297.05,) * 3),
        encoding="latin-1",
        notes=("printer.max_z_velocity",),
    ),
    "marlin": Sample(
        "marlin",
        {"Configuration.h": MARLIN},
        Marlin(250.0, 124.0, 250.0, (0.0, -0.55, -0.2), (0.12, -0.08, 0.0)),
        {
            "velocity_limits": (0.5, 0.4, 0.3),
            "platform_speed_limit": 0.0,
            "acceleration_limits": (2.85, 2.85, 2.8),
            "cylinder_radius": 0.14,
            "cylinder_z": (0.0, 0.25),
        },
        notes=("DEFAULT_ACCELERATION",),
    ),
    "trimmed": Sample(
        "marlin",
        {"Configuration.h": TRIMMED},
        Marlin(
            250.0,
            124.0,
            250.0,
            (0.0, -0.55, -0.2),
            (0.12, -0.08, 0.0),
            (0.31, -0.2, 0.05),
            (0.1, -0.25, 0.0),
            -3.5,
        ),
        notes=("DEFAULT_ACCELERATION", "-3.5 mm"),
    ),
    "old": Sample(
        "marlin",
        {"Configuration.h": OLD.replace("\n", "\r")},
        Marlin(201.5, 124.0, 250.5),
        {"cylinder_radius": 0.09},
        notes=("DEFAULT_ACCELERATION",),
    ),
    "m503": Sample(
        "marlin",
        {"serial.log": M503},
        Marlin(
            283.86,
            98.92,
            217.95,
            (-0.43, 0.0, -0.17),
            (0.18, 0.31, 0.0),
            rod_trims=(0.02, -0.03, 0.0),
            probe=-16.8,
        ),
        {"velocity_limits": (0.2,) * 3, "acceleration_limits": (2.0,) * 3},
        notes=("DELTA_RADIUS_TRIM_TOWER", "-16.8 mm", "M204 P"),
    ),
    "duet": Sample(
        "reprap",
        {"config.g": DUET},
        RepRap((215.0,) * 3, 105.6, 250.0, adjustments=(0.5, -0.1, 0.0)),
        {
            "velocity_limits": (0.3,) * 3,
            "platform_speed_limit": 0.3,
            "acceleration_limits": (1.0,) * 3,
            "cylinder_radius": 0.085,
        },
    ),
    "overridden": Sample(
        "reprap",
        {"config.g": f"{DUET}M501\n", "config-override.g": OVERRIDE},
        OVERRIDDEN,
    ),
    "override": Sample(
        "reprap",
        {"config-override.g": OVERRIDE.replace("\n", "\r\n")},
        OVERRIDDEN,
        {"velocity_limits": (1.0,) * 3, "acceleration_limits": (10.0,) * 3},
    ),
    "macro": Sample(
        "reprap",
        {
            "config.g": "  M669 K3\nM98 P0:/sys/Geometry.g ; towers\nm203 x12000 y12000 z6000\n"
            "M208 X-100:100 Y-100:100 Z-1.5:300\nM204 P900 T1500\n",
            "Geometry.g": "M665 L300.5 R140.25 H310 X1.5 Y-0.75 Z0.25\n",
        },
        RepRap((300.5,) * 3, 140.25, 310.0, (1.5, -0.75, 0.25)),
        {
            "velocity_limits": (0.1,) * 3,
            "acceleration_limits": (0.9,) * 3,
            "cylinder_z": (-0.0015, 0.31),
        },
        encoding="utf-8-sig",
        notes=("M203 Z", "M204 P"),
    ),
}
