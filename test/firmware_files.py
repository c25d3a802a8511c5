"""Twelve files of settings as three firmwares have them, with the numbers that stand in them.

The numbers are written a second time, and each firmware's own formulas a second time, too.
"""

from __future__ import annotations

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


STEPPER = """step_pin: PF0
dir_pin: PF1
enable_pin: !PD7
microsteps: 16
rotation_distance: 40
endstop_pin: ^PE4
homing_speed: 50
"""
KOSSEL = f"""# This file serves as documentation for config parameters of delta
# style printers.

# See docs/Config_Reference.md for a description of parameters.

[stepper_a]
{STEPPER}#   The position of the end stop.
position_endstop: 297.05
arm_length: 333.0 ; of all three

[stepper_b]
{STEPPER}
[stepper_c]
{STEPPER}
[gcode_macro START_PRINT]
gcode:
    {{% set BED = params.BED|default(60)|float %}}
    G28
    M140 S{{BED}}

    G1 Z20 F3000

[mcu]
serial: /dev/ttyACM0

[printer]
kinematics: delta
max_velocity: 300
max_accel: 3000
max_z_velocity: 150
delta_radius: 174.75
minimum_z_position: -5
"""
SAVED = f"""[include mainsail.cfg]
[printer]
kinematics: delta
max_velocity = 250
max_accel = 2500
print_radius = 120
#*delta_radius: 100
#delta_radius = 101.0
[stepper_a]
{STEPPER}#position_endstop: 220
#arm_length: 215
angle: 210.25
[stepper_b]
{STEPPER}
[stepper_c]
{STEPPER}
[probe]
pin: ^PD3
z_offset: 12.5

#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
#*# [printer]
#*# delta_radius = 101.123456
#*#
#*# [stepper_a]
#*# angle = 209.981234
#*# arm_length = 215.017001
#*# position_endstop = 221.432101
#*#
#*# [stepper_b]
#*# angle = 330.046877
#*# arm_length = 214.983120
#*# position_endstop = 221.300000
#*#
#*# [stepper_c]
#*# angle = 90.000000
#*# arm_length = 215.250001
#*# position_endstop = 221.000100
#*#
#*# [delta_calibrate]
#*# height0 = 0.0
#*# height0_pos = 50000.000,49950.125,50012.000
"""
TOWERS = f"""[stepper_b]
{STEPPER}position_endstop=355.5
[stepper_c]
{STEPPER}arm_length=401.5
"""
MARLIN_HEAD = """/**
 * Marlin 3D Printer Firmware
 * Copyright (c) 2020 MarlinFirmware [https://github.com/MarlinFirmware/Marlin]
 */
#pragma once

/**
 * Configuration.h
 *
 * Basic settings such as:
 *  - Type of electronics
 */
#define CONFIGURATION_H_VERSION 02010201

//#define DELTA_HEIGHT 1.0 // an old one
#define SERIAL_PORT 0
#ifndef MOTHERBOARD
  #define MOTHERBOARD BOARD_RAMPS_14_EFB
#endif

// @section polar
//#define POLAR
#if ENABLED(POLAR)
  #define DEFAULT_SEGMENTS_PER_SECOND 180
  #define PRINTABLE_RADIUS 82.0f
#endif
"""
MARLIN_END = """
#define DEFAULT_AXIS_STEPS_PER_UNIT   { 80, 80, 80, 500 }
#define DEFAULT_MAX_FEEDRATE          { 500, 400, 300, 25 }
#define DEFAULT_MAX_ACCELERATION      { 3000, 2900, 2800, 10000 }

#define DEFAULT_ACCELERATION          2850    // X, Y, Z and E acceleration for printing moves
#define DEFAULT_RETRACT_ACCELERATION  3000    // E acceleration for retracts
#define DEFAULT_TRAVEL_ACCELERATION   3000    // X, Y, Z acceleration for travel moves
"""
MARLIN = (
    MARLIN_HEAD
    + """
// @section delta

// Enable for DELTA kinematics and configure below
#define DELTA
#if ENABLED(DELTA)

  // Make delta curves from many straight lines (linear interpolation).
  #define DEFAULT_SEGMENTS_PER_SECOND 200

  // Delta calibration menu
  //#define DELTA_CALIBRATION_MENU
  #define DELTA_AUTO_CALIBRATION

  #if ENABLED(DELTA_AUTO_CALIBRATION)
    #define DELTA_CALIBRATION_DEFAULT_POINTS 4
  #endif

  #if EITHER(DELTA_AUTO_CALIBRATION, DELTA_CALIBRATION_MENU)
    #define PROBE_MANUALLY_STEP 0.05      // (mm)
  #endif

  // Print surface diameter/2 minus unreachable space (avoid collisions with vertical towers).
  #define PRINTABLE_RADIUS          140.0 // (mm)

  // Center-to-center distance of the holes in the diagonal push rods.
  #define DELTA_DIAGONAL_ROD        250.0 // (mm)

  // Distance between bed and nozzle Z home position
  #define DELTA_HEIGHT              250.00 // (mm) Get this value from G33 auto calibrate

  #define DELTA_ENDSTOP_ADJ { 0.0, -0.55, -0.2 } // (mm) Get these values from G33 auto calibrate

  // Horizontal distance bridged by diagonal push rods when effector is centered.
  #define DELTA_RADIUS              124.0 // (mm) Get this value from G33 auto calibrate

  #define DELTA_TOWER_ANGLE_TRIM { 0.12, -0.08, 0.0 } // (degrees)

  // Delta radius and diagonal rod adjustments
  //#define DELTA_RADIUS_TRIM_TOWER       { 0.0, 0.0, 0.0 } // (mm)
  //#define DELTA_DIAGONAL_ROD_TRIM_TOWER { 0.0, 0.0, 0.0 } // (mm)
#endif

//#define FIX_MOUNTED_PROBE
#define NOZZLE_TO_PROBE_OFFSET { 10, 10, -3.5 }
"""
    + MARLIN_END
)
TRIMMED = MARLIN.replace("//#define DELTA_RADIUS_TRIM_TOWER       { 0.0, 0.0, 0.0 }", "")
TRIMMED = TRIMMED.replace(
    "  // Delta radius and diagonal rod adjustments",
    "  #define DELTA_RADIUS_TRIM_TOWER       { 0.31, -0.2, 0.05 } // (mm)\n"
    "  #define DELTA_DIAGONAL_ROD_TRIM_TOWER { \\\n    0.1, -0.25, 0.0 } /* (mm) */",
).replace("//#define FIX_MOUNTED_PROBE", "#define FIX_MOUNTED_PROBE")
OLD = (
    MARLIN_HEAD
    + """
#define DELTA
#if ENABLED(DELTA)
  #define DELTA_SEGMENTS_PER_SECOND 200
  #define DELTA_DIAGONAL_ROD 250.5f // mm
  #define DELTA_SMOOTH_ROD_OFFSET 175.0
  #define DELTA_EFFECTOR_OFFSET 33.0
  #define DELTA_CARRIAGE_OFFSET 18.0
  #define DELTA_RADIUS (DELTA_SMOOTH_ROD_OFFSET-(DELTA_EFFECTOR_OFFSET)-(DELTA_CARRIAGE_OFFSET))
  #define DELTA_PRINTABLE_RADIUS 90.0
#else
  #define DELTA_RADIUS 1.0
#endif
#define MANUAL_Z_HOME_POS 201.5
"""
    + MARLIN_END
)
M503 = """Send: M503
Recv: echo:; Linear Units:
Recv: echo:  G21 ; (mm)
Recv: echo:; Filament settings (Disabled):
Recv: echo:  M200 S0 D1.75
Recv: echo:; Steps per unit:
Recv: echo:  M92 X80.00 Y80.00 Z80.00 E97.00
Recv: echo:; Max feedrates (units/s):
Recv: echo:  M203 X200.00 Y200.00 Z200.00 E25.00
Recv: echo:; Max Acceleration (units/s2):
Recv: echo:  M201 X3000.00 Y3000.00 Z3000.00 E10000.00
Recv: echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):
Recv: echo:  M204 P2000.00 R3000.00 T3000.00
Recv: echo:; Advanced (B<min_segment_time_us> S<min_feedrate> T<min_travel_feedrate>):
Recv: echo:  M205 B20000.00 S0.00 T0.00 J0.02
Recv: echo:; Delta (L<diagonal-rod> R<radius> H<height> S<segments> XYZ<trim> ABC<rod-trim>):
Recv: echo:  M665 L217.95 R98.92 H283.86 S200.00 X0.18 Y0.31 Z0.00 A0.02 B-0.03 C0.00
Recv: echo:; Endstop adjustment:
Recv: echo:  M666 X-0.43 Y0.00 Z-0.17
Recv: echo:; Z-Probe Offset:
Recv: echo:  M851 X0.00 Y0.00 Z-16.80 ; (mm)
Recv: ok
"""
DUET = """; Configuration file for Duet WiFi
; executed by the firmware on start-up
;
; generated by RepRapFirmware Configuration Tool v3.3.10

; General preferences
G90                                                ; send absolute coordinates...
M83                                                ; ...but relative extruder moves
M550 P"Kossel; the big one"                        ; set printer name
M665 R105.6 L215.0 B85 H250 ; set delta radius, rod length, printable radius, homed height
M666 X0.5 Y-0.1 Z0                                 ; put your endstop adjustments here

; Network
M552 S1                                            ; enable network
; Drives
M569 P0 S1                                         ; physical drive 0 goes forwards
M350 X16 Y16 Z16 E16 I1                            ; configure microstepping with interpolation
M92 X80.00 Y80.00 Z80.00 E420.00                   ; set steps per mm
M566 X1200.00 Y1200.00 Z1200.00 E1200.00           ; set maximum speed changes (mm/min)
M203 X18000.00 Y18000.00 Z18000.00 E1200.00        ; set maximum speeds (mm/min)
M201 X1000.00 Y1000.00 Z1000.00 E1000.00           ; set accelerations (mm/s^2)
; Axis Limits
M208 Z-0.25 S1                                     ; set minimum Z
; Heaters
if boards[0].firmwareVersion == "3.4"
  M308 S0 P"bedtemp" Y"thermistor" T100000 B4138
M575 P1 S1 B57600
"""
OVERRIDE = """; config-override.g file generated in response to M500 at 2021-03-14 15:09
; This is a system-generated file - do not edit
; Delta parameters
M665 L215.000:215.107:214.950 R105.603 H250.104 B85.0 X0.213 Y-0.402 Z0.000
M666 X0.121 Y-0.062 Z-0.059 A0.00 B0.00
; Heater model parameters
M307 H0 R0.500 K0.30:0.00 D5.50 E1.35 S1.00 B0
; Workspace coordinates
G10 L2 P1 X0.00 Y0.00 Z0.00
"""

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
        RepRap(
            (215.0, 215.107, 214.95),
            105.603,
            250.104,
            (0.213, -0.402, 0.0),
            (0.121, -0.062, -0.059),
        ),
    ),
    "override": Sample(
        "reprap",
        {"config-override.g": OVERRIDE.replace("\n", "\r\n")},
        RepRap(
            (215.0, 215.107, 214.95),
            105.603,
            250.104,
            (0.213, -0.402, 0.0),
            (0.121, -0.062, -0.059),
        ),
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
