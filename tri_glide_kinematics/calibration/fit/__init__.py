"""Calibration: measurements in, the machine and what is known of it out."""
