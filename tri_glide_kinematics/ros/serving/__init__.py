"""Services and actions that lose no call."""
