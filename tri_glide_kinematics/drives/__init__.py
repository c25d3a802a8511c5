"""Drives on a bus: their states, units, playing out and homing. No ROS; one seam to the bus."""
