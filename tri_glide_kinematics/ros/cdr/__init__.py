"""Messages as bytes, written at once where a message of Python would take too long."""
