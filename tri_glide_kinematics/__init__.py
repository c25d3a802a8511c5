"""Kinematics and motion of tri-glide delta robots, and of the planar mechanisms around them."""
