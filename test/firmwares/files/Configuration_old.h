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

#define DEFAULT_AXIS_STEPS_PER_UNIT   { 80, 80, 80, 500 }
#define DEFAULT_MAX_FEEDRATE          { 500, 400, 300, 25 }
#define DEFAULT_MAX_ACCELERATION      { 3000, 2900, 2800, 10000 }

#define DEFAULT_ACCELERATION          2850    // X, Y, Z and E acceleration for printing moves
#define DEFAULT_RETRACT_ACCELERATION  3000    // E acceleration for retracts
#define DEFAULT_TRAVEL_ACCELERATION   3000    // X, Y, Z acceleration for travel moves
