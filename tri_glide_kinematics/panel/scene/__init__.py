"""The machine and its workspace in three dimensions."""
