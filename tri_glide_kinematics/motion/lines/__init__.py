"""Motion of the platform along straight lines."""
