"""Files of moves, paths and waits: how they are read, and what is told while one is driven."""
