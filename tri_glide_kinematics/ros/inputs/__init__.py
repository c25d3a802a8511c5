"""What comes to a node: targets, goals, measurements and calls."""
