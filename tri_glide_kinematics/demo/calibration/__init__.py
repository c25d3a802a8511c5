"""Demonstration of a calibration: a machine that is wrong is probed, measured and put right."""
