"""Figures: pictures of motions and mechanisms."""
