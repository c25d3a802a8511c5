"""Tracking: each cycle a step towards a velocity or a moving target, with a way to rest behind."""
