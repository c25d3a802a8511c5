/**
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

#define DEFAULT_AXIS_STEPS_PER_UNIT   { 80, 80, 80, 500 }
#define DEFAULT_MAX_FEEDRATE          { 500, 400, 300, 25 }
#define DEFAULT_MAX_ACCELERATION      { 3000, 2900, 2800, 10000 }

#define DEFAULT_ACCELERATION          2850    // X, Y, Z and E acceleration for printing moves
#define DEFAULT_RETRACT_ACCELERATION  3000    // E acceleration for retracts
#define DEFAULT_TRAVEL_ACCELERATION   3000    // X, Y, Z acceleration for travel moves
