"""Drives on a bus: how a drive is led, units, playing out, homing. No ROS; CAN behind one seam only."""
