#!/usr/bin/env python3
"""Solves a four-bar linkage: positions, velocities, and what kind of linkage it is.

    python3 examples/solve_a_four_bar.py

Needs numpy only, no ROS.
"""

from math import degrees, radians

from tri_glide_kinematics import FourBar

linkage = FourBar(crank=0.02, coupler=0.07, rocker=0.09, ground=0.06)  # m
print(f"{linkage.grashof_class.value}; at a crank angle of 30 degrees, 10 rad/s:")
for pose in linkage.solve(radians(30.0), crank_velocity=10.0):
    print(
        f"  {pose.branch.value:8} coupler {degrees(pose.coupler_angle):9.3f} deg, "
        f"rocker {degrees(pose.rocker_angle):9.3f} deg, {pose.rocker_velocity:7.3f} rad/s"
    )
