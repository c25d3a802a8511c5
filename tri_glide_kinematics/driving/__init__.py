"""The command that drives a file of moves, paths and waits, one after the other."""
