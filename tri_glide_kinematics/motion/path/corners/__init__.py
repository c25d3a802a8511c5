"""How the corners of a path are rounded."""
