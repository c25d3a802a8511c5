"""Simulated servo drives, and pseudo-terminals with them."""
