"""Trajectories to rest: their curves and time scalings, and the proof that they keep limits."""
