#!/usr/bin/env python3
"""Follows a branch of an F-mechanism through its turning points.

    python3 examples/follow_a_branch.py

Needs numpy only, no ROS.
"""

from math import degrees, radians

from tri_glide_kinematics import FMechanism

mechanism = FMechanism(
    base=((0.0, 0.0), (0.0525, 0.008), (0.04, 0.099)),  # m
    crank_lengths=(0.019, 0.014, 0.016),
    rod_lengths=(0.035, 0.034, 0.054),
    platform=((0.0, 0.0), (0.04, 0.018), (-0.007, 0.028)),
    phase_b=radians(243.0),
    phase_c=radians(-15.0),
    counter_rotating=True,
)
start = radians(146.0)
for number, pose in enumerate(mechanism.poses(start)):
    trace = mechanism.trace(start, pose, through=True)
    turning_points = [f"{degrees(event.crank_angle):.3f}" for event in trace.turning_points]
    print(
        f"position {number}, platform at {degrees(pose.angle):8.3f} deg: "
        + ("the cranks turn fully" if trace.turns_fully else f"turns back at {turning_points} deg")
    )
