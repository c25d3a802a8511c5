"""Motion in which each slider takes its own shortest way."""
