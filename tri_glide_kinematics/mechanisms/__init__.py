"""Solvers for planar mechanisms and for the landing gear; no ROS."""
