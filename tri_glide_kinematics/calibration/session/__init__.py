"""Calibrating: what a user does to calibrate: probing, notes of measurements, report and files."""
