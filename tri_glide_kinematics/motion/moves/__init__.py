"""Moves to a position, jogs and stops, from rest or in motion."""
