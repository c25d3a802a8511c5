"""Verified trajectories of the sliders, from the present state to rest."""
